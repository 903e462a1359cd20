"""What comes out."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from . import _core
from ._inputs import cloud_of

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Stats:
    """How a fit went."""

    backend: str  #: "cpu", "vulkan", "reference"
    device: str
    backend_reason: str  #: why it was chosen
    seed: int
    threshold: float  #: tau used [data unit]
    stop_reason: str
    finite_points: int
    iterations: int  #: swarm steps
    evaluations: int  #: particles scored
    points_touched: float  #: share of points x particles really computed, in [0, 1]
    total_ms: float
    copied: bool = False  #: the input had to be copied or converted before it could be looked at


class Told:
    """What a report tells of how a result came about: the call, its options, and the search where it was recorded."""

    def __init__(self, function: str, taken: str, options: Mapping[str, Any], record_search: bool, dimension: int = 3) -> None:
        self.title = function
        self.dimension = dimension  #: columns of a point
        self.options = {name: value for name, value in options.items() if value is not None}
        given = ", ".join(f"{name}={value!r}" for name, value in self.options.items())
        self.call = f"swarmfit.{function}({taken}{', ' if given else ''}{given})"
        self.search = _core.SearchRecord() if record_search else None

    def arguments(self) -> tuple[_core.SearchRecord, str, str, list[tuple[str, str, bool]]]:
        """Of the compiled half's write_..._report, behind file, result and cloud."""
        settings = [(name, str(value), True) for name, value in self.options.items()]
        return self.search or _core.SearchRecord(), self.title, self.call, settings


@dataclass(frozen=True)
class FitResult:
    """All models found in a cloud, in the order found."""

    models: list[_core.Model]
    labels: NDArray[np.uint16]  #: the input's shape without its last axis: 0 none, k for models[k - 1]
    stats: Stats
    _core: Any = field(repr=False, compare=False, default=None)
    _told: Any = field(repr=False, compare=False, default=None)

    def __str__(self) -> str:
        return self._core.brief()  # type: ignore[no-any-return]

    def report(self, file: str | os.PathLike[str], points: Any, *, color: Any = None) -> None:
        """One HTML page to look at, as the command's --report writes it; the search is replayed if the fit was told `record_search=True`.

        Args:
            points: those of the fit. They are copied.
            color: of the points' shape, uint8, red first; default: the cloud's own.

        Raises:
            CannotWrite: the file cannot be written, or this build cannot write reports.
        """
        _core.check_report()
        cloud = cloud_of(points, color, None, self._told.dimension)
        if len(cloud) != self.labels.size:
            raise _core.BadInput(f"points are {len(cloud)}, must be the {self.labels.size} of the fit")
        _core.write_fit_report(file, self._core, cloud, *self._told.arguments())


@dataclass(frozen=True)
class PerceiveResult:
    """Surfaces, what stands on them, its outline, its name. Label images have the shape of the input, H x W or N."""

    models: list[_core.Model]  #: planes; those with `supporting` carry things
    labels: NDArray[np.uint16]  #: 0 none, k for models[k - 1]
    sois: list[_core.SpaceOfInterest]
    popout: NDArray[np.uint16]  #: 0, or k for sois[k - 1]: what 3D alone says
    objects: NDArray[np.uint16] | None  #: 0 background, k for sois[k - 1], UNCERTAIN; None without an image grid
    up: NDArray[np.float64]  #: the vertical used, against gravity
    vertical_source: str  #: "gravity", "camera tilt" or "dominant plane"
    stats: Stats
    timing_ms: dict[str, float]
    cloud: _core.Cloud = field(repr=False)  #: what was looked at
    _core: Any = field(repr=False, compare=False, default=None)
    _told: Any = field(repr=False, compare=False, default=None)

    def overlay(self) -> NDArray[np.uint8]:
        """H x W x 3, red first: planes in their colours, what sticks out in yellow, outlines, names."""
        return self._core.overlay(self.cloud)  # type: ignore[no-any-return]

    def to_json(self) -> str:
        """The text of result.json, as the command writes it."""
        return self._core.to_json(self.cloud)  # type: ignore[no-any-return]

    def report(self, file: str | os.PathLike[str]) -> None:
        """One HTML page to look at, as the command's --report writes it; the search is replayed if perceive() was told
        `record_search=True`.

        Raises:
            CannotWrite: the file cannot be written, or this build cannot write reports.
        """
        _core.write_perceive_report(file, self._core, self.cloud, *self._told.arguments())

    def write(self, folder: str | os.PathLike[str]) -> None:
        """result.json, planes.png, popout.png, objects.png, overlay.png; or labelled.ply for a cloud without an image grid."""
        self._core.write(folder, self.cloud)


def fit_result(result: _core.FitResult, shape: tuple[int, ...], copied: bool, told: Told) -> FitResult:
    return FitResult(result.models, result.labels.reshape(shape), Stats(**result.figures, copied=copied), result, told)


def perceive_result(result: _core.PerceiveResult, cloud: _core.Cloud, copied: bool, told: Told) -> PerceiveResult:
    shape = (cloud.height, cloud.width) if cloud.organised else (len(cloud),)
    objects = result.objects
    return PerceiveResult(
        models=result.models,
        labels=result.labels.reshape(shape) if result.labels.size else result.popout.reshape(shape) * 0,
        sois=result.sois,
        popout=result.popout.reshape(shape),
        objects=None if objects is None else objects.reshape(shape),
        up=result.up,
        vertical_source=result.vertical_source,
        stats=Stats(**result.figures, copied=copied),
        timing_ms=result.timing_ms,
        cloud=cloud,
        _core=result,
        _told=told,
    )
