"""Swarmfit's compiled half. Arrays are views of what the object holds and are not to be written to."""

import os
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

__version__: str
UNCERTAIN: int
"""Label in `objects` where neither object nor background is likely."""

class Error(Exception):
    """What Swarmfit cannot do, in words that name the field, the value and the bound."""

class InvalidOption(Error, ValueError):
    """An option is out of its bounds."""

class BadInput(Error, ValueError):
    """Data that cannot be used: unreadable, of the wrong shape, too few."""

class BackendUnavailable(Error, RuntimeError):
    """The back end or device asked for cannot be used."""

class OutOfMemory(Error, RuntimeError):
    """Host or device memory does not hold the work."""

class CannotWrite(Error, RuntimeError):
    """An output cannot be written."""

class Model:
    """A fitted model, in the data's frame and unit. Made by hand, it can warm-start a fit."""

    def __init__(self, type: str, parameters: Sequence[float]) -> None: ...
    @property
    def type(self) -> str: ...
    @property
    def parameters(self) -> NDArray[np.float64]:
        """line2d: a, b, offset. plane: normal (3), offset. circle2d, sphere: centre, radius. cylinder: point (3), axis (3), radius.
        homography, fundamental: the matrix, row by row."""
    @property
    def covariance(self) -> NDArray[np.float64]:
        """Of `parameters`, P x P, from the inliers' residuals."""
    @property
    def normal(self) -> NDArray[np.float64]:
        """plane (3), line2d (2): unit normal; normal . x + offset = 0."""
    @property
    def offset(self) -> float:
        """plane, line2d [data unit]: normal . x + offset = 0."""
    @property
    def centre(self) -> NDArray[np.float64]:
        """sphere (3), circle2d (2) [data unit]."""
    @property
    def radius(self) -> float:
        """sphere, circle2d, cylinder [data unit]."""
    @property
    def point(self) -> NDArray[np.float64]:
        """cylinder (3): a point of its axis."""
    @property
    def axis(self) -> NDArray[np.float64]:
        """cylinder (3): its unit direction."""
    @property
    def matrix(self) -> NDArray[np.float64]:
        """homography, fundamental: 3 x 3, of norm 1."""
    @property
    def inliers(self) -> int:
        """Points labelled with this model."""
    @property
    def cost(self) -> float:
        """Truncated loss over all points under the caps it was found with [data unit]."""
    @property
    def rms(self) -> float:
        """Of its inliers' distances [data unit]."""
    @property
    def supporting(self) -> bool:
        """Set by perception: horizontal, and of reasonable size."""
    @property
    def id(self) -> int:
        """With `track`: 1, 2 ..., the same plane over frames, never given twice; else 0."""
    @property
    def iterations(self) -> int: ...
    @property
    def evaluations(self) -> int: ...
    @property
    def points_touched(self) -> float: ...
    @property
    def found_at_ms(self) -> float:
        """Since the start of the fit."""

def model_types() -> list[str]:
    """Every kind this build knows."""

def dimension(type: str) -> int:
    """Columns of a point the kind is fitted to."""

class Cloud:
    """Points in input order, perhaps on an image grid, perhaps with colour."""

    @property
    def points(self) -> NDArray[Any]:
        """N x D, or H x W x D on an image grid; float32 or float64, the source's own."""
    @property
    def rgb(self) -> NDArray[np.uint8] | None:
        """Of the points' shape, red first; or None."""
    @property
    def width(self) -> int: ...
    @property
    def height(self) -> int:
        """> 1: on an image grid."""
    @property
    def organised(self) -> bool: ...
    @property
    def intrinsics(self) -> tuple[float, float, float, float] | None:
        """fx, fy, cx, cy [px] of the camera behind the grid, where known."""
    def __len__(self) -> int: ...

_Path = str | os.PathLike[str]
_Camera = tuple[float, float, float, float]

def cloud_from_arrays(
    points: NDArray[Any], width: int, height: int, rgb: NDArray[np.uint8] | None = None, intrinsics: _Camera | None = None
) -> Cloud: ...
def cloud_from_depth(depth: NDArray[Any], intrinsics: _Camera, depth_scale: float, rgb: NDArray[np.uint8] | None = None) -> Cloud: ...
def read_cloud(file: _Path) -> Cloud: ...
def read_depth(depth: _Path, intrinsics: _Camera, depth_scale: float = 0.001) -> Cloud: ...
def read_rgbd(color: _Path, depth: _Path, intrinsics: _Camera, depth_scale: float = 0.001) -> Cloud: ...
def read_stereo(left: _Path, right: _Path, calib: _Path) -> Cloud: ...
def make_room_scene(seed: int = 1, width: int = 640, height: int = 480, frame: int = 0, frames: int = 1) -> Cloud: ...

class SearchRecord:
    """A search to be replayed in a report."""

    def __init__(self) -> None: ...

_Settings = Sequence[tuple[str, str, bool]]

