// Small data of each kind, the same every time.

/** A generator of numbers in [0, 1) (mulberry32). */
export function random(seed) {
  let state = seed;
  return () => {
    state = (state + 0x6d2b79f5) | 0;
    let t = Math.imul(state ^ (state >>> 15), 1 | state);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
}

const csv = (head, rows) => head + '\n' + rows.map((row) => row.map((v) => v.toFixed(6)).join(',')).join('\n') + '\n';

/** Four lines among outliers, in the unit square. */
export function lines() {
  const next = random(7), rows = [];
  const noise = () => 0.004 * (next() + next() + next() - 1.5);
  for (const [x0, y0, x1, y1] of [[0.1, 0.2, 0.9, 0.8], [0.15, 0.85, 0.8, 0.1], [0.2, 0.5, 0.95, 0.45], [0.3, 0.1, 0.4, 0.95]]) {
    for (let i = 0; i < 100; ++i) {
      const t = next();
      rows.push([x0 + t * (x1 - x0) + noise(), y0 + t * (y1 - y0) + noise()]);
    }
  }
  for (let i = 0; i < 300; ++i) rows.push([next(), next()]);
  return csv('x,y', rows);
}

/** A floor, a wall, a ball and a pipe. */
export function solids() {
  const next = random(11), rows = [];
  const noise = () => 0.004 * (next() - 0.5);
  for (let i = 0; i < 3000; ++i) rows.push([2 * next(), 2 * next(), noise()]);
  for (let i = 0; i < 2000; ++i) rows.push([2 * next(), 2 + noise(), 1.2 * next()]);
  for (let i = 0; i < 1500; ++i) {
    const z = 2 * next() - 1, angle = 2 * Math.PI * next(), r = 0.3 + noise(), flat = Math.sqrt(1 - z * z);
    rows.push([0.6 + r * flat * Math.cos(angle), 0.7 + r * flat * Math.sin(angle), 0.31 + r * z]);
  }
  for (let i = 0; i < 1500; ++i) {
    const angle = 2 * Math.PI * next(), r = 0.15 + noise();
    rows.push([1.5 + r * Math.cos(angle), 1.2 + r * Math.sin(angle), next()]);
  }
  return csv('x,y,z', rows);
}

/** Two bodies' points seen in two images. */
export function pairs() {
  const next = random(13), rows = [];
  const noise = () => next() - 0.5;
  for (const [x0, y0, move] of [[80, 60, (x, y) => [1.1 * x + 0.05 * y + 20, -0.04 * x + 1.05 * y + 10]], [360, 220, (x, y) => [0.9 * x - 0.1 * y - 15, 0.08 * x + 0.95 * y + 25]]]) {
    for (let i = 0; i < 120; ++i) {
      const x = x0 + 200 * next(), y = y0 + 180 * next(), [u, v] = move(x, y);
      rows.push([x, y, u + noise(), v + noise()]);
    }
  }
  for (let i = 0; i < 80; ++i) rows.push([640 * next(), 480 * next(), 640 * next(), 480 * next()]);
  return csv('x1,y1,x2,y2', rows);
}

const add = (a, b, times) => a.map((v, d) => v + times * b[d]);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** Where a ray leaves the free air of a table with a box and a ball on it, and the colour there. */
function hit(from, along) {
  let best = {t: -from[2] / along[2], colour: [168, 140, 110]};
  if (!(best.t > 0)) best = {t: Infinity};
  const ball = [0.16, 0.02, 0.09], radius = 0.09, off = add(from, ball, -1);
  const b = dot(off, along), root = b * b - dot(off, off) + radius * radius;
  if (root > 0 && -b - Math.sqrt(root) < best.t) best = {t: -b - Math.sqrt(root), colour: [40, 90, 200]};
  const low = [-0.46, -0.24, 0], high = [-0.3, -0.08, 0.24];  // at the edge: its sphere reaches further than any point
  const [near, far] = [0, 1, 2].reduce(([n, f], d) => {
    const [s, e] = [(low[d] - from[d]) / along[d], (high[d] - from[d]) / along[d]];
    return [Math.max(n, Math.min(s, e)), Math.min(f, Math.max(s, e))];
  }, [0, Infinity]);
  if (near < far && near < best.t) best = {t: near, colour: [190, 50, 40]};
  return best;
}

/** A depth camera's frame of that table, as an organised coloured .pcd. */
export function frame() {
  const next = random(17), width = 160, height = 120, focal = 140;
  const eye = [0, -0.75, 0.6], forward = [0, -eye[1], -eye[2]].map((v) => v / Math.hypot(eye[1], eye[2]));
  const right = [1, 0, 0], down = [0, forward[2], -forward[1]];
  const rows = [];
  for (let v = 0; v < height; ++v) {
    for (let u = 0; u < width; ++u) {
      const [x, y] = [(u - 79.5) / focal, (v - 59.5) / focal], size = Math.hypot(x, y, 1);
      const ray = add(add(forward, right, x), down, y).map((c) => c / size);
      const {t, colour} = hit(eye, ray), depth = t / size + 0.001 * (next() - 0.5);
      if (!(depth < 2)) rows.push('nan nan nan 0');
      else rows.push(`${(x * depth).toFixed(5)} ${(y * depth).toFixed(5)} ${depth.toFixed(5)} ${colour[0] * 65536 + colour[1] * 256 + colour[2]}`);
    }
  }
  return `# .PCD v0.7\nVERSION 0.7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH ${width}\nHEIGHT ${height}\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS ${width * height}\nDATA ascii\n${rows.join('\n')}\n`;
}
