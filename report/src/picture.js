// The camera's image and what is drawn on it.
import {apart} from './apart.js';
import {css, modelColour, objectColour, ramp} from './colours.js';
import {$, choices, slider} from './dom.js';
import {distanceColour} from './paint.js';

const uncertain = 65535;

export class Picture {
  /** `describe(i)` gives words for a shown point, `onHover(i)` is told which point is under the pointer, -1 none. */
  constructor(page, distances, describe, onHover) {
    Object.assign(this, {page, distances, describe, onHover, image: page.image, by: 'all', strength: 0.6});
    this.canvas = $('image');
    this.canvas.width = this.image.width;
    this.canvas.height = this.image.height;
    this.pointAt = this.pointsOfPixels();
    $('image-part').hidden = false;
    this.controls();
    this.costs = {};
    this.image.source.decode().then(() => this.draw());
    this.canvas.addEventListener('pointermove', (event) => this.hover(event));
    this.canvas.addEventListener('pointerleave', () => this.hover());
  }

  controls() {
    const bar = $('image-toolbar'), perceived = this.page.about.kind === 'perceive';
    const options = [['all', perceived ? 'Planes and things' : 'Models']];
    if (perceived) options.push(['planes', 'Planes'], ['popout', 'What sticks out'], ['objects', 'Outlines']);
    if (this.image.costs.object) options.push(['cost-object', 'Cost as object'], ['cost-background', 'Cost as background']);
    options.push(['distance', 'Distance'], ['none', this.image.coloured ? 'Photo' : 'Depth']);
    choices(bar, 'What is drawn on the image', options, this.by, (value) => {
      this.by = value;
      this.readCosts(value.replace('cost-', '')).then(() => this.draw());
    });
    slider(bar, 'strength', {min: 0.15, max: 1, step: 0.05, value: this.strength}, (value) => {
      this.strength = value;
      this.draw();
    });
  }

  /** By pixel of the canvas the point that is shown there, -1 none. */
  pointsOfPixels() {
    const {cloud} = this.page, {width, height, every} = this.image;
    const at = new Int32Array(width * height).fill(-1);
    const block = Math.max(1, Math.round(cloud.every / every));
    for (let i = 0; i < cloud.count; ++i) {
      const u = Math.floor((cloud.index[i] % cloud.width) / every), v = Math.floor(Math.floor(cloud.index[i] / cloud.width) / every);
      for (let y = v; y < Math.min(height, v + block); ++y) at.fill(i, y * width + u, y * width + Math.min(width, u + block));
    }
    return at;
  }

  /** The levels of a map of costs, read when it is first looked at: 0 none, 1 a cost of 0, 255 a cost of 1. */
  async readCosts(label) {
    const source = this.image.costs[label], {width, height} = this.image;
    if (!source || this.costs[label]) return;
    await source.decode();
    const context = new OffscreenCanvas(width, height).getContext('2d');
    context.drawImage(source, 0, 0, width, height);
    this.costs[label] = context.getImageData(0, 0, width, height).data.filter((_, k) => k % 4 === 0);
  }

  /** What costs little is strong. */
  costColour(label, pixel) {
    const level = this.costs[label]?.[pixel] ?? 0;
    return level > 0 ? ramp(1 - (level - 1) / 254) : undefined;
  }

  colourAt(pixel) {
    const {planes, popout, objects} = this.image;
    const of = (labels, colour) => (labels && labels[pixel] > 0 && labels[pixel] !== uncertain ? colour(labels[pixel]) : undefined);
    switch (this.by) {
      case 'planes': return of(planes, modelColour);
      case 'popout': return of(popout, objectColour);
      case 'objects': return objects?.[pixel] === uncertain ? [255, 255, 255] : of(objects, objectColour);
      case 'distance': return this.pointAt[pixel] < 0 ? undefined : distanceColour(this.distances()[this.pointAt[pixel]], this.page.result.threshold);
      case 'cost-object': return this.costColour('object', pixel);
      case 'cost-background': return this.costColour('background', pixel);
      case 'all': return of(objects ?? popout, objectColour) ?? of(planes, modelColour);
      default: return undefined;
    }
  }

