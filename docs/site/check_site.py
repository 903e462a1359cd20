"""check_site.py FOLDER: every link of a built site leads to a page, a file, an image and an anchor that is there. Says which do not."""

from __future__ import annotations

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class Page(HTMLParser):
    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.anchors: set[str] = {"", "top"}
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        for name, value in attributes:
            if value is None:
                continue
            if name in ("href", "src"):
                self.links.append(value)
            elif name == "id" or (name == "name" and tag == "a"):
                self.anchors.add(value)


def broken_links(folder: Path) -> tuple[int, list[str]]:
    """How many links there are within the site, and which lead nowhere, or out of it without saying so."""
    pages = {file: Page(file.read_text()) for file in sorted(folder.rglob("*.html"))}
    seen, broken = 0, []
    for file, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            seen += 1
            there = file if not parts.path else (file.parent / unquote(parts.path)).resolve()
            if there.is_dir():
                there /= "index.html"
            if not there.is_file():
                broken.append(f"{file.relative_to(folder)}: {link}: no such file")
            elif there in pages and unquote(parts.fragment) not in pages[there].anchors:
                broken.append(f"{file.relative_to(folder)}: {link}: no such anchor")
    return seen, broken


def main() -> int:
    folder = Path(sys.argv[1]).resolve()
    seen, broken = broken_links(folder)
    for line in broken:
        print(line, file=sys.stderr)
    if not seen:
        print(f"{folder}: no links, is there a site?", file=sys.stderr)
    print(f"{seen} links within the site, {len(broken)} broken")
    return 1 if broken or not seen else 0


if __name__ == "__main__":
    sys.exit(main())
