// The colours of the points: by what they were found to be, as the camera saw them, or by how far they are from the nearest model.
import {dark, modelColour, neutral, objectColour, ramp} from './colours.js';
import {distanceTo, relative} from './models.js';

const uncertain = 65535;

/** The thing a point belongs to, 1-based; 0 none. */
export function thingOf(cloud, i) {
  const thing = (cloud.objects ?? cloud.popout)?.[i] ?? 0;
  return thing === uncertain ? 0 : thing;
}

/** Distance of each point to the nearest model. */
export function residuals(cloud, models, centre) {
  const least = new Float32Array(cloud.count).fill(Infinity);
  // Point pairs are measured in the images' own frame.
  let columns = cloud.columns;
  if (cloud.dimension === 4) columns = cloud.columns.map((v, k) => v + cloud.middle[k % 4]);
  for (const model of models) {
    const distance = distanceTo(model.type, relative(model, centre));
    for (let i = 0; i < cloud.count; ++i) least[i] = Math.min(least[i], distance(columns, i * cloud.dimension));
  }
  return least;
}

/** Near is strong, three thresholds away is faint. */
export const distanceColour = (distance, threshold) => ramp(1 - Math.min(distance / (3 * threshold), 1));

/** The camera's picture seen through a colour. */
function textured(colour, rgb, i, strength) {
  if (!rgb) return colour;
  const light = 0.5 + (0.3 * rgb[3 * i] + 0.59 * rgb[3 * i + 1] + 0.11 * rgb[3 * i + 2]) / 320;
  return colour.map((c, d) => strength * light * c + (1 - strength) * rgb[3 * i + d]);
}

function plain(rgb, i) {
  const grey = neutral();
  if (!rgb) return grey;
  const light = 0.3 * rgb[3 * i] + 0.59 * rgb[3 * i + 1] + 0.11 * rgb[3 * i + 2];
  const level = dark.matches ? 30 + 0.45 * light : 120 + 0.45 * light;
  return [level, level, level * 1.03];
}

/**
 * Fills `out`, four bytes a drawn point. `show`: {by: found|photo|distance, found: the set of model numbers known by now or undefined for
 * the result, selected: {kind, k} or undefined}.
 */
export function paint(out, layout, cloud, show, distances, threshold, background) {
  const cached = new Map(), things = Boolean(cloud.objects ?? cloud.popout);
  const known = (key, colour) => {
    if (!cached.has(key)) cached.set(key, colour());
    return cached.get(key);
  };
  for (let i = 0; i < cloud.count; ++i) {
    const plane = cloud.planes[i], thing = show.found ? 0 : thingOf(cloud, i);
    const visible = plane > 0 && (!show.found || show.found.has(plane));
    let colour;
    if (show.by === 'photo') {
      colour = cloud.rgb.subarray(3 * i, 3 * i + 3);
    } else if (show.by === 'distance') {
      colour = distanceColour(distances[i], threshold);
    } else if (thing > 0) {
      colour = textured(known(-thing, () => objectColour(thing)), cloud.rgb, i, 0.72);
    } else if (visible) {
      colour = textured(known(plane, () => modelColour(plane)), cloud.rgb, i, things ? 0.5 : 0.72);
    } else {
      colour = plain(cloud.rgb, i);
    }
    const {selected} = show;
    const out_of_it = selected && (selected.kind === 'model' ? plane !== selected.k : thing !== selected.k);
    for (let d = 0; d < 3; ++d) out[4 * i + d] = Math.min(255, out_of_it ? 0.16 * colour[d] + 0.84 * background[d] : colour[d]);
    out[4 * i + 3] = 255;
  }
  if (layout.pairs) out.copyWithin(4 * cloud.count, 0, 4 * cloud.count);
}
