from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

import swarmfit


def plane_points(rng: np.random.Generator, normal: Sequence[float], offset: float, count: int, noise: float = 0.002) -> np.ndarray:
    """Points of a square of 1 m on normal . x + offset = 0."""
    n = np.asarray(normal) / np.linalg.norm(normal)
    u = np.cross(n, [1, 0, 0] if abs(n[0]) < 0.9 else [0, 1, 0])
    u /= np.linalg.norm(u)
    v = np.cross(n, u)
    a, b = rng.uniform(-0.5, 0.5, (2, count))
    points: np.ndarray[Any, Any] = -offset * n + a[:, None] * u + b[:, None] * v + rng.normal(0, noise, (count, 1)) * n
    return points


@pytest.fixture(scope="session")
def corner() -> np.ndarray:
    """Three planes at right angles and noise: 10000 x 3 of float32 in no order."""
    rng = np.random.default_rng(7)
    parts = [plane_points(rng, n, d, 3000) for n, d in (([0, 0, 1], 0.5), ([1, 0, 0], -0.4), ([0, 1, 0.2], 0.3))]
    points = np.concatenate([*parts, rng.uniform(-1, 1, (1000, 3))]).astype(np.float32)
    return points[rng.permutation(len(points))]


@pytest.fixture(scope="session")
def room() -> swarmfit.Cloud:
    return swarmfit.make_room_scene(width=320, height=240)
