"""Keyword arguments by name and type, for type checkers."""

from __future__ import annotations

from typing import TYPE_CHECKING, SupportsFloat, SupportsIndex

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from typing_extensions import TypedDict, Unpack

    class FitterOptions(TypedDict, total=False):
        backend: str | None
        threads: SupportsIndex | None
        seed: SupportsIndex | None
        preset: str | None
        particles: SupportsIndex | None
        iterations: SupportsIndex | None
        stall: SupportsIndex | None
        noise: str | None
        deflation: str | None
        lambda_: SupportsFloat | None
        loss: str | None
        min_inliers: SupportsIndex | None
        max_models: SupportsIndex | None
        time_budget_ms: SupportsFloat | None
        direction: tuple[Sequence[float], float] | None
        pipeline_cache: str | os.PathLike[str] | None

    class PerceiverOptions(FitterOptions, total=False):
        threshold: SupportsFloat | str | None
        gravity: Sequence[float] | None
        camera_tilt: SupportsFloat | None
        horizontal_angle: SupportsFloat | None
        min_plane_share: SupportsFloat | None
        min_height: SupportsFloat | None
        max_height: SupportsFloat | None
        flood_step: SupportsFloat | None
        min_soi_points: SupportsIndex | None
        soi_margin: SupportsFloat | None
        segmentation: str | None
        colour_neighbours: SupportsIndex | None
        uncertain_cost: SupportsFloat | None
        smoothness: SupportsFloat | None
        gallery: str | os.PathLike[str] | None
        track: bool | None

    __all__ = ["FitterOptions", "PerceiverOptions", "Unpack"]
