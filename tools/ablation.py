#!/usr/bin/env python3
"""The parts of the search, one at a time: runs `swarmfit fit` on scenes with a known truth and writes a table in Markdown.

  tools/ablation.py BINARY [--trials 20] [--seeds 3] [--out FILE] [--data DIR]

Scenes are made here: lines among outliers (the paper's: 100 points each, 700 outliers, unit square) and planes in a box. With --data, or
SWARMFIT_DATA_DIR, the labelled files in its adelaide_h, adelaide_f and toldo as well. Needs numpy and scipy.
"""
import argparse
import csv
import json
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
from scipy.optimize import linear_sum_assignment

SIGMA = 0.005
TAU = 2.5 * SIGMA

# Name, what it stands for, options. A swarm of one step is random sampling: its particles are minimal samples, scored once.
LINE_ROWS = [
    ("fast", "the default", []),
    ("fast, parametric deflation", "Eq. (5) instead of sinking caps", ["--deflation", "parametric"]),
    ("fast, s = 3", "swarms end sooner", ["--stall", "3"]),
    ("fast, s = 5", "all swarms alike", ["--stall", "5"]),
    ("fast, s = 10", "the default for planes", ["--stall", "10"]),
    ("fast, s = 20", "and later", ["--stall", "20"]),
    ("fast, all samples fly, 64", "none is left out after the first step", ["--particles", "64"]),
    ("fast, all samples fly, 200", "", ["--particles", "200"]),
    ("fast, no flight", "random sampling, half of it local; the best refined", ["--particles", "1250", "--iterations", "1"]),
    ("fast, no flight, more", "the same with more samples", ["--particles", "2500", "--iterations", "1"]),
    ("paper", "Zhou et al. 2010", ["--preset", "paper"]),
    ("paper, residual deflation", "", ["--preset", "paper", "--deflation", "residual"]),
    ("paper, 200 particles", "", ["--preset", "paper", "--particles", "200"]),
    ("paper, no flight", "random sampling, nothing refined", ["--preset", "paper", "--particles", "5000", "--iterations", "1"]),
]
PLANE_ROWS = LINE_ROWS
# Without flight the samples of all swarms are what the joint end chooses from: random sampling and PEaRL (Isack and Boykov 2012) for pairs.
REAL_ROWS = [
    ("fast", "the default", []),
    ("fast, parametric deflation", "", ["--deflation", "parametric"]),
    ("fast, s = 5", "all swarms alike", ["--stall", "5"]),
    ("fast, s = 10", "", ["--stall", "10"]),
    ("fast, s = 20", "", ["--stall", "20"]),
    ("fast, all samples fly, 64", "", ["--particles", "64"]),
    ("fast, no flight", "random sampling, then the joint end", ["--particles", "1250", "--iterations", "1"]),
    ("fast, no flight, more", "the same with more samples", ["--particles", "2500", "--iterations", "1"]),
    ("paper", "", ["--preset", "paper"]),
]

def line_scene(rng, count):
    points, labels = [], []
    for k in range(count):
        while True:
            a, b = rng.random((2, 2))
            if np.linalg.norm(b - a) >= 0.5:
                break
        along = (b - a) / np.linalg.norm(b - a)
        normal = np.array([-along[1], along[0]])
        points.append(a + rng.random((100, 1)) * (b - a) + SIGMA * rng.standard_normal((100, 1)) * normal)
        labels += [k + 1] * 100
    points.append(rng.random((700, 2)))
    return np.concatenate(points), np.array(labels + [0] * 700)


def plane_scene(rng, count):
    """Square patches of half a side in the unit cube, 300 points each, as many outliers again as points on planes."""
    points, labels = [], []
    for k in range(count):
        frame = np.linalg.qr(rng.standard_normal((3, 3)))[0]
        centre = 0.25 + 0.5 * rng.random(3)
        flat = 0.5 * (rng.random((300, 2)) - 0.5)
        points.append(centre + flat @ frame[:, :2].T + SIGMA * rng.standard_normal((300, 1)) * frame[:, 2])
        labels += [k + 1] * 300
    outliers = 300 * count
    points.append(rng.random((outliers, 3)))
    return np.concatenate(points), np.array(labels + [0] * outliers)


def fit(binary, model, file, options, seed, folder):
    labels, result = folder / "labels.txt", folder / "result.json"
    subprocess.run([binary, "fit", model, str(file), "--seed", str(seed), "--threads", "1", "--labels", str(labels), "--json", str(result),
                    "--quiet", *options], check=True)
    return json.loads(result.read_text()), np.loadtxt(labels, dtype=int)


def misclassification(truth, found):
    """Share of points whose label is wrong; found models are matched to true ones, outliers to outliers."""
    rows, columns = [k for k in np.unique(truth) if k], [k for k in np.unique(found) if k]
    hits = np.array([[np.sum((truth == r) & (found == c)) for c in columns] for r in rows], float).reshape(len(rows), len(columns))
    good = hits[linear_sum_assignment(-hits)].sum() if hits.size else 0
    return 1 - (good + np.sum((truth == 0) & (found == 0))) / len(truth)


