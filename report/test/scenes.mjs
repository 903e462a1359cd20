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
