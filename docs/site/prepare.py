"""Lays out what Sphinx reads: prepare.py ROOT OUT, with Doxygen's XML in OUT/xml.

The pages of docs/ and README, CONTRIBUTING, CHANGELOG are copied to OUT/source, line for line, with their links made the site's: a link to
another of these pages stays one, a link to any other file or folder of the repository becomes one to a page that shows it. A link to what
is not there is an error. The pages of the API are written beside them, one a header, and one for Python.
"""

from __future__ import annotations

import ast
import json
import re
import shutil
import sys
from pathlib import Path

import navigation

LINK = re.compile(r"(?<=\]\()(?!#|[a-z]+:)([^)\s#]+)(#[^)\s]*)?(?=\))")
FENCE = re.compile(r"^\s*(```|~~~)")


class Copier:
    """Copies pages and remembers what of the repository they show."""

    def __init__(self, root: Path, out: Path) -> None:
        self.root, self.out = root, out
        self.pages = {root / "docs" / f"{name}.md": f"{name}.md" for name in navigation.written(root)}
        self.pages.update({root / name: page for name, page in navigation.OF_THE_ROOT.items()})
        self.shown: set[str] = set()
        self.errors: list[str] = []

    def copy(self, page: Path) -> None:
        lines, fenced = [], False
        for number, line in enumerate(page.read_text().splitlines(), 1):
            if FENCE.match(line):
                fenced = not fenced
            if not fenced:
                line = LINK.sub(lambda m, n=number: self._link(page, n, m[1], m[2] or ""), line)
            lines.append(line)
        target = self.out / self.pages[page]
        target.write_text("\n".join(lines) + "\n" + navigation.toctrees(self.pages[page]))

    def _link(self, page: Path, number: int, path: str, anchor: str) -> str:
        there = (page.parent / path).resolve()
        if there in self.pages:
            return self.pages[there] + anchor
        if not there.exists() or not there.is_relative_to(self.root):
            self.errors.append(f"{page.relative_to(self.root)}:{number}: no file {path}")
            return path
        inside = there.relative_to(self.root).as_posix()
        if inside.startswith("docs/images/"):
            return inside.removeprefix("docs/")
        self.shown.add(inside)
        return f"source:{inside}{anchor}"


def title(text: str, line: str = "=") -> str:
    return f"{text}\n{line * len(text)}\n\n"


def what_it_is(header: Path) -> str:
    """The lines of comment that a header begins with."""
    lines = []
    for line in header.read_text().splitlines():
        if not line.startswith("//"):
            break
        lines.append(line.removeprefix("//").strip())
    return " ".join(lines)


def plain(text: str) -> str:
    """Text as reStructuredText that means nothing else; what stands between backticks is code."""
    parts = text.split("`")
    return "".join(f"``{part}``" if i % 2 else re.sub(r"([\\*|_])", r"\\\1", part) for i, part in enumerate(parts))


def write_cpp_pages(root: Path, out: Path) -> None:
    folder = root / "host/include/swarmfit"
    headers = sorted(folder.glob("*.hpp")) + sorted(folder.glob("adapters/*.hpp"))
    index = title("C++") + "Made from the comments in the installed headers. ``swarmfit/swarmfit.hpp`` includes all but the adapters.\n\n"
    entries = []
    (out / "api/cpp/adapters").mkdir(parents=True, exist_ok=True)
    for header in headers:
        name = header.relative_to(folder.parent).as_posix()
        if header.name in navigation.HEADERS_WITHOUT_A_PAGE:
            continue
        page = f"api/cpp/{header.relative_to(folder).with_suffix('').as_posix()}"
        (out / f"{page}.rst").write_text(
            title(name) + plain(what_it_is(header)) + f"\n\n.. code-block:: cpp\n\n   #include <{name}>\n\n.. doxygenfile:: {header.name}\n"
        )
        index += f":doc:`{name} </{page}>`\n   {plain(what_it_is(header))}\n\n"
        entries.append(f"   {header.relative_to(folder).as_posix()} </{page}>\n")
    (out / "api/cpp/index.rst").write_text(index + ".. toctree::\n   :hidden:\n\n" + "".join(entries))


def write_python_page(root: Path, out: Path) -> list[str]:
    """Copies the page; names that the package exports and the page does not show are errors."""
    page = root / "docs/site/python.rst"
    shutil.copy(page, out / "api/python.rst")
    shown = set(re.findall(r"^\.\. auto\w+:: (\w+)$", page.read_text(), re.M)) | {"__version__"}
    tree = ast.parse((root / "python/swarmfit/__init__.py").read_text())
    exported = next(ast.literal_eval(n.value) for n in tree.body if isinstance(n, ast.Assign) and ast.unparse(n.targets[0]) == "__all__")
    return [f"docs/site/python.rst does not show {name}" for name in sorted(set(exported) - shown)]


def main() -> int:
    root, build = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
    out = build / "source"
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    shutil.copytree(root / "docs/images", out / "images")
    copier = Copier(root, out)
    for page in copier.pages:
        copier.copy(page)
    write_cpp_pages(root, out)
    copier.errors += write_python_page(root, out)
    (build / "shown.json").write_text(json.dumps(sorted(copier.shown)))
    for error in copier.errors:
        print(error, file=sys.stderr)
    return 1 if copier.errors else 0


if __name__ == "__main__":
    sys.exit(main())
