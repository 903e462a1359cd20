"""The stub says what there is."""

from __future__ import annotations

import ast
import inspect
from pathlib import Path

import swarmfit
from swarmfit import _core


def names(body: list[ast.stmt]) -> set[str]:
    found: set[str] = set()
    for node in body:
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
            found.add(node.name)
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            found.add(node.target.id)
    return found


def public(thing: object) -> set[str]:
    return {name for name in vars(thing) if not name.startswith("_")}


def test_the_stub_names_all_and_only_what_is_compiled() -> None:
    stub = ast.parse(Path(swarmfit.__file__).with_name("_core.pyi").read_text())
    assert names(stub.body) - {"__version__"} == public(_core)
    for node in stub.body:
        if not isinstance(node, ast.ClassDef):
            continue
        there = getattr(_core, node.name)
        own = names(node.body)
        assert {name for name in own if not name.startswith("__")} == public(there), node.name
        assert all(hasattr(there, name) for name in own), node.name


def test_everything_exported_is_there_and_documented() -> None:
    assert (Path(swarmfit.__file__).parent / "py.typed").exists()
    for name in swarmfit.__all__:
        thing = getattr(swarmfit, name)
        if inspect.isclass(thing) or inspect.isfunction(thing):
            assert thing.__doc__, name
    assert "threshold" in (swarmfit.fit.__doc__ or "")
    assert "gravity" in (swarmfit.perceive.__doc__ or "")
