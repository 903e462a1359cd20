// What is in the 3D view at the moment, its controls, and what is said of the point under the pointer.
import * as THREE from 'three';

import {apart} from './apart.js';
import {css, modelColour, neutral, objectColour, ramp, variable} from './colours.js';
import {$, choices, make, slider, switches} from './dom.js';
import {called, list, relative, short} from './models.js';
import {paint, thingOf} from './paint.js';
import {ball, best, dispose, modelShape, stroke, swarm} from './solids.js';
import {thingName} from './tables.js';
import {View} from './view.js';

/** The way to the eye of the camera where there was one, else from above and aside; and up. */
function startOf({about, cloud, layout}) {
  const unit = (v) => v.map((c) => c / Math.hypot(...v));
  if (cloud.height <= 1) {
    const up = about.up ?? [0, 0, 1], side = Math.abs(up[2]) > 0.7 ? [0.45, -1, 0] : [0.45, 0, 1];
    return {up, toward: unit(side.map((v, d) => v + 0.75 * up[d]))};
  }
  const eye = about.centre.map((v) => -v), look = layout.centre.map((v, d) => v - eye[d]);
  const far = Math.hypot(...look), up = about.up ?? [0, look[2] > 0 ? -1 : 1, 0];
  const side = [look[1] * up[2] - look[2] * up[1], look[2] * up[0] - look[0] * up[2], look[0] * up[1] - look[1] * up[0]];
  // A little to the side and above: from the eye itself a frame looks flat.
  return {up, toward: unit(eye.map((v, d) => v + 0.16 * side[d] + 0.1 * far * up[d] - layout.centre[d]))};
}

const most = 12;  // names of either kind at once; the largest things come first, and more would hide each other

const rgbOf = (colour) => new THREE.Color(colour).toArray().map((v) => 255 * v);

export class SpaceView {
  constructor(page, replay, distances, onHover) {
    Object.assign(this, {page, replay, distances, onHover});
    this.state = {by: 'found', hulls: true, spheres: true, labels: true, particles: true};
    const balls = page.result.sois.map(({centre, radius}) => ({centre: centre.map((v, d) => v - page.about.centre[d]), radius}));
    this.view = new View($('canvas'), page.layout, {...startOf(page), balls});
    this.makeModels();
    this.makeSpheres(balls);
    this.makeTags();
    if (page.layout.pairs) this.makeFrames();
    this.makeControls();
    this.listen();
    this.update();
  }

  makeControls() {
    const bar = $('toolbar'), {about, cloud, layout} = this.page;
    const by = [['found', about.kind === 'perceive' ? 'Planes and things' : 'Models']];
    if (cloud.rgb) by.push(['photo', 'Photo']);
    if (this.page.result.models.length > 0) by.push(['distance', 'Distance']);
    choices(bar, 'Colour of the points', by, this.state.by, (value) => {
      this.state.by = value;
      this.update();
    });
    const kinds = [];
    if (!layout.pairs) kinds.push(['hulls', layout.flat ? 'Shapes' : 'Hulls']);
    if (this.spheres.length > 0) kinds.push(['spheres', 'Spheres']);
    if (this.tags.length > 0) kinds.push(['labels', 'Names']);
    switches(bar, 'What else is shown', kinds, this.state, () => this.update());
    if (!layout.flat) slider(bar, 'points', {min: 0.4, max: 3, step: 0.1, value: 1}, (value) => this.view.setPointSize(value));
    bar.append(make('button', {class: 'chip', type: 'button', id: 'home', onclick: () => this.view.home()}, 'Reset view'));
    $('hint').textContent = layout.flat ? 'drag to move, scroll to zoom' : 'drag to turn, right button to move, scroll to zoom';
  }

  makeModels() {
    const {result, about, layout, cloud} = this.page;
    const members = result.models.map(() => []);
    for (let i = 0; i < cloud.count; ++i) if (cloud.planes[i] > 0) members[cloud.planes[i] - 1]?.push(i);
    this.shapes = result.models.map((model, k) => {
      const shape = modelShape(model.type, relative(model, about.centre), modelColour(k + 1), layout.positions, members[k], result.threshold);
      this.view.scene.add(shape);
      return shape;
    });
  }

  makeSpheres(balls) {
    const up = this.page.about.up ?? [0, 0, 1];
    this.spheres = balls.map(({centre, radius}, k) => {
      const sphere = ball(centre, radius, objectColour(k + 1), balls.length > most ? 0.07 : 0.14);
      sphere.userData.anchor = centre.map((v, d) => v + radius * up[d]);
      this.view.scene.add(sphere);
      return sphere;
    });
  }

