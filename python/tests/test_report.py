"""The page of --report from Python; what the page does is tested in a browser (report/test)."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import swarmfit
from swarmfit import _core


def can_report() -> bool:
    try:
        _core.check_report()
    except swarmfit.CannotWrite:
        return False
    return True


needs_page = pytest.mark.skipif(not can_report(), reason="this build writes no reports: Node.js was absent when it was configured")


def part(page: str, name: str) -> Any:
    found = re.search(rf'<script type="application/json" id="{name}">(.*?)</script>', page, re.S)
    assert found, name
    return json.loads(found[1])


@needs_page
def test_a_fit_and_its_search(corner: np.ndarray, tmp_path: Path) -> None:
    plain = swarmfit.fit(corner, "plane", threshold=0.01)
    result = swarmfit.fit(corner, "plane", threshold=0.01, record_search=True)
    assert np.array_equal(plain.labels, result.labels)
    result.report(tmp_path / "fit.html", corner)
    page = (tmp_path / "fit.html").read_text()
    about = part(page, "about")
    assert about["command"] == "swarmfit.fit(points, 'plane', threshold=0.01)"
    assert {"name": "threshold", "value": "0.01", "given": True} in about["settings"]
    assert len(part(page, "result")["models"]) == len(result.models) == 3
    assert len(part(page, "search")["steps"]) > 10
    plain.report(tmp_path / "plain.html", corner)
    assert not part((tmp_path / "plain.html").read_text(), "search")["steps"]


@needs_page
def test_data_of_two_columns(tmp_path: Path) -> None:
    x = np.linspace(0, 10, 200)
    points = np.stack([x, 0.5 * x + 1], axis=1)
    swarmfit.fit(points, "line2d", threshold=0.05).report(tmp_path / "line.html", points)
    assert part((tmp_path / "line.html").read_text(), "about")["cloud"]["dimension"] == 2


@needs_page
def test_perception(room: swarmfit.Cloud, tmp_path: Path) -> None:
    seen = swarmfit.perceive_cloud(room, seed=3, record_search=True)
    seen.report(tmp_path / "room.html")
    page = (tmp_path / "room.html").read_text()
    assert part(page, "about")["command"] == "swarmfit.perceive_cloud(points, seed=3)"
    assert len(part(page, "result")["sois"]) == len(seen.sois)
    assert part(page, "search")["steps"]


@needs_page
def test_what_cannot_be_reported(corner: np.ndarray, tmp_path: Path) -> None:
    result = swarmfit.fit(corner, "plane", threshold=0.01)
    with pytest.raises(swarmfit.BadInput, match="must be the 10000 of the fit"):
        result.report(tmp_path / "fit.html", corner[:100])
    with pytest.raises(swarmfit.CannotWrite):
        result.report(tmp_path / "absent" / "fit.html", corner)
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(can_report(), reason="this build writes reports")
def test_a_build_without_the_page_says_so(corner: np.ndarray, tmp_path: Path) -> None:
    with pytest.raises(swarmfit.CannotWrite, match="docs/report.md"):
        swarmfit.fit(corner, "plane", threshold=0.01).report(tmp_path / "fit.html", corner)
