// Two small charts on canvases: the fitness over the search's steps, and where the particles are among all models.
import {css, modelColour, ramp, variable} from './colours.js';

/** A context in CSS pixels, cleared. */
function prepare(canvas) {
  const ratio = Math.min(window.devicePixelRatio || 1, 2), {clientWidth: width, clientHeight: height} = canvas;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  const context = canvas.getContext('2d');
  context.scale(ratio, ratio);
  context.font = '11px system-ui, sans-serif';
  return {context, width, height};
}

const frame = {left: 42, right: 8, top: 14, bottom: 18};

/** Which share of what is left to explain the best of each swarm saves, as far as it is known by each step. */
export class FitnessChart {
  constructor(canvas, search, seek) {
    this.canvas = canvas;
    this.search = search;
    this.bests = search.steps.map(({nothing, fitness}) => (nothing > 0 ? Math.max(0, (nothing - fitness) / nothing) : 0));
    this.most = Math.max(0.05, ...this.bests) * 1.08;
    const follow = (event) => {
      const {left, width} = canvas.getBoundingClientRect();
      const share = (event.clientX - left - frame.left) / (width - frame.left - frame.right);
      seek(Math.round(share * (search.steps.length - 1)));
    };
    canvas.addEventListener('pointerdown', (event) => {
      canvas.setPointerCapture(event.pointerId);
      follow(event);
    });
    canvas.addEventListener('pointermove', (event) => event.buttons && follow(event));
  }

  draw(now) {
    const {context, width, height} = prepare(this.canvas);
    const count = Math.max(1, this.search.steps.length - 1);
    const x = (t) => frame.left + (t / count) * (width - frame.left - frame.right);
    const y = (share) => height - frame.bottom - (share / this.most) * (height - frame.top - frame.bottom);
    context.drawImage(this.backdrop(width, height, x, y), 0, 0, width, height);
    this.curves(context, x, y, now);
    this.founds(context, x);
    context.strokeStyle = variable('--accent');
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(x(Math.min(now, count)), frame.top - 8);
    context.lineTo(x(Math.min(now, count)), height - frame.bottom);
    context.stroke();
  }

  /** What stays the same from step to step: axes, and a dot for each particle. */
  backdrop(width, height, x, y) {
    const key = `${width} ${height} ${this.canvas.width} ${variable('--soft')}`;
    if (key === this.drawn) return this.still;
    this.drawn = key;
    this.still = new OffscreenCanvas(this.canvas.width, this.canvas.height);
    const context = this.still.getContext('2d');
    context.scale(this.canvas.width / width, this.canvas.height / height);
    context.font = this.canvas.getContext('2d').font;
    this.axes(context, width, height, x, y);
    this.particles(context, x, y);
    return this.still;
  }

  axes(context, width, height, x, y) {
    context.fillStyle = variable('--soft');
    context.strokeStyle = variable('--line');
    context.textAlign = 'right';
    context.textBaseline = 'middle';
    const step = this.most > 0.6 ? 0.25 : this.most > 0.25 ? 0.1 : this.most > 0.12 ? 0.05 : 0.02;
    for (let share = 0; share <= this.most; share += step) {
      context.beginPath();
      context.moveTo(frame.left, y(share));
      context.lineTo(width - frame.right, y(share));
      context.stroke();
      context.fillText(`${Math.round(100 * share)} %`, frame.left - 5, y(share));
    }
    context.textBaseline = 'alphabetic';
    context.textAlign = 'left';
    context.fillText('step 0', frame.left, height - 4);
    context.textAlign = 'right';
    context.fillText(String(count(this.search)), width - frame.right, height - 4);
  }

  particles(context, x, y) {
    context.globalAlpha = 0.35;
    this.search.steps.forEach((step, t) => {
      for (const share of step.shares) {
        if (share <= 0) continue;
        context.fillStyle = css(ramp(share / 1000 / Math.max(this.bests[t], 1e-9)));
        context.fillRect(x(t) - 0.7, y(share / 1000) - 0.7, 1.4, 1.4);
      }
    });
    context.globalAlpha = 1;
  }

  curves(context, x, y, now) {
    context.lineWidth = 2;
    context.lineJoin = 'round';
    for (let first = 0; first < this.bests.length;) {
      let last = first;
      while (last < this.bests.length && this.search.steps[last].swarm === this.search.steps[first].swarm) ++last;
      context.strokeStyle = variable(now >= first && now < last ? '--accent' : '--soft');
      context.beginPath();
      for (let t = first; t < last; ++t) {
        if (t > first) context.lineTo(x(t), y(this.bests[t - 1]));
        context.lineTo(x(t), y(this.bests[t]));
      }
      context.stroke();
      first = last;
    }
  }

  founds(context, x) {
    this.search.found.forEach(({after, model}) => {
      context.fillStyle = model > 0 ? css(modelColour(model)) : variable('--soft');
      context.beginPath();
      context.arc(x(Math.max(0, after - 1)), frame.top - 7, 4, 0, 2 * Math.PI);
      context.fill();
    });
  }
}

/** Steps that were flown, of which some may have been left out. */
const count = (search) => search.steps.length * search.every;

const directionOf = {plane: (p) => [p[0], p[1], p[2]], cylinder: (p) => [p[3], p[4], p[5]]};

/** Lambert's equal areas about the vertical, upright directions at 1; n and -n are one direction. */
function around([x, y, z], up) {
  const [u, v, w] = [up.u, up.v, up.w].map((axis) => x * axis[0] + y * axis[1] + z * axis[2]);
  const sign = w < 0 ? -1 : 1, size = 1 / Math.sqrt(1 + Math.abs(w));
  return [sign * u * size, -sign * v * size];
}