def check_report() -> None:
    """Raises CannotWrite, and says why, where this build cannot write reports."""

def write_fit_report(
    file: _Path, result: FitResult, cloud: Cloud, search: SearchRecord, title: str, call: str, settings: _Settings
) -> None: ...
def write_perceive_report(
    file: _Path, result: PerceiveResult, cloud: Cloud, search: SearchRecord, title: str, call: str, settings: _Settings
) -> None: ...

class FitResult:
    @property
    def models(self) -> list[Model]: ...
    @property
    def labels(self) -> NDArray[np.uint16]: ...
    @property
    def figures(self) -> dict[str, Any]: ...
    def brief(self) -> str: ...

class ModelStream:
    def __iter__(self) -> Iterator[Model]: ...
    def __next__(self) -> Model: ...
    def stop(self) -> None: ...
    def result(self) -> FitResult: ...

class Fitter:
    def __init__(self, **options: Any) -> None: ...
    def fit(
        self,
        points: NDArray[Any],
        on_model: Callable[[Model], object] | None = None,
        warm_start: Sequence[Model] = [],
        record: SearchRecord | None = None,
    ) -> FitResult: ...
    def find_models(self, points: NDArray[Any], warm_start: Sequence[Model] = []) -> ModelStream: ...
    @property
    def backend(self) -> tuple[str, str, str]: ...

class SpaceOfInterest:
    """A group of points above a supporting plane and the sphere around it."""

    @property
    def centre(self) -> NDArray[np.float64]:
        """[m]"""
    @property
    def radius(self) -> float:
        """[m], slightly larger than the group."""
    @property
    def points(self) -> int: ...
    @property
    def plane(self) -> int:
        """It stands on models[plane - 1]."""
    @property
    def id(self) -> int:
        """With `track`: 1, 2 ..., the same thing over frames, never given twice; else 0."""
    @property
    def bbox(self) -> tuple[int, int, int, int]:
        """x, y, width, height [px]; zeros without an image grid."""
    @property
    def recognised(self) -> list[tuple[str, int, float]]:
        """Name, matches that agree, score in [0, 1]; best first."""

class PerceiveResult:
    @property
    def models(self) -> list[Model]: ...
    @property
    def labels(self) -> NDArray[np.uint16]: ...
    @property
    def figures(self) -> dict[str, Any]: ...
    @property
    def timing_ms(self) -> dict[str, float]: ...
    @property
    def up(self) -> NDArray[np.float64]: ...
    @property
    def vertical_source(self) -> str: ...
    @property
    def sois(self) -> list[SpaceOfInterest]: ...
    @property
    def popout(self) -> NDArray[np.uint16]: ...
    @property
    def objects(self) -> NDArray[np.uint16] | None: ...
    def overlay(self, cloud: Cloud) -> NDArray[np.uint8]: ...
    def to_json(self, cloud: Cloud) -> str: ...
    def write(self, folder: _Path, cloud: Cloud) -> None: ...

class Perceiver:
    def __init__(self, **options: Any) -> None: ...
    def perceive(
        self, cloud: Cloud, on_plane: Callable[[Model], object] | None = None, record: SearchRecord | None = None
    ) -> PerceiveResult: ...

class Device:
    """One way to evaluate on this machine."""

    @property
    def backend(self) -> str: ...
    @property
    def name(self) -> str:
        """Accepted as `backend`."""
    @property
    def kind(self) -> str:
        """"cpu", "discrete GPU", "integrated GPU", "software"."""
    @property
    def usable(self) -> bool: ...
    @property
    def reason(self) -> str:
        """Why it cannot be used, or what "auto" thinks of it."""
    @property
    def limits(self) -> dict[str, str]: ...

def devices() -> list[Device]: ...

class BenchRow:
    """One line of a bench."""

    @property
    def backend(self) -> str: ...
    @property
    def device(self) -> str: ...
    @property
    def model(self) -> str: ...
    @property
    def points(self) -> int: ...
    @property
    def particles(self) -> int: ...
    @property
    def pruning(self) -> bool: ...
    @property
    def evaluations_per_s(self) -> float:
        """Points x particles a second; effective, with pruning."""
    @property
    def fraction_of_limit(self) -> float:
        """Of the fused multiply-adds that this run measured."""
    @property
    def max_relative_error(self) -> float:
        """Against the reference."""
    @property
    def seconds(self) -> float:
        """Median of one evaluation of the swarm."""

class BenchReport:
    """What bench() measured."""

    @property
    def fma_per_s(self) -> float: ...
    @property
    def threads(self) -> int: ...
    @property
    def rows(self) -> list[BenchRow]: ...
    def to_json(self) -> str: ...

def bench(
    backends: Sequence[str],
    models: Sequence[str],
    points: Sequence[int],
    particles: Sequence[int],
    pruning: Sequence[bool],
    threads: int,
    seconds: float,
    seed: int,
    cloud: NDArray[Any] | None = None,
    progress: Callable[[str], object] | None = None,
) -> BenchReport: ...
