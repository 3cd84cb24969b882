"""Count lines of code, and fail if there are more than before.

    python tools/count_lines.py

Lines of code are those with anything on them but comments and docstrings. A string that is no docstring counts, except
for its blank lines. Modules are files ``*.py`` of the packages, empty ones included; of tests, each line counts.

A room's target is where it is to end. A room above it prints by how much; the sum must not grow (:data:`MOST`). Longer
lines, missing docstrings and code in data files do not make a room smaller.
"""

from __future__ import annotations

import ast
import io
import sys
import tokenize
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("rotflex", "labcourse")

#: The most lines of code of all rooms: lower it with each landing that makes them fewer.
MOST = 35_601
#: Room → the lines of code that it should come to, and its files. Where several patterns match, the longest one
#: decides: a file that is named belongs elsewhere than the rest of its folder.
ROOMS: dict[str, tuple[int, tuple[str, ...]]] = {
    "laboratory core, figures, greybox, model": (
        3500,
        (
            "rotflex/*.py",
            "rotflex/figures/**/*.py",
            "rotflex/greybox/**/*.py",
            "rotflex/signals/**/*.py",
        ),
    ),
    "hil, commissioning, doctor, bench commands": (
        3100,
        (
            "rotflex/bench_commands.py",
            "rotflex/commissioning/**/*.py",
            "rotflex/hil/**/*.py",
        ),
    ),
    "recordings of a real bench": (200, ("rotflex/course/plausible.py", "rotflex/course/recordings_folder.py")),
    "widgets, scene, the course": (
        4000,
        (
            "labcourse/scene/**/*.py",
            "rotflex/course/**/*.py",
            "rotflex/widgets/**/*.py",
        ),
    ),
    "answers, session, files of a course": (
        2700,
        (
            "labcourse/*.py",
            "labcourse/answers/**/*.py",
            "labcourse/jupyter/**/*.py",
        ),
    ),
    "run": (1700, ("labcourse/run/**/*.py",)),
    "report": (450, ("labcourse/report/**/*.py",)),
    "running, the warm process": (850, ("labcourse/grading/running/**/*.py", "labcourse/run/inside/**/*.py")),
    "intake": (1000, ("labcourse/grading/intake/**/*.py",)),
    "gradebook": (1050, ("labcourse/grading/gradebook/**/*.py",)),
    "marking": (1050, ("labcourse/grading/marking/**/*.py",)),
    "isolation": (850, ("labcourse/grading/isolation/**/*.py",)),
    "reports, scoring": (1800, ("labcourse/grading/reports/**/*.py", "labcourse/grading/scoring/**/*.py")),
    "outcomes, overview, to do, platforms, accounts": (
        1250,
        (
            "labcourse/grading/accounts.py",
            "labcourse/grading/erasure.py",
            "labcourse/grading/feedback_zip.py",
            "labcourse/grading/outcomes.py",
            "labcourse/grading/overview.py",
            "labcourse/grading/platforms.py",
            "labcourse/grading/sheets.py",
            "labcourse/grading/todo.py",
        ),
    ),
    "settings, release, commands, rest": (
        2500,
        (
            "rotflex/cli.py",
            "labcourse/command_line.py",
            "labcourse/courses.py",
            "labcourse/lab_command.py",
            "labcourse/program.py",
            "labcourse/grading/*.py",
            "labcourse/grading/new/**/*.py",
            "labcourse/grading/release/**/*.py",
        ),
    ),
}

_LAYOUT = (
    tokenize.COMMENT,
    tokenize.DEDENT,
    tokenize.ENCODING,
    tokenize.ENDMARKER,
    tokenize.INDENT,
    tokenize.NEWLINE,
    tokenize.NL,
)
_WITH_DOCSTRING = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


def code_lines(source: str) -> int:
    """Count the lines of a module that are neither blank, nor comments, nor docstrings.

    Raises
    ------
    SyntaxError
        If the text is no Python.
    """
    docstrings = set(_docstrings(ast.parse(source)))
    text = source.splitlines()
    counted: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type not in _LAYOUT and token.start not in docstrings:
            counted.update(range(token.start[0], token.end[0] + 1))
    return sum(1 for number in counted if text[number - 1].strip())


def _docstrings(tree: ast.Module) -> Iterator[tuple[int, int]]:
    """Find line and column where each docstring begins."""
    for node in ast.walk(tree):
        if isinstance(node, _WITH_DOCSTRING) and ast.get_docstring(node, clean=False) is not None:
            yield node.body[0].lineno, node.body[0].col_offset


def rooms_of_modules(root: Path, rooms: Mapping[str, tuple[int, Sequence[str]]]) -> dict[Path, str | None]:
    """Find the room of each module of the packages; None where no pattern matches.

    Parameters
    ----------
    root : folder of the repository
    rooms : room → target and patterns
    """
    found: dict[Path, str | None] = {path: None for name in PACKAGES for path in sorted((root / name).rglob("*.py"))}
    by_length = sorted(
        (len(pattern), pattern, room) for room, (_target, patterns) in rooms.items() for pattern in patterns
    )
    for _length, pattern, room in by_length:
        found.update(dict.fromkeys(root.glob(pattern), room))
    return found


def main() -> int:
    """Print a row for each room; return 1 if there are more lines than before, or a module in no room."""
    rooms = rooms_of_modules(ROOT, ROOMS)
    wrong = [
        f"{path.relative_to(ROOT)} is in no room of tools/count_lines.py." for path, room in rooms.items() if not room
    ]
    lines: Counter[str | None] = Counter()
    for path, room in rooms.items():
        lines[room] += code_lines(path.read_text(encoding="utf-8"))
    print(f"{'room':<44}{'lines':>8}{'target':>8}{'above':>8}")
    for room, (target, _patterns) in ROOMS.items():
        print(f"{room:<44}{lines[room]:>8}{target:>8}{max(lines[room] - target, 0) or '':>8}")
    print(f"{'sum':<44}{lines.total():>8}{sum(target for target, _patterns in ROOMS.values()):>8}")
    if lines.total() > MOST:
        wrong.append(
            f"{lines.total()} lines of code, and there may be {MOST}. Make them fewer; MOST (tools/count_lines.py) may "
            "be raised only with a reason in the commit."
        )
    tests = sum(len(path.read_text(encoding="utf-8").splitlines()) for path in (ROOT / "tests").rglob("*.py"))
    print(f"{len(rooms)} modules; {tests} lines of tests")
    print(*wrong, sep="\n", end="\n" if wrong else "")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
