"""A page for each file and folder of the repository that a page of the documentation links to."""

from __future__ import annotations

import html
import json
import os
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pygments.lexers import get_lexer_for_filename
from pygments.util import ClassNotFound
from sphinx.application import Sphinx

root = Path(os.environ["SWARMFIT_ROOT"])
build = Path(os.environ["SWARMFIT_DOCS_BUILD"])

# GLSL's includes and what is compiled once for each instruction set.
LANGUAGES = {".inl": "cpp", ".comp": "glsl"}


def language(path: Path) -> str:
    if path.suffix in LANGUAGES:
        return LANGUAGES[path.suffix]
    try:
        return str(get_lexer_for_filename(path.name).aliases[0])
    except (ClassNotFound, IndexError):
        return "none"


def listing(path: Path) -> list[str]:
    """Files of a folder, as git knows them; where there is no git, all but what tools leave behind."""
    command = ["git", "-C", str(path), "ls-files", "--cached", "--others", "--exclude-standard"]
    try:
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    except (OSError, subprocess.CalledProcessError):
        inside = (file.relative_to(path) for file in sorted(path.rglob("*")) if file.is_file())
        left_behind = ("__pycache__", "node_modules")
        return [str(file) for file in inside if not any(part in left_behind or part.startswith(".") for part in file.parts)]


def pages(app: Sphinx) -> Iterator[tuple[str, dict[str, Any], str]]:
    shown = json.loads((build / "shown.json").read_text())
    files = {name: root / name for name in shown if (root / name).is_file()}
    for name in shown:
        if name in files:
            continue
        inside = listing(root / name)
        files.update({f"{name}/{each}": root / name / each for each in inside})
        up = "../" * (name.count("/"))
        items = "".join(f'<li><a href="{up}{html.escape(f"{name}/{each}")}.html">{html.escape(each)}</a></li>' for each in inside)
        yield f"source/{name}", {"title": name, "body": f"<h1>{html.escape(name)}</h1><ul>{items}</ul>", "parents": []}, "page.html"
    for name, file in files.items():
        try:
            text = file.read_text()
        except UnicodeDecodeError:
            text = f"({file.stat().st_size} bytes)"
        code = app.builder.highlighter.highlight_block(text, language(file), linenos="inline")  # type: ignore[attr-defined]
        yield f"source/{name}", {"title": name, "body": f"<h1>{html.escape(name)}</h1>{code}", "parents": []}, "page.html"


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("html-collect-pages", pages)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
