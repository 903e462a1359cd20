// All of the page that is words and numbers.
import {css, modelColour, objectColour} from './colours.js';
import {$, make} from './dom.js';
import {called, counted, list, short, whole} from './models.js';

const stages = {
  load: ['loading', '#8a94a3'],
  fit: ['fit', '#3b7ddd'],
  popout: ['pop-out', '#e0a800'],
  segment: ['outlines', '#36a269'],
  recognise: ['names', '#a35bd0'],
};

const ms = (value) => (value >= 100 ? value.toFixed(0) : value >= 10 ? value.toFixed(1) : value.toFixed(2));

export function head({about, result}) {
  document.title = `${about.title} · swarmfit`;
  $('title').textContent = about.title;
  const grid = result.input.height > 1 ? `, ${result.input.width} × ${result.input.height}` : '';
  $('subtitle').textContent = `${whole(result.input.points)} points${grid}, ${whole(result.input.finite)} of them finite; ${result.stop_reason}`;
  const fact = (name, value, unit) => make('div', {}, make('dt', {}, name), make('dd', {title: `${value} ${unit ?? ''}`}, value, unit ? make('small', {}, ' ' + unit) : ''));
  const kinds = new Set(result.models.map((m) => m.type)).size;
  const facts = [fact('found', kinds > 1 ? `${result.models.length} models` : counted(result.models))];
  if (about.kind === 'perceive') {
    const carry = result.models.filter((m) => m.supporting).length;
    facts.push(fact('carry things', String(carry), called('plane', carry !== 1)), fact('things', String(result.sois.length)));
  }
  const explained = result.models.reduce((sum, m) => sum + m.inliers, 0);
  facts.push(
    fact('explained', result.input.finite > 0 ? `${((100 * explained) / result.input.finite).toFixed(1)} %` : '–', 'of points'),
    fact('threshold τ', short(result.threshold, 3), about.kind === 'perceive' ? 'm' : ''),
    fact('time', ms(result.timing_ms.total), 'ms'),
    fact('back end', result.backend.name),
  );
  $('facts').append(...facts);
}

function parameters({type, parameters: p}) {
  switch (type) {
    case 'line2d':
    case 'plane': return [['normal', list(p.normal)], ['offset', short(p.offset, 5)]];
    case 'circle2d':
    case 'sphere': return [['centre', list(p.centre)], ['radius', short(p.radius, 5)]];
    case 'cylinder': return [['through', list(p.point)], ['axis', list(p.axis)], ['radius', short(p.radius, 5)]];
    default: return [['matrix', p.matrix.map((row) => list(row, 3)).join(' ')]];
  }
}

function details(rows) {
  const out = make('dl', {class: 'details', hidden: true});
  for (const [name, value] of rows) out.append(make('dt', {}, name), make('dd', {}, value));
  return out;
}

function item(colour, what, badge, much, share, rows, select) {
  const button = make('button', {class: 'row', type: 'button', 'aria-expanded': 'false', onclick: select},
    make('i', {class: 'swatch', tag: css(colour)}), make('span', {class: 'what'}, what, badge ? make('span', {class: 'badge'}, badge) : ''),
    make('span', {class: 'much'}, much));
  if (share !== undefined) {
    const bar = make('i', {tag: css(colour)});
    bar.style.width = `${(100 * share).toFixed(1)}%`;
    button.append(make('span', {class: 'share'}, bar));
  }
  return make('li', {}, button, details(rows));
}

/** Fills both lists. `select(kind, k)` is called when one is chosen; gives a function that shows what is selected. */
export function lists({result, about}, select) {
  const unit = about.kind === 'perceive' ? ' m' : '';
  const most = Math.max(1, ...result.models.map((m) => m.inliers));
  const deviations = (m) => list((m.covariance ?? []).map((row, k) => Math.sqrt(Math.max(0, row[k]))), 2);
  $('models-title').textContent = counted(result.models);
  $('models').append(...result.models.map((m, k) => item(modelColour(k + 1), `${called(m.type)} ${k + 1}`, m.supporting ? 'carries things' : '',
    whole(m.inliers), m.inliers / most,
    [...parameters(m), ['standard deviations', deviations(m)], ['inliers', whole(m.inliers)], ['rms', short(m.rms, 3) + unit],
      ['found', `after ${ms(m.found_at_ms)} ms, ${m.iterations > 0 ? `${m.iterations} steps, ${whole(m.evaluations)} evaluations` : 'when points were shared out'}`]],
    () => select('model', k + 1))));
  if (about.kind === 'perceive') {
    $('sois-part').hidden = false;
    $('sois-title').textContent = `${result.sois.length} ${result.sois.length === 1 ? 'thing' : 'things'}`;
    $('sois').append(...result.sois.map((s, k) => item(objectColour(k + 1), thingName(s, k), s.recognised[0] ? s.recognised[0].score.toFixed(2) : '',
      whole(s.points), undefined,
      [['on', `plane ${s.plane}`], ['centre', list(s.centre, 3) + ' m'], ['radius', short(s.radius, 3) + ' m'], ['points', whole(s.points)],
        ...(s.bbox[2] > 0 ? [['in the image', `${s.bbox[2]} × ${s.bbox[3]} px at ${s.bbox[0]}, ${s.bbox[1]}`]] : []),
        ...s.recognised.map((r) => ['name', `${r.name}, ${r.inliers} matches, score ${short(r.score, 2)}`])],
      () => select('thing', k + 1))));
  }
  return (selected) => {
    for (const [kind, id] of [['model', 'models'], ['thing', 'sois']]) {
      [...$(id).children].forEach((li, k) => {
        const on = selected?.kind === kind && selected.k === k + 1;
        li.classList.toggle('on', on);
        li.querySelector('button').setAttribute('aria-expanded', String(on));
        li.querySelector('.details').hidden = !on;
      });
    }
  };
}

