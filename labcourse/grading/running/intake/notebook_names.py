"""Which notebook of the course a file is, whatever its name became on the way.

Browsers write ``x (1).ipynb`` and ``x.ipynb.txt``, JupyterLab ``x-Copy1.ipynb``, Canvas ``x-1.ipynb``, drives ``Copy of
x.ipynb``, and platforms put people and numbers before it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from labcourse.answers.notebooks import Cell
from labcourse.run.alignment import source_of
from labcourse.student_id import caseless

ENDING = ".ipynb"
_ENDINGS = (ENDING, f"{ENDING}.txt", f"{ENDING}.json")
_PDF = ".pdf"
_WORD = re.compile(r"[^\W_]+")
#: Words that programs add to the name of a copy.
_OF_COPIES = re.compile(r"copy\d*|kopie\d*|copia\d*|copie\d*|of|von|de|\d{1,3}")
_FEWEST_CELLS = 3  # by which a notebook of an unknown name is told; two may be the same by chance


@dataclass(frozen=True, order=True)
class Fit:
    """How well a file's name fits a notebook's: the smaller, the better."""

    changes: int  #: 0 none, 1 as programs name copies, 2 with other words in it
    earlier: int  #: of copies, minus the number
    depth: int
    path: str


def is_notebook(path: str) -> bool:
    """Whether a file is a notebook, by its name."""
    return path.casefold().endswith(_ENDINGS)


def is_pdf(path: str) -> bool:
    """Whether a file is a PDF, by its name."""
    return path.casefold().endswith(_PDF)


def fitting(
    paths: Iterable[str], wanted: Sequence[str], of_the_sort: Callable[[str], bool] = is_notebook
) -> dict[str, list[tuple[Fit, str]]]:
    """For each wanted notebook, the files that it may be, the best first. Of reports' PDFs the same.

    Parameters
    ----------
    paths : of files in a hand-in
    wanted : file names of the course's notebooks, or of its reports
    of_the_sort : which files may be one, by their names
    """
    words = {name: _words(name) for name in wanted}
    found: dict[str, list[tuple[Fit, str]]] = {}
    for path in filter(of_the_sort, paths):
        fits = [(len(words[name]), fit, name) for name in wanted if (fit := _fit(path, name, words[name]))]
        if fits:
            longest = max(length for length, _fit_, _name in fits)
            _length, fit, name = min(one for one in fits if one[0] == longest)
            found.setdefault(name, []).append((fit, path))
    return {name: sorted(found[name]) for name in wanted if name in found}


def _stem(name: str) -> str:
    folded = caseless(name)
    ending = next((one for one in sorted((*_ENDINGS, _PDF, ".py"), key=len, reverse=True) if folded.endswith(one)), "")
    return folded.removesuffix(ending)


def _words(name: str) -> list[str]:
    return _WORD.findall(_stem(name))


def _fit(path: str, wanted: str, words: Sequence[str]) -> Fit | None:
    name, depth = path.rpartition("/")[2], path.count("/")
    if caseless(name) == caseless(wanted):
        return Fit(0, 0, depth, path)
    given = _words(name)
    place = next((place for place in range(len(given)) if given[place : place + len(words)] == words), None)
    if not words or place is None:
        return None
    added = [*given[:place], *given[place + len(words) :]]
    numbers = [int(number) for number in re.findall(r"\d+", " ".join(given[place + len(words) :]))[-1:]]
    changes = 1 if all(map(_OF_COPIES.fullmatch, added)) else 2
    return Fit(changes, -numbers[0] if numbers and numbers[0] < 1000 else 0, depth, path)


def by_cells(cells: Sequence[Cell], masters: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> str | None:
    """The notebook of the course that holds most of these cells; None where it holds too few, or another as many.

    Parameters
    ----------
    cells : of a file
    masters : notebook's file name → id → cell
    """

    def alike(master: Mapping[str, Mapping[str, Any]]) -> int:
        texts = {source_of(cell).strip() for cell in master.values()} - {""}
        return sum(one.id in master or one.grade_id in master or one.source.strip() in texts for one in cells)

    counts = sorted(((alike(master), name) for name, master in masters.items()), reverse=True)
    most, name = counts[0] if counts else (0, "")
    alone = len(counts) < 2 or counts[1][0] < most
    return name if alone and most >= max(_FEWEST_CELLS, len(masters[name]) // 2) else None
