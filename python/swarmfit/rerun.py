"""Results to Rerun (https://rerun.io): the cloud, planes, spaces of interest, outlines, over the frames of a sequence.

    import rerun
    import swarmfit
    import swarmfit.rerun

    rerun.init("swarmfit", spawn=True)       # or rerun.save("walk.rrd")
    perceiver = swarmfit.Perceiver(track=True)
    for number, frame in enumerate(frames):
        swarmfit.rerun.log_perception(perceiver.perceive_cloud(frame), frame=number)

Rerun is no part of this package: `pip install swarmfit[rerun]`. Nothing is opened or saved here; what is logged goes to the
`recording` given (a rerun.RecordingStream), or else to the one that is active. Positions are the cloud's own: x right, y down, z forward
in a camera's frame [m].

What is logged, under `path`:

    cloud                   Points3D: in the cloud's colours, or by model where it has none
    cloud/models            Points3D of those on a model, by its colour
    planes/ID               Mesh3D, translucent: the convex hull of a plane's points on the plane, with its numbers
    models/ID               Ellipsoids3D of spheres, Cylinders3D of cylinders
    sois/ID                 Ellipsoids3D: the sphere of interest, with its names
    camera                  Pinhole and Image, where the camera is known and the cloud is coloured and on an image grid
    camera/planes, objects  SegmentationImage: k on the k-th plane, the k-th thing; `camera/boxes`: rectangles with names

ID is what stays with a plane or thing over frames (a Perceiver with `track=True`), else its number in the result. What an
earlier frame showed and this one does not is cleared.
"""

from __future__ import annotations

import colorsys
import importlib
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _core
from ._inputs import points_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ._results import FitResult, PerceiveResult

__all__ = ["log_fit", "log_perception"]

_FILL_ALPHA = 90  # of 255
_DIRECTIONS = 64
_UNCERTAIN_CLASS = 65535


def _sdk() -> Any:
    try:
        return importlib.import_module("rerun")
    except ModuleNotFoundError as error:
        raise ImportError("swarmfit.rerun needs the package rerun-sdk: pip install swarmfit[rerun]") from error


def colour(k: int) -> tuple[int, int, int]:
    """Of the k-th model or thing, k >= 1: hues that follow each other are far apart on their circle."""
    r, g, b = colorsys.hsv_to_rgb(k * 0.618034 % 1.0, 0.65, 0.95)
    return round(r * 255), round(g * 255), round(b * 255)


def hull_on_plane(points: NDArray[Any], plane: _core.Model) -> NDArray[np.float64]:
    """K x 3: corners around the N x 3 points of a plane, on it: the farthest points in 64 directions; K < 3 where they have no area."""
    normal = plane.normal
    across = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    across /= np.linalg.norm(across)
    axes = np.stack([across, np.cross(normal, across)])
    flat = points.astype(np.float64) @ axes.T
    if not len(flat):
        return np.empty((0, 3))
    turns = np.linspace(0, 2 * np.pi, _DIRECTIONS, endpoint=False)
    farthest = [int(np.argmax(flat @ (np.cos(turn), np.sin(turn)))) for turn in turns]
    around = list(dict.fromkeys(farthest))  # each once, in the order of the directions
    corners: NDArray[np.float64] = flat[around] @ axes - plane.offset * normal
    return corners


class _Log:
    """One frame's worth of logging under one path."""

    def __init__(self, path: str, recording: Any, frame: int | None, seconds: float | None) -> None:
        self.rr = _sdk()
        self._path = path.rstrip("/")
        self._recording = recording
        if frame is not None:
            self.rr.set_time("frame", sequence=frame, recording=recording)
        if seconds is not None:
            self.rr.set_time("time", duration=seconds, recording=recording)

    def __call__(self, name: str, *what: Any) -> None:
        self.rr.log(f"{self._path}/{name}", *what, recording=self._recording)

    def clear(self, *names: str) -> None:
        for name in names:
            self(name, self.rr.Clear(recursive=True))


def _identity(thing: _core.Model | _core.SpaceOfInterest, k: int) -> int:
    return thing.id or k


def _log_cloud(log: _Log, points: NDArray[Any], labels: NDArray[Any], rgb: NDArray[np.uint8] | None, models: list[_core.Model]) -> None:
    """Points are N x 3, labels N, colours N x 3. Points that are not finite are left out."""
    rr = log.rr
    shown = np.isfinite(points).all(axis=1)
    palette = np.array([(120, 120, 120)] + [colour(_identity(model, k)) for k, model in enumerate(models, 1)], dtype=np.uint8)
    colours = palette[labels] if rgb is None else rgb
    log("cloud", rr.Points3D(points[shown], colors=colours[shown]))
    on_model = shown & (labels > 0)
    log("cloud/models", rr.Points3D(points[on_model], colors=palette[labels[on_model]]))


def _log_models(log: _Log, points: NDArray[Any], labels: NDArray[Any], models: list[_core.Model]) -> None:
    rr = log.rr
    log.clear("planes", "models")
    for k, model in enumerate(models, 1):
        own = points[labels == k]
        name = f"{model.type} {_identity(model, k)}: {model.inliers} points, rms {model.rms:.4f}"
        if model.type == "plane":
            corners = hull_on_plane(own, model)
            if len(corners) < 3:
                continue
            fan = [(0, i, i + 1) for i in range(1, len(corners) - 1)]
            mesh = rr.Mesh3D(
                vertex_positions=corners,
                triangle_indices=fan,
                vertex_normals=np.broadcast_to(model.normal, corners.shape),
                albedo_factor=(*colour(_identity(model, k)), _FILL_ALPHA),
            )
            log(f"planes/{_identity(model, k)}", mesh, rr.AnyValues(name=name, normal=model.normal, offset=model.offset))
        elif model.type == "sphere":
            ball = rr.Ellipsoids3D(centers=[model.centre], radii=[model.radius], colors=[colour(_identity(model, k))], labels=[name])
            log(f"models/{_identity(model, k)}", ball)
        elif model.type == "cylinder" and len(own):
            log(f"models/{_identity(model, k)}", _cylinder(rr, own, model, colour(_identity(model, k)), name))


