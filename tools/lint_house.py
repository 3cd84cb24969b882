"""Check rules of this project that no other tool knows, and print file, line and reason for each breach.

    python tools/lint_house.py

* The engine (``labcourse/``) names no question, quantity or part of this laboratory, and no package names the courses
  that tests make.
* The import rule "library" lists all rooms of the laboratory that it is for.
* Code that the notebooks recommend takes no name that their first cells bind.
* A quick run leaves out what tests are marked with, and a test that starts a browser gets its marker.
* A regular expression of the engine that students' text may meet is in the list of ``labcourse.patterns``.
"""

from __future__ import annotations

import ast
import io
import json
import re
import sys
import tokenize
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "helpers")]

import marks  # noqa: E402
import run_tests  # noqa: E402

from rotflex.course.questions import CATALOGUE  # noqa: E402

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]
CONTRACTS = {contract["id"]: contract for contract in PROJECT["importlinter"]["contracts"]}

# --- neutral words ---

READ = (".py", ".js", ".css", ".html")
#: Besides the catalogue's quantities.
PARTS = {"servo", "SRV02", "joint", "stiffness", "deflection", "torque", "theta", "workbook", "rotflex"}
NEW_COURSE = "labcourse/grading/new/template/"  #: a course of its own plant, with quantities of its own
MADE_COURSES = re.compile(r"springlab|spring-course|01_spring")
#: Files with versions of a library that look like questions.
VERSIONS = {
    "labcourse/run/inside/private_interfaces.py": ("2.6", "2.7", "3.10", "3.11"),
    "labcourse/grading/release/student_course.py": ("3.11",),
    "labcourse/grading/release/student_notebooks.py": ("4.5",),
    "labcourse/run/skippable_cells.py": ("3.12",),
}


def _whole(words: Iterable[str]) -> str:
    return "|".join(map(re.escape, sorted(words, key=len, reverse=True)))


def _quantities() -> set[str]:
    """Collect symbols, channels and units of the course, and names of its parts that are written like a symbol."""
    parts = [part for question in CATALOGUE.everything.values() for part in question.parts]
    given = {name for part in parts for name in (*part.symbols, *part.channels, *part.units)}
    asked = {part.name for part in parts if part.kind in ("number", "matrix", "poles", "expression")}
    return (given | {name for name in asked if "_" in name}) - {"a", "b"}  # they are words, too


#: No attributes, and no opacity as matplotlib has it: ``alpha=0.3``.
NAMES = re.compile(rf"(?<![\w.])(?:{_whole(_quantities() | PARTS)})(?!\w|=[\d.])")
#: No part of another number or version, as in ``>=2.1``. What is below 1 is a question only in quotation marks.
_QUOTED = {number for number in CATALOGUE.everything if number.startswith("0.")}
NUMBERS = re.compile(
    rf"(?<![\w.<>=])(?:{_whole(set(CATALOGUE.everything) - _QUOTED)})(?!\w|\.\d)"
    rf"|(?<=[\"'`])(?:{_whole(_QUOTED)})(?=[\"'`])"
)


def words_of_the_course(text: str, python: bool = True) -> Iterator[tuple[int, str]]:
    """Find questions and quantities of this course in a text, each with its line."""
    numbered = _without_numbers(text) if python else text
    for row, (line, without) in enumerate(zip(text.splitlines(), numbered.splitlines(), strict=True), 1):
        yield from ((row, word) for word in (*NAMES.findall(line), *NUMBERS.findall(without)))


def _without_numbers(text: str) -> str:
    """Blank the numbers of Python's source: 0.1 is no question there, and "0.1" in a string is."""
    lines = text.splitlines()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.NUMBER:
            (row, start), (_, end) = token.start, token.end
            lines[row - 1] = lines[row - 1][:start] + " " * (end - start) + lines[row - 1][end:]
    return "\n".join(lines)


def neutral() -> Iterator[str]:
    """Find words of this laboratory where any course is served, and of the tests' courses in the packages."""
    packages = [path for name in ("labcourse", "rotflex") for path in (ROOT / name).rglob("*") if path.suffix in READ]
    for path in sorted(packages):
        name, text = path.relative_to(ROOT).as_posix(), path.read_text(encoding="utf-8")
        for found in MADE_COURSES.finditer(text):
            yield f"{name}:{text.count(chr(10), 0, found.start()) + 1}: {found[0]!r} is of a course made for tests."
        if name.startswith("labcourse/") and not name.startswith(NEW_COURSE):
            for row, word in words_of_the_course(text, path.suffix == ".py"):
                if word not in VERSIONS.get(name, ()):
                    yield f"{name}:{row}: {word!r} is of this laboratory, and this file serves any course."


def library() -> Iterator[str]:
    """Find rooms that the import rule "library" lacks, or that are gone: import-linter demands no whole list there."""
    contract = CONTRACTS["library"]
    named = {name.removeprefix("rotflex.") for name in contract["source_modules"]}
    floors = (re.split(r"[|:]", floor) for floor in CONTRACTS["laboratory"]["layers"])
    wanted = {room.strip() for floor in floors for room in floor} - {"__main__", "cli", "course", "widgets"}
    if wanted != named:
        yield f"pyproject.toml: the import rule 'library' lacks a room or has one too many: {sorted(wanted ^ named)}."


