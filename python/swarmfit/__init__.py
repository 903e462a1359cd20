"""Finds all planes, lines, circles, spheres, cylinders, homographies or fundamental matrices in data full of outliers.

    import swarmfit

    cloud = swarmfit.read_cloud("room.pcd")            # or your own N x 3 array
    result = swarmfit.fit(cloud, "plane", threshold=0.02)
    for plane in result.models:
        print(plane.normal, plane.offset, plane.inliers)
    floor = cloud.points[result.labels == 1]

Points are N x D, or H x W x D where they lie on an image grid: D is 3 for planes, spheres and cylinders, 2 for line2d and circle2d,
4 (x1, y1, x2, y2) for homographies and fundamental matrices. float32 and float64 are read where they lie, any row stride; structured
arrays with fields x, y, z as PCD readers and ROS give them are, too; other numbers are converted to float64, and `stats.copied` says so.
Points with a NaN or an infinity keep their place and get label 0. Open3D's point clouds are taken as they come.

The work is done without Python's lock; do not write to an array while it is looked at. Ctrl-C stops it. What cannot be done is an
`Error`: InvalidOption and BadInput are ValueErrors; BackendUnavailable, OutOfMemory and CannotWrite are RuntimeErrors.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, SupportsFloat, TypeVar

import numpy as np

from . import _core
from ._core import (
    UNCERTAIN,
    BackendUnavailable,
    BadInput,
    BenchReport,
    BenchRow,
    CannotWrite,
    Cloud,
    Device,
    Error,
    InvalidOption,
    Model,
    OutOfMemory,
    SpaceOfInterest,
    __version__,
    model_types,
)
from ._inputs import Points, camera_of, cloud_of, frame_of, points_of
from ._results import FitResult, PerceiveResult, Stats, Told, fit_result, perceive_result

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterator, Sequence
    from types import TracebackType

    from ._options import FitterOptions, PerceiverOptions, Unpack

__all__ = [
    "UNCERTAIN",
    "BackendUnavailable",
    "BadInput",
    "BenchReport",
    "BenchRow",
    "CannotWrite",
    "Cloud",
    "Device",
    "Error",
    "FitResult",
    "Fitter",
    "InvalidOption",
    "Model",
    "ModelStream",
    "OutOfMemory",
    "PerceiveResult",
    "Perceiver",
    "SpaceOfInterest",
    "Stats",
    "__version__",
    "bench",
    "devices",
    "find_models",
    "fit",
    "make_room_scene",
    "model_types",
    "perceive",
    "perceive_cloud",
    "read_cloud",
    "read_depth",
    "read_rgbd",
    "read_stereo",
]

_T = TypeVar("_T")

_FIT_OPTIONS = """
    Options, None for the default:
        model: plane, line2d, circle2d, sphere, cylinder, homography, fundamental; several, parted by commas, compete for the same points.
        threshold: inliers are within this distance, in the data's unit; "auto" takes it from the data's own noise.
            Default 0.01 for planes, spheres and cylinders, 6 px for homographies, 2.5 px for fundamental matrices, else "auto".
        noise: "none"; "depth" lets the threshold grow with the square of the depth |z|, as the noise of depth cameras and stereo
            does; it is that of the near end, up to the |z| that three points in ten do not reach, and estimated where none is given.
            For points of 3 columns in the camera's frame, and not for perceive().
        backend: "auto", "cpu", "vulkan", "reference", or part of a device's name; see devices().
        threads: of the CPU back end; 0 takes all.
        seed: the same seed gives the same answer, on any number of threads.
        preset: "fast", what measures best; "paper", Zhou et al. 2010. Decides what is left to the default below.
        particles, iterations, stall: size of the swarm, by default the fittest of many samples; most steps of one; converged after so many
            steps without a better one.
        deflation: "residual" or "parametric". lambda_: strength of the latter.
        loss: "truncated_l1" or "truncated_l2".
        min_inliers: a model has at least so many points. max_models: stop after so many.
        time_budget_ms: stop after this time; what is found by then is valid.
        direction: (axis, angle [rad]): only planes and lines whose normal, or cylinders whose axis, is within the angle of the axis.
        pipeline_cache: a folder for compiled Vulkan pipelines.