export const thingName = (soi, k) => soi.recognised[0]?.name ?? `thing ${k + 1}`;

export function timing({result}) {
  const times = Object.entries(stages).filter(([key]) => result.timing_ms[key] > 0).map(([key, [words, colour]]) => [words, colour, result.timing_ms[key]]);
  const sum = times.reduce((all, [, , t]) => all + t, 0) || 1;
  for (const [words, colour, t] of times) {
    const part = make('i', {title: `${words}: ${ms(t)} ms`});
    part.style.cssText = `flex:${t} 1 0;background:${colour}`;
    $('timing').append(part);
    $('timing-legend').append(make('li', {}, make('i', {class: 'swatch', tag: colour}), words, make('b', {}, `${ms(t)} ms`), make('span', {}, `${((100 * t) / sum).toFixed(0)} %`)));
  }
  $('timing').setAttribute('aria-label', times.map(([words, , t]) => `${words} ${ms(t)} ms`).join(', '));
  $('timing-legend').append(make('li', {}, make('span', {}, 'in all, without loading'), make('b', {}, `${ms(result.timing_ms.total)} ms`)));
}

export function reproduction({about, result}) {
  // Lines break between words, not within an option.
  $('command').append(...about.command.split(' ').flatMap((word, k) => [k > 0 ? ' ' : '', make('span', {}, word)]).filter((part) => part !== ''));
  $('copy').addEventListener('click', () => copy(about.command));
  const row = ([name, value], given) => make('tr', {class: given ? 'given' : undefined}, make('td', {}, name), make('td', {}, value));
  $('settings').append(...about.settings.map((s) => row([s.name, s.value], s.given)));
  $('facts-more').append(...[
    ['swarmfit', about.version],
    ['back end', `${result.backend.name} on ${result.backend.device}`],
    ['why', result.backend.reason],
    ['seed', String(result.seed)],
    ['threshold τ', short(result.threshold, 6)],
    ...(about.up ? [['up', `${list(about.up, 3)} by ${about.vertical_source}`]] : []),
    ['steps to these models', whole(about.iterations)],
    ['evaluations', `${whole(about.evaluations)}, ${(100 * about.points_touched).toFixed(0)} % of the points touched`],
    ['stopped', result.stop_reason],
  ].map((entry) => row(entry, false)));
}

async function copy(words) {
  let copied = true;
  try {
    await navigator.clipboard.writeText(words);
  } catch {
    // A page from a file may not reach the clipboard: then it is selected, to be copied by hand.
    getSelection().selectAllChildren($('command'));
    copied = document.execCommand('copy');
  }
  $('copy').textContent = copied ? 'Copied' : 'Selected';
  setTimeout(() => ($('copy').textContent = 'Copy'), 1500);
}

export function smallPrint({about, cloud, image, search}) {
  const words = [];
  if (cloud.every > 1) {
    const which = cloud.height > 1 ? `every ${ordinal(cloud.every)} row and column` : `every ${ordinal(cloud.every)} point`;
    words.push(`Of the cloud ${which} is shown, ${whole(cloud.count)} points; the numbers are of all.`);
  }
  words.push('Positions are shown to 1/65536 of the cloud’s extent.');
  if (image?.every > 1) words.push(`The image is shown at 1/${image.every} of its size.`);
  const shown = Math.max(0, ...search.steps.map((s) => s.shares.length));
  if (shown > 0 && shown < search.particles) words.push(`Of a step ${shown} particles are shown, which may have up to ${search.particles}.`);
  if (search.every > 1) words.push(`Of the search every ${ordinal(search.every)} step is shown.`);
  words.push(`Written by swarmfit ${about.version}; drawn with three.js. The page is whole in itself and asks nothing of the network.`);
  $('small-print').textContent = words.join(' ');
}

const ordinal = (n) => (n === 2 ? 'second' : n === 3 ? 'third' : `${n}th`);
