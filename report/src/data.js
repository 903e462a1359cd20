// What the command wrote into the page: JSON, and bytes in base64 (host/report/encode.hpp is the other half).

const text = (id) => document.getElementById(id)?.textContent;

function bytes(id) {
  const encoded = text(id);
  if (!encoded) return new Uint8Array(0);
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(encoded);
  const plain = atob(encoded);
  const out = new Uint8Array(plain.length);
  for (let i = 0; i < plain.length; ++i) out[i] = plain.charCodeAt(i);
  return out;
}

/** Calls back with each varint: seven bits a byte, the lowest first. */
function eachVarint(from, call) {
  let value = 0, scale = 1;
  for (const byte of from) {
    value += (byte & 127) * scale;
    scale *= 128;
    if (byte < 128) {
      call(value);
      value = 0;
      scale = 1;
    }
  }
}

/** Labels from runs of value and length; undefined where the page has none. */
export function readRuns(from, count) {
  if (from.length === 0) return undefined;
  const out = new Uint16Array(count);
  let at = 0, label = -1;
  eachVarint(from, (value) => {
    if (label < 0) {
      label = value;
      return;
    }
    out.fill(label, at, at + value);
    at += value;
    label = -1;
  });
  return out;
}

export function readDifferences(from, count) {
  const out = new Uint32Array(count);
  let k = 0, sum = 0;
  eachVarint(from, (value) => {
    sum += value;
    out[k++] = sum;
  });
  return out;
}

/** Columns about the middle of their range, in float32. */
function readPoints(from, {dimension, low, high, shown}) {
  const levels = new Uint16Array(from.buffer, from.byteOffset, shown * dimension);
  const out = new Float32Array(shown * dimension);
  for (let d = 0; d < dimension; ++d) {
    const step = (high[d] - low[d]) / 65535, half = (high[d] - low[d]) / 2;
    for (let i = 0; i < shown; ++i) out[i * dimension + d] = levels[i * dimension + d] * step - half;
  }
  return out;
}

function readCloud(about) {
  const count = about.cloud.shown;
  return {
    ...about.cloud,
    count,
    middle: about.cloud.low.map((low, d) => low / 2 + about.cloud.high[d] / 2),
    columns: readPoints(bytes('points'), about.cloud),
    index: readDifferences(bytes('points-index'), count),
    planes: readRuns(bytes('points-planes'), count) ?? new Uint16Array(count),
    popout: readRuns(bytes('points-popout'), count),
    objects: readRuns(bytes('points-objects'), count),
    rgb: text('points-rgb') ? bytes('points-rgb') : undefined,
  };
}

/** A picture that the page brings along, not yet decoded; undefined where it has none. */
function picture(id, kind) {
  const encoded = text(id);
  if (!encoded) return undefined;
  const source = new Image();
  source.src = `data:image/${kind};base64,${encoded}`;
  return source;
}

function readImage(about) {
  if (!about.image) return undefined;
  const count = about.image.width * about.image.height;
  return {
    ...about.image,
    source: picture('image-jpeg', 'jpeg'),
    planes: readRuns(bytes('image-planes'), count),
    popout: readRuns(bytes('image-popout'), count),
    objects: readRuns(bytes('image-objects'), count),
    costs: {object: picture('image-cost-object', 'png'), background: picture('image-cost-background', 'png')},
  };
}

/** Steps with their particles: `particles` is a view of one step's parameters, one particle after another. */
function readSearch() {
  const search = JSON.parse(text('search'));
  const raw = bytes('search-particles');
  const all = new Float32Array(raw.buffer, raw.byteOffset, raw.length / 4);
  let at = 0;
  for (const step of search.steps) {
    step.width = step.best.length;
    step.particles = all.subarray(at, at + step.width * step.shares.length);
    at += step.particles.length;
  }
  return search;
}

/**
 * Models that a search for the threshold had found are taken over all at once. In the replay each appears when the last swarm that came to it
 * had converged. Lengths count in units of `radius`.
 */
function spreadFound({steps, found}, radius) {
  const ends = steps.flatMap((step, t) => (t + 1 === steps.length || steps[t + 1].swarm !== step.swarm ? [t] : []));
  const taken = new Set(), near = 0.08;
  const apart = (type, p, q) => {
    const lengths = {plane: 3, line2d: 2}[type] ?? 0;  // from this entry on; the direction before it has two signs
    const size = (sign) => Math.hypot(...p.map((v, d) => (v - sign * q[d]) / (d < lengths ? 1 : radius)));
    return lengths > 0 ? Math.min(size(1), size(-1)) : size(1);
  };
  for (const one of found) {
    if (found.filter(({after}) => after === one.after).length < 2) continue;
    const end = ends.findLast((t) => t < one.after && !taken.has(t) && steps[t].type === one.type && steps[t].width > 0 && apart(one.type, one.parameters, steps[t].best) < near);
    if (end === undefined) continue;
    taken.add(end);
    one.shownAfter = end + 1;
  }
  for (const one of found) one.after = one.shownAfter ?? one.after;
}

export function load() {
  const about = JSON.parse(text('about')), cloud = readCloud(about), search = readSearch();
  spreadFound(search, Math.hypot(...cloud.high.map((high, d) => high - cloud.low[d])) / 2 || 1);
  return {about, result: JSON.parse(text('result')), cloud, image: readImage(about), search};
}
