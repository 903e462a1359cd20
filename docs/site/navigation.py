"""The order of the site's pages. A page of docs/ that is in no section is an error of Sphinx's."""

from __future__ import annotations

from pathlib import Path

#: Pages beside docs/, and what they are called on the site.
OF_THE_ROOT = {"README.md": "readme.md", "CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md"}

SECTIONS: dict[str, list[str]] = {
    "Start": ["quick_start", "concepts", "faq"],
    "How to": ["from_pcl", "from_open3d", "on_a_gpu", "without_a_gpu", "tuning", "own_models", "rerun", "report", "embedding"],
    "Reference": ["api/cpp/index", "api/python", "performance"],
    "How it works": ["method", "fitting", "perception", "backends", "architecture"],
    "Project": ["Read me <readme>", "contributing", "changelog"],
}

#: They hold no names, or only macros.
HEADERS_WITHOUT_A_PAGE = {"swarmfit.hpp", "export.hpp", "version.hpp"}


def written(root: Path) -> list[str]:
    return sorted(page.stem for page in (root / "docs").glob("*.md"))


def toctrees(page: str) -> str:
    """What the first page ends with, for the site's sidebar."""
    if page != "index.md":
        return ""
    trees = (
        "\n```{toctree}\n:hidden:\n:caption: " + section + "\n\n" + "\n".join(pages) + "\n```\n" for section, pages in SECTIONS.items()
    )
    return "".join(trees)
