"""What comes out."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from . import _core

if TYPE_CHECKING:
    import os

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


@dataclass(frozen=True)
class FitResult:
    """All models found in a cloud, in the order found."""

    models: list[_core.Model]
    labels: NDArray[np.uint16]  #: the input's shape without its last axis: 0 none, k for models[k - 1]
    stats: Stats
    _brief: str = field(repr=False, default="")

    def __str__(self) -> str:
        return self._brief


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

    def overlay(self) -> NDArray[np.uint8]:
        """H x W x 3, red first: planes in their colours, what sticks out in yellow, outlines, names."""
        return self._core.overlay(self.cloud)  # type: ignore[no-any-return]

    def to_json(self) -> str:
        """The text of result.json, as the command writes it."""
        return self._core.to_json(self.cloud)  # type: ignore[no-any-return]

    def write(self, folder: str | os.PathLike[str]) -> None:
        """result.json, planes.png, popout.png, objects.png, overlay.png; or labelled.ply for a cloud without an image grid."""
        self._core.write(folder, self.cloud)


def fit_result(result: _core.FitResult, shape: tuple[int, ...], copied: bool) -> FitResult:
    return FitResult(result.models, result.labels.reshape(shape), Stats(**result.figures, copied=copied), result.brief())


def perceive_result(result: _core.PerceiveResult, cloud: _core.Cloud, copied: bool) -> PerceiveResult:
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
    )
