"""The Python package as autodoc sees it, without compiling: the stub stands in for the compiled half.

The tests hold the stub against what is compiled (python/tests/test_stubs.py), so what it says is what there is. Docstrings are plain text
with backticks around code and examples set in, and are made reStructuredText here.
"""

from __future__ import annotations

import ast
import os
import re
import sys
import types
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

package = Path(os.environ["SWARMFIT_ROOT"]) / "python/swarmfit"


def compiled_half(version: str) -> types.ModuleType:
    """_core.pyi as a module. Names that it only declares are None."""
    source = package / "_core.pyi"
    tree = ast.parse(source.read_text())
    module = types.ModuleType("swarmfit._core", ast.get_docstring(tree))
    for node in tree.body:
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            vars(module)[node.target.id] = None
    exec(compile("from __future__ import annotations\n" + source.read_text().split('"""', 2)[2], str(source), "exec"), vars(module))
    vars(module).update(__version__=version, UNCERTAIN=65535)
    for thing in vars(module).values():
        if isinstance(thing, type) and thing.__module__ == "swarmfit._core":
            thing.__module__ = "swarmfit"  # where it is exported
    return module


def literal(text: str) -> str:
    """Backticks mean code; nothing else means anything."""
    parts = text.split("`")
    return "".join(f"``{part}``" if i % 2 else re.sub(r"([\\*|])|(?<=\w)_(?=[\s:,.)]|$)", r"\\\g<0>", part) for i, part in enumerate(parts))


def rewrite(_app: Sphinx, _what: str, _name: str, _object: Any, _options: Any, lines: list[str]) -> None:
    """Before napoleon: examples become code blocks, lists of options sections."""
    out: list[str] = []
    code = False
    for line in lines:
        begins = line.startswith("    ") and (not out or not out[-1].strip()) and not in_section(out)
        if begins and not code:
            out += ["::", ""]
            code = True
        elif line.strip() and not line.startswith("    "):
            code = False
        section = re.match(r"Options, None for the default(; .*)?:$", line)
        if section:
            out += [f"Options that are None have their default{literal(section[1] or '')}.", "", "Options:"]
        else:
            out.append(line if code else literal(line))
    lines[:] = out


def in_section(lines: list[str]) -> bool:
    """Is the last line that is not set in a heading such as `Args:`?"""
    for line in reversed(lines):
        if line.strip() and not line.startswith(" "):
            return bool(re.match(r"(Args|Returns|Raises|Options):$", line))
    return False


def setup(app: Sphinx) -> dict[str, bool]:
    sys.modules["swarmfit._core"] = compiled_half(app.config.release)
    app.connect("autodoc-process-docstring", rewrite, priority=400)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
