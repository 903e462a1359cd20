#!/usr/bin/env python3
"""How many of the spheres or cylinders strewn points hide are found: runs `swarmfit fit` on scenes whose models are known.

  tools/curved_recall.py BINARY sphere|cylinder [--scenes 20] [--seed 1] [--points 120,300,800] [--outliers 0.2,0.5,0.7,0.85]
                         [-- further options of fit]

One to four models in a cube of 2 m, of radius 5 to 30 cm and so many points each, with a deviation of 3 mm; whole, or only the half that a
camera would see. Outliers are strewn evenly over the cube. A sphere is found where some model's radius is within 5 % of its own and the
centre within a tenth of it and 1 cm; a cylinder where the radius is, the axis is within 8 degrees, and its middle is within 0.15 radii and
1 cm of that axis. A model by which nothing is found is a stray. Needs numpy.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

CUBE, SIGMA = 2.0, 0.003        # [m]
SMALLEST, LARGEST = 0.05, 0.3   # radius [m]
SAME_RADIUS, SAME_AXIS = 0.05, np.cos(np.radians(8))


def between(rng, low, high):
    """Evenly by its logarithm."""
    return np.exp(rng.uniform(np.log(low), np.log(high)))


def directions(rng, count):
    v = rng.normal(size=(count, 3))
    return v / np.linalg.norm(v, axis=1)[:, None]


def sphere(rng, count, whole):
    radius = between(rng, SMALLEST, LARGEST)
    centre = rng.uniform(radius - CUBE / 2, CUBE / 2 - radius, 3)
    out = directions(rng, count)
    if not whole:
        out[:, 2] = -np.abs(out[:, 2])
    return {"radius": radius, "centre": centre}, centre + radius * out


def cylinder(rng, count, whole):
    radius = between(rng, SMALLEST, LARGEST)
    centre = rng.uniform(radius - CUBE / 2, CUBE / 2 - radius, 3)
    axis = directions(rng, 1)[0]
    across = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    across /= np.linalg.norm(across)
    angle = rng.uniform(0, 2 * np.pi if whole else np.pi, count)
    along = rng.uniform(-0.5, 0.5, count) * radius * between(rng, 2, 8)
    points = centre + np.outer(along, axis) + radius * (np.outer(np.cos(angle), across) + np.outer(np.sin(angle), np.cross(axis, across)))
    return {"radius": radius, "centre": centre, "axis": axis}, points


def same(found, true):
    if abs(found["radius"] - true["radius"]) > SAME_RADIUS * true["radius"]:
        return False
    if "axis" not in true:
        return np.linalg.norm(np.array(found["centre"]) - true["centre"]) < 0.1 * true["radius"] + 0.01
    axis, off = np.array(found["axis"]), true["centre"] - np.array(found["point"])
    return abs(axis @ true["axis"]) > SAME_AXIS and np.linalg.norm(off - axis * (axis @ off)) < 0.15 * true["radius"] + 0.01


def fit(binary, kind, rows, further):
    with tempfile.TemporaryDirectory() as folder:
        cloud, result = pathlib.Path(folder, "cloud.xyz"), pathlib.Path(folder, "result.json")
        np.savetxt(cloud, rows, fmt="%.5f")
        subprocess.run([binary, "fit", kind, cloud, "--json", result, "--quiet", *further], check=True, stdout=subprocess.DEVNULL)
        answer = json.loads(result.read_text())
        return [m["parameters"] for m in answer["models"] if m["type"] == kind], answer["timing_ms"]["total"]


def main():
    own, further = sys.argv[1:], []
    if "--" in own:
        own, further = own[:own.index("--")], own[own.index("--") + 1:]
    parser = argparse.ArgumentParser()
    parser.add_argument("binary")
    parser.add_argument("kind", choices=["sphere", "cylinder"])
    parser.add_argument("--scenes", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--points", default="120,300,800")
    parser.add_argument("--outliers", default="0.2,0.5,0.7,0.85")
    args = parser.parse_args(own)
    make = {"sphere": sphere, "cylinder": cylinder}[args.kind]
    print("| points | outliers | seen | found | strays a scene | ms, median |")
    print("|---|---|---|---|---|---|")
    for points in map(int, args.points.split(",")):
        for outliers in map(float, args.outliers.split(",")):
            for whole in (True, False):
                found, all_true, strays, times = 0, 0, 0, []
                for scene in range(args.scenes):
                    rng = np.random.default_rng([args.seed, scene, points, int(1000 * outliers), whole])
                    made = [make(rng, points, whole) for _ in range(rng.integers(1, 5))]
                    rows = np.vstack([p + rng.normal(0, SIGMA, p.shape) for _, p in made])
                    strewn = rng.uniform(-CUBE / 2, CUBE / 2, (int(outliers / (1 - outliers) * len(rows)), 3))
                    models, ms = fit(args.binary, args.kind, np.vstack([rows, strewn]), further)
                    found += sum(any(same(m, true) for m in models) for true, _ in made)
                    strays += sum(not any(same(m, true) for true, _ in made) for m in models)
                    all_true += len(made)
                    times.append(ms)
                print(f"| {points} | {outliers:.0%} | {'whole' if whole else 'half'} | {found / all_true:.0%} | "
                      f"{strays / args.scenes:.2f} | {np.median(times):.1f} |", flush=True)


if __name__ == "__main__":
    main()
