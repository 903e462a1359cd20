"""What callers hold, seen as the arrays the compiled half takes. Nothing is copied where a view will do."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from . import _core

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Points(NamedTuple):
    """N x D float32 or float64 rows whose columns are adjacent."""

    rows: NDArray[Any]
    shape: tuple[int, ...]  # of the labels: (N,) or (H, W)
    copied: bool


def _array(points: Any) -> tuple[NDArray[Any], bool]:
    """An array of what may be an array, a cloud of Open3D's (either API) or of ours, a tensor, a list. And: was it copied?"""
    if isinstance(points, np.ndarray):
        return points, False
    if isinstance(points, _core.Cloud):
        return points.points, False
    if hasattr(points, "points"):  # open3d.geometry.PointCloud and its likes
        points = points.points
    elif hasattr(points, "point") and hasattr(points.point, "positions"):  # open3d.t.geometry.PointCloud
        points = points.point.positions
    if hasattr(points, "cpu"):
        points = points.cpu()
    if hasattr(points, "numpy"):
        points = points.numpy()
    array = np.asarray(points)
    shares = isinstance(points, np.ndarray) or hasattr(points, "__array_interface__") or hasattr(points, "__buffer__")
    if not shares:
        try:
            shares = np.shares_memory(array, np.asarray(memoryview(points)))
        except (TypeError, ValueError, BufferError):
            shares = False
    return array, not shares


def _columns(array: NDArray[Any], names: tuple[str, ...]) -> tuple[NDArray[Any], bool]:
    """Fields x, y, z of a structured array as a further axis: a view where they lie side by side."""
    fields: Any = array.dtype.fields or {}
    missing = [name for name in names if name not in fields]
    if missing:
        raise _core.BadInput(f"the structured array has fields {', '.join(fields)}, must have {', '.join(names)}")
    kinds = [fields[name][0] for name in names]
    offsets = [fields[name][1] for name in names]
    kind = kinds[0]
    beside = all(offset == offsets[0] + i * kind.itemsize for i, offset in enumerate(offsets))
    if kind in (np.float32, np.float64) and all(k == kind for k in kinds) and beside and array.ndim > 0:
        first = array[names[0]]
        shape, strides = first.shape + (len(names),), first.strides + (kind.itemsize,)
        return np.lib.stride_tricks.as_strided(first, shape, strides, writeable=False), False
    return np.stack([array[name] for name in names], axis=-1), True


def points_of(points: Any, dimension: int) -> Points:
    """N x D, H x W x D, or a structured array with fields x, y(, z), as rows in the input's order."""
    array, copied = _array(points)
    if array.dtype.names is not None:
        array, stacked = _columns(array, ("x1", "y1", "x2", "y2") if dimension == 4 else ("x", "y", "z")[:dimension])
        copied |= stacked
    if array.ndim not in (2, 3):
        raise _core.BadInput(f"points have shape {array.shape}, must be N x {dimension} or H x W x {dimension}")
    if array.dtype.kind not in "fiu":
        raise _core.BadInput(f"points are of dtype {array.dtype}, must be float32 or float64 [other numbers are converted]")
    wanted = np.dtype(array.dtype.newbyteorder("="))
    if wanted not in (np.float32, np.float64):
        wanted = np.dtype(np.float32) if wanted == np.float16 else np.dtype(np.float64)
    if array.dtype != wanted or not array.dtype.isnative:
        array, copied = array.astype(wanted), True
    shape = array.shape[:-1]
    steps = array.strides
    adjacent = array.shape[-1] <= 1 or steps[-1] == array.itemsize
    forward = all(step >= 0 for step in steps)
    even = array.ndim == 2 or array.shape[0] <= 1 or steps[0] == array.shape[1] * steps[1]
    if not (adjacent and forward and even):
        array, copied = np.ascontiguousarray(array), True
        steps = array.strides
    if array.ndim == 3:  # reshape would copy rows with gaps between them
        flat = (shape[0] * shape[1], array.shape[2])
        array = np.lib.stride_tricks.as_strided(array, flat, (steps[1], steps[2]), writeable=False)
    return Points(array, shape, copied)