def _cylinder(rr: Any, own: NDArray[Any], model: _core.Model, tint: tuple[int, int, int], name: str) -> Any:
    """As long as its points reach along the axis."""
    along = (own - model.point) @ model.axis
    low, high = float(along.min()), float(along.max())
    turn = np.cross((0.0, 0.0, 1.0), model.axis)  # Rerun's cylinders stand along z
    sine = float(np.linalg.norm(turn))
    angle = float(np.arctan2(sine, model.axis[2]))
    return rr.Cylinders3D(
        lengths=[high - low],
        radii=[model.radius],
        centers=[model.point + model.axis * (low + high) / 2],
        rotation_axis_angles=[rr.RotationAxisAngle(turn / sine if sine > 0 else (1.0, 0.0, 0.0), rr.Angle(rad=angle))],
        colors=[tint],
        labels=[name],
    )


def log_fit(
    result: FitResult,
    points: Any,
    *,
    color: Any = None,
    path: str = "swarmfit",
    frame: int | None = None,
    seconds: float | None = None,
    recording: Any = None,
) -> None:
    """A fit of planes, spheres or cylinders and its cloud; see swarmfit.rerun's own docstring.

    Args:
        points: those of the fit: N x 3, H x W x 3, or whatever fit() takes.
        color: of the points' shape, uint8, red first; default: by model.
        path: of the entities.
        frame, seconds: where on the timelines "frame" and "time" this is; default: where Rerun is.
        recording: a rerun.RecordingStream; default: the active one.

    Raises:
        ImportError: rerun-sdk is not installed.
        BadInput: points that are not those of the fit, or not of three columns.
    """
    log = _Log(path, recording, frame, seconds)
    if color is None and isinstance(points, _core.Cloud):
        color = points.rgb
    rows = points_of(points, 3).rows
    if len(rows) != result.labels.size:
        raise _core.BadInput(f"points are {len(rows)}, must be the {result.labels.size} of the fit")
    rgb = None if color is None else np.asarray(color, dtype=np.uint8).reshape(-1, 3)
    labels = result.labels.reshape(-1)
    _log_cloud(log, rows, labels, rgb, result.models)
    _log_models(log, rows, labels, result.models)


def log_perception(
    result: PerceiveResult,
    *,
    path: str = "swarmfit",
    frame: int | None = None,
    seconds: float | None = None,
    recording: Any = None,
) -> None:
    """What perceive() or perceive_cloud() saw; see swarmfit.rerun's own docstring.

    Args:
        path: of the entities.
        frame, seconds: where on the timelines "frame" and "time" this is; default: where Rerun is.
        recording: a rerun.RecordingStream; default: the active one.

    Raises:
        ImportError: rerun-sdk is not installed.
    """
    log = _Log(path, recording, frame, seconds)
    cloud = result.cloud
    rows, labels = cloud.points.reshape(-1, 3), result.labels.reshape(-1)
    rgb = None if cloud.rgb is None else cloud.rgb.reshape(-1, 3)
    _log_cloud(log, rows, labels, rgb, result.models)
    _log_models(log, rows, labels, result.models)
    log.clear("sois")
    for k, soi in enumerate(result.sois, 1):
        sphere = log.rr.Ellipsoids3D(
            centers=[soi.centre], radii=[soi.radius], colors=[colour(_identity(soi, k))], labels=[_name(soi, k)], show_labels=True
        )
        log(f"sois/{_identity(soi, k)}", sphere)
    if cloud.organised:
        _log_images(log, result)


def _name(soi: _core.SpaceOfInterest, k: int) -> str:
    names = [name for name, _, _ in soi.recognised]
    return names[0] if names else f"SOI {_identity(soi, k)}"


def _log_images(log: _Log, result: PerceiveResult) -> None:
    rr, cloud = log.rr, result.cloud
    if cloud.intrinsics is not None:
        fx, fy, cx, cy = cloud.intrinsics
        pinhole = rr.Pinhole(
            focal_length=(fx, fy), principal_point=(cx, cy), width=cloud.width, height=cloud.height, camera_xyz=rr.ViewCoordinates.RDF
        )
        log("camera", pinhole)
    if cloud.rgb is not None:
        log("camera", rr.Image(cloud.rgb))
    planes = [(k, f"plane {_identity(m, k)}", colour(_identity(m, k))) for k, m in enumerate(result.models, 1)]
    log("camera/planes", rr.AnnotationContext(planes), rr.SegmentationImage(result.labels, opacity=0.4))
    if result.objects is not None:
        things = [(k, _name(soi, k), colour(_identity(soi, k))) for k, soi in enumerate(result.sois, 1)]
        context = rr.AnnotationContext([*things, (_UNCERTAIN_CLASS, "uncertain", (90, 90, 90))])
        log("camera/objects", context, rr.SegmentationImage(result.objects, opacity=0.6))
    boxes = np.array([soi.bbox for soi in result.sois], dtype=np.float32).reshape(-1, 4)
    log(
        "camera/boxes",
        rr.Boxes2D(
            array=boxes,
            array_format=rr.Box2DFormat.XYWH,
            labels=[_name(soi, k) for k, soi in enumerate(result.sois, 1)],
            colors=[colour(_identity(soi, k)) for k, soi in enumerate(result.sois, 1)],
        ),
    )
