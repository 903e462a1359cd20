"""The Python of README and of the documentation is run as it stands there."""

from __future__ import annotations

import importlib.util
import re
import runpy
import sys
from pathlib import Path

import pytest

from test_report import can_report

root = Path(__file__).parents[2]
pages = [root / "README.md", *sorted((root / "docs").glob("*.md"))]
snippets = [
    pytest.param(snippet, id=f"{page.name}-{k}")
    for page in pages
    for k, snippet in enumerate(re.findall(r"```python\n(.*?)```", page.read_text(), re.S), 1)
]


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the files that the examples read."""
    folder = tmp_path_factory.mktemp("examples")
    inputs = runpy.run_path(str(root / "tests/snippets/inputs.py"))
    inputs["write_all"](folder)
    return folder


@pytest.mark.parametrize("snippet", snippets)
def test_a_snippet_runs(
    snippet: str, files: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in re.findall(r"^import (\w+)", snippet, re.M):
        if not importlib.util.find_spec(name):
            pytest.skip(f"{name} is not installed")
    if ".report(" in snippet and not can_report():
        pytest.skip("this build writes no reports: Node.js was absent when it was configured")
    monkeypatch.chdir(files)
    monkeypatch.setattr(sys, "argv", ["planes.py", "room.pcd"])
    exec(compile(snippet, "snippet", "exec"), {})
    if "print(" in snippet:
        assert capsys.readouterr().out


def test_there_are_snippets_and_the_readme_prints_what_it_should(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert len(snippets) >= 10
    for snippet in re.findall(r"```python\n(.*?)```", (root / "README.md").read_text(), re.S):
        exec(compile(snippet, "README.md", "exec"), {})
    printed = capsys.readouterr().out
    assert "points after" in printed
    assert "things stand on" in printed


def test_the_quick_starts_program_is_the_sample() -> None:
    sample = (root / "samples/quick_start/planes.py").read_text()
    assert f"```python\n{sample}```" in (root / "docs/quick_start.md").read_text()