def camera_of(intrinsics: Any) -> tuple[float, float, float, float]:
    """(fx, fy, cx, cy) [px], a 3 x 3 camera matrix, Open3D's PinholeCameraIntrinsic, or a ROS CameraInfo."""
    for attribute in ("intrinsic_matrix", "k", "K"):
        if hasattr(intrinsics, attribute):
            intrinsics = getattr(intrinsics, attribute)
            break
    values = np.asarray(intrinsics, dtype=np.float64)
    if values.size == 9:
        k = values.reshape(3, 3)
        return float(k[0, 0]), float(k[1, 1]), float(k[0, 2]), float(k[1, 2])
    if values.shape != (4,):
        raise _core.InvalidOption(f"intrinsics have shape {values.shape}, must be fx, fy, cx, cy [px] or a 3 x 3 matrix")
    return float(values[0]), float(values[1]), float(values[2]), float(values[3])


def colour_of(color: Any) -> NDArray[np.uint8]:
    """H x W x 3 uint8, red first."""
    image = np.asarray(color)
    if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] not in (3, 4):
        raise _core.BadInput(f"color is {image.dtype} of shape {image.shape}, must be uint8, H x W x 3, red first")
    image = image[:, :, :3]
    return image if image.strides[2] == 1 and image.strides[1] == 3 and image.strides[0] > 0 else np.ascontiguousarray(image)


def frame_of(color: Any, depth: Any, intrinsics: Any, depth_scale: float | None) -> _core.Cloud:
    """A depth image, with its colours, back-projected to an organised cloud."""
    z = np.asarray(depth)
    if z.ndim == 3 and z.shape[2] == 1:
        z = z[:, :, 0]
    if z.ndim != 2 or z.dtype.kind not in "fui":
        raise _core.BadInput(f"depth is {z.dtype} of shape {z.shape}, must be H x W of uint16 or of floats")
    scale = depth_scale if depth_scale is not None else (1.0 if z.dtype.kind == "f" else 0.001)
    if z.dtype != np.uint16:
        z = z.astype(np.float32, copy=False)
    if z.size and (z.strides[1] != z.itemsize or z.strides[0] < 0):
        z = np.ascontiguousarray(z)
    return _core.cloud_from_depth(z, camera_of(intrinsics), scale, None if color is None else colour_of(color))


def cloud_of(points: Any, color: Any, intrinsics: Any, dimension: int = 3) -> _core.Cloud:
    """A cloud of ours as it is, anything else copied into one."""
    if isinstance(points, _core.Cloud) and color is None and intrinsics is None:
        return points
    if color is None:
        if isinstance(points, _core.Cloud):
            color = points.rgb
        elif hasattr(points, "colors") and len(points.colors):  # Open3D: floats in [0, 1]
            color = np.rint(np.asarray(points.colors) * 255).astype(np.uint8)
    if intrinsics is None and isinstance(points, _core.Cloud):
        intrinsics = points.intrinsics
    rows, shape, _ = points_of(points, dimension)
    rgb = None
    if color is not None:
        rgb = np.asarray(color)
        if rgb.dtype != np.uint8 or rgb.size != 3 * len(rows) or rgb.shape[-1] != 3:
            expected = " x ".join(str(n) for n in (*shape, 3))
            raise _core.BadInput(f"color is {rgb.dtype} of shape {rgb.shape}, must be uint8, {expected}, red first")
        rgb = np.ascontiguousarray(rgb.reshape(-1, 3))
    height, width = shape if len(shape) == 2 else (1, len(rows))
    return _core.cloud_from_arrays(rows, width, height, rgb, None if intrinsics is None else camera_of(intrinsics))