# --- notebooks ---

_OPENED = re.compile(r"with lab\.bench\([^)]*\) as (\w+)")


def recommended_names() -> Iterator[str]:
    """Find names that recommended code would take from the cells that every notebook begins with."""
    notebooks = sorted((ROOT / "solutions").glob("*.ipynb"))
    bound: set[str] = set()
    for path in notebooks:
        cells = {cell["id"]: "".join(cell["source"]) for cell in json.loads(path.read_text("utf-8"))["cells"]}
        for node in ast.walk(ast.parse(cells.get("parameters", "") + "\n" + cells.get("setup", ""))):
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                bound.add(node.id)
            bound.update(alias.asname or alias.name for alias in getattr(node, "names", ()))
    for path in (*(ROOT / "rotflex").rglob("*.py"), *notebooks):
        for row, line in enumerate(path.read_text("utf-8").splitlines(), 1):
            for name in bound.intersection(_OPENED.findall(line)):
                yield f"{path.relative_to(ROOT)}:{row}: {name!r} is bound by the first cells of the notebooks."


# --- markers ---


def markers() -> Iterator[str]:
    """Find markers that a quick run does not know, and tests that start a browser without being given its marker."""
    declared = {line.partition(":")[0] for line in PROJECT["pytest"]["ini_options"]["markers"]}
    given = {"slow", *marks.PROGRAMS.values(), *marks.BY_FIXTURE.values(), *marks.BY_HELPER.values()}
    if given != set(run_tests.LEFT_OUT):
        yield f"tools/run_tests.py: LEFT_OUT is {run_tests.LEFT_OUT}, and tests are given {sorted(given)}."
    if missing := {*given, run_tests.SCHEDULED} ^ declared:
        yield f"pyproject.toml: markers that are declared and markers that are used differ in {sorted(missing)}."
    for path in sorted((ROOT / "tests").rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        marked = re.search(
            r"^(import browser|from browser import|pytestmark = pytest\.mark\.(slow|browser))", text, re.M
        )
        if "playwright.sync_api" in text and path.name != "browser.py" and not marked:
            yield f"{path.relative_to(ROOT)}: use tests/helpers/browser.py, by which tests get the marker 'browser'."


# --- regular expressions ---

#: Modules and folders (with "/" at the end) that use the module ``re`` as they like → why no text of a student's can
#: cost others time there.
NO_STUDENTS_TEXT = {
    "labcourse/patterns.py": "it is the list",
    "labcourse/command_line.py": "names of files in the student's own folder, at home",
    "labcourse/report/": "a report is made at home, of the student's own text",
    "labcourse/scene/": "explorers run at home, in the student's own kernel",
    "labcourse/run/place.py": "the course bar is at home",
    "labcourse/run/inside/private_interfaces.py": "versions of installed libraries",
    "labcourse/grading/course_check.py": "the course's own texts",
    "labcourse/grading/rehearse.py": "the course's own texts",
    "labcourse/grading/gradebook/database.py": "the address of the gradebook",
    "labcourse/grading/gradebook/persons.py": "a name of the roster as it is written, without repeats",
    "labcourse/grading/gradebook/roster.py": "the instructor's roster",
    "labcourse/grading/isolation/": "what the operating system says of itself",
    "labcourse/grading/new/": "the name of a new course",
    "labcourse/grading/platforms.py": "files of a platform, which the instructor downloads",
    "labcourse/grading/release/": "the course's notebooks",
    "labcourse/grading/scoring/guards.py": "names of hosts, in headers and in the address that the instructor gives",
    "labcourse/grading/scoring/server.py": "the style of the scoring page",
    "labcourse/grading/scoring/start.py": "the address that the instructor gives",
}


def unlisted_patterns() -> Iterator[str]:
    """Find regular expressions that may meet students' text and are not in the list, or only once a function runs."""
    for path in sorted((ROOT / "labcourse").rglob("*.py")):
        name, tree = path.relative_to(ROOT).as_posix(), ast.parse(path.read_text(encoding="utf-8"))
        if name.startswith(tuple(NO_STUDENTS_TEXT)):
            continue
        functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.Lambda)]
        late = {id(node) for function in functions for node in ast.walk(function)}
        for node in ast.walk(tree):
            called = ast.unparse(node.func) if isinstance(node, ast.Call) else ""
            direct = called.startswith("re.") or (isinstance(node, ast.ImportFrom) and node.module == "re")
            if direct or (called == "pattern" and id(node) in late):
                yield (
                    f"{name}:{node.lineno}: compile this with labcourse.patterns.pattern, outside of functions, so "
                    "that a test tries it on hostile text; or say in NO_STUDENTS_TEXT why it needs none."
                )


def main() -> int:
    """Print all breaches; return 1 if there are any."""
    found = [
        breach for check in (neutral, library, recommended_names, markers, unlisted_patterns) for breach in check()
    ]
    print(*found or ["no breach"], sep="\n")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