"""

_PERCEIVE_OPTIONS = """
    Options, None for the default; those of fit() beside model as well:
        gravity: direction of gravity in the cloud's frame (x right, y down, z forward), 3 numbers.
        camera_tilt: the camera looks down by this much [rad]. With neither, the dominant plane of the first view is the ground.
        horizontal_angle: a supporting plane's normal is within this of the vertical [rad].
        min_plane_share: of the finite points a plane of reasonable size holds, in (0, 1).
        min_height, max_height: a point sticks out of its plane by at least and at most this much [m].
        flood_step: neighbours in one group are at most this far apart [m].
        min_soi_points: smaller groups are debris (for 640 x 480; scaled by the image's size).
        soi_margin: the sphere is larger than the group by this factor.
        segmentation: how things are outlined, by "graphcut" or by "fixation", a contour around each thing's centre.
        colour_neighbours, uncertain_cost, smoothness: of the outlines' graph cut.
        gallery: a folder of names for what is found: one image, or one folder of images, a name.
        track: frames follow each other (a Perceiver's): the last one's planes seed the search, planes and things keep their `id`.
"""


def _documented(options: str) -> Callable[[_T], _T]:
    def add(documented: _T) -> _T:
        documented.__doc__ = (documented.__doc__ or "").rstrip() + "\n" + options
        return documented

    return add


class ModelStream:
    """Iterates over models as they are found; the search for the next goes on meanwhile. Leaving it, or a with block, ends the search."""

    def __init__(self, stream: _core.ModelStream, points: Points, told: Told) -> None:
        self._stream = stream
        self._points = points
        self._told = told

    def __iter__(self) -> Iterator[Model]:
        return self

    def __next__(self) -> Model:
        return self._stream.__next__()

    def stop(self) -> None:
        """The search ends soon; result() holds what there is by then."""
        self._stream.stop()

    def result(self) -> FitResult:
        """Waits for the end: all models refined together, the labels, the figures."""
        return fit_result(self._stream.result(), self._points.shape, self._points.copied, self._told)

    def __enter__(self) -> ModelStream:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.stop()


@_documented(_FIT_OPTIONS)
class Fitter:
    """Holds a back end; reuse it over frames, one a thread.

        fitter = swarmfit.Fitter(model="plane", threshold=0.02)
        models = []
        for frame in frames:                     # H x W x 3 or N x 3
            result = fitter.fit(frame, warm_start=models)
            models = result.models
    """

    def __init__(self, model: str = "plane", threshold: SupportsFloat | str | None = None, **options: Unpack[FitterOptions]) -> None:
        self._model = model
        self._dimension = _core.dimension(model)
        self._options = {"threshold": threshold, **options}
        self._fitter = _core.Fitter(model=model, threshold=threshold, **options)

    @property
    def backend(self) -> tuple[str, str, str]:
        """Name, device, and why it was chosen."""
        return self._fitter.backend

    def fit(
        self,
        points: Any,
        *,
        on_model: Callable[[Model], object] | None = None,
        warm_start: Sequence[Model] = (),
        record_search: bool = False,
    ) -> FitResult:
        """Fits all models; `warm_start`: those of an earlier fit, to seed the swarm. See swarmfit.fit."""
        taken = points_of(points, self._dimension)
        told = self._tell(record_search)
        result = self._fitter.fit(taken.rows, on_model, list(warm_start), told.search)
        return fit_result(result, taken.shape, taken.copied, told)

    def find_models(self, points: Any, *, warm_start: Sequence[Model] = ()) -> ModelStream:
        """Iterates over models as they are found; the Fitter is at work until that ends. See swarmfit.find_models."""
        taken = points_of(points, self._dimension)
        return ModelStream(self._fitter.find_models(taken.rows, list(warm_start)), taken, self._tell(False))

    def _tell(self, record_search: bool) -> Told:
        return Told("fit", f"points, {self._model!r}", self._options, record_search, self._dimension)

    def __repr__(self) -> str:
        return f"Fitter({self._model!r} on {self.backend[0]})"


@_documented(_FIT_OPTIONS)
def fit(
    points: Any,
    model: str = "plane",
    threshold: SupportsFloat | str | None = None,
    *,
    on_model: Callable[[Model], object] | None = None,
    warm_start: Sequence[Model] = (),
    record_search: bool = False,
    **options: Unpack[FitterOptions],
) -> FitResult:
    """Finds all models of one kind.

    Args:
        points: N x D or H x W x D, a structured array with fields x, y, z, a Cloud, an Open3D point cloud; see swarmfit's own docstring.
        on_model: told of each model the moment it is found; returns False to stop with what there is.
        warm_start: models of an earlier fit, to seed the swarm.
        record_search: keeps what the swarms did, for report() to replay; the result is the same, and takes a little longer.

    Returns:
        Models, labels and stats. Labels are N or H x W of uint16, in the input's order, with 0 for none and k for models[k - 1].
    """
    return Fitter(model, threshold, **options).fit(points, on_model=on_model, warm_start=warm_start, record_search=record_search)


@_documented(_FIT_OPTIONS)
def find_models(
    points: Any,
    model: str = "plane",
    threshold: SupportsFloat | str | None = None,
    *,
    warm_start: Sequence[Model] = (),
    **options: Unpack[FitterOptions],
) -> ModelStream:
    """Iterates over models of one kind as they are found.

        for plane in swarmfit.find_models(cloud, threshold=0.02):
            if is_table(plane):
                break

    Points as in fit(). The models are those of the search; result() waits for its end and has them refined together, with labels.
    """
    return Fitter(model, threshold, **options).find_models(points, warm_start=warm_start)


@_documented(_PERCEIVE_OPTIONS)
class Perceiver:
    """Holds the back end, the gallery and the vertical of the first view; reuse it over frames, one a thread."""

    def __init__(self, **options: Unpack[PerceiverOptions]) -> None:
        self._options = dict(options)
        self._perceiver = _core.Perceiver(**options)

    def perceive(
        self,
        color: Any,
        depth: Any,
        intrinsics: Any,
        *,
        depth_scale: float | None = None,
        on_plane: Callable[[Model], object] | None = None,
        record_search: bool = False,
    ) -> PerceiveResult:
        """One coloured depth frame. See swarmfit.perceive."""
        told = Told("perceive", "color, depth, intrinsics", self._options, record_search)
        return self._look(frame_of(color, depth, intrinsics, depth_scale), True, on_plane, told)

    def perceive_cloud(
        self,
        points: Any,
        color: Any = None,
        *,
        intrinsics: Any = None,
        on_plane: Callable[[Model], object] | None = None,
        record_search: bool = False,
    ) -> PerceiveResult:
        """One cloud. See swarmfit.perceive_cloud."""
        cloud = cloud_of(points, color, intrinsics)
        told = Told("perceive_cloud", "points", self._options, record_search)
        return self._look(cloud, cloud is not points, on_plane, told)

    def _look(self, cloud: Cloud, copied: bool, on_plane: Callable[[Model], object] | None, told: Told) -> PerceiveResult:
        return perceive_result(self._perceiver.perceive(cloud, on_plane, told.search), cloud, copied, told)


@_documented(_PERCEIVE_OPTIONS)
def perceive(
    color: Any,
    depth: Any,
    intrinsics: Any,
    *,
    depth_scale: float | None = None,
    on_plane: Callable[[Model], object] | None = None,
    record_search: bool = False,
    **options: Unpack[PerceiverOptions],
) -> PerceiveResult:
    """A coloured depth frame to supporting planes, what stands on them, its outline, its name.

    Args:
        color: H x W x 3 of uint8, red first, registered to the depth; None for depth alone.
        depth: H x W of uint16 or of floats; 0 and NaN are holes.
        intrinsics: fx, fy, cx, cy [px]; or a 3 x 3 camera matrix; or Open3D's PinholeCameraIntrinsic; or a ROS CameraInfo.
        depth_scale: metres a unit of depth; default 0.001 for whole numbers, 1 for floats.
        on_plane: told of each plane the moment it is found; returns False to stop with what there is.
        record_search: keeps what the swarms did, for report() to replay; the result is the same, and takes a little longer.
    """
    return Perceiver(**options).perceive(
        color, depth, intrinsics, depth_scale=depth_scale, on_plane=on_plane, record_search=record_search
    )


@_documented(_PERCEIVE_OPTIONS)
def perceive_cloud(
    points: Any,
    color: Any = None,
    *,
    intrinsics: Any = None,
    on_plane: Callable[[Model], object] | None = None,
    record_search: bool = False,
    **options: Unpack[PerceiverOptions],
) -> PerceiveResult:
    """A cloud to supporting planes and what stands on them; with an image grid and colours to outlines and names, too.

    Args:
        points: H x W x 3 [m] on an image grid, N x 3 without one, a Cloud, an Open3D point cloud. Copied, unless it is a Cloud.
        color: of the same shape, uint8, red first; default: the cloud's own.
        intrinsics: of the camera behind the grid, where known; as in perceive().
    """
    return Perceiver(**options).perceive_cloud(
        points, color, intrinsics=intrinsics, on_plane=on_plane, record_search=record_search
    )


def devices() -> list[Device]:
    """Every way to evaluate on this machine, and why one cannot be used. `name` is accepted as `backend`."""
    return _core.devices()


def bench(
    *,
    backends: Sequence[str] = (),
    models: Sequence[str] = (),
    points: Sequence[int] = (10000, 100000, 307200),
    particles: Sequence[int] = (64, 256),
    pruning: Sequence[bool] = (False,),
    threads: int = 0,
    seconds: float = 0.3,
    seed: int = 1,
    cloud: Any = None,
    progress: Callable[[str], object] | None = None,
) -> BenchReport:
    """Fitness throughput of each back end, against the limit that the same run measures.

    Args:
        backends, models: names; empty: every usable back end, every kind.
        points, particles: sizes, each combination a row. cloud: take the points from here instead, N x D.
        pruning: with False by brute force, with True in effective evaluations.
        seconds: least time a row is run for. progress: told of each row before it starts.
    """
    rows = None
    if cloud is not None:
        dimension = np.shape(cloud.points if hasattr(cloud, "points") else cloud)[-1:]
        rows = points_of(cloud, dimension[0] if dimension else 3).rows
    return _core.bench(
        list(backends), list(models), list(points), list(particles), list(pruning), threads, seconds, seed, rows, progress
    )


def read_cloud(file: str | os.PathLike[str]) -> Cloud:
    """.pcd, .ply, .xyz, or .csv (x,y / x,y,z / x1,y1,x2,y2), by the file's extension."""
    return _core.read_cloud(file)


def read_depth(depth: str | os.PathLike[str], intrinsics: Any, depth_scale: float = 0.001) -> Cloud:
    """A 16-bit depth PNG to an organised cloud; `depth_scale`: metres a unit; 0 is a hole."""
    return _core.read_depth(depth, camera_of(intrinsics), depth_scale)


def read_rgbd(
    color: str | os.PathLike[str], depth: str | os.PathLike[str], intrinsics: Any, depth_scale: float = 0.001
) -> Cloud:
    """A colour image registered to a depth image of the same size."""
    return _core.read_rgbd(color, depth, camera_of(intrinsics), depth_scale)


def read_stereo(
    left: str | os.PathLike[str], right: str | os.PathLike[str], calib: str | os.PathLike[str]
) -> Cloud:
    """A rectified pair and Middlebury's calib.txt, by dense stereo, on the left image's grid [m]."""
    return _core.read_stereo(left, right, calib)


def make_room_scene(seed: int = 1, width: int = 640, height: int = 480, *, frame: int = 0, frames: int = 1) -> Cloud:
    """The built-in scene: a loaded shelf and table on a floor before a wall, as a depth camera sees them.

    Args:
        frame, frames: the view from place `frame` of `frames` on a walk before the table, at walking pace for 300.
    """
    return _core.make_room_scene(seed, width, height, frame, frames)
