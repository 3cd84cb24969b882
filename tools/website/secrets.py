"""What must not be in the public site: what the solutions and the instructor's package say, and a student's copy does not.

A secret is a run of tokens: so many words and signs after each other, white space aside. What students are handed out
anyway is none. Numbers are looked at one by one: those of several digits that solutions print.
"""

from __future__ import annotations

import ast
import html
import io
import json
import re
import tokenize
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from website.staging import DOCS, ROOT

RUN = 12  #: tokens; shorter runs are found in any two texts on the same matter
DIGITS = 4  #: significant ones that make a number telling
PAGES = (".html", ".js", ".txt", ".json", ".svg", ".xml", ".inv")

_TOKEN = re.compile(r"[^\W\d_]+|\d+(?:\.\d+)?|[^\w\s]")
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
    runs : run of tokens → where it stands
    numbers : number, as its significant digits → where it stands
    """

    runs: dict[str, str]
    numbers: dict[str, str]

    @classmethod
    def of_the_course(cls) -> Secrets:
        """All of this course's."""
        public = "\n".join(text for _origin, text in _handed_out())
        known, known_numbers = set(runs(public)), set(numbers(public))
        secret: dict[str, str] = {}
        told: dict[str, str] = {}
        for origin, text in _kept_back():
            for run in runs(text):
                if run not in known:
                    secret.setdefault(run, origin)
        for origin, text in _results():
            for number in numbers(text):
                if number not in known_numbers:
                    told.setdefault(number, origin)
        return cls(secret, told)

    def found_in(self, site: Path) -> list[Found]:
        """What the files of a site give away: of each file and origin, the first."""
        found: dict[tuple[str, str], Found] = {}
        for path in sorted(path for path in site.rglob("*") if path.suffix in PAGES and path.name != "mathjax.js"):
            page = path.relative_to(site).as_posix()
            text = path.read_text(encoding="utf-8", errors="replace")
            text = html.unescape(_TAG.sub("", text)) if path.suffix == ".html" else text
            for run in runs(text):
                if run in self.runs:
                    found.setdefault((page, self.runs[run]), Found(page, self.runs[run], run))
            for number in numbers(text) if path.suffix == ".html" else ():
                if number in self.numbers:
                    origin = f"{self.numbers[number]} (a number)"
                    found.setdefault((page, origin), Found(page, origin, number))
        return list(found.values())


def runs(text: str) -> Iterator[str]:
    """All runs of tokens in a text."""
    tokens = _TOKEN.findall(text)
    for at in range(len(tokens) - RUN + 1):
        run = tokens[at : at + RUN]
        # Rules and rows of zeros tell nothing.
        if sum(token[0].isalnum() for token in run) >= RUN // 2 - 1 and len(set(run)) > RUN // 2:
            yield " ".join(run)


def numbers(text: str) -> Iterator[str]:
    """The telling numbers in a text, as their significant digits."""
    for found in _NUMBER.findall(text):
        digits = re.sub(r"[eE].*|\.", "", found).lstrip("0")
        if len(digits) >= DIGITS and digits.strip("0") and len(set(digits)) > 1:
            yield digits


# --- where texts come from --------------------------------------------------------------------------------------------


def _cells(path: Path) -> Iterator[dict[str, object]]:
    yield from json.loads(path.read_text(encoding="utf-8"))["cells"]


def _source(cell: dict[str, object]) -> str:
    source = cell["source"]
    return source if isinstance(source, str) else "".join(source)  # type: ignore[arg-type]


def _outputs(cell: dict[str, object]) -> Iterator[str]:
    for output in cell.get("outputs", ()):  # type: ignore[attr-defined]
        yield "".join(output.get("text", ""))
        for kind in ("text/plain", "text/markdown"):
            yield "".join(output.get("data", {}).get(kind, ""))


def _handed_out() -> Iterator[tuple[str, str]]:
    """What each student gets."""
    for path in sorted((ROOT / "notebooks").glob("*.ipynb")):
        yield path.name, "\n".join(_source(cell) for cell in _cells(path))
    for path in sorted((ROOT / "rotflex").rglob("*.py")):
        if "instructor" not in path.relative_to(ROOT).parts:
            yield path.name, path.read_text(encoding="utf-8")
    yield "course.toml", (ROOT / "solutions" / "course.toml").read_text(encoding="utf-8")


def _kept_back() -> Iterator[tuple[str, str]]:
    """What no student gets, as texts."""
    for path in sorted((ROOT / "solutions").glob("*.ipynb")):
        for cell in _cells(path):
            source = _source(cell)
            mine = path.name.startswith("9") or "instructor" in cell["metadata"].get("tags", ())  # type: ignore[attr-defined]
            for text in [source] if mine else _SOLUTION.findall(source):
                yield f"solutions/{path.name}, cell {cell.get('id')}", text
    for path in sorted((ROOT / "solutions").glob("*.*")):
        if path.suffix in (".py", ".toml") and path.name not in _HARMLESS:
            text = path.read_text(encoding="utf-8")
            yield f"solutions/{path.name}", code(text) if path.suffix == ".py" else text
    for path in sorted((ROOT / "rotflex" / "instructor").rglob("*.py")):
        yield path.relative_to(ROOT).as_posix(), code(path.read_text(encoding="utf-8"))
    derivation = (DOCS / "derivation.html").read_text(encoding="utf-8")
    yield "docs/derivation.html", html.unescape(_TAG.sub("", derivation))


def _results() -> Iterator[tuple[str, str]]:
    """What solutions print: numbers of the very bench that the chapters show."""
    for path in sorted((ROOT / "solutions").glob("[01]*.ipynb")):
        for cell in _cells(path):
            source = _source(cell)
            yield f"solutions/{path.name}, cell {cell.get('id')}", "\n".join([*_SOLUTION.findall(source), *_outputs(cell)])


def code(source: str) -> str:
    """A module without its docstrings, imports and comments: what it does."""
    tree = ast.parse(source)
    left_out: set[int] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            left_out.update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
        elif isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            first = node.body[0] if node.body else None
            if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant) and isinstance(first.value.value, str):
                left_out.update(range(first.lineno, (first.end_lineno or first.lineno) + 1))
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.body:
                # The head is in the reference.
                left_out.update(range(node.lineno, node.body[0].lineno))
    tokens: Iterable[tokenize.TokenInfo] = tokenize.generate_tokens(io.StringIO(source).readline)
    kept = (one for one in tokens if one.start[0] not in left_out and one.type != tokenize.COMMENT)
    return " ".join(one.string for one in kept)
