// Models about the cloud's middle: their parameters in one flat form, distances, words.

/** The parameters of a model of result.json as the replay has them, with the origin moved to `centre`. */
export function relative(model, [cx, cy, cz]) {
  const p = model.parameters;
  switch (model.type) {
    case 'line2d': return [...p.normal, p.offset + p.normal[0] * cx + p.normal[1] * cy];
    case 'plane': return [...p.normal, p.offset + p.normal[0] * cx + p.normal[1] * cy + p.normal[2] * cz];
    case 'circle2d': return [p.centre[0] - cx, p.centre[1] - cy, p.radius];
    case 'sphere': return [p.centre[0] - cx, p.centre[1] - cy, p.centre[2] - cz, p.radius];
    case 'cylinder': return [p.point[0] - cx, p.point[1] - cy, p.point[2] - cz, ...p.axis, p.radius];
    default: return p.matrix.flat();
  }
}

function transfer(h, x, y) {
  const w = h[6] * x + h[7] * y + h[8];
  return [(h[0] * x + h[1] * y + h[2]) / w, (h[3] * x + h[4] * y + h[5]) / w];
}

function inverse(m) {
  const [a, b, c, d, e, f, g, h, i] = m;
  return [e * i - f * h, c * h - b * i, b * f - c * e, f * g - d * i, a * i - c * g, c * d - a * f, d * h - e * g, b * g - a * h, a * e - b * d];
}

function sampson(f, x, y, u, v) {
  const a = f[0] * x + f[1] * y + f[2], b = f[3] * x + f[4] * y + f[5], c = f[6] * x + f[7] * y + f[8];
  const d = f[0] * u + f[3] * v + f[6], e = f[1] * u + f[4] * v + f[7];
  return Math.abs(u * a + v * b + c) / Math.sqrt(a * a + b * b + d * d + e * e);
}

/** A function (columns, offset) => distance of that point. Point pairs are in the data's own frame, all else about the centre. */
export function distanceTo(type, p) {
  switch (type) {
    case 'line2d': return (x, o) => Math.abs(p[0] * x[o] + p[1] * x[o + 1] + p[2]);
    case 'plane': return (x, o) => Math.abs(p[0] * x[o] + p[1] * x[o + 1] + p[2] * x[o + 2] + p[3]);
    case 'circle2d': return (x, o) => Math.abs(Math.hypot(x[o] - p[0], x[o + 1] - p[1]) - p[2]);
    case 'sphere': return (x, o) => Math.abs(Math.hypot(x[o] - p[0], x[o + 1] - p[1], x[o + 2] - p[2]) - p[3]);
    case 'cylinder':
      return (x, o) => {
        const dx = x[o] - p[0], dy = x[o + 1] - p[1], dz = x[o + 2] - p[2];
        const along = dx * p[3] + dy * p[4] + dz * p[5];
        return Math.abs(Math.hypot(dx - along * p[3], dy - along * p[4], dz - along * p[5]) - p[6]);
      };
    case 'homography': {
      const back = inverse(p);
      return (x, o) => {
        const [u, v] = transfer(p, x[o], x[o + 1]), [s, t] = transfer(back, x[o + 2], x[o + 3]);
        return Math.sqrt(((x[o + 2] - u) ** 2 + (x[o + 3] - v) ** 2 + (x[o] - s) ** 2 + (x[o + 1] - t) ** 2) / 2);
      };
    }
    default: return (x, o) => sampson(p, x[o], x[o + 1], x[o + 2], x[o + 3]);
  }
}

const words = {
  plane: ['plane', 'planes'],
  line2d: ['line', 'lines'],
  circle2d: ['circle', 'circles'],
  sphere: ['sphere', 'spheres'],
  cylinder: ['cylinder', 'cylinders'],
  homography: ['homography', 'homographies'],
  fundamental: ['fundamental matrix', 'fundamental matrices'],
};

export const called = (type, many = false) => words[type][many ? 1 : 0];

/** "5 planes", "2 planes, 1 sphere and 1 cylinder". */
export function counted(models) {
  const counts = new Map();
  for (const {type} of models) counts.set(type, (counts.get(type) ?? 0) + 1);
  const parts = [...counts].map(([type, n]) => `${n} ${called(type, n !== 1)}`), last = parts.pop() ?? 'no model';
  return parts.length > 0 ? `${parts.join(', ')} and ${last}` : last;
}

/** A number in at most `digits` significant ones. */
export function short(value, digits = 4) {
  if (value === null || !Number.isFinite(value)) return '–';
  const size = Math.abs(value);
  if (size !== 0 && (size >= 1e6 || size < 1e-4)) return value.toExponential(digits - 2);
  return String(Number(value.toPrecision(digits)));
}

/** 307 200: groups of three, parted by a narrow space. */
export const whole = (n) => String(n).replace(/\B(?=(\d{3})+$)/g, ' ');

export const list = (values, digits = 4) => '(' + values.map((v) => short(v, digits)).join(', ') + ')';
