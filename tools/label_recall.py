#!/usr/bin/env python3
"""How many labels are right where models are many or outliers are: runs `swarmfit fit` on made-up scenes whose labels are known.

  tools/label_recall.py BINARY [--scenes 40] [--seeds 2] [--seed 1] [--sets facades,bodies,...] [--keep DIR] [-- further options of fit]

Sets: `facades` (homographies: one to seven walls of a building that a camera walks past, key points at windows' corners, a seventh of them
set back; of the outliers a third are on no wall, a third join key points of any walls), `large facades` (four to six walls, up to 2000
correspondences, few outliers), `bodies` (fundamental matrices: one to four boxes and cylinders that move each its own way, mismatches among
their key points), `star5`, `star11`, `stairs4` (lines) and `circles5`, 50 points each, at several shares of outliers and deviations, under
the threshold that is estimated. Each true model is matched with at most one found; a label is right where its true one's match agrees.
Needs numpy and scipy.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
from scipy.spatial.transform import Rotation

from ablation import misclassification

SIZE = np.array([640.0, 480.0])
FOCAL = 700.0
TAU = 6.0  # [px] what two walls must differ by to be told apart


def project(points):
    return FOCAL * points[:, :2] / points[:, 2:] + SIZE / 2


def inside(pixels):
    return ((pixels > 0) & (pixels < SIZE)).all(1)


def homography(pairs):
    """Direct linear transform, normalised."""
    def normalised(x):
        scale = np.sqrt(2) / np.sqrt(((x - x.mean(0)) ** 2).sum(1).mean())
        t = np.array([[scale, 0, -scale * x.mean(0)[0]], [0, scale, -scale * x.mean(0)[1]], [0, 0, 1]])
        return np.c_[x, np.ones(len(x))] @ t.T, t

    a, ta = normalised(pairs[:, :2])
    b, tb = normalised(pairs[:, 2:4])
    zero = np.zeros_like(a)
    rows = np.r_[np.c_[a, zero, -b[:, :1] * a], np.c_[zero, a, -b[:, 1:2] * a]]
    return np.linalg.inv(tb) @ np.linalg.svd(rows)[2][-1].reshape(3, 3) @ ta


def transfer(h, pairs):
    """Symmetric transfer distances [px]."""
    one = np.ones(len(pairs))
    there, back = np.c_[pairs[:, :2], one] @ h.T, np.c_[pairs[:, 2:4], one] @ np.linalg.inv(h).T
    return np.sqrt(((there[:, :2] / there[:, 2:] - pairs[:, 2:4]) ** 2).sum(1) + ((back[:, :2] / back[:, 2:] - pairs[:, :2]) ** 2).sum(1))


def told_apart(walls):
    """Whether no wall's points follow another's homography, and nearly all follow their own."""
    models = [homography(w) for w in walls]
    near = np.array([[np.mean(transfer(h, w) < TAU) for h in models] for w in walls])
    return bool((np.diag(near) > 0.9).all() and (near - np.diag(np.diag(near)) < 0.35).all())


def wall_points(rng, corner, along, width, height, count):
    """Key points of a wall: corners of windows, and some anywhere."""
    columns, rows = rng.integers(2, 6), rng.integers(2, 4)
    u = rng.choice(np.linspace(0.1, 0.9, columns), count) + rng.choice([-0.25, 0.25], count) / columns + rng.normal(0, 0.01, count)
    v = rng.choice(np.linspace(0.15, 0.85, rows), count) + rng.choice([-0.25, 0.25], count) / rows + rng.normal(0, 0.01, count)
    anywhere = rng.random(count) < 0.4
    u[anywhere], v[anywhere] = rng.random(anywhere.sum()), rng.random(anywhere.sum())
    relief = np.where(rng.random(count) < 0.15, rng.normal(0, 0.08, count), rng.normal(0, 0.015, count))
    across = np.cross(along, [0, 1.0, 0])
    return corner + np.outer(u * width, along) + np.outer(-v * height, [0, 1.0, 0]) + np.outer(relief, across)


def try_facades(rng, large):
    """Correspondences of each wall, and the outliers; none where the walls cannot be told apart."""
    walls = int(rng.integers(4, 7)) if large else int(rng.choice(np.arange(1, 8), p=[0.1, 0.25, 0.2, 0.15, 0.1, 0.1, 0.1]))
    scale = np.exp(rng.uniform(np.log(2), np.log(6)) if large else rng.uniform(np.log(0.5), np.log(4)))
    corner, angle, plan = np.zeros(3), np.radians(rng.uniform(-50, 50)), []
    for _ in range(walls):
        along, width = np.array([np.cos(angle), 0, np.sin(angle)]), rng.uniform(3, 14)
        plan.append((corner.copy(), along, width, rng.uniform(3, 10)))
        corner = corner + along * width
        if rng.random() < 0.75:
            angle = np.radians(rng.uniform(-70, 70))  # a corner
        else:
            corner[2] += rng.uniform(1, 5) * rng.choice([-1, 1])  # set back
    centre = np.mean([c + a * w / 2 for c, a, w, _ in plan], 0)
    far = rng.uniform(10, 30)
    apart = rng.uniform(0.15, 0.5) * far
    eyes = [centre + [rng.uniform(-5, 5), -rng.uniform(0, 3), -far]]
    eyes.append(eyes[0] + [rng.choice([-1, 1]) * apart, rng.normal(0, 0.3), rng.normal(0, 0.4 * apart)])
    turns = []
    for eye in eyes:
        forward = centre + rng.normal(0, 0.8, 3) - eye
        forward /= np.linalg.norm(forward)
        right = np.cross([rng.normal(0, 0.05), 1, 0], forward)
        right /= np.linalg.norm(right)
        turns.append(np.array([right, np.cross(forward, right), forward]))
    sigma, seen = rng.uniform(0.3, 1.0), []
    for corner, along, width, height in plan:
        points = wall_points(rng, corner, along, width, height, max(18, int(np.exp(rng.uniform(np.log(22), np.log(110))) * scale)))
        views = [(points - eye) @ turn.T for eye, turn in zip(eyes, turns)]
        if any((v[:, 2] < 1).any() for v in views):
            return None
        pixels = [project(v) for v in views]
        both = inside(pixels[0]) & inside(pixels[1])
        if both.sum() >= 15:
            seen.append(np.c_[pixels[0], pixels[1]][both] + rng.normal(0, sigma, (both.sum(), 4)))
    if len(seen) < max(1, walls - 1) or not told_apart(seen):
        return None
    count = sum(map(len, seen))
    share = rng.uniform(0.06, 0.3) if large else rng.uniform(0.2, 0.7)
    strewn = int(count * share / (1 - share))
    out, third = np.c_[rng.uniform(0, SIZE, (strewn, 2)), rng.uniform(0, SIZE, (strewn, 2))], strewn // 3
    # A third are things of their own before and behind the walls, and a third join key points of any walls.
    rays = np.c_[(out[:third, :2] - SIZE / 2) / FOCAL, np.ones(third)] * (rng.uniform(0.5, 1.6, third) * far)[:, None]
    again = (rays @ turns[0] + eyes[0] - eyes[1]) @ turns[1].T
    again[:, 2] = np.maximum(again[:, 2], 0.5)
    there = project(again)
    out[:third, 2:][inside(there)] = there[inside(there)]
    every = np.vstack(seen)
    for side in (slice(0, 2), slice(2, 4)):
        out[third:2 * third, side] = every[rng.integers(count, size=third), side]
    return seen, out


def facades(rng, large=False):
    while True:
        made = try_facades(rng, large)
        if made is not None:
            return made


def body_points(rng, count):
    """On a box, or on a cylinder with its lid, of 8 to 30 cm, seen from its front (-z)."""
    half = rng.uniform(0.04, 0.15, 3)
    u, v = rng.uniform(-1, 1, count), rng.uniform(-1, 1, count)
    face = rng.integers(0, 3, count)
    if rng.random() < 0.5:
        one = np.ones(count)
        points = half * np.select([(face == k)[:, None] for k in range(3)], [np.c_[u, v, -one], np.c_[u, -one, v], np.c_[one, u, v]])
    else:
        angle = np.pi * v / 2
        out, turn = np.sqrt(np.abs(u)), np.pi * v
        side, lid = np.c_[np.sin(angle), u, -np.cos(angle)], np.c_[out * np.sin(turn), -np.ones(count), out * np.cos(turn)]
        points = np.where((face > 0)[:, None], side, lid) * half[[0, 1, 0]]
    # Texture lies in patches.
    middles = points[rng.integers(count, size=6)]
    nearest = np.min(np.linalg.norm(points[:, None] - middles, axis=2), 1)
    keep = np.argsort(nearest + rng.uniform(0, 0.08, count))[:max(14, count // 2)]
    return points[keep]


def bodies(rng):
    wanted = rng.choice([1, 2, 3, 4], p=[0.15, 0.3, 0.35, 0.2])
    sigma, common = rng.uniform(0.3, 0.9), Rotation.from_rotvec(rng.normal(0, np.radians(3), 3))
    shift, boxes, seen = rng.normal(0, 0.02, 3), [], []
    for _ in range(wanted):
        for _ in range(200):
            count = int(np.exp(rng.uniform(np.log(28), np.log(300))))
            centre = np.array([rng.uniform(-0.25, 0.25), rng.uniform(-0.18, 0.18), rng.uniform(0.45, 0.9)])
            before = Rotation.from_rotvec(rng.normal(0, 0.3, 3)).apply(body_points(rng, count))
            axis = rng.normal(size=3)
            turn = Rotation.from_rotvec(axis / np.linalg.norm(axis) * np.radians(rng.uniform(4, 28)))
            after = common.apply(turn.apply(before) + centre + rng.normal(0, rng.uniform(0.02, 0.08), 3)) + shift
            before = before + centre
            if min(before[:, 2].min(), after[:, 2].min()) < 0.2:
                continue
            pair = np.c_[project(before), project(after)]
            both = inside(pair[:, :2]) & inside(pair[:, 2:])
            box = np.r_[pair[:, :2].min(0) - 5, pair[:, :2].max(0)]
            clear = all(box[2] < b[0] or b[2] < box[0] or box[3] < b[1] or b[3] < box[1] for b in boxes)
            if both.mean() >= 0.95 and clear:
                boxes.append(box)
                seen.append(pair[both] + rng.normal(0, sigma, (both.sum(), 4)))
                break
    count = sum(map(len, seen))
    share = rng.uniform(0.2, 0.6)
    strewn, every = int(count * share / (1 - share)), np.vstack(seen)
    sides = []
    for k in (0, 2):
        near = every[rng.integers(count, size=strewn), k:k + 2] + rng.normal(0, 12, (strewn, 2))
        sides.append(np.where(rng.random((strewn, 1)) < 0.6, near, rng.uniform(0, SIZE, (strewn, 2))))
    return seen, np.hstack(sides)


def segment(rng, ends, sigma):
    a, b = map(np.asarray, ends)
    along = (b - a) / np.linalg.norm(b - a)
    return a + rng.random((50, 1)) * (b - a) + rng.normal(0, sigma, (50, 1)) * [-along[1], along[0]]


def star(corners):
    tips = [(np.cos(2 * np.pi * k / corners + np.pi / 2), np.sin(2 * np.pi * k / corners + np.pi / 2)) for k in range(corners)]
    return [(tips[k], tips[(k + corners // 2) % corners]) for k in range(corners)]


LINES = {"star5": star(5), "star11": star(11), "stairs4": [((0.25 * k, 0.2 * k), (0.25 * (k + 1), 0.2 * k)) for k in range(4)]}
CIRCLES = [(0.18, 0.15, 0.55), (0.57, 0.97, 0.334), (0.45, 0.58, 0.146), (0.36, 0.9, 0.595), (0.26, 0.02, 0.281)]


def figure(rng, name, sigma, outliers):
    if name == "circles5":
        angles = rng.uniform(0, 2 * np.pi, (5, 50))
        seen = [np.array([x, y]) + (radius + rng.normal(0, sigma, (50, 1))) * np.c_[np.cos(a), np.sin(a)]
                for (x, y, radius), a in zip(CIRCLES, angles)]
    else:
        seen = [segment(rng, ends, sigma) for ends in LINES[name]]
    every = np.vstack(seen)
    strewn = int(len(every) * outliers / (1 - outliers))
    return seen, rng.uniform(every.min(0) - 0.05, every.max(0) + 0.05, (strewn, 2))


def fit(binary, kind, path, seed, further):
    with tempfile.TemporaryDirectory() as folder:
        labels, result = pathlib.Path(folder, "labels.txt"), pathlib.Path(folder, "result.json")
        subprocess.run([binary, "fit", kind, path, "--seed", str(seed), "--labels", labels, "--json", result, "--quiet", *further],
                       check=True, stdout=subprocess.DEVNULL)
        answer = json.loads(result.read_text())
        return np.loadtxt(labels, dtype=int, ndmin=1), len(answer["models"]), answer["timing_ms"]["total"]


def sets_of(args):
    """Name, kind, and what makes a scene of it."""
    every = {"facades": ("homography", facades), "large facades": ("homography", lambda rng: facades(rng, True)),
             "bodies": ("fundamental", bodies)}
    for name in [*LINES, "circles5"]:
        for sigma in (0.0025, 0.0075):
            for outliers in (0.0, 0.5, 0.7):
                every[f"{name}, sigma {sigma}, {outliers:.0%} outliers"] = (
                    "circle2d" if name == "circles5" else "line2d", lambda rng, n=name, s=sigma, o=outliers: figure(rng, n, s, o))
    wanted = args.sets.split(",") if args.sets else list(every)
    return [(name, *of) for name, of in every.items() if any(name == w or name.startswith(w + ",") for w in wanted)]


def main():
    own, further = sys.argv[1:], []
    if "--" in own:
        own, further = own[:own.index("--")], own[own.index("--") + 1:]
    parser = argparse.ArgumentParser()
    parser.add_argument("binary")
    parser.add_argument("--scenes", type=int, default=40)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--sets")
    parser.add_argument("--keep", type=pathlib.Path)
    args = parser.parse_args(own)
    sets = sets_of(args)
    if not sets:
        parser.error(f"--sets is '{args.sets}', must name sets")
    print("| set | points, median | wrong labels, mean | median | right number | too few | too many | ms, mean |")
    print("|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for k, (name, kind, make) in enumerate(sets):
            wrong, counts, times, sizes = [], [], [], []
            for scene in range(args.scenes):
                # Scenes are the same whatever other sets are asked for.
                rng = np.random.default_rng([args.seed, scene, *name.encode()])
                seen, out = make(rng)
                rows = np.vstack([*seen, out])
                truth = np.r_[np.repeat(np.arange(1, len(seen) + 1), [len(s) for s in seen]), np.zeros(len(out), int)]
                order = rng.permutation(len(rows))
                rows, truth = rows[order], truth[order]
                path = (args.keep or pathlib.Path(folder)) / f"{k:02d}-{scene:03d}.csv"
                path.parent.mkdir(parents=True, exist_ok=True)
                header = ["x", "y"] if rows.shape[1] == 2 else ["x1", "y1", "x2", "y2"]
                np.savetxt(path, np.c_[rows, truth], delimiter=",", header=",".join([*header, "label"]), comments="",
                           fmt=["%.6f"] * rows.shape[1] + ["%d"])
                sizes.append(len(rows))
                for seed in range(1, args.seeds + 1):
                    labels, models, ms = fit(args.binary, kind, path, seed, further)
                    wrong.append(misclassification(truth, labels))
                    counts.append(models - len(seen))
                    times.append(ms)
            counts = np.array(counts)
            shares = [f"{100 * np.mean(of):.0f} %" for of in (counts == 0, counts < 0, counts > 0)]
            print(f"| {name} | {np.median(sizes):.0f} | {100 * np.mean(wrong):.1f} % | {100 * np.median(wrong):.1f} % | "
                  f"{' | '.join(shares)} | {np.mean(times):.1f} |", flush=True)


if __name__ == "__main__":
    main()
