"""What is broken is found: links of pages before the site is built, and of the site after. Python's own library alone."""

from __future__ import annotations

import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import check_site
import prepare


class Preparing(unittest.TestCase):
    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name).resolve()
        self.out = self.root / "out"
        for inside in ("docs/images", "kernels", "out"):
            (self.root / inside).mkdir(parents=True)
        (self.root / "kernels/a.hpp").write_text("// a\n")
        (self.root / "docs/images/p.png").write_bytes(b"")
        (self.root / "docs/other.md").write_text("# Other\n")
        for name in prepare.navigation.OF_THE_ROOT:
            (self.root / name).write_text("# Root\n")

    def copy(self, text: str) -> tuple[str, prepare.Copier]:
        page = self.root / "docs/page.md"
        page.write_text(text)
        copier = prepare.Copier(self.root, self.out)
        copier.copy(page)
        return (self.out / "page.md").read_text(), copier

    def test_links_become_the_sites(self) -> None:
        text, copier = self.copy(
            "[o](other.md#x) [r](../README.md) [a](../kernels/a.hpp) [k](../kernels) ![p](images/p.png) [w](https://a.b/c) [h](#here)\n"
        )
        self.assertEqual(
            text,
            "[o](other.md#x) [r](readme.md) [a](source:kernels/a.hpp) [k](source:kernels) ![p](images/p.png) "
            "[w](https://a.b/c) [h](#here)\n",
        )
        self.assertEqual(copier.shown, {"kernels/a.hpp", "kernels"})
        self.assertEqual(copier.errors, [])

    def test_what_is_not_there_is_an_error_with_its_line(self) -> None:
        _, copier = self.copy("# Page\n\n[a](../kernels/b.hpp)\n![q](images/q.png) [out](../../etc)\n```\n[code](not/a/link)\n```\n")
        self.assertEqual(
            copier.errors,
            ["docs/page.md:3: no file ../kernels/b.hpp", "docs/page.md:4: no file images/q.png", "docs/page.md:4: no file ../../etc"],
        )

    def test_text_means_nothing_to_restructuredtext(self) -> None:
        self.assertEqual(prepare.plain("a_ |b| `c_d` *e*"), r"a\_ \|b\| ``c_d`` \*e\*")


class Checking(unittest.TestCase):
    def broken(self, **pages: str) -> list[str]:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name).resolve()
            for page, text in pages.items():
                (folder / f"{page}.html").write_text(text)
            (folder / "p.png").write_bytes(b"")
            return check_site.broken_links(folder)[1]

    def test_whole_links_are_whole(self) -> None:
        self.assertEqual(self.broken(a='<a href="b.html#x">b</a><img src="p.png"><a href="#">top</a>', b='<p id="x">x</p>'), [])
        self.assertEqual(self.broken(a='<a href="https://a.b/c">outside</a>'), [])

    def test_broken_ones_are_named(self) -> None:
        found = self.broken(a='<a href="c.html">c</a><a href="b.html#y">b</a><img src="q.png">', b='<p id="x">x</p>')
        self.assertEqual(found, ["a.html: c.html: no such file", "a.html: b.html#y: no such anchor", "a.html: q.png: no such file"])


if __name__ == "__main__":
    unittest.main()
