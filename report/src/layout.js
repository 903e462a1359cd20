// Where points are drawn: as they are in space, flat in a plane, or the two images of point pairs beside each other.

/** The value below which so many of a sorted sample lie. */
export const quantile = (sorted, share) => sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))];

function boxOf(positions, low, high) {
  const count = positions.length / 3, step = Math.max(1, Math.floor(count / 20000));
  const box = {min: [0, 0, 0], max: [0, 0, 0]};
  for (let d = 0; d < 3 && count > 0; ++d) {
    const sample = [];
    for (let i = 0; i < count; i += step) sample.push(positions[3 * i + d]);
    sample.sort((a, b) => a - b);
    box.min[d] = quantile(sample, low);
    box.max[d] = quantile(sample, high);
  }
  return box;
}

const centreOf = ({min, max}) => min.map((v, d) => (v + max[d]) / 2);
const radiusOf = ({min, max}) => Math.hypot(...min.map((v, d) => max[d] - v)) / 2 || 1;

function spread(columns, count, dimension) {
  const positions = new Float32Array(3 * count);
  for (let i = 0; i < count; ++i) {
    for (let d = 0; d < Math.min(dimension, 3); ++d) positions[3 * i + d] = columns[i * dimension + d];
  }
  return positions;
}

/** Images have y down; the first is on the left. Frames are the images' own, as far as points reach. */
function beside(cloud) {
  const {columns, count, low, high} = cloud;
  const size = [0, 1, 2, 3].map((d) => high[d] - low[d] || 1);
  const gap = 0.06 * (size[0] + size[2]);
  const shift = [-(gap + size[0]) / 2, (gap + size[2]) / 2];
  const positions = new Float32Array(6 * count);
  for (let i = 0; i < count; ++i) {
    positions.set([columns[4 * i] + shift[0], -columns[4 * i + 1], 0], 3 * i);
    positions.set([columns[4 * i + 2] + shift[1], -columns[4 * i + 3], 0], 3 * (count + i));
  }
  const frames = [0, 1].map((k) => ({x: shift[k], width: size[2 * k], height: size[2 * k + 1]}));
  return {positions, frames};
}

/** Some of the points. */
function sampleOf(positions) {
  const count = positions.length / 3, step = Math.max(1, Math.floor(count / 20000)), sample = [];
  for (let i = 0; i < count; i += step) sample.push(positions.subarray(3 * i, 3 * i + 3));
  return sample;
}

export function lay(cloud) {
  const pairs = cloud.dimension === 4;
  const {positions, frames} = pairs ? beside(cloud) : {positions: spread(cloud.columns, cloud.count, cloud.dimension)};
  const flat = cloud.dimension !== 3;
  const box = flat ? boxOf(positions, 0, 1) : boxOf(positions, 0.01, 0.99);
  const sample = sampleOf(positions);
  return {positions, frames, pairs, flat, box, sample, centre: centreOf(box), radius: radiusOf(box), drawn: positions.length / 3};
}
