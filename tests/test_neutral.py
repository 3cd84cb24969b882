"""What serves any course speaks of no question and of no quantity of this one."""

from __future__ import annotations

import io
import re
import tokenize
import tomllib

import pytest
from checkout import ROOT

from rotflex.workbook.questions import CATALOGUE

CONTRACTS = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]["contracts"]
NEUTRAL = next(contract for contract in CONTRACTS if contract["id"] == "neutral")
FILES = sorted(
    file
    for name in NEUTRAL["source_modules"]
    for place in [ROOT / name.replace(".", "/")]
    for file in (place.rglob("*") if place.is_dir() else [place.with_suffix(".py")])
    if file.suffix in (".py", ".js", ".css", ".html")
)
#: Of the laboratory, though no symbol of the catalogue.
WORDS = {"servo", "SRV02", "stiffness", "deflection", "torque", "workbook"}


def quantities() -> set[str]:
    """Symbols and channels of this course, and names of its parts that are written like a symbol."""
    parts = [part for question in CATALOGUE.everything.values() for part in question.parts]
    given = {name for part in parts for name in (*part.symbols, *part.channels, *part.units)}
    asked = {part.name for part in parts if part.kind in ("number", "matrix", "poles", "expression")}
    return given | {name for name in asked if "_" in name}


def whole(words: set[str]) -> str:
    return "|".join(map(re.escape, sorted(words, key=len, reverse=True)))


#: Not an attribute, nor an opacity as matplotlib has it: ``alpha=0.3``.
NAMES = re.compile(rf"(?<![\w.])(?:{whole(quantities() | WORDS)})(?!\w|=[\d.])")
#: Not a part of another number or version: ``>=2.1``. What is below 1 is a question only where it is quoted.
QUOTED = {number for number in CATALOGUE.everything if number.startswith("0.")}
NUMBERS = re.compile(
    rf"(?<![\w.<>=])(?:{whole(set(CATALOGUE.everything) - QUOTED)})(?!\w|\.\d)|(?<=[\"'`])(?:{whole(QUOTED)})(?=[\"'`])"
)
#: Versions of a library that look like a question.
VERSIONS = {
    "rotflex/instructor/running/inside/private_interfaces.py": ("3.10", "3.11"),
    "rotflex/courseware/run/skippable_cells.py": ("3.12",),
}


def without_numbers(text: str) -> str:
    """Python's source without its numbers: 0.1 is no question there, but "0.1" in a text is."""
    lines = text.splitlines()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.NUMBER:
            (row, start), (_, end) = token.start, token.end
            lines[row - 1] = lines[row - 1][:start] + " " * (end - start) + lines[row - 1][end:]
    return "\n".join(lines)


def found_in(text: str, python: bool = True) -> list[str]:
    """Words of this course, each with its line."""
    numbered = without_numbers(text) if python else text
    both = zip(text.splitlines(), numbered.splitlines(), strict=True)
    return [
        f"line {row}: {word}"
        for row, (line, without) in enumerate(both, 1)
        for word in (*NAMES.findall(line), *NUMBERS.findall(without))
    ]


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.relative_to(ROOT).as_posix())
def test_what_serves_any_course_speaks_of_no_question_and_quantity_of_this_one(file):
    found = found_in(file.read_text(encoding="utf-8"), file.suffix == ".py")
    known = VERSIONS.get(file.relative_to(ROOT).as_posix(), ())
    assert [one for one in found if not one.endswith(known)] == []


def test_the_files_are_those_of_the_general_rooms():
    rooms = {file.relative_to(ROOT / "rotflex").parts[0] for file in FILES}
    assert rooms == {"courseware", "instructor"}
    assert {file.suffix for file in FILES} == {".py", ".js", ".css", ".html"}
    assert len(FILES) > 80


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ('"""As in lab.value("2.12", "K_s")."""', ["K_s", "2.12"]),
        ('number = "Table 2"  # theta', ["theta", "Table 2"]),
        ('units = {"vm": "V"}', ["vm"]),
        ("x = 2.1 + 0.1  # place(0.1, 0.2)", []),
        ('book.get("0.1")', ["0.1"]),
        ("draw(x, alpha=0.3)", []),
        ('needs = ">=3.11", "3.11.2"', []),
        ("item.alpha = alphabet", []),
    ],
)
def test_words_are_found_whole(text, found):
    assert found_in(text) == [f"line 1: {word}" for word in found]
