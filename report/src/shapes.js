// Models as outlines in space: polylines, and the polygons that planes show of themselves.
import {across} from './hulls.js';

const add = (a, b, times) => a.map((v, d) => v + times * b[d]);
const dot = (a, b) => a.reduce((sum, v, d) => sum + v * b[d], 0);

/** The part of a plane within a box: a polygon of up to six corners, in order around it; empty where they do not meet. */
export function planeInBox([a, b, c, offset], {min, max}) {
  const normal = [a, b, c], corners = [];
  const corner = (k) => [k & 1 ? max[0] : min[0], k & 2 ? max[1] : min[1], k & 4 ? max[2] : min[2]];
  for (let k = 0; k < 8; ++k) {
    for (const bit of [1, 2, 4]) {
      if (k & bit) continue;
      const from = corner(k), to = corner(k | bit);
      const f = dot(normal, from) + offset, t = dot(normal, to) + offset;
      if (f < 0 === t < 0) continue;
      corners.push(add(from, to.map((v, d) => v - from[d]), f / (f - t)));
    }
  }
  if (corners.length < 3) return [];
  const middle = [0, 1, 2].map((d) => corners.reduce((sum, p) => sum + p[d], 0) / corners.length);
  const [u, v] = across(normal);
  const angle = (p) => Math.atan2(dot(v, add(p, middle, -1)), dot(u, add(p, middle, -1)));
  return corners.sort((p, q) => angle(p) - angle(q));
}

/** The two ends of a line a x + b y + c = 0 within a box, or none. */
export function lineInBox([a, b, c], {min, max}) {
  const ends = [];
  const keep = (x, y) => {
    const slack = 1e-9 * (Math.abs(max[0] - min[0]) + Math.abs(max[1] - min[1]));
    if (x >= min[0] - slack && x <= max[0] + slack && y >= min[1] - slack && y <= max[1] + slack) ends.push([x, y, 0]);
  };
  if (Math.abs(b) > 1e-12) for (const x of [min[0], max[0]]) keep(x, -(c + a * x) / b);
  if (Math.abs(a) > 1e-12) for (const y of [min[1], max[1]]) keep(-(c + b * y) / a, y);
  if (ends.length < 2) return [];
  const far = ends.reduce((best, p) => (Math.hypot(p[0] - ends[0][0], p[1] - ends[0][1]) > Math.hypot(best[0] - ends[0][0], best[1] - ends[0][1]) ? p : best));
  return [ends[0], far];
}

/** A circle about `centre`, across `axis`. */
export function ring(centre, axis, radius, corners = 48) {
  const [u, v] = across(axis), out = [];
  for (let k = 0; k <= corners; ++k) {
    const angle = (2 * Math.PI * k) / corners;
    out.push(add(add(centre, u, radius * Math.cos(angle)), v, radius * Math.sin(angle)));
  }
  return out;
}

/** A particle as polylines; `box` is what is looked at. */
export function outline(type, p, box) {
  const size = Math.hypot(...box.max.map((v, d) => v - box.min[d]));
  switch (type) {
    case 'plane': {
      const polygon = planeInBox(p, box);
      return polygon.length > 0 ? [[...polygon, polygon[0]]] : [];
    }
    case 'line2d': {
      const ends = lineInBox(p, box);
      return ends.length > 0 ? [ends] : [];
    }
    case 'circle2d': return p[2] < size ? [ring([p[0], p[1], 0], [0, 0, 1], p[2])] : [];
    case 'sphere': {
      const centre = [p[0], p[1], p[2]];
      return p[3] < size ? [ring(centre, [0, 0, 1], p[3], 24), ring(centre, [1, 0, 0], p[3], 24)] : [];
    }
    case 'cylinder': {
      const axis = [p[3], p[4], p[5]], middle = box.min.map((v, d) => (v + box.max[d]) / 2);
      const through = [p[0], p[1], p[2]];
      const foot = add(through, axis, dot(axis, add(middle, through, -1)));
      const ends = [add(foot, axis, -size / 4), add(foot, axis, size / 4)];
      return p[6] < size / 2 ? [ends, ring(foot, axis, p[6], 20)] : [ends];
    }
    default: return [];
  }
}

/** How far points reach along a direction: [low, high]; one in a hundred at either end is left out. */
function reach(positions, members, direction) {
  const along = Float64Array.from(members, (i) => positions[3 * i] * direction[0] + positions[3 * i + 1] * direction[1] + positions[3 * i + 2] * direction[2]).sort();
  return [along[Math.floor(0.01 * (along.length - 1))], along[Math.ceil(0.99 * (along.length - 1))]];
}

/** The part of a line that its points lie along. */
export function segment([a, b, c], positions, members) {
  const along = [-b, a, 0];
  const [low, high] = reach(positions, members, along);
  return [low, high].map((t) => [-c * a + t * along[0], -c * b + t * along[1], 0]);
}

/** The part of a cylinder that its points lie along: middle, axis, length, radius. */
export function barrel(p, positions, members) {
  const axis = [p[3], p[4], p[5]], through = [p[0], p[1], p[2]];
  const [low, high] = reach(positions, members, axis);
  const at = dot(axis, through);
  return {middle: add(through, axis, (low + high) / 2 - at), axis, length: high - low, radius: p[6]};
}
