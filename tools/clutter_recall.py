#!/usr/bin/env python3
"""How well the things on a cluttered table are told apart: runs `swarmfit perceive` on frames composed of labelled ones.

  tools/clutter_recall.py BINARY FRAME.pcd... [--scenes 40] [--seed 1] [--keep DIR] [-- further options of perceive]

Frames are organised and coloured, seen by a camera of 525 px with its centre in the middle of 640 x 480, and have a field `label`: 1 to 9 the
table, 20 to 29 the first thing, 30 to 39 the second and so on. Whole things are taken from any of them, turned by up to 20 degrees, moved over
another's table and seen by its camera: apart from all else, touching something, stacked on a flat top, or each of these by chance. What lies
nearer hides what is behind it, and the projector beside the camera leaves shadows. Each true thing is matched with at most one that was
found; F is that of the overlap, over pixels with depth. Needs numpy, scipy, opencv-python-headless and pypcd4.
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile
from dataclasses import dataclass

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # its threads spin on while the program is timed

import cv2
import numpy as np
from pypcd4 import Encoding, PointCloud
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

WIDTH, HEIGHT, FOCAL, CENTRE = 640, 480, 525.0, (319.5, 239.5)
BASELINE = 0.075  # [m] from the camera to the projector at its left
KINDS = ("apart", "touching", "stacked", "mixed")
UNCERTAIN = 65535


class Frame:
    """A labelled frame; table coordinates have the table at height 0 and the foot of the camera at the origin."""

    def __init__(self, path):
        data = PointCloud.from_path(path).pc_data
        self.points = np.stack([data[c] for c in "xyz"], 1).astype(float).reshape(HEIGHT, WIDTH, 3)
        self.label = data["label"].astype(int).reshape(HEIGHT, WIDTH) // 10
        self.table = (data["label"].reshape(HEIGHT, WIDTH) > 0) & (self.label == 0)
        self.colour = data["rgba"].reshape(HEIGHT, WIDTH)
        self.seen = np.isfinite(self.points).all(2)
        on_table = self.points[self.seen & self.table]
        inliers = on_table
        for _ in range(3):
            middle = inliers.mean(0)
            normal = np.linalg.svd((inliers - middle)[::10], full_matrices=False)[2][2]
            normal *= -np.sign(normal[1])  # y points down
            inliers = on_table[np.abs((on_table - middle) @ normal) < 0.01]
        right = np.array([1.0, 0, 0]) - normal * normal[0]
        right /= np.linalg.norm(right)
        self.axes = np.stack([right, np.cross(normal, right), normal])
        self.foot = normal * (normal @ middle)

    def to_table(self, points):
        return (points - self.foot) @ self.axes.T

    def to_camera(self, points):
        return points @ self.axes + self.foot


@dataclass
class Thing:
    points: np.ndarray  # in table coordinates, three times as dense as its pixels along either side
    colours: np.ndarray
    count: int  # of its own pixels, which are the last of the points


@dataclass
class Placed:
    """What stands in a scene."""

    places: np.ndarray  # on the table
    number: int
    count: int
    bottom: float
    top: float
    flat: np.ndarray | None  # places of its top, where that is flat and whole

    def hull(self):
        return hull_of(self.places)


def hull_of(places):
    return cv2.convexHull((places * 1000).astype(np.float32))  # [mm]


def shared(a, b):
    """Area two hulls have in common [mm^2]."""
    return cv2.intersectConvexConvex(a, b)[0]


def things_of(frame):
    """Those that are seen whole and stand on the table."""
    for number in np.unique(frame.label[frame.label >= 2]):
        mask = frame.seen & (frame.label == number)
        rows, columns = np.where(mask)
        inside = columns.min() > 2 and columns.max() < WIDTH - 3 and rows.max() < HEIGHT - 3 if len(rows) else False
        if mask.sum() < 1500 or not inside:
            continue
        outline = cv2.convexHull(np.stack([columns, rows], 1).astype(np.int32))
        height = frame.to_table(frame.points[mask])[:, 2]
        if mask.sum() < 0.78 * cv2.contourArea(outline) or height.max() < 0.03 or np.percentile(height, 2) > 0.03:
            continue
        yield dense(frame, mask)


def dense(frame, mask, steps=3):
    places = np.where(mask[..., None], frame.to_table(np.nan_to_num(frame.points).reshape(-1, 3)).reshape(frame.points.shape), np.nan)
    corners = [(slice(None, -1), slice(None, -1)), (slice(None, -1), slice(1, None)), (slice(1, None), slice(None, -1)), (slice(1, None), slice(1, None))]
    depth = np.stack([np.where(mask, frame.points[..., 2], np.inf)[c] for c in corners])
    whole = np.all([mask[c] for c in corners], 0)
    whole[whole] = np.ptp(depth[:, whole], axis=0) < 0.02  # one surface
    points, colours = [], []
    for a in range(steps):
        for b in range(steps):
            s, t = a / steps, b / steps
            weights = ((1 - s) * (1 - t), (1 - s) * t, s * (1 - t), s * t)
            points.append(sum(w * places[c][whole] for w, c in zip(weights, corners)))
            colours.append(frame.colour[corners[int(np.argmax(weights))]][whole])
    points.append(places[mask])
    colours.append(frame.colour[mask])
    return Thing(np.concatenate(points), np.concatenate(colours), int(mask.sum()))


class Scene:
    def __init__(self, base):
        self.base = base
        self.points, self.label, self.colour, self.seen = (a.copy() for a in (base.points, base.label, base.colour, base.seen))
        self.placed = []
        self.table = base.to_table(base.points[base.seen & base.table])[::50, :2]
        for number in np.unique(base.label[base.label >= 2]):
            places = base.to_table(base.points[base.seen & (base.label == number)])
            if len(places) > 100:
                self.note(places, int(number), 0.0)

    def note(self, places, number, bottom):
        top = np.percentile(places[:, 2], 98)
        flat = places[np.abs(places[:, 2] - top) < 0.006][:, :2]
        whole = False
        if len(flat) > max(300, 0.12 * len(places)):
            cells = np.zeros((400, 400), np.uint8)
            at = np.clip((flat - flat.min(0)) * 500, 0, 399).astype(int)
            cells[at[:, 1], at[:, 0]] = 1
            whole = cv2.morphologyEx(cells, cv2.MORPH_CLOSE, np.ones((5, 5))).sum() * 4 > 0.75 * cv2.contourArea(hull_of(flat))
        self.placed.append(Placed(places[::7, :2], number, len(places), bottom, top, flat if whole else None))

    def propose(self, rng, thing, how):
        """Its points over this table, and the height it stands at; None where it does not fit."""
        turn, own = rng.uniform(-0.35, 0.35), thing.points[-thing.count :]
        about = np.append(own[:, :2].mean(0), 0)
        rotation = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
        bottom = 0.0
        if how == "stacked":
            tops = [p for p in self.placed if p.flat is not None and p.top < 0.2]
            if not tops:
                return None
            below = tops[rng.integers(len(tops))]
            to, bottom = below.flat.mean(0) + rng.uniform(-0.15, 0.15, 2) * np.ptp(below.flat, axis=0), below.top
        else:
            to = self.table[rng.integers(len(self.table))]
            if np.linalg.norm(to - about[:2]) > 0.25:  # its hidden sides would come into view
                return None
        moved = (thing.points - about) @ rotation.T + np.append(to, bottom)
        places = moved[-thing.count :: 7, :2]
        hull = hull_of(places)
        if how == "stacked":
            top = hull_of(below.flat)
            if np.mean([cv2.pointPolygonTest(top, (float(x * 1000), float(y * 1000)), True) > -12 for x, y in places[::8]]) < 0.8:
                return None
            taken = [p for p in self.placed if p.bottom >= bottom - 0.005 and shared(p.hull(), hull) > 0]
            return None if taken else (moved, bottom)
        if any(shared(p.hull(), hull) > (5 if how == "touching" else 0) for p in self.placed):
            return None
        gaps = [cKDTree(p.places).query(places) for p in self.placed]
        if how == "apart":
            on_table = cKDTree(self.table).query(places)[0].max() < 0.05
            return (moved, bottom) if on_table and all(g[0].min() > 0.012 for g in gaps) else None
        nearest = int(np.argmin([g[0].min() for g in gaps]))
        distance, other = gaps[nearest]
        k = int(distance.argmin())
        if distance[k] > 0.15:
            return None
        way = self.placed[nearest].places[other[k]] - places[k]
        moved[:, :2] += way * max(0.0, 1 - rng.uniform(0, 0.006) / max(distance[k], 1e-9))
        hull = hull_of(moved[-thing.count :: 7, :2])
        return None if any(shared(p.hull(), hull) > 30 for p in self.placed) else (moved, bottom)

    def add(self, rng, thing, how):
        proposal = self.propose(rng, thing, how)
        if proposal is None:
            return False
        moved, bottom = proposal
        seen_at = self.base.to_camera(moved)
        u, v = (np.rint(seen_at[:, d] / seen_at[:, 2] * FOCAL + CENTRE[d]).astype(int) for d in (0, 1))
        if u.min() < 3 or u.max() > WIDTH - 4 or v.min() < 3 or v.max() > HEIGHT - 4:
            return False
        order = np.argsort(-seen_at[:, 2])  # the nearest is written last
        at = (v * WIDTH + u)[order]
        depth = np.full(HEIGHT * WIDTH, np.inf)
        source = np.zeros(HEIGHT * WIDTH, int)
        depth[at], source[at] = seen_at[order, 2], order
        wins = depth < np.where(self.seen, self.points[..., 2], np.inf).ravel()
        label, seen = self.label.ravel().copy(), self.seen.ravel() | wins
        number = max([p.number for p in self.placed], default=1) + 1
        label[wins] = number
        fair = wins.sum() > max(1000, 0.5 * np.isfinite(depth).sum())
        if not fair or any((seen & (label == p.number)).sum() < max(600, 0.25 * p.count) for p in self.placed):
            return False  # too little of something would be seen
        self.points.reshape(-1, 3)[wins] = seen_at[source[wins]]
        self.colour.ravel()[wins] = thing.colours[source[wins]]
        self.label, self.seen = label.reshape(HEIGHT, WIDTH), seen.reshape(HEIGHT, WIDTH)
        self.note(moved[-thing.count :], number, bottom)
        return True

    def cast_shadows(self):
        """What the projector's light does not reach has no depth."""
        column = np.arange(WIDTH) - FOCAL * BASELINE / np.where(self.seen, self.points[..., 2], 1)
        lit = np.where(self.seen, column, np.inf)[:, ::-1]
        nearest = np.minimum.accumulate(lit, 1)
        self.seen &= ~(lit > np.concatenate([np.full((HEIGHT, 1), np.inf), nearest[:, :-1]], 1) + 0.5)[:, ::-1]
        self.points[~self.seen] = np.nan

    def truth(self):
        """The thing at each pixel, 0 for none, -1 where there is no depth."""
        return np.where(self.seen, np.where(self.label >= 2, self.label, 0), -1).astype(np.int16)

    def write(self, path):
        label = np.where(self.label >= 2, 10 * self.label, self.base.table)
        fields = [self.points[..., d].ravel() for d in range(3)] + [self.colour.ravel(), np.where(self.seen, label, 0).ravel()]
        types = (np.float32, np.float32, np.float32, np.uint32, np.uint32)
        cloud = PointCloud.from_points([f.astype(t) for f, t in zip(fields, types)], ("x", "y", "z", "rgba", "label"), types)
        cloud.metadata.width, cloud.metadata.height = WIDTH, HEIGHT
        cloud.save(str(path), encoding=Encoding.BINARY)


