"""check.py ROOT COMMAND: every example in README.md, CONTRIBUTING.md and docs/ is something that works.

    cpp, cmake  stands, line for line, in a file that the build compiles and the tests run
    sh          lines of `swarmfit` are run by COMMAND on files made for them; of the others it is checked that the tools, presets, options
                and packages they name are there
    python      is run by the Python package's own tests (python/tests/test_readme.py)
    yaml, none  are left alone

Says what it did with each line; ends with 1 if an example does not work.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import inputs

PLACEHOLDERS = {"FX,FY,CX,CY": inputs.CAMERA, "X,Y,Z": "0,0.866,0.5", "DIR": "out", "DEG": "30"}
#: A walk of 300 frames takes minutes; what is shown works with three.
SHORTER = {"--frames 300": "--frames 3"}
#: Exit code of a command whose back end is absent: skipped, and said.
BACKEND_ABSENT = 4


@dataclass
class Example:
    page: str
    line: int
    language: str
    text: str


def examples(root: Path) -> Iterator[Example]:
    for page in [root / "README.md", root / "CONTRIBUTING.md", *sorted((root / "docs").glob("*.md"))]:
        lines = page.read_text().splitlines()
        begin = None
        for i, line in enumerate(lines):
            if not line.startswith("```"):
                continue
            if begin is None:
                begin = i
            else:
                yield Example(page.relative_to(root).as_posix(), begin + 2, lines[begin][3:].strip(), "\n".join(lines[begin + 1 : i]))
                begin = None


def stripped(text: str) -> list[str]:
    return [line.strip() for line in text.splitlines() if line.strip()]


def stands_in(text: str, files: list[Path]) -> bool:
    """Are its lines, blank ones and indentation apart, lines that follow each other in one of the files?"""
    wanted = stripped(text)
    for file in files:
        lines = stripped(file.read_text())
        if any(lines[i : i + len(wanted)] == wanted for i in range(len(lines) - len(wanted) + 1)):
            return True
    return False


class Shell:
    """Lines of shell: run, or looked at."""

    def __init__(self, root: Path, command: Path, folder: Path) -> None:
        self.root, self.folder = root, folder
        binaries = folder / "bin"
        binaries.mkdir()
        (binaries / "swarmfit").symlink_to(command)
        camera = binaries / "camera-driver"
        camera.write_text("#!/bin/sh\nls frames/*.pcd\n")
        camera.chmod(0o755)
        self.path = f"{binaries}:/usr/local/bin:/usr/bin:/bin"
        presets = json.loads((root / "CMakePresets.json").read_text())
        kinds = ("configurePresets", "buildPresets", "testPresets")
        self.presets = {preset["name"] for kind in kinds for preset in presets[kind] if not preset.get("hidden")}
        self.options = set(re.findall(r"\b(?:option|set)\((\w+)", (root / "CMakeLists.txt").read_text()))
        self.packages = (root / "tools/setup.sh").read_text()
        self.looks: list[tuple[str, Callable[[str], str]]] = [
            (r"tools/\S+", self._tool),
            (r"cmake|ctest|cpack", self._cmake),
            (r"apt-get install", self._packages),
            (r"python3 -m venv|venv/bin/|npm ci --prefix report|node report/|git |cd ", self._files),
            (r"build/planes/planes|swarmfit_", lambda _: ""),
        ]

    def run(self, line: str) -> str:
        """What is wrong with it; empty: nothing."""
        for old, new in {**PLACEHOLDERS, **SHORTER}.items():
            line = re.sub(rf"(?<![\w/]){re.escape(old)}(?![\w/])", new, line)
        done = subprocess.run(
            ["bash", "-c", f"set -o pipefail; {line}"], cwd=self.folder, env={"PATH": self.path, "HOME": str(self.folder)},
            capture_output=True, text=True, timeout=300,
        )
        if done.returncode == BACKEND_ABSENT and "--backend" in line:
            print(f"    skipped: {done.stderr.strip()}")
            return ""
        if "--report" in line and "this build cannot write one" in done.stderr:
            print(f"    skipped: {done.stderr.strip()}")
            return ""
        return "" if done.returncode == 0 else f"ended with {done.returncode}: {done.stderr.strip()}"

    def look(self, line: str) -> str:
        for pattern, check in self.looks:
            if re.match(pattern, line):
                return check(line)
        return "is neither run nor known"

    def _tool(self, line: str) -> str:
        script, *arguments = line.split()
        if not (self.root / script).is_file():
            return f"no file {script}"
        text = (self.root / script).read_text()
        absent = [a for a in arguments if a.startswith("--") and a not in text and "option...]" not in text]
        return f"{script} knows no {' '.join(absent)}" if absent else ""

    def _cmake(self, line: str) -> str:
        named = set(re.findall(r"--preset (\S+)", line))
        options = {o for o in re.findall(r"-D(\w+)=", line) if not o.startswith("CMAKE_")}
        absent = sorted(named - self.presets) + sorted(options - self.options)
        return f"no {', '.join(absent)} in CMakePresets.json or CMakeLists.txt" if absent else ""

    def _packages(self, line: str) -> str:
        absent = [p for p in line.split()[2:] if not p.startswith("-") and p not in self.packages and p != "./packages/swarmfit_*.deb"]
        return f"tools/setup.sh has no {', '.join(absent)}" if absent else ""

    def _files(self, line: str) -> str:
        named = re.findall(r"\b(?:samples|report|tools|python)/\S+", line)
        absent = [n for n in named if not (self.root / n).exists() and n != "report/"]
        return f"no file {', '.join(absent)}" if absent else ""


def commands(text: str) -> Iterator[str]:
    """Lines without their comments; && parts them, unless swarmfit's own output is piped."""
    joined = re.sub(r"\\\n\s*", " ", text)
    for line in joined.splitlines():
        line = re.sub(r"(^|\s+)#\s.*$", "", line).strip()
        if line:
            yield from (part.strip() for part in line.split("&&"))


def check_shell(example: Example, shell: Shell) -> Iterator[str]:
    for line in commands(example.text):
        runs = re.match(r"swarmfit |camera-driver ", line)
        print(f"  {'run ' if runs else 'seen'} {example.page}:{example.line}  {line}")
        wrong = shell.run(line) if runs else shell.look(line)
        if wrong:
            yield f"{example.page}:{example.line}: {line}: {wrong}"


def check(root: Path, command: Path) -> list[str]:
    compiled = [root / "tests/snippets_test.cpp", *sorted((root / "samples").rglob("*.cpp"))]
    built = [root / "samples/quick_start/CMakeLists.txt", root / "tests/install/outside/CMakeLists.txt"]
    errors = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        inputs.write_all(folder)
        shell = Shell(root, command, folder)
        for example in examples(root):
            files = {"cpp": compiled, "cmake": built}.get(example.language)
            if files and not stands_in(example.text, files):
                places = ", ".join(f.relative_to(root).as_posix() for f in files)
                errors.append(f"{example.page}:{example.line}: these lines are in none of {places}")
            if example.language == "sh":
                errors += check_shell(example, shell)
    return errors


def main() -> int:
    command = shutil.which(sys.argv[2])
    if command is None:
        print(f"no command {sys.argv[2]}", file=sys.stderr)
        return 1
    errors = check(Path(sys.argv[1]).resolve(), Path(command).resolve())
    for error in errors:
        print(error, file=sys.stderr)
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
