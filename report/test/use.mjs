// What a person does on a page, and what must come of it. Every function gives problems as words.

/** How many colours an element shows: a blank one has a few. */
async function coloursOf(page, selector) {
  const png = (await page.locator(selector).screenshot()).toString('base64');
  return page.evaluate(async (encoded) => {
    const bytes = Uint8Array.from(atob(encoded), (c) => c.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes], {type: 'image/png'}));
    const context = new OffscreenCanvas(image.width, image.height).getContext('2d');
    context.drawImage(image, 0, 0);
    const data = new Uint32Array(context.getImageData(0, 0, image.width, image.height).data.buffer);
    return new Set(data).size;
  }, png);
}

/** The largest share of the left, the right and the upper edge of an element that is not of that edge's most frequent colour. */
async function atTheEdges(page, selector) {
  const png = (await page.locator(selector).screenshot()).toString('base64');
  return page.evaluate(async (encoded) => {
    const bytes = Uint8Array.from(atob(encoded), (c) => c.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes], {type: 'image/png'}));
    const context = new OffscreenCanvas(image.width, image.height).getContext('2d', {willReadFrequently: true});
    context.drawImage(image, 0, 0);
    // The element's own border is above and below, the hint in a corner.
    const height = image.height - 40, width = image.width - 6;
    return Math.max(...[[3, 3, 1, height], [image.width - 4, 3, 1, height], [3, 3, width, 1]].map((edge) => {
      const pixels = new Uint32Array(context.getImageData(...edge).data.buffer), count = new Map();
      for (const pixel of pixels) count.set(pixel, (count.get(pixel) ?? 0) + 1);
      return 1 - Math.max(...count.values()) / pixels.length;
    }));
  }, png);
}

const frames = (page, count = 3) =>
  page.evaluate((n) => new Promise((done) => {
    const next = (left) => (left === 0 ? done() : requestAnimationFrame(() => next(left - 1)));
    next(n);
  }), count);

class Visit {
  constructor(page, what, shots) {
    Object.assign(this, {page, what, shots, problems: []});
  }

  expect(right, words) {
    if (!right) this.problems.push(words);
  }

  async shoot(name, fullPage = false) {
    if (!this.shots) return;
    await frames(this.page);
    await this.page.screenshot({path: `${this.shots}-${name}.png`, fullPage});
  }

  async looksRight() {
    const {page, what} = this;
    const count = await page.locator('#models > li').count();
    this.expect(what.models === undefined ? count > 0 : count === what.models, `${count} models in the list, expected ${what.models ?? 'some'}`);
    this.expect(!what.things || (await page.locator('#sois > li').count()) > 0, 'no things in the list');
    this.expect((await page.locator('#timing > i').count()) >= 2, 'no stages in the timing bar');
    this.expect((await page.locator('#command').textContent()).includes(what.arguments[0]), 'the command is not shown');
    this.expect((await page.locator('#settings tr').count()) > 0, 'no settings');
    this.expect(await page.locator('#no-webgl').isHidden(), 'WebGL did not start');
    const colours = await coloursOf(page, '#view');
    this.expect(colours > 12, `the view has ${colours} colours only`);
    const wide = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
    this.expect(wide <= 0, `the page is ${wide} px wider than the screen`);
    this.expect((await page.locator('#image-part').isVisible()) === Boolean(what.image), 'the image is there where it should not be, or the other way round');
  }

