// While the view is turned, no more points are drawn than leave it following the hand; all of them again when it stands still.

const slow = 50, quick = 25;  // ms from one picture to the next
const leastShare = 1 / 16;
const rest = 200;  // ms without a move until it stands still

const commonDivisor = (a, b) => (b === 0 ? a : commonDivisor(b, a % b));

/** 0 ... n - 1 in an order of which every beginning is spread evenly over all. */
export function evenly(n) {
  let step = Math.max(1, Math.round(0.618034 * n));
  while (commonDivisor(step, n) > 1) ++step;
  const order = new Uint32Array(n);
  for (let k = 0, at = 0; k < n; ++k, at = (at + step) % n) order[k] = at;
  return order;
}

export class Pace {
  /** `atRest` is called when the view stands still again. */
  constructor(atRest) {
    Object.assign(this, {atRest, share: 1, held: false, moving: false});
  }

  hold() {
    this.held = true;
    clearTimeout(this.timer);
  }

  release() {
    this.held = false;
    if (this.moving) this.move();
  }

  move() {
    this.moving = true;
    clearTimeout(this.timer);
    if (this.held) return;
    this.timer = setTimeout(() => {
      this.moving = false;
      this.atRest();
    }, rest);
  }

  /** How many of the points the next picture has. */
  points(all) {
    return this.moving ? Math.ceil(this.share * all) : all;
  }

  /** A picture of a moving view took so long. */
  took(ms) {
    if (ms > slow) this.share = Math.max(leastShare, this.share / 2);
    else if (ms < quick) this.share = Math.min(1, 1.25 * this.share);
  }
}
