// Colours of models, of things, and of how good a particle is; as [r, g, b] in 0..255.

export const dark = matchMedia('(prefers-color-scheme: dark)');

let named = [];
let first = [255, 221, 0];
export function setColours(models, stickingOut) {
  named = models;
  first = stickingOut;
}

/** Of the k-th model, k >= 1: those of overlay.png. */
export const modelColour = (k) => named[(k - 1) % named.length];

function fromHue(hue, saturation, lightness) {
  const a = saturation * Math.min(lightness, 1 - lightness);
  const channel = (n) => {
    const k = (n + hue / 30) % 12;
    return Math.round(255 * (lightness - a * Math.max(-1, Math.min(k - 3, 9 - k, 1))));
  };
  return [channel(0), channel(8), channel(4)];
}

/** Of the k-th thing: the yellow of what sticks out first, then hues far from the last ones. */
export function objectColour(k) {
  if (k === 1) return first;
  const hue = (52 + 137.508 * (k - 1)) % 360;
  return fromHue(hue, 0.85, k % 2 === 0 ? 0.56 : 0.68);
}

export const neutral = () => (dark.matches ? [92, 104, 120] : [150, 160, 173]);
/** As stylesheets and three.js both read it. */
export const css = ([r, g, b]) => `rgb(${Math.round(r)}, ${Math.round(g)}, ${Math.round(b)})`;
export const variable = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

const ramps = {
  light: [[176, 188, 204], [86, 156, 214], [64, 84, 178], [120, 20, 90]],
  dark: [[58, 72, 92], [42, 120, 170], [80, 200, 150], [255, 226, 92]],
};

/** share in [0, 1]: from what is of no use to the best. */
export function ramp(share) {
  const stops = dark.matches ? ramps.dark : ramps.light;
  const at = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
  const k = Math.min(Math.floor(at), stops.length - 2);
  return stops[k].map((c, i) => Math.round(c + (stops[k + 1][i] - c) * (at - k)));
}
