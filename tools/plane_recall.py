#!/usr/bin/env python3
"""How many of the planes that a depth camera sees are found: runs `swarmfit fit plane` on ray-cast scenes whose planes are known.

  tools/plane_recall.py BINARY [--scenes 60] [--seeds 2] [-- further options of fit]

Tables with three to eight boxes, and every third scene a room with boxes and two walls, as a 640 x 480 camera sees them: noise of 1 mm +
1.9 mm/m^2 times the square of the depth beyond 0.4 m, a hundredth of flying pixels, holes. A true plane of at least 1.2 % of the points is
found where half of its points have one label whose plane is within 5 degrees of it. A stray is a model most points of which are not one
plane's, or that is farther off than that. Needs numpy.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

WIDTH, HEIGHT, FOCAL, FARTHEST = 640, 480, 525.0, 5.0
LEAST_SHARE, MOST_ANGLE = 0.012, 5.0
BIG = 0.03  # share of the points from which on a plane is told of as big


def is_room(number):
    return number % 3 == 2


def rectangles(rng, room):
    """Point, normal, two edges' directions and half lengths, each."""
    size = 3.0 if room else 1.0
    x, y, z = np.eye(3)
    faces = [(np.zeros(3), z, x, y, 1.2 * size, size)]
    if room:
        for k in range(2):
            turn = k * np.pi / 2 + rng.normal(0, 0.03)
            normal = np.array([np.cos(turn), np.sin(turn), 0])
            faces.append((1.2 * z - 2.4 * normal, normal, np.array([-np.sin(turn), np.cos(turn), 0]), z, 3.0, 1.4))
    for _ in range(rng.integers(3, 9)):
        half = rng.uniform(0.03, 0.14, 3) * (1.3 * size if room else 1)
        centre = np.array([rng.uniform(-0.45, 0.45) * size, rng.uniform(-0.35, 0.35) * size, half[2]])
        turn = rng.uniform(0, np.pi)
        axes = np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
        for a in range(3):
            b, c = [k for k in range(3) if k != a]
            faces += [(centre + s * half[a] * axes[a], s * axes[a], axes[b], axes[c], half[b], half[c]) for s in (-1, 1)]
    return faces


def scene(number):
    """Points (N, 3), float32, NaN where there is none; the number of each point's plane from 1, 0 none; planes as normal and offset."""
    rng = np.random.default_rng(number)
    room = is_room(number)
    faces = rectangles(rng, room)
    elevation, azimuth = np.radians(rng.uniform(25, 55)), rng.uniform(-0.5, 0.5) + (np.pi / 4 if room else 0)
    camera = rng.uniform(0.9, 1.5) * (2.0 if room else 1) * np.array(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
    forward = -camera / np.linalg.norm(camera)
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    turn = np.stack([right, np.cross(forward, right), forward])
    u, v = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    rays = np.stack([(u - WIDTH / 2) / FOCAL, (v - HEIGHT / 2) / FOCAL, np.ones_like(u, float)], -1).reshape(-1, 3)
    depth, labels, planes = np.full(len(rays), np.inf), np.zeros(len(rays), int), []
    for point, normal, a, b, half_a, half_b in faces:
        at, normal, a, b = turn @ (point - camera), turn @ normal, turn @ a, turn @ b
        toward = rays @ normal
        t = (at @ normal) / np.where(np.abs(toward) < 1e-9, 1e-9, toward)
        where = rays * t[:, None] - at
        seen = (t > 0.3) & (np.abs(where @ a) <= half_a) & (np.abs(where @ b) <= half_b) & (toward < 0) & (t < depth)
        planes.append((normal, -normal @ at))
        depth[seen], labels[seen] = t[seen], len(planes)
    there = (depth <= FARTHEST) & (rng.random(len(rays)) >= 0.02)
    depth[~there], labels[~there] = np.nan, 0
    noisy = depth + (0.001 + 0.0019 * np.maximum(depth - 0.4, 0) ** 2) * rng.standard_normal(len(rays))
    points = rays * (np.round(noisy * 3000) / 3000)[:, None]
    flying = there & (rng.random(len(rays)) < 0.01)
    points[flying] *= rng.uniform(0.8, 1.2, (flying.sum(), 1))
    labels[flying] = 0
    return points.astype(np.float32), labels, planes


def write_pcd(file, points):
    header = ("# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
              f"WIDTH {WIDTH}\nHEIGHT {HEIGHT}\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(points)}\nDATA binary\n")
    file.write_bytes(header.encode() + points.tobytes())


def fit(binary, cloud, seed, folder, options):
    result, labels = folder / "result.json", folder / "labels.txt"
    files = ["--json", str(result), "--labels", str(labels)]
    subprocess.run([binary, "fit", "plane", str(cloud), "--seed", str(seed), "--quiet", *files, *options], check=True)
    return json.loads(result.read_text()), np.array(labels.read_text().split(), dtype=int)


def judge(points, truth, planes, result, labels, tally):
    finite, models = np.isfinite(points[:, 0]).sum(), result["models"]
    shared = np.zeros((len(planes) + 1, len(models) + 1), int)
    np.add.at(shared, (truth, labels), 1)
    counts = np.bincount(truth, minlength=len(planes) + 1)
    cosines = np.array([[abs(np.dot(normal, m["parameters"]["normal"])) for m in models] for normal, _ in planes])
    apart = np.degrees(np.arccos(np.minimum(cosines, 1.0)))
    for k in range(len(planes)):
        if counts[k + 1] < LEAST_SHARE * finite:
            continue
        found = [j for j in range(len(models)) if 2 * shared[k + 1, j + 1] >= counts[k + 1] and apart[k, j] < MOST_ANGLE]
        tally["big" if counts[k + 1] > BIG * finite else "small"].append(bool(found))
        tally["angle"] += [apart[k, j] for j in found[:1]]
    strays = 0
    for j in range(len(models)):
        own = shared[1:, j + 1]
        k = own.argmax()
        strays += own.sum() == 0 or 2 * own[k] < own.sum() or apart[k, j] >= MOST_ANGLE
    tally["strays"].append(strays)
    tally["ms"].append(result["timing_ms"]["fit"])


def main():
    given = sys.argv[1:]
    at = given.index("--") if "--" in given else len(given)
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("binary")
    parser.add_argument("--scenes", type=int, default=60)
    parser.add_argument("--seeds", type=int, default=2)
    asked = parser.parse_args(given[:at])
    tallies = {kind: {k: [] for k in ("big", "small", "angle", "strays", "ms")} for kind in ("tables", "rooms")}
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for number in range(asked.scenes):
            points, truth, planes = scene(number)
            cloud = folder / "scene.pcd"
            write_pcd(cloud, points)
            for seed in range(1, asked.seeds + 1):
                result, labels = fit(asked.binary, cloud, seed, folder, given[at + 1:])
                judge(points, truth, planes, result, labels, tallies["rooms" if is_room(number) else "tables"])
    for kind, t in tallies.items():
        if not t["ms"]:
            continue
        every = t["big"] + t["small"]
        print(f"{kind:6}  planes found {np.mean(every):.3f} of {len(every)} (big {np.mean(t['big']):.3f}, small {np.mean(t['small']):.3f})"
              f"  angle {np.median(t['angle']):.2f} deg  strays a fit {np.mean(t['strays']):.2f}  {np.median(t['ms']):.1f} ms")


if __name__ == "__main__":
    main()