const sizeOf = (degrees) => Math.sqrt(1 - Math.cos((degrees * Math.PI) / 180));

/** The least of a few round angles from the vertical within which all particles' directions are. */
function rimOf(search, up) {
  let most = 0;
  for (const step of search.steps) {
    const direction = directionOf[step.type];
    if (!direction) continue;
    for (let at = 0; at < step.particles.length; at += step.width) most = Math.max(most, Math.hypot(...around(direction(step.particles.subarray(at, at + step.width)), up)));
  }
  return [5, 10, 15, 20, 30, 45, 60].find((degrees) => sizeOf(degrees) > most) ?? 90;
}

/** How a kind's parameters become a place in [-1, 1]^2, and what that is called. */
function maps(type, radius, up, rim) {
  const compass = {place: (p) => around(directionOf[type](p), up).map((v) => v / sizeOf(rim)), disc: true};
  switch (type) {
    case 'line2d':
      return {
        place: ([a, b, c]) => {
          const angle = Math.atan2(b, a), turned = angle < 0 || angle >= Math.PI;
          return [((turned ? angle + (angle < 0 ? Math.PI : -Math.PI) : angle) / Math.PI) * 2 - 1, (turned ? -c : c) / radius];
        },
        caption: 'Every particle is a line: its direction, 0° to 180°, across; its distance from the middle upwards.',
      };
    case 'plane': return {...compass, caption: `Every particle is a plane: the direction of its normal. Level ones are in the middle, at the rim they stand at ${rim}°.`};
    case 'cylinder': return {...compass, caption: `Every particle is a cylinder: the direction of its axis, ${rim}° from upright at the rim.`};
    case 'circle2d':
      return {place: (p) => [p[0] / radius, -p[1] / radius], caption: 'Every particle is a circle: its centre.'};
    case 'sphere':
      return {
        place: (p) => [up.u, up.v].map((axis, k) => ((k ? -1 : 1) * (p[0] * axis[0] + p[1] * axis[1] + p[2] * axis[2])) / radius),
        caption: 'Every particle is a sphere: its centre, from above.',
      };
    default: return undefined;
  }
}

const trail = 8;  // steps that are still seen

export class ParameterMap {
  /** `up`: {u, v, w}, two directions across the vertical and the vertical itself. */
  constructor(canvas, caption, search, radius, up) {
    Object.assign(this, {canvas, caption, search, radius, up, rim: rimOf(search, up)});
  }

  /** Is there one for this search? */
  get possible() {
    return this.search.steps.some((step) => maps(step.type, this.radius, this.up, this.rim));
  }

  draw(now) {
    const {context, width, height} = prepare(this.canvas);
    const steps = this.search.steps, current = steps[Math.min(now, steps.length - 1)];
    const map = current && maps(current.type, this.radius, this.up, this.rim);
    if (!map) return;
    this.caption.textContent = map.caption;
    const half = map.disc ? [Math.min(width, height) / 2 - 4, Math.min(width, height) / 2 - 4] : [width / 2 - 4, height / 2 - 4];
    const at = (p) => map.place(p).map((v, d) => [width, height][d] / 2 + Math.max(-1.02, Math.min(1.02, v)) * half[d]);
    this.border(context, width, height, half, map.disc);
    for (let t = Math.max(0, now - trail); t <= Math.min(now, steps.length - 1); ++t) {
      if (steps[t].swarm !== current.swarm) continue;
      this.dots(context, steps[t], at, t === now ? 1 : 0.1 + (0.3 * (t - now + trail)) / trail, t === now ? 2.4 : 1.6);
    }
    this.marks(context, current, at, now);
  }

  border(context, width, height, half, disc) {
    context.strokeStyle = variable('--line');
    context.lineWidth = 1;
    context.beginPath();
    if (disc) {
      for (const share of [1, sizeOf(this.rim / 2) / sizeOf(this.rim)]) {
        context.moveTo(width / 2 + share * half[0], height / 2);
        context.arc(width / 2, height / 2, share * half[0], 0, 2 * Math.PI);
      }
    } else {
      context.rect(width / 2 - half[0], height / 2 - half[1], 2 * half[0], 2 * half[1]);
      context.moveTo(width / 2 - half[0], height / 2);
      context.lineTo(width / 2 + half[0], height / 2);
    }
    context.stroke();
  }

  dots(context, step, at, opacity, size) {
    const best = Math.max(1, ...step.shares);
    context.globalAlpha = opacity;
    step.shares.forEach((share, j) => {
      const [x, y] = at(step.particles.subarray(j * step.width, (j + 1) * step.width));
      context.fillStyle = css(ramp(share / best));
      context.beginPath();
      context.arc(x, y, size, 0, 2 * Math.PI);
      context.fill();
    });
    context.globalAlpha = 1;
  }

  /** What has been found, and the swarm's best. */
  marks(context, current, at, now) {
    for (const {after, type, parameters, model} of this.search.found) {
      if (after > now || type !== current.type) continue;
      const [x, y] = at(parameters);
      context.strokeStyle = model > 0 ? css(modelColour(model)) : variable('--soft');
      context.lineWidth = 2.5;
      context.beginPath();
      context.moveTo(x - 5, y - 5);
      context.lineTo(x + 5, y + 5);
      context.moveTo(x + 5, y - 5);
      context.lineTo(x - 5, y + 5);
      context.stroke();
    }
    if (now >= this.search.steps.length) return;
    const [x, y] = at(current.best);
    context.strokeStyle = variable('--ink');
    context.lineWidth = 2;
    context.beginPath();
    context.arc(x, y, 7, 0, 2 * Math.PI);
    context.stroke();
  }
}
