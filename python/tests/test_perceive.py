from __future__ import annotations

import json
import types
from typing import Any

import numpy as np
import pytest

import swarmfit


@pytest.fixture(scope="module")
def seen(room: swarmfit.Cloud) -> swarmfit.PerceiveResult:
    return swarmfit.perceive_cloud(room)


def test_planes_and_what_stands_on_them(seen: swarmfit.PerceiveResult, room: swarmfit.Cloud) -> None:
    assert sum(m.supporting for m in seen.models) >= 2
    assert len(seen.sois) >= 3
    assert seen.vertical_source == "dominant plane"
    assert abs(np.linalg.norm(seen.up) - 1) < 1e-6
    for image in (seen.labels, seen.popout, seen.objects):
        assert image is not None
        assert image.shape == (240, 320)
    soi = seen.sois[0]
    inside = np.linalg.norm(room.points[seen.popout == 1] - soi.centre, axis=1) <= soi.radius
    assert inside.all()
    assert 1 <= soi.plane <= len(seen.models)
    assert len(soi.bbox) == 4
    assert set(seen.timing_ms) >= {"total", "fit", "popout", "segment"}


def test_a_frame_is_the_cloud_it_makes(seen: swarmfit.PerceiveResult, room: swarmfit.Cloud) -> None:
    depth = np.array(room.points[:, :, 2])
    frame = swarmfit.perceive(room.rgb, depth, room.intrinsics)
    assert np.allclose(frame.cloud.points, room.points, atol=1e-4, equal_nan=True)
    assert len(frame.models) == len(seen.models)
    millimetres = np.nan_to_num(depth * 1000).round().astype(np.uint16)
    whole = swarmfit.perceive(room.rgb, millimetres, room.intrinsics, depth_scale=0.001)
    assert np.nanmax(np.abs(whole.cloud.points[:, :, 2] - depth)) < 0.00051
    assert np.isnan(whole.cloud.points[:, :, 2]).sum() == np.isnan(depth).sum()
    alone = swarmfit.perceive(None, depth, room.intrinsics, camera_tilt=np.pi / 6)
    assert alone.vertical_source == "camera tilt"
    assert alone.cloud.rgb is None


def test_arrays_and_open3d_clouds(seen: swarmfit.PerceiveResult, room: swarmfit.Cloud) -> None:
    assert room.rgb is not None
    grid = swarmfit.perceive_cloud(np.array(room.points), np.array(room.rgb), intrinsics=room.intrinsics)
    assert (grid.labels == seen.labels).all()
    assert np.array_equal(grid.objects, seen.objects)  # type: ignore[arg-type]
    assert grid.stats.copied
    assert not seen.stats.copied
    finite = np.isfinite(room.points).all(axis=2)
    cloud = types.SimpleNamespace(points=room.points[finite].astype(np.float64), colors=room.rgb[finite] / 255.0)
    flat = swarmfit.perceive_cloud(cloud)
    assert flat.objects is None
    assert flat.labels.shape == (finite.sum(),)
    assert len(flat.models) >= 2


def test_results_to_look_at_and_to_keep(seen: swarmfit.PerceiveResult, tmp_path: Any) -> None:
    overlay = seen.overlay()
    assert overlay.shape == (240, 320, 3)
    assert overlay.dtype == np.uint8
    assert json.loads(seen.to_json())["schema"] == 1
    seen.write(tmp_path / "out")
    assert (tmp_path / "out" / "overlay.png").stat().st_size > 1000
    (tmp_path / "file").write_text("")
    with pytest.raises(swarmfit.CannotWrite, match="file"):
        seen.write(tmp_path / "file")


def test_a_perceiver_keeps_the_vertical(room: swarmfit.Cloud) -> None:
    perceiver = swarmfit.Perceiver(gravity=[0, 0.866, 0.5])
    planes: list[swarmfit.Model] = []
    first = perceiver.perceive_cloud(room, on_plane=planes.append)
    again = perceiver.perceive_cloud(room)
    assert first.vertical_source == "gravity"
    assert planes
    assert (first.labels == again.labels).all()


def test_errors(room: swarmfit.Cloud) -> None:
    depth = np.ones((240, 320), np.float32)
    with pytest.raises(swarmfit.InvalidOption, match="fx: 0, must be > 0"):
        swarmfit.perceive(None, depth, (0, 1, 1, 1))
    with pytest.raises(swarmfit.BadInput, match="colour image is 2 x 2 pixels, must be 320 x 240"):
        swarmfit.perceive(np.zeros((2, 2, 3), np.uint8), depth, (1, 1, 1, 1))
    with pytest.raises(swarmfit.BadInput, match="must be uint8"):
        swarmfit.perceive(np.zeros((240, 320, 3)), depth, (1, 1, 1, 1))
    with pytest.raises(swarmfit.BadInput, match="must be H x W"):
        swarmfit.perceive(None, np.zeros(3), (1, 1, 1, 1))
    with pytest.raises(swarmfit.InvalidOption, match="horizontal"):
        swarmfit.perceive_cloud(room, horizontal_angle=7)
    with pytest.raises(swarmfit.InvalidOption, match="segmentation is 'grabcut', must be 'graphcut' or 'fixation'"):
        swarmfit.Perceiver(segmentation="grabcut")
    with pytest.raises(TypeError, match="unknown option 'model'"):
        swarmfit.Perceiver(model="plane")  # type: ignore[call-arg]


def test_tracked_planes_and_things_keep_their_ids() -> None:
    perceiver = swarmfit.Perceiver(track=True)
    seen = [perceiver.perceive_cloud(swarmfit.make_room_scene(width=320, height=240, frame=k, frames=300)) for k in range(3)]
    for kind in ("models", "sois"):
        ids = [{thing.id for thing in getattr(result, kind)} for result in seen]
        assert all(0 not in each for each in ids)
        assert len(ids[0] & ids[1] & ids[2]) >= 3, (kind, ids)
    alone = swarmfit.perceive_cloud(swarmfit.make_room_scene(width=320, height=240))
    assert not any(model.id for model in alone.models) and not any(soi.id for soi in alone.sois)
    with pytest.raises(TypeError, match="track is 1, must be True or False"):
        swarmfit.Perceiver(track=1)  # type: ignore[arg-type]


def test_places_of_the_walk_through_the_room() -> None:
    first, second = (swarmfit.make_room_scene(width=64, height=48, frame=k, frames=300) for k in range(2))
    assert np.array_equal(first.points, swarmfit.make_room_scene(width=64, height=48).points, equal_nan=True)
    assert not np.array_equal(first.points, second.points, equal_nan=True)
    with pytest.raises(swarmfit.InvalidOption, match="frame is 3, must be less than frames, 3"):
        swarmfit.make_room_scene(frame=3, frames=3)
