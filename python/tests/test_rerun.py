"""Results logged to Rerun: into a file, which is read again. Without rerun-sdk only what needs none is tested."""

from __future__ import annotations

import importlib
import importlib.util
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import swarmfit
import swarmfit.rerun

needs_sdk = pytest.mark.skipif(not importlib.util.find_spec("rerun"), reason="rerun-sdk is not installed: pip install swarmfit[rerun]")


def test_without_the_sdk_it_says_what_to_install(
    corner: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    result = swarmfit.fit(corner, "plane", threshold=0.01)
    with pytest.raises(ImportError, match=r"pip install swarmfit\[rerun\]"):
        swarmfit.rerun.log_fit(result, corner)


def test_a_hull_goes_around_its_points_on_their_plane() -> None:
    rng = np.random.default_rng(1)
    plane = swarmfit.Model("plane", [0.6, 0.0, 0.8, -0.5])
    across, along = np.array([0.8, 0.0, -0.6]), np.array([0.0, 1.0, 0.0])
    u, v = rng.uniform(-1, 1, (2, 5000))
    points = 0.5 * plane.normal + u[:, None] * across + v[:, None] * along + rng.normal(0, 0.01, (5000, 1)) * plane.normal
    corners = swarmfit.rerun.hull_on_plane(points, plane)
    assert len(corners) >= 4
    assert np.abs(corners @ plane.normal + plane.offset).max() < 1e-12
    # The shoelace formula in the plane's own axes, and the same way round throughout.
    x, y = corners @ across, corners @ along
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    assert abs(abs(cross.sum()) / 2 - 4) < 0.1
    assert (cross > -1e-9).all() or (cross < 1e-9).all()
    assert len(swarmfit.rerun.hull_on_plane(points[:0], plane)) == 0


def test_colours_of_neighbours_differ() -> None:
    assert len({swarmfit.rerun.colour(k) for k in range(1, 40)}) == 39


def recording_to(file: Path) -> Any:
    rr = importlib.import_module("rerun")
    recording = rr.RecordingStream("swarmfit_test")
    recording.save(file)
    return recording


def printed(file: Path) -> str:
    """The file's content, told by Rerun's own command."""
    command = [sys.executable, "-m", "rerun", "rrd", "print", "-vv", str(file)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout


@needs_sdk
def test_a_sequence_of_frames(tmp_path: Path) -> None:
    file = tmp_path / "walk.rrd"
    recording = recording_to(file)
    perceiver = swarmfit.Perceiver(track=True)
    seen = [perceiver.perceive_cloud(swarmfit.make_room_scene(width=320, height=240, frame=k, frames=300)) for k in range(3)]
    for k, result in enumerate(seen):
        swarmfit.rerun.log_perception(result, frame=k, seconds=k / 30, recording=recording)
    recording.flush()
    del recording
    text = printed(file)
    for entity in ("cloud", "cloud/models", "camera", "camera/planes", "camera/objects", "camera/boxes"):
        assert f"/swarmfit/{entity} " in text, entity
    for result in seen:
        for model in result.models:
            assert f"/swarmfit/planes/{model.id} " in text
        for soi in result.sois:
            assert f"/swarmfit/sois/{soi.id} " in text
    for what in ("Mesh3D:albedo_factor", "Ellipsoids3D:", "Pinhole:", "SegmentationImage:", "Boxes2D:", "Clear:", "frame", "time"):
        assert what in text, what


@needs_sdk
def test_a_fit_of_several_kinds(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    ball = rng.normal(size=(1500, 3))
    ball = np.array([0.0, 0.0, 1.0]) + 0.3 * ball / np.linalg.norm(ball, axis=1, keepdims=True)
    floor = np.concatenate([rng.uniform(-1, 1, (3000, 2)), np.full((3000, 1), 0.2)], axis=1)
    turn, height = rng.uniform(0, 2 * np.pi, 1500), rng.uniform(0.2, 0.8, 1500)
    post = np.stack([0.7 + 0.1 * np.cos(turn), 0.7 + 0.1 * np.sin(turn), height], axis=1)
    points = np.concatenate([floor, ball, post]) + rng.normal(0, 0.002, (6000, 3))
    result = swarmfit.fit(points, "plane,cylinder,sphere", threshold=0.01)
    assert {m.type for m in result.models} == {"plane", "cylinder", "sphere"}
    file = tmp_path / "fit.rrd"
    recording = recording_to(file)
    swarmfit.rerun.log_fit(result, points, path="a/b", recording=recording)
    recording.flush()
    del recording
    text = printed(file)
    assert "/a/b/planes/" in text
    assert "Ellipsoids3D:" in text
    assert "Cylinders3D:" in text
    with pytest.raises(swarmfit.BadInput, match="must be the 6000 of the fit"):
        swarmfit.rerun.log_fit(result, points[:10], recording=recording_to(tmp_path / "other.rrd"))
