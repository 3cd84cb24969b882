"""Which tests concern a line: those that execute it, and those of the folder that mirrors its own.

What a module does when it is imported, no test executes: there, the tests count that execute what names the thing, or
else all that execute something of the file. Nor is it known what is executed in other processes.
"""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
SOURCES = ("rotflex", "solutions")
#: Never run: a browser's tests, and those that take long and see what happens in other processes.
LEFT_OUT = (
    "tests/whole",
    "tests/courses",
    "tests/test_distributions.py",
    "tests/test_marks.py",
    "tests/widgets/test_explorers_browser.py",
    "tests/instructor/test_cluster.py",
    "tests/instructor/test_crash.py",
    "tests/instructor/release/test_released_course.py",
    "tests/instructor/running/test_inside_equivalence.py",
)
IGNORED = [f"--ignore={name}" for name in LEFT_OUT]
_PARTS = (("tests/instructor",), ("tests", "--ignore=tests/instructor"))  # measured side by side
_SETTINGS = "[run]\nsource = rotflex, solutions\ncore = ctrace\n"


@dataclass(frozen=True)
class TestMap:
    """What is known of the tests.

    Attributes
    ----------
    executed : file → line → tests that execute it
    seconds : test → what it takes; of those that pass
    failing : those that do not, without any fault
    """

    executed: Mapping[str, Mapping[int, frozenset[str]]]
    seconds: Mapping[str, float]
    failing: tuple[str, ...]

    def quickest_first(self, tests: Iterable[str]) -> list[str]:
        """Those that pass without a fault, the quickest first."""
        return sorted((one for one in tests if one in self.seconds), key=lambda one: (self.seconds[one], one))

    def too_slow_or_failing(self, folders: Iterable[str], done: Iterable[str], most: float) -> list[str]:
        """Tests of some files and folders that fail anyway, were run, or take the longest, beyond so many seconds."""
        within = tuple(folders)
        left_out = [*self.failing, *done]
        passed_over, total = set(left_out), 0.0
        for test in self.quickest_first(one for one in self.seconds if one.startswith(within)):
            if test not in passed_over:
                total += self.seconds[test]
                if total > most:
                    left_out.append(test)
        return left_out

    def executing(self, file: str, first: int, last: int, tree: Path) -> set[str]:
        """Tests that execute a line, or what becomes of it."""
        lines = self.executed.get(file, {})
        found = {test for line in range(first, last + 1) for test in lines.get(line, ())}
        if found:
            return found
        names = set(_bound_at((tree / file).read_text(encoding="utf-8"), first))
        for other, at in _named(tree).items():
            for name, place in at:
                if name in names:
                    found |= self.executed.get(other, {}).get(place, frozenset())
        return found or {test for tests in lines.values() for test in tests}


def mirrored(file: str, tree: Path) -> list[str]:
    """Test files and folders that concern a file, by its place."""
    path = Path(file)
    parts = path.parts[1:] if path.parts[0] == "rotflex" else path.parts
    folder = tree / "tests" / Path(*parts[:-1])
    while not folder.is_dir():
        folder = folder.parent
    stem = path.stem.removeprefix("test_")
    own = sorted(folder.glob(f"test_*{stem}*.py"))
    inner = (
        [folder] if folder not in (tree / "tests", tree / "tests" / "instructor", tree / "tests" / "courseware") else []
    )
    more = [tree / "tests" / "test_bounds.py"]
    more += [tree / "tests" / "instructor" / "test_course_check.py"] if path.parts[0] == "solutions" else []
    return [one.relative_to(tree).as_posix() for one in (*own, *inner, *more) if one.exists()]


def measure(tree: Path, folder: Path, command: list[str], environment: dict[str, str]) -> None:
    """Run the tests once, and write down in a folder which executes what, and what it takes."""
    folder.mkdir(parents=True, exist_ok=True)
    settings = folder / "settings"
    settings.write_text(_SETTINGS, encoding="utf-8")
    running = []
    for number, part in enumerate(_PARTS):
        files = {"FAULTS_TIMES": f"{folder / f'times-{number}.json'}", "COVERAGE_FILE": f"{folder / f'lines-{number}'}"}
        measuring = [sys.executable, "-m", "coverage", "run", f"--rcfile={settings}", *command, *IGNORED, *part]
        running.append(subprocess.Popen(measuring, cwd=tree, env=environment | files))
    for one in running:
        one.wait()
    (folder / "tree").write_text(str(tree), encoding="utf-8")  # last: now it is whole


def read(folder: Path) -> TestMap:
    """What :func:`measure` has written down."""
    from coverage import CoverageData

    tree = Path((folder / "tree").read_text(encoding="utf-8"))
    times: dict[str, dict[str, Any]] = {}
    executed: dict[str, dict[int, frozenset[str]]] = defaultdict(dict)
    for number in range(len(_PARTS)):
        times |= json.loads((folder / f"times-{number}.json").read_text(encoding="utf-8"))
        data = CoverageData(str(folder / f"lines-{number}"))
        data.read()
        for measured in data.measured_files():
            lines = executed[Path(measured).relative_to(tree).as_posix()]
            for line, tests in data.contexts_by_lineno(measured).items():
                lines[line] = lines.get(line, frozenset()) | frozenset(filter(None, tests))
    known = {file: {line: tests for line, tests in lines.items() if tests} for file, lines in executed.items()}
    seconds = {test: one["seconds"] for test, one in times.items() if "outcome" not in one and "seconds" in one}
    return TestMap(known, seconds, tuple(test for test, one in times.items() if one.get("outcome") == "failed"))


def _bound_at(source: str, line: int) -> Iterator[str]:
    """Names that the outermost statements around a line bind."""
    inner = list(ast.parse(source).body)
    while inner:
        around = [one for one in inner if one.lineno <= line <= (one.end_lineno or one.lineno)]
        inner = []
        for one in around:
            if isinstance(one, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
                yield one.name
                inner = one.body if isinstance(one, ast.ClassDef) else []
            else:
                yield from (
                    below.id
                    for below in ast.walk(one)
                    if isinstance(below, ast.Name) and isinstance(below.ctx, ast.Store)
                )


@cache
def _named(tree: Path) -> Mapping[str, list[tuple[str, int]]]:
    """File → names that are used in it, and where."""
    found: dict[str, list[tuple[str, int]]] = defaultdict(list)
    for folder in SOURCES:
        for path in sorted((tree / folder).rglob("*.py")):
            name = path.relative_to(tree).as_posix()
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
                    found[name].append((node.id, node.lineno))
                elif isinstance(node, ast.Attribute):
                    found[name].append((node.attr, node.lineno))
    return found
