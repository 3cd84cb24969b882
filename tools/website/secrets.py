"""What must not be in the public site: what the solutions and the instructor's package say, and a student's copy not.

A secret is a run of tokens: so many words and signs after each other, white space aside; of a solution in code, each
line as well. What students are handed out anyway is none, and neither is what their notebooks show before an answer.
Numbers are looked at one by one: those of several digits that solutions print.

Of the instructor's guide and the scoring notebook (91, 92) the code and its results are secrets. Their text says much
that other pages may say; they are no part of the public site, and neither is any other page that ``staging`` names.
"""

from __future__ import annotations

import ast
import html
import io
import json
import re
import tokenize
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from website.staging import DOCS, ROOT, is_for_instructors

RUN = 12  #: tokens; shorter runs are found in any two texts on the same matter
LINE = 7  #: tokens that a line of a solution has at least, to be looked for by itself
DIGITS = 4  #: significant ones that make a number telling
PAGES = (".html", ".js", ".txt", ".json", ".svg", ".xml", ".inv")

_TOKEN = re.compile(r"[^\W\d_]+|\d+(?:\.\d+)?|[^\w\s*`#]")  # without what is Markdown in one text and gone in another
_FORMULA = re.compile(r"\$|\\[()\[\]]")  # where one begins and ends, in a notebook and on a page
_NUMBER = re.compile(r"(?<![\w.])\d+\.?\d*(?:[eE][-+]?\d+)?(?![\w])")
_SOLUTION = re.compile(r"(?:###|<!--) BEGIN SOLUTION(.*?)(?:###|<!--) END SOLUTION", re.DOTALL)
_TAG = re.compile(r"<(script|style)\b.*?</\1>|<[^>]*>", re.DOTALL)
#: Of the course's folder, what tells nothing of what is right.
_HARMLESS = ("course.toml", "outcomes.toml", "sheets.toml", "conftest.py", "__init__.py", "course.py")


@dataclass(frozen=True)
class Found:
    """A secret on a page."""

    page: str
    origin: str
    text: str

    def __str__(self) -> str:
        return f"{self.page}: gives away what is in {self.origin}: {self.text}"


@dataclass(frozen=True)
class Secrets:
    """What must not be told.

    Attributes
    ----------
    runs : run of tokens → where it stands; of RUN tokens, and lines of fewer
    numbers : number, as its significant digits → where it stands
    """

    runs: dict[str, str]
    numbers: dict[str, str]

    def found_in(self, site: Path) -> list[Found]:
        """What the files of a site give away: of each file and origin, the first."""
        found: dict[tuple[str, str], Found] = {}
        lengths = {run.count(" ") + 1 for run in self.runs}
        for path in sorted(path for path in site.rglob("*") if path.suffix in PAGES and path.name != "mathjax.js"):
            page = path.relative_to(site).as_posix()
            text = path.read_text(encoding="utf-8", errors="replace")
            text = html.unescape(_TAG.sub("", text)) if path.suffix == ".html" else text
            for run in (run for length in lengths for run in runs(text, length)):
                if run in self.runs:
                    found.setdefault((page, self.runs[run]), Found(page, self.runs[run], run))
            for number in numbers(text) if path.suffix == ".html" else ():
                if number in self.numbers:
                    origin = f"{self.numbers[number]} (a number)"
                    found.setdefault((page, origin), Found(page, origin, number))
        return list(found.values())


def of_the_course(chapters: Iterable[Mapping[str, Any]]) -> Secrets:
    """All of this course's.

    Parameters
    ----------
    chapters : the student notebooks as they were run before any answer
    """
    public = "\n".join([*_handed_out(), *(text for notebook in chapters for text in _shown(notebook))])
    known_numbers = set(numbers(public))
    known = {length: set(runs(public, length)) for length in range(LINE, RUN + 1)}
    secret: dict[str, str] = {}
    told: dict[str, str] = {}
    for origin, text in _kept_back():
        for run in runs(text):
            if run not in known[RUN]:
                secret.setdefault(run, origin)
    for origin, line in _solution_lines():
        count = len(_TOKEN.findall(line))
        if LINE <= count < RUN:
            secret.update({run: origin for run in runs(line, count) if run not in known[count]})
    for origin, text in _results():
        for number in numbers(text):
            if number not in known_numbers:
                told.setdefault(number, origin)
    return Secrets(secret, told)


def runs(text: str, length: int = RUN) -> Iterator[str]:
    """All runs of so many tokens in a text."""
    tokens = _TOKEN.findall(_FORMULA.sub(" ", text))
    for at in range(len(tokens) - length + 1):
        run = tokens[at : at + length]
        # Rules and rows of zeros tell nothing.
        if len(set(run)) > length // 2 and sum(token[0].isalnum() for token in run) >= length // 2 - 1:
            yield " ".join(run)


