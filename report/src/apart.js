// Labels that would cover each other move aside.

/** Where a label may go, in its own widths and heights; near places first. */
const places = [0, 1, 2, 3].flatMap((far) =>
  [[0, -1], [0, 1], [-1, 0], [1, 0], [-1, -1], [1, -1], [-1, 1], [1, 1]].slice(0, far === 0 ? 1 : 8).map(([x, y]) => [0.6 * far * x, far * y]));

const covers = (a, b) => Math.abs(a.x - b.x) < (a.w + b.w) / 2 && Math.abs(a.y - b.y) < (a.h + b.h) / 2;

/**
 * Middles {x, y} of labels, the most important first, each wanted at the middle {x, y, w, h} given, all of them within width x height.
 * undefined for one that finds no free place near its own.
 */
export function apart(labels, width, height) {
  const placed = [];
  return labels.map(({x, y, w, h}) => {
    for (const [across, down] of places) {
      const at = {w, h, x: Math.min(Math.max(x + across * w, w / 2), width - w / 2), y: Math.min(Math.max(y + down * h, h / 2), height - h / 2)};
      if (placed.some((other) => covers(at, other))) continue;
      placed.push(at);
      return {x: at.x, y: at.y};
    }
    return undefined;
  });
}
