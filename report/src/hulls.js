// What a flat model covers: the hulls of the pieces that its points form.

/** Two unit vectors across a unit normal. */
export function across([x, y, z]) {
  const u = Math.abs(x) < 0.8 ? [0, -z, y] : [z, 0, -x];
  const size = Math.hypot(...u);
  const a = u.map((v) => v / size);
  return [a, [y * a[2] - z * a[1], z * a[0] - x * a[2], x * a[1] - y * a[0]]];
}

/** Convex hull of [x, y] pairs, anticlockwise (Andrew's monotone chain). */
export function convexHull(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  if (sorted.length < 3) return sorted;
  const turn = (o, a, b) => (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
  const half = (ordered) => {
    const chain = [];
    for (const p of ordered) {
      while (chain.length >= 2 && turn(chain.at(-2), chain.at(-1), p) <= 0) chain.pop();
      chain.push(p);
    }
    chain.pop();
    return chain;
  };
  return half(sorted).concat(half(sorted.reverse()));
}

const side = 96;  // cells along the longer side of the grid
const leastShare = 0.03;  // of the points; smaller pieces have no hull

/** Marks a piece of touching cells, and gives its cells. */
function flood(counts, width, height, start) {
  const piece = [], open = [start];
  counts[start] = -counts[start];
  while (open.length > 0) {
    const cell = open.pop();
    piece.push(cell);
    const cx = cell % width, cy = (cell - cx) / width;
    for (let y = Math.max(0, cy - 1); y <= Math.min(height - 1, cy + 1); ++y) {
      for (let x = Math.max(0, cx - 1); x <= Math.min(width - 1, cx + 1); ++x) {
        const next = y * width + x;
        if (counts[next] <= 0) continue;
        counts[next] = -counts[next];
        open.push(next);
      }
    }
  }
  return piece;
}

/** Convex hulls of the pieces that points [x, y, x, y ...] of a plane form, largest first. */
export function pieces(flat) {
  const count = flat.length / 2;
  if (count < 3) return [];
  const low = [Infinity, Infinity], high = [-Infinity, -Infinity];
  for (let i = 0; i < flat.length; ++i) {
    low[i % 2] = Math.min(low[i % 2], flat[i]);
    high[i % 2] = Math.max(high[i % 2], flat[i]);
  }
  // Few points lie far apart: their cells are larger.
  const longest = Math.max(high[0] - low[0], high[1] - low[1]) || 1;
  const cell = longest / Math.max(4, Math.min(side, Math.sqrt(count) / 1.5));
  const width = Math.floor((high[0] - low[0]) / cell) + 1, height = Math.floor((high[1] - low[1]) / cell) + 1;
  const cellOf = (i) => Math.floor((flat[2 * i + 1] - low[1]) / cell) * width + Math.floor((flat[2 * i] - low[0]) / cell);
  const counts = new Int32Array(width * height);
  for (let i = 0; i < count; ++i) ++counts[cellOf(i)];
  const pieceOf = new Int32Array(width * height).fill(-1), found = [];
  for (let start = 0; start < counts.length; ++start) {
    if (counts[start] <= 0) continue;
    const cells = flood(counts, width, height, start);
    const size = cells.reduce((sum, c) => sum - counts[c], 0);
    if (size < Math.max(3, leastShare * count)) continue;
    for (const c of cells) pieceOf[c] = found.length;
    found.push({size, rows: new Map()});
  }
  for (let i = 0; i < count; ++i) widen(found[pieceOf[cellOf(i)]], flat[2 * i], flat[2 * i + 1], cell);
  return found.sort((a, b) => b.size - a.size).map(({rows}) => convexHull([...rows.values()].flat()));
}

/** A hull asks only for the ends of each thin row of points. */
function widen(piece, x, y, cell) {
  if (!piece) return;
  const row = Math.floor((4 * y) / cell), ends = piece.rows.get(row);
  if (!ends) {
    piece.rows.set(row, [[x, y], [x, y]]);
    return;
  }
  if (x < ends[0][0]) ends[0] = [x, y];
  if (x > ends[1][0]) ends[1] = [x, y];
}