def compose(rng, frames, things, kind):
    while True:
        scene = Scene(frames[rng.integers(len(frames))])
        standing = len(scene.placed)
        wanted = standing + rng.integers(2, 7)
        for _ in range(200):
            if len(scene.placed) >= wanted:
                break
            scene.add(rng, things[rng.integers(len(things))], KINDS[rng.integers(3)] if kind == "mixed" else kind)
        if len(scene.placed) > standing:
            scene.cast_shadows()
            return scene


def overlap(truth, found):
    """F of each true thing."""
    true, other = np.unique(truth[truth > 0]), np.unique(found[found > 0])
    f = np.zeros((len(true), len(other)))
    for i, a in enumerate(true):
        for j, b in enumerate(other):
            f[i, j] = 2 * np.sum((truth == a) & (found == b)) / (np.sum(truth == a) + np.sum(found == b))
    rows, columns = linear_sum_assignment(-f)
    best = np.zeros(len(true))
    best[rows] = f[rows, columns]
    return best


def score(binary, truth, path, options):
    with tempfile.TemporaryDirectory() as out:
        subprocess.run([binary, "perceive", str(path), "--out", out, "--quiet", *options], check=True, stdout=subprocess.DEVNULL)
        result = json.loads((pathlib.Path(out) / "result.json").read_text())
        objects = cv2.imread(str(pathlib.Path(out) / "objects.png"), cv2.IMREAD_UNCHANGED).astype(int)
    f = overlap(np.maximum(truth, 0), np.where((truth >= 0) & (objects != UNCERTAIN), objects, 0))
    return f.mean(), (f > 0.75).mean(), sum(m["supporting"] for m in result["models"]), result["timing_ms"]["total"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("binary")
    parser.add_argument("frames", nargs="+")
    parser.add_argument("--scenes", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=pathlib.Path, help="folder for the frames that are made")
    arguments = sys.argv[1:]
    cut = arguments.index("--") if "--" in arguments else len(arguments)
    args = parser.parse_args(arguments[:cut])
    frames = [Frame(path) for path in args.frames]
    things = [thing for frame in frames for thing in things_of(frame)]
    if not things:
        parser.error("no frame holds a thing that is seen whole")
    rng = np.random.default_rng(args.seed)
    rows, made = {kind: [] for kind in KINDS}, []
    with tempfile.TemporaryDirectory() as folder:
        keep = args.keep or pathlib.Path(folder)
        keep.mkdir(parents=True, exist_ok=True)
        for number in range(args.scenes):
            kind = KINDS[number % len(KINDS)]
            scene = compose(rng, frames, things, kind)
            made.append((kind, scene.truth(), keep / f"{kind}_{number}.pcd"))
            scene.write(made[-1][2])
        # Afterwards, so that nothing else goes on while the program is timed.
        for kind, truth, path in made:
            rows[kind].append(score(args.binary, truth, path, arguments[cut + 1 :]))
    rows["all"] = [row for kind in KINDS for row in rows[kind]]
    for kind, values in rows.items():
        if values:
            f, good, supports, ms = np.array(values).T
            print(f"{kind:8s} {len(f):3d} scenes  F {f.mean():.3f}  F > .75 {good.mean():.3f}  supports {supports.mean():.2f}  median {np.median(ms):.1f} ms")


if __name__ == "__main__":
    main()