  /** Nothing of the scene is cut off, no name covers another, no option of the command is broken over two lines. */
  async isTidy() {
    const {page} = this;
    const ends = await page.evaluate(() => {
      const tags = [...document.querySelectorAll('#labels > :not([hidden])')];
      const rects = tags.map((tag) => tag.getBoundingClientRect());
      const covered = rects.filter((a, k) => rects.slice(0, k).some((b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom));
      const words = [...document.querySelectorAll('#command span')].filter((word) => word.textContent.startsWith('--'));
      const line = words.length && parseFloat(getComputedStyle(words[0]).lineHeight);
      return {covered: covered.length, tags: tags.length, broken: words.filter((word) => word.clientHeight > 1.5 * line).length};
    });
    this.expect(ends.covered === 0, `${ends.covered} of ${ends.tags} names cover others`);
    this.expect(ends.broken === 0, `${ends.broken} options of the command are broken over lines`);
    // Names may stand at an edge, where they are whole.
    const showNames = (how) => page.locator('#labels').evaluate((names, visibility) => (names.style.visibility = visibility), how);
    await showNames('hidden');
    const cut = await atTheEdges(page, '#view');
    await showNames('');
    this.expect(cut < 0.02, `${(100 * cut).toFixed(0)} % of an edge of the view are covered by the scene`);
  }

  async replays() {
    const {page} = this;
    const moment = () => page.locator('#moment').textContent();
    this.expect((await moment()).startsWith('Result'), 'the page does not start with the result');
    const end = Number(await page.locator('#time').getAttribute('max'));
    this.expect(end > 5, `only ${end} steps to replay`);
    await page.locator('#time').fill(String(Math.floor(end / 2)));
    this.expect(/^Swarm \d+ of \d+ looks for a .*step \d+/.test(await moment()), `in the middle: ${await moment()}`);
    await frames(page);
    await this.shoot('search');
    await page.locator('#play').click();
    const before = Number(await page.locator('#time').inputValue());
    await page.waitForFunction((at) => Number(document.getElementById('time').value) > at, before);
    // Where drawing is slow it has come to the end by now, and stopped by itself.
    await page.evaluate(() => document.querySelector('#play[aria-label="Pause"]')?.click());
    this.expect((await page.locator('#play').getAttribute('aria-label')) === 'Play the search', 'the player does not pause');
    const box = await page.locator('#fitness').boundingBox();
    await page.locator('#fitness').click({position: {x: 40, y: box.height / 2}});
    this.expect(Number(await page.locator('#time').inputValue()) < end / 4, 'the chart does not seek');
    await page.locator('#to-result').click();
    this.expect((await moment()).startsWith('Result'), 'Result does not lead to the result');
  }

  async selects() {
    const {page} = this;
    const row = page.locator('#models > li').first();
    await row.locator('button').click();
    this.expect(await row.locator('.details').isVisible(), 'a chosen model shows no details');
    await frames(page);
    await row.locator('button').click();
    this.expect(await row.locator('.details').isHidden(), 'a model cannot be let go');
    for (const choice of await page.locator('#toolbar [data-choice]').all()) {
      await choice.click();
      this.expect((await choice.getAttribute('aria-pressed')) === 'true', 'a colour cannot be chosen');
      await frames(page);
    }
    await page.locator('#toolbar [data-choice="found"]').click();
    for (const one of await page.locator('#toolbar [data-switch]').all()) {
      await one.click();
      this.expect((await one.getAttribute('aria-pressed')) === 'false', 'a switch does not switch');
      await one.click();
    }
    await page.locator('#home').click();
  }

  /** Somewhere on a coarse grid there is a point, and what is known of it is told. */
  async tells(touch) {
    const {page} = this;
    await page.locator('#view').scrollIntoViewIfNeeded();
    const box = await page.locator('#canvas').boundingBox();
    let words = '';
    for (const share of [0.5, 0.45, 0.55, 0.4, 0.6, 0.35, 0.65, 0.3, 0.7]) {
      for (const across of [0.5, 0.4, 0.6, 0.3, 0.7]) {
        const at = [box.x + across * box.width, box.y + share * box.height];
        if (touch) await page.touchscreen.tap(...at);
        else await page.mouse.move(...at);
        await frames(page, 2);
        if (await page.locator('#tip').isVisible()) words = await page.locator('#tip').textContent();
        if (words) break;
      }
      if (words) break;
    }
    this.expect(/(pixel|point) \d/.test(words), `under the pointer: ${words || 'nothing'}`);
  }

  async turns() {
    const {page} = this;
    const box = await page.locator('#canvas').boundingBox();
    const before = await page.locator('#view').screenshot();
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.mouse.down();
    await page.mouse.move(box.x + box.width / 2 + 90, box.y + box.height / 2 + 30, {steps: 4});
    await page.mouse.up();
    await page.mouse.wheel(0, -200);
    await frames(page, 4);
    this.expect(!before.equals(await page.locator('#view').screenshot()), 'dragging moves nothing');
    await page.locator('#home').click();
  }

  /** Where pictures come slowly, a view that is turned has fewer points, and all of them again when it stands still. */
  async keepsPace() {
    const {page} = this;
    const box = await page.locator('#canvas').boundingBox();
    const allDrawn = () => page.waitForFunction(() => {
      const [drawn, all] = document.getElementById('canvas').dataset.points.split(' of ');
      return drawn === all;
    });
    await allDrawn();
    // By this clock every picture takes 100 ms.
    await page.evaluate(() => {
      const ask = window.ownRequest = window.requestAnimationFrame;
      let now = performance.now();
      window.requestAnimationFrame = (call) => ask(() => call((now += 100)));
    });
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.mouse.down();
    for (const aside of [20, 40]) {
      await page.mouse.move(box.x + box.width / 2 + aside, box.y + box.height / 2);
      await frames(page);
    }
    const words = await page.locator('#canvas').getAttribute('data-points'), [turning, all] = words.split(' of ').map(Number);
    this.expect(turning > 0 && turning < all, `${words} points are drawn while the view is turned slowly`);
    await page.mouse.up();
    await allDrawn();
    await page.evaluate(() => (window.requestAnimationFrame = window.ownRequest));
    await page.locator('#home').click();
  }

  async looksAtTheImage(touch) {
    const {page} = this;
    await page.locator('#image-part').scrollIntoViewIfNeeded();
    this.expect((await coloursOf(page, '#image')) > 100, 'the image is blank');
    const box = await page.locator('#image').boundingBox();
    if (!touch) {
      await page.mouse.move(box.x + box.width / 2, box.y + Math.min(box.height, 300) / 2);
      await frames(page);
      this.expect(/^\d+, \d+: /.test(await page.locator('#image-note').textContent()), 'nothing is told of the pixel under the pointer');
    }
    const choices = await page.locator('#image-toolbar [data-choice]').all();
    const names = await Promise.all(choices.map((choice) => choice.getAttribute('data-choice')));
    this.expect(!this.what.things || names.includes('cost-object'), 'there are no maps of costs');
    const drawn = () => page.locator('#image').evaluate((canvas) => canvas.toDataURL());
    const plain = names.includes('none') && (await page.locator('#image-toolbar [data-choice="none"]').click(), await frames(page), await drawn());
    for (const choice of choices) {
      await choice.click();
      await frames(page);
      if ((await choice.getAttribute('data-choice')).startsWith('cost-')) {
        await page.waitForFunction((was) => document.getElementById('image').toDataURL() !== was, plain);
      }
      await this.shoot(`image-${await choice.getAttribute('data-choice')}`);
    }
    await page.locator('#image-toolbar [data-choice="all"]').click();
  }
}

/** Gives what is wrong with the page on this screen, in words. */
export async function usePage(browser, url, options, what, shots) {
  const context = await browser.newContext(options);
  context.setDefaultTimeout(120000);  // drawn in software, beside other work, half a million points take their time
  context.setDefaultNavigationTimeout(120000);
  const page = await context.newPage();
  const visit = new Visit(page, what, shots);
  page.on('console', (message) => {
    if (['error', 'warning'].includes(message.type()) && !/GPU stall due to ReadPixels|swiftshader/i.test(message.text()))
      visit.problems.push(`console: ${message.text()}`);
  });
  page.on('pageerror', (error) => visit.problems.push(`error: ${error.stack ?? error.message}`));
  page.on('request', (request) => {
    if (request.url() !== url && !/^(data|blob):/.test(request.url())) visit.problems.push(`the page asks for ${request.url()}`);
  });
  try {
    await page.goto(url);
    await page.waitForSelector('html[data-ready]', {state: 'attached'});
    await frames(page, 5);
    await visit.looksRight();
    await visit.isTidy();
    await page.evaluate(() => window.scrollTo(0, 0));
    await visit.shoot('top');
    await visit.shoot('whole', true);
    await visit.replays();
    await visit.selects();
    await visit.tells(Boolean(options.hasTouch));
    if (!options.hasTouch) {
      await visit.turns();
      await visit.keepsPace();
    }
    if (what.image) await visit.looksAtTheImage(Boolean(options.hasTouch));
  } catch (error) {
    visit.problems.push(error.message.split('\n')[0]);
  } finally {
    await context.close();
  }
  return visit.problems;
}