  /** Numbers of models and names of things, that follow what they belong to. */
  makeTags() {
    const {about} = this.page;
    const models = this.shapes.map((shape, k) => ({shape, words: about.kind === 'perceive' ? `plane ${k + 1}` : String(k + 1), colour: modelColour(k + 1), kind: 'model', k: k + 1}));
    const things = this.spheres.map((shape, k) => ({shape, words: thingName(this.page.result.sois[k], k).replace(/^thing /, ''), colour: objectColour(k + 1), kind: 'thing', k: k + 1}));
    this.tags = [...models, ...things].filter(({shape}) => shape.userData.anchor);
    for (const tag of this.tags) {
      const [r, g, b] = tag.colour;
      tag.element = make('span', {tag: css(tag.colour)}, tag.words);
      if (0.3 * r + 0.59 * g + 0.11 * b > 150) tag.element.style.color = '#14181d';
      $('labels').append(tag.element);
    }
    this.view.afterRender.push(() => this.placeTags());
  }

  /** Those of models before those of things, large ones first; none covers another. */
  placeTags() {
    const {selected, view} = this, shown = [];
    for (const tag of this.tags) {
      const {shape, element, kind, k} = tag;
      const wanted = this.state.labels && (kind === 'model' ? this.modelShown(k) : this.replay.atEnd) && (selected ? selected.kind === kind && selected.k === k : k <= most);
      const at = wanted ? view.toScreen(shape.userData.anchor.map((v, d) => v + shape.position.getComponent(d))) : undefined;
      element.hidden = !at || at[0] < 0 || at[1] < 0 || at[0] > view.width || at[1] > view.height;
      if (element.hidden) continue;
      tag.size ??= [element.offsetWidth + 3, element.offsetHeight + 3];
      shown.push({element, x: at[0], y: at[1], w: tag.size[0], h: tag.size[1]});
    }
    apart(shown, view.width, view.height).forEach((at, k) => {
      const {element} = shown[k];
      element.hidden = !at;
      if (at) element.style.transform = `translate(${at.x.toFixed(1)}px, ${at.y.toFixed(1)}px) translate(-50%, -50%)`;
    });
  }

  makeFrames() {
    for (const {x, width, height} of this.page.layout.frames) {
      const [l, r, t, b] = [x - width / 2, x + width / 2, height / 2, -height / 2];
      this.view.scene.add(stroke([[l, t, -1], [r, t, -1], [r, b, -1], [l, b, -1], [l, t, -1]], neutral(), 1.5, 0.6));
    }
  }

  modelShown(k) {
    return this.replay.atEnd || this.replay.known.has(k);
  }

  select(selected) {
    this.selected = selected;
    this.update();
  }

  update() {
    const {page, view, replay} = this;
    const found = replay.atEnd ? undefined : replay.known;
    const show = {by: this.state.by, found, selected: this.selected};
    // Colours are worked out anew only when they change.
    const key = JSON.stringify([show.by, found && [...found], this.selected, variable('--view')]);
    if (key !== this.painted) {
      this.painted = key;
      paint(view.colours.array, page.layout, page.cloud, show, this.state.by === 'distance' ? this.distances() : undefined, page.result.threshold, rgbOf(variable('--view')));
      view.coloursChanged();
    }
    const chosen = (kind, k) => !this.selected || (this.selected.kind === kind && this.selected.k === k);
    this.shapes.forEach((shape, k) => this.drop(shape, this.state.hulls && this.modelShown(k + 1) && chosen('model', k + 1)));
    this.spheres.forEach((sphere, k) => (sphere.visible = this.state.spheres && replay.atEnd && chosen('thing', k + 1)));
    this.showSwarm();
    this.showPairs();
    view.render();
  }

  /** While the search is replayed, a model falls into its place when it is found. */
  drop(shape, visible) {
    const appears = visible && !shape.visible && this.replay.playing;
    shape.visible = visible;
    if (!appears) {
      if (!visible) shape.position.set(0, 0, 0);
      return;
    }
    const {page} = this, start = performance.now(), lasts = 450;
    const from = (page.layout.flat ? [0, 1, 0] : this.view.camera.up.toArray()).map((v) => 0.35 * page.layout.radius * v);
    const fall = (time) => {
      const left = Math.max(0, 1 - (time - start) / lasts);
      shape.position.set(...from.map((v) => v * left * left));
      this.view.render();
      if (left > 0 && shape.visible) requestAnimationFrame(fall);
    };
    requestAnimationFrame(fall);
  }

  showSwarm() {
    for (const part of this.flying ?? []) dispose(part);
    this.flying = [];
    if (this.replay.atEnd || this.page.layout.pairs) return;
    const step = this.page.search.steps[this.replay.now], {box} = this.page.layout;
    const most = Math.max(1, ...step.shares);
    this.flying = [swarm(step, box, (share) => ramp(share / most)), best(step, box, rgbOf(variable('--ink')))];
    this.view.scene.add(...this.flying);
  }