def numbers(text: str) -> Iterator[str]:
    """The telling numbers in a text, as their significant digits."""
    for found in _NUMBER.findall(text):
        if re.fullmatch(r"(?:19|20)\d\d", found):
            continue  # a year
        whole = f"{float(found):.0f}" if "e" in found.lower() else found
        digits = whole.replace(".", "").lstrip("0")
        if len(digits) >= DIGITS and digits.strip("0") and len(set(digits)) > 1:
            yield digits


# --- where texts come from --------------------------------------------------------------------------------------------


def _cells(path: Path) -> Iterator[Mapping[str, Any]]:
    yield from json.loads(path.read_text(encoding="utf-8"))["cells"]


def _source(cell: Mapping[str, Any]) -> str:
    return "".join(cell["source"])


def _shown(notebook: Mapping[str, Any]) -> Iterator[str]:
    for cell in notebook["cells"]:
        yield from _outputs(cell)


def _outputs(cell: Mapping[str, Any]) -> Iterator[str]:
    for output in cell.get("outputs", ()):
        yield "".join(output.get("text", ""))
        for kind in ("text/plain", "text/markdown"):
            yield "".join(output.get("data", {}).get(kind, ""))


def _handed_out() -> Iterator[str]:
    """What each student gets."""
    for path in sorted((ROOT / "notebooks").glob("*.ipynb")):
        yield "\n".join(_source(cell) for cell in _cells(path))
    for path in sorted((ROOT / "rotflex").rglob("*.py")):
        if not is_for_instructors(path.relative_to(ROOT).as_posix()):
            yield path.read_text(encoding="utf-8")
    yield (ROOT / "solutions" / "course.toml").read_text(encoding="utf-8")


def _kept_back() -> Iterator[tuple[str, str]]:
    """What no student gets, as texts."""
    for path in sorted((ROOT / "solutions").glob("*.ipynb")):
        for cell in _cells(path):
            source = _source(cell)
            whole = path.name.startswith("90") or (path.name.startswith("9") and cell["cell_type"] == "code")
            mine = "instructor" in cell["metadata"].get("tags", ()) and not path.name.startswith("9")
            for text in [source] if whole or mine else _SOLUTION.findall(source):
                yield f"solutions/{path.name}, cell {cell.get('id')}", text
            if path.name.startswith("9"):
                yield f"solutions/{path.name}, cell {cell.get('id')}", "\n".join(_outputs(cell))
    for path in sorted((ROOT / "solutions").glob("*.*")):
        if path.suffix in (".py", ".toml") and path.name not in _HARMLESS:
            text = path.read_text(encoding="utf-8")
            yield f"solutions/{path.name}", code(text) if path.suffix == ".py" else text
    for path in sorted((ROOT / "rotflex").rglob("*.py")):
        name = path.relative_to(ROOT).as_posix()
        if is_for_instructors(name):
            yield name, code(path.read_text(encoding="utf-8"), bodies=True)
    derivation = (DOCS / "derivation.html").read_text(encoding="utf-8")
    yield "docs/derivation.html", html.unescape(_TAG.sub("", derivation))


def _solution_lines() -> Iterator[tuple[str, str]]:
    """The lines of code that students are to write."""
    for path in sorted((ROOT / "solutions").glob("[01]*.ipynb")):
        for cell in _cells(path):
            for solution in _SOLUTION.findall(_source(cell)) if cell["cell_type"] == "code" else ():
                for line in solution.split("\n"):
                    yield f"solutions/{path.name}, cell {cell.get('id')}", line.partition("  #")[0]


def _results() -> Iterator[tuple[str, str]]:
    """What solutions print: numbers of the very bench that the chapters show."""
    for path in sorted((ROOT / "solutions").glob("[01]*.ipynb")):
        for cell in _cells(path):
            source = _source(cell)
            yield (
                f"solutions/{path.name}, cell {cell.get('id')}",
                "\n".join([*_SOLUTION.findall(source), *_outputs(cell)]),
            )


def code(source: str, bodies: bool = False) -> str:
    """A module without its docstrings and imports, with its comments. With ``bodies``, what is in functions alone."""
    tree = ast.parse(source)
    kept: set[int] = set() if bodies else set(range(1, source.count("\n") + 2))
    for node in ast.walk(tree):
        if bodies and isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            kept.update(range(node.body[0].lineno, (node.end_lineno or node.lineno) + 1))
    for node in ast.walk(tree):
        constant = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
        if isinstance(node, ast.Import | ast.ImportFrom) or constant:
            kept.difference_update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    tokens = tokenize.generate_tokens(io.StringIO(source).readline)
    return " ".join(one.string for one in tokens if one.start[0] in kept)