  draw() {
    const {width, height} = this.image, context = this.canvas.getContext('2d');
    context.drawImage(this.image.source, 0, 0, width, height);
    if (this.by !== 'none') this.tint(context, width, height);
    if (this.by === 'all' || this.by === 'objects') this.outlines(context, width, height);
    if (this.page.about.kind === 'perceive' && this.by !== 'none' && this.by !== 'distance' && !this.by.startsWith('cost')) this.boxes(context);
    if (this.marked >= 0) this.ring(context);
  }

  tint(context, width, height) {
    const layer = new OffscreenCanvas(width, height), paint = layer.getContext('2d'), data = paint.createImageData(width, height);
    for (let pixel = 0; pixel < width * height; ++pixel) {
      const colour = this.colourAt(pixel);
      if (!colour) continue;
      data.data.set(colour, 4 * pixel);
      data.data[4 * pixel + 3] = 255;
    }
    paint.putImageData(data, 0, 0);
    context.globalAlpha = this.strength;
    context.drawImage(layer, 0, 0);
    context.globalAlpha = 1;
  }

  /** White where a proto-object ends. */
  outlines(context, width, height) {
    const {objects} = this.image;
    if (!objects) return;
    const own = (label) => (label === uncertain ? 0 : label);
    context.fillStyle = '#fff';
    for (let y = 1; y < height; ++y) {
      for (let x = 1; x < width; ++x) {
        const label = own(objects[y * width + x]);
        if (label !== own(objects[y * width + x - 1]) || label !== own(objects[(y - 1) * width + x])) context.fillRect(x - 1, y - 1, 1.5, 1.5);
      }
    }
  }

  boxes(context) {
    const {sois} = this.page.result, {width, height, every} = this.image;
    const many = sois.length > 12, size = Math.max(11, Math.round(width / (many ? 62 : 50)));
    context.font = `600 ${size}px system-ui, sans-serif`;
    context.textBaseline = 'middle';
    context.lineWidth = Math.max(1, width / 640);
    const labels = [];
    sois.forEach((soi, k) => {
      const [x, y, w, h] = soi.bbox.map((v) => v / every);
      if (w === 0) return;
      const words = soi.recognised[0]?.name ?? String(k + 1), wide = context.measureText(words).width + 8;
      context.strokeStyle = css(objectColour(k + 1));
      if (!many) context.strokeRect(x, y, w, h);
      labels.push({words, colour: css(objectColour(k + 1)), x: x + wide / 2, y: y - (size + 4) / 2, w: wide, h: size + 4});
    });
    // A name that finds no place of its own lies under those of larger things.
    const places = apart(labels, width, height);
    labels.reverse().forEach((label, k) => {
      const {x, y} = places[labels.length - 1 - k] ?? label;
      context.fillStyle = label.colour;
      context.fillRect(x - label.w / 2, y - label.h / 2, label.w, label.h);
      context.fillStyle = '#111';
      context.fillText(label.words, x - label.w / 2 + 4, y + 1);
    });
  }

  /** Marks a point, -1 none. */
  mark(point) {
    if (point === this.marked) return;
    this.marked = point;
    this.draw();
  }

  ring(context) {
    const {cloud} = this.page, i = cloud.index[this.marked];
    context.beginPath();
    context.arc((i % cloud.width) / this.image.every, Math.floor(i / cloud.width) / this.image.every, this.image.width / 64, 0, 2 * Math.PI);
    context.lineWidth = Math.max(2, this.image.width / 320);
    context.strokeStyle = '#fff';
    context.stroke();
  }

  hover(event) {
    let point = -1, words = '';
    if (event) {
      const {left, top, width} = this.canvas.getBoundingClientRect(), scale = this.image.width / width;
      const x = Math.floor((event.clientX - left) * scale), y = Math.floor((event.clientY - top) * scale);
      point = this.pointAt[y * this.image.width + x] ?? -1;
      words = `${x * this.image.every}, ${y * this.image.every}: ` + (point < 0 ? 'no depth' : this.describe(point).join(', '));
    }
    $('image-note').textContent = words;
    this.onHover(point);
  }
}

