#!/usr/bin/env python3
"""How many outliers a line survives, and how soon most of a fit is done: runs `swarmfit fit` on made-up lines and draws the first.

  tools/breakdown.py BINARY [--trials 20] [--out docs/images/breakdown.svg]

Breakdown: one line of 100 points, sigma 0.005, among more and more outliers in the unit square, threshold 2.5 sigma. It counts as found where
some model has nine in ten of its points within the threshold; a model that has no such line is an invented one.
Anytime: lines of the same kind among 700 outliers; what the models delivered so far save of the loss, over time. Needs numpy.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

SIGMA, TAU, OWN = 0.005, 0.0125, 100
SHARES = (0.5, 0.7, 0.8, 0.85, 0.88, 0.9, 0.92, 0.93, 0.94, 0.95, 0.96, 0.97)


def line(rng):
    while True:
        a, b = rng.random((2, 2))
        if np.linalg.norm(b - a) >= 0.5:
            break
    along = (b - a) / np.linalg.norm(b - a)
    return a + rng.random((OWN, 1)) * (b - a) + SIGMA * rng.standard_normal((OWN, 1)) * np.array([-along[1], along[0]])


def fit(binary, points, seed, folder, *options):
    file, result = folder / "points.csv", folder / "result.json"
    np.savetxt(file, points, delimiter=",", header="x,y", comments="")
    subprocess.run([binary, "fit", "line2d", str(file), "--threshold", repr(TAU), "--seed", str(seed), "--json", str(result), "--quiet", *options],
                   check=True)
    return json.loads(result.read_text())


def distances(points, model):
    return np.abs(points @ np.array(model["parameters"]["normal"]) + model["parameters"]["offset"])


def breakdown(binary, preset, trials, folder):
    rows = []
    for share in SHARES:
        outliers = round(OWN * share / (1 - share))
        found = invented = 0
        ms = []
        for t in range(trials):
            rng = np.random.default_rng((outliers, t))
            own = line(rng)
            answer = fit(binary, np.concatenate([own, rng.random((outliers, 2))]), t + 1, folder, "--preset", preset)
            hits = [np.mean(distances(own, m) <= TAU) >= 0.9 for m in answer["models"]]
            found += any(hits)
            invented += len(hits) - any(hits)
            ms.append(answer["timing_ms"]["total"])
        rows.append((share, found / trials, invented / trials, float(np.median(ms))))
        print(f"{preset:5s} outliers {100 * share:.0f} %  found {rows[-1][1]:.2f}  invented {rows[-1][2]:.2f}  {rows[-1][3]:.1f} ms", file=sys.stderr)
    return rows


def anytime(binary, trials, folder):
    """Share of the final saving that is there after a fifth of the time, and share of the time after which nine tenths are."""
    for count in (1, 3, 5, 8):
        at_fifth, until_most = [], []
        for t in range(trials):
            rng = np.random.default_rng((count, t))
            points = np.concatenate([line(rng) for _ in range(count)] + [rng.random((700, 2))])
            answer = fit(binary, points, t + 1, folder)
            least = np.full(len(points), TAU)
            times, saved = [], []
            for m in sorted(answer["models"], key=lambda m: m["found_at_ms"]):
                least = np.minimum(least, distances(points, m))
                times.append(m["found_at_ms"] / answer["timing_ms"]["total"])
                saved.append((TAU - least).sum())
            if not saved:
                continue
            share = np.array(saved) / saved[-1]
            at_fifth.append(max([s for s, when in zip(share, times) if when <= 0.2], default=0.0))
            until_most.append(next(when for s, when in zip(share, times) if s >= 0.9))
        print(f"{count} lines: {100 * np.median(at_fifth):.0f} % of the final saving after a fifth of the time; "
              f"90 % after {100 * np.median(until_most):.0f} % of it (medians of {trials})")


def draw(curves, file):
    width, height, left, top, right, bottom = 640, 360, 64, 24, 20, 56
    x = lambda share: left + (share - 0.5) / 0.48 * (width - left - right)
    y = lambda value: height - bottom - value * (height - top - bottom)
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="sans-serif" font-size="12">',
           f'<rect width="{width}" height="{height}" fill="#ffffff"/>']
    for value in (0, 0.25, 0.5, 0.75, 1):
        out.append(f'<path d="M{left} {y(value):.1f}H{width - right}" stroke="#e5e7eb"/>'
                   f'<text x="{left - 8}" y="{y(value) + 4:.1f}" text-anchor="end" fill="#374151">{value:g}</text>')
    for share in (0.5, 0.6, 0.7, 0.8, 0.9, 0.97):
        out.append(f'<path d="M{x(share):.1f} {y(0):.1f}v5" stroke="#374151"/>'
                   f'<text x="{x(share):.1f}" y="{y(0) + 20:.1f}" text-anchor="middle" fill="#374151">{100 * share:.0f} %</text>')
    out.append(f'<text x="{(left + width - right) / 2}" y="{height - 12}" text-anchor="middle" fill="#374151">outliers, of all points</text>'
               f'<text x="18" y="{height / 2 - 16}" text-anchor="middle" transform="rotate(-90 18 {height / 2 - 16})" fill="#374151">'
               'share of scenes, models a scene</text>')
    for k, (name, colour, dashes, values) in enumerate(curves):
        path = " ".join(f"{'M' if i == 0 else 'L'}{x(s):.1f} {y(min(v, 1)):.1f}" for i, (s, v) in enumerate(values))
        out.append(f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="2" stroke-dasharray="{dashes}"/>')
        out += [f'<circle cx="{x(s):.1f}" cy="{y(min(v, 1)):.1f}" r="3" fill="{colour}"/>' for s, v in values]
        out.append(f'<path d="M{left + 16} {y(0.62) + 18 * k:.1f}h28" stroke="{colour}" stroke-width="2" stroke-dasharray="{dashes}"/>'
                   f'<text x="{left + 52}" y="{y(0.62) + 18 * k + 4:.1f}" fill="#374151">{name}</text>')
    file.write_text("\n".join([*out, "</svg>"]) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("binary")
    parser.add_argument("--trials", type=int, default=20, help="scenes a point of the curve [20]")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("docs/images/breakdown.svg"))
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as made:
        folder = pathlib.Path(made)
        fast = breakdown(arguments.binary, "fast", arguments.trials, folder)
        paper = breakdown(arguments.binary, "paper", arguments.trials, folder)
        anytime(arguments.binary, arguments.trials, folder)
    draw([("fast: the line is found", "#2563eb", "none", [(r[0], r[1]) for r in fast]),
          ("fast: models invented", "#dc2626", "none", [(r[0], r[2]) for r in fast]),
          ("paper: the line is found", "#2563eb", "5 4", [(r[0], r[1]) for r in paper]),
          ("paper: models invented", "#dc2626", "5 4", [(r[0], r[2]) for r in paper])], arguments.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