  /** Of a chosen model of point pairs: which point of one image goes with which of the other. */
  showPairs() {
    if (this.links) dispose(this.links);
    this.links = undefined;
    const {layout, cloud} = this.page;
    if (!layout.pairs || this.selected?.kind !== 'model') return;
    const ends = [];
    for (let i = 0; i < cloud.count; ++i) {
      if (cloud.planes[i] !== this.selected.k) continue;
      for (const v of [i, cloud.count + i]) ends.push(...layout.positions.subarray(3 * v, 3 * v + 3));
    }
    const geometry = new THREE.BufferGeometry().setAttribute('position', new THREE.Float32BufferAttribute(ends, 3));
    this.links = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({color: css(modelColour(this.selected.k)), transparent: true, opacity: 0.35}));
    this.view.scene.add(this.links);
  }

  listen() {
    const canvas = $('canvas');
    let waiting = false;
    canvas.addEventListener('pointermove', (event) => {
      if (event.buttons !== 0 || waiting) {
        if (event.buttons !== 0) this.hover(-1);
        return;
      }
      waiting = true;
      requestAnimationFrame(() => {
        waiting = false;
        this.hoverAt(event);
      });
    });
    // A finger does not hover: it taps.
    canvas.addEventListener('pointerup', (event) => event.pointerType !== 'mouse' && this.hoverAt(event, 16));
    canvas.addEventListener('pointerleave', (event) => event.pointerType === 'mouse' && this.hover(-1));
  }

  hoverAt(event, reach) {
    const {left, top} = $('canvas').getBoundingClientRect();
    const x = event.clientX - left, y = event.clientY - top;
    this.hover(this.view.pick(x, y, reach), x, y);
  }

  hover(drawn, x = 0, y = 0) {
    const tip = $('tip'), point = drawn < 0 ? -1 : drawn % this.page.cloud.count;
    tip.hidden = point < 0;
    this.onHover(point);
    this.highlight(point);
    if (point < 0) return;
    const [first, ...rest] = this.describe(point);
    tip.replaceChildren(make('b', {}, make('i', {class: 'swatch', tag: css(this.colourOf(point))}), first), ...rest.map((line) => make('span', {}, line)));
    const {clientWidth, clientHeight} = tip, {width, height} = this.view;
    tip.style.transform = `translate(${Math.min(x + 14, width - clientWidth - 6)}px, ${y + 14 + clientHeight > height ? y - clientHeight - 12 : y + 14}px)`;
  }

  colourOf(i) {
    const thing = thingOf(this.page.cloud, i), plane = this.page.cloud.planes[i];
    return thing > 0 ? objectColour(thing) : plane > 0 ? modelColour(plane) : neutral();
  }

  /** Words for a point: what it is, where, how far from the nearest model. */
  describe(i) {
    const {cloud, result, about} = this.page, plane = cloud.planes[i], thing = thingOf(cloud, i);
    const lines = [];
    if (thing > 0 && result.sois[thing - 1]) {
      lines.push(thingName(result.sois[thing - 1], thing - 1), `on plane ${result.sois[thing - 1].plane}`);
    } else {
      lines.push(plane > 0 ? `${called(result.models[plane - 1].type)} ${plane}` : 'no model');
    }
    const unit = about.kind === 'perceive' ? ' m' : '';
    const at = cloud.middle.map((middle, d) => middle + cloud.columns[i * cloud.dimension + d]).slice(0, cloud.dimension);
    if (result.models.length > 0) lines.push(`${short(this.distances()[i], 3)}${unit} from the nearest ${result.models.length > 1 ? 'model' : called(result.models[0].type)}`);
    lines.push(list(at) + unit);
    lines.push(cloud.height > 1 ? `pixel ${cloud.index[i] % cloud.width}, ${Math.floor(cloud.index[i] / cloud.width)}` : `point ${cloud.index[i]}`);
    return lines;
  }

  /** A ring about a point, or none for -1. */
  highlight(point) {
    if (point === this.ringed) return;
    this.ringed = point;
    if (this.ring) dispose(this.ring);
    this.ring = undefined;
    if (point >= 0) {
      const {layout, cloud} = this.page, ends = [];
      for (const v of layout.pairs ? [point, cloud.count + point] : [point]) ends.push(...layout.positions.subarray(3 * v, 3 * v + 3));
      const geometry = new THREE.BufferGeometry().setAttribute('position', new THREE.Float32BufferAttribute(ends, 3));
      const colour = variable('--ink');
      this.ring = new THREE.Group().add(new THREE.Points(geometry, new THREE.PointsMaterial({color: colour, size: 9, sizeAttenuation: false, depthTest: false, transparent: true})));
      if (layout.pairs) this.ring.add(new THREE.Line(geometry, new THREE.LineBasicMaterial({color: colour})));
      this.view.scene.add(this.ring);
    }
    this.view.render();
  }
}
