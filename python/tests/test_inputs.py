"""What callers hold: views where a view will do, the same answer from all of them."""

from __future__ import annotations

import types
from typing import Any

import numpy as np
import pytest

import swarmfit
from swarmfit._inputs import camera_of, points_of


def taken_as_it_lies(points: Any, base: np.ndarray) -> bool:
    taken = points_of(points, 3)
    return np.shares_memory(taken.rows, base) and not taken.copied


def test_views_are_not_copied(corner: np.ndarray) -> None:
    doubles = corner.astype(np.float64)
    wide = np.zeros((len(corner), 5), np.float32)
    wide[:, :3] = corner
    for points, base in (
        (corner, corner),
        (doubles, doubles),
        (wide[:, :3], wide),  # rows further apart than they are long
        (corner[::2], corner),
        (corner.reshape(100, 100, 3), corner),
        (corner.reshape(100, 100, 3)[:, :, :], corner),
        (doubles.data, doubles),
    ):
        assert taken_as_it_lies(points, base)


def test_the_rest_is_converted_and_says_so(corner: np.ndarray) -> None:
    for points in (
        np.asfortranarray(corner),
        corner[::-1],
        corner.reshape(100, 100, 3)[:, :50],
        (corner * 1000).astype(np.int32),
        corner.astype(np.float16),
        corner.astype(">f4"),
        corner.tolist(),
    ):
        taken = points_of(points, 3)
        assert taken.copied
        assert np.array_equal(taken.rows, np.asarray(points).reshape(-1, 3))
    assert swarmfit.fit(np.asfortranarray(corner), threshold=0.01).stats.copied


def test_one_answer_from_all(corner: np.ndarray) -> None:
    rows = swarmfit.fit(corner, threshold=0.01)
    grid = swarmfit.fit(corner.reshape(100, 100, 3), threshold=0.01)
    assert grid.labels.shape == (100, 100)
    assert (grid.labels.ravel() == rows.labels).all()

    pcl = np.zeros(len(corner), dtype=[("x", "f4"), ("y", "f4"), ("z", "f4"), ("rgb", "u4"), ("ring", "u2")])
    for i, name in enumerate("xyz"):
        pcl[name] = corner[:, i]
    assert pcl.dtype.itemsize == 18
    assert taken_as_it_lies(pcl, pcl)
    assert (swarmfit.fit(pcl, threshold=0.01).labels == rows.labels).all()

    apart = np.zeros(len(corner), dtype=[("z", "f4"), ("pad", "f4"), ("x", "f4"), ("y", "f4")])
    for i, name in enumerate("xyz"):
        apart[name] = corner[:, i]
    result = swarmfit.fit(apart, threshold=0.01)
    assert result.stats.copied
    assert (result.labels == rows.labels).all()


def test_nan_keeps_its_place(corner: np.ndarray) -> None:
    holes = corner.reshape(100, 100, 3).copy()
    holes[::7, ::3] = np.nan
    result = swarmfit.fit(holes, threshold=0.01)
    assert len(result.models) == 3
    assert (result.labels[::7, ::3] == 0).all()
    assert result.stats.finite_points == np.isfinite(holes[:, :, 0]).sum()


def test_open3d_shaped_clouds(corner: np.ndarray) -> None:
    doubles = corner.astype(np.float64)
    legacy = types.SimpleNamespace(points=doubles.data, colors=[])
    assert taken_as_it_lies(legacy, doubles)
    tensor = types.SimpleNamespace(numpy=lambda: corner)
    modern = types.SimpleNamespace(point=types.SimpleNamespace(positions=tensor))
    assert taken_as_it_lies(modern, corner)
    assert len(swarmfit.fit(legacy, threshold=0.01).models) == 3


def test_open3d_itself(corner: np.ndarray) -> None:
    o3d = pytest.importorskip("open3d")
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(corner.astype(np.float64)))
    result = swarmfit.fit(cloud, threshold=0.01)
    assert len(result.models) == 3
    assert not result.stats.copied


def test_shapes_that_cannot_be() -> None:
    with pytest.raises(swarmfit.BadInput, match=r"shape \(3,\), must be N x 3 or H x W x 3"):
        swarmfit.fit([1.0, 2.0, 3.0])
    with pytest.raises(swarmfit.BadInput, match="dtype bool"):
        swarmfit.fit(np.zeros((10, 3), bool))
    with pytest.raises(swarmfit.BadInput, match="fields x, y, must have x, y, z"):
        swarmfit.fit(np.zeros(10, dtype=[("x", "f4"), ("y", "f4")]))


def test_cameras() -> None:
    wanted = (500.0, 510.0, 320.0, 240.0)
    matrix = [[500, 0, 320], [0, 510, 240], [0, 0, 1]]
    assert camera_of(wanted) == camera_of(matrix) == camera_of(np.array(matrix)) == wanted
    assert camera_of(types.SimpleNamespace(intrinsic_matrix=np.array(matrix))) == wanted
    assert camera_of(types.SimpleNamespace(k=np.ravel(matrix))) == wanted
    with pytest.raises(swarmfit.InvalidOption, match="must be fx, fy, cx, cy"):
        camera_of([1, 2, 3])


def test_clouds_are_views(room: swarmfit.Cloud) -> None:
    assert room.points.shape == (240, 320, 3)
    assert room.rgb is not None
    assert room.rgb.shape == (240, 320, 3)
    assert taken_as_it_lies(room, room.points)
    assert not room.points.flags.writeable
    assert len(room) == 240 * 320
    assert room.organised
    result = swarmfit.fit(room)
    assert result.labels.shape == (240, 320)
    assert len(result.models) >= 3


def test_reads_files(tmp_path: Any, corner: np.ndarray) -> None:
    file = tmp_path / "corner.xyz"
    np.savetxt(file, corner)
    cloud = swarmfit.read_cloud(file)
    assert cloud.points.shape == corner.shape
    assert cloud.rgb is None
    assert np.allclose(cloud.points, corner)