def matches(models, points, labels, tau):
    """How many true models are met, and how many found ones met none: nine in ten of the points of a true one are within tau."""
    used = set()
    for k in range(1, labels.max() + 1):
        own = points[labels == k]
        for i, m in enumerate(models):
            normal, offset = np.array(m["parameters"]["normal"]), m["parameters"]["offset"]
            if i not in used and np.mean(np.abs(own @ normal + offset) < tau) >= 0.9:
                used.add(i)
                break
    return len(used), len(models) - len(used)


def synthetic_table(binary, rows, model, make, counts, trials, folder):
    heads = "".join(f" recall, {k} | right count, {k} |" for k in counts)
    out = [f"| search |{heads} evaluations | ms |", "|---|" + "---|" * (2 * len(counts) + 2)]
    scenes = []
    for k in counts:
        for t in range(trials):
            points, labels = make(np.random.default_rng((k, t)), k)
            file = folder / f"{model}-{k}-{t}.csv"
            np.savetxt(file, points, delimiter=",", header="x,y" if points.shape[1] == 2 else "x,y,z", comments="")
            scenes.append((k, t, file, points, labels))
    for name, says, options in rows:
        recall, right = {k: 0 for k in counts}, {k: 0 for k in counts}
        evaluations, ms = [], []
        for k, t, file, points, labels in scenes:
            answer, _ = fit(binary, model, file, ["--threshold", repr(TAU), *options], t + 1, folder)
            met, extra = matches(answer["models"], points, labels, TAU)
            recall[k] += met / k
            right[k] += met == k and extra == 0
            evaluations.append(sum(m["evaluations"] for m in answer["models"]))
            ms.append(answer["timing_ms"]["total"])
        cells = "".join(f" {recall[k] / trials:.3f} | {100 * right[k] / trials:.0f} % |" for k in counts)
        out.append(f"| {name}{': ' + says if says else ''} |{cells} {np.mean(evaluations):,.0f} | {np.median(ms):.1f} |")
        print(out[-1], file=sys.stderr)
    return out


def real_table(binary, groups, seeds, folder):
    out = ["| search | data | wrong labels, mean | median | right count | ms |", "|---|---|---|---|---|---|"]
    for title, files in groups:
        for name, says, options in REAL_ROWS:
            errors, right, ms = [], [], []
            for model, file in files:
                truth = np.array([int(float(r[-1])) for r in list(csv.reader(open(file)))[1:]])
                wrong = []
                for seed in range(1, seeds + 1):
                    answer, found = fit(binary, model, file, options, seed, folder)
                    wrong.append(misclassification(truth, found))
                    right.append(len(answer["models"]) == len(set(truth) - {0}))
                    ms.append(answer["timing_ms"]["total"])
                errors.append(np.mean(wrong))
            out.append(f"| {name}{': ' + says if says else ''} | {title} | {100 * np.mean(errors):.1f} % | {100 * np.median(errors):.1f} % | "
                       f"{100 * np.mean(right):.0f} % | {np.mean(ms):.1f} |")
            print(out[-1], file=sys.stderr)
    return out


def real_files(data):
    groups = []
    pairs = (("adelaide_h", "homography", "AdelaideRMF homographies"), ("adelaide_f", "fundamental", "AdelaideRMF fundamental matrices"))
    for folder, model, title in pairs:
        files = sorted((data / folder).glob("*.csv"))
        if files:
            groups.append((f"{title}, {len(files)} scenes", [(model, f) for f in files]))
    toldo = sorted((data / "toldo").glob("*.csv"))
    if toldo:
        kinds = [("circle2d" if f.name.startswith("Circle") else "line2d", f) for f in toldo]
        groups.append((f"Toldo's lines and circles, {len(toldo)} scenes", kinds))
    return groups


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("binary")
    parser.add_argument("--trials", type=int, default=20, help="scenes of each made-up sort [20]")
    parser.add_argument("--seeds", type=int, default=3, help="runs of each real scene [3]")
    parser.add_argument("--data", default=os.environ.get("SWARMFIT_DATA_DIR", ""), help="folder of real scenes [SWARMFIT_DATA_DIR]")
    parser.add_argument("--out", help="write the tables here [stdout]")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as made:
        folder = pathlib.Path(made)
        out = ["**Lines.**", ""] + synthetic_table(arguments.binary, LINE_ROWS, "line2d", line_scene, (1, 3, 5, 8), arguments.trials, folder)
        out += ["", "**Planes.**", ""] + synthetic_table(arguments.binary, PLANE_ROWS, "plane", plane_scene, (1, 3, 5), arguments.trials, folder)
        groups = real_files(pathlib.Path(arguments.data)) if arguments.data else []
        if groups:
            out += ["", "**Real pairs of images, and Toldo's figures.**", ""] + real_table(arguments.binary, groups, arguments.seeds, folder)
    text = "\n".join(out) + "\n"
    if arguments.out:
        pathlib.Path(arguments.out).write_text(text)
    else:
        print(text, end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
