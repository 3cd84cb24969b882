"""Recognise the course's notebooks among a student's files."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from labcourse.answers.notebooks import Cell
from labcourse.files import ANSWERS_FILE, COURSE_FILE
from labcourse.grading.intake.archives import is_hidden
from labcourse.run.alignment import source_of
from labcourse.student_id import caseless

ENDING, PDF = ".ipynb", ".pdf"
ENDINGS = (".ipynb.txt", ".ipynb.json", ENDING)  #: of notebooks, also as browsers write them
_WORD = re.compile(r"[^\W_]+")
#: Words that browsers, drives and systems add to the name of a copy.
_OF_COPIES = re.compile(r"copy\d*|kopie\d*|copia\d*|copie\d*|of|von|de|\d{1,3}")
_FEWEST_CELLS = 3  # by which a notebook of another name is recognised; two may be equal by chance

#: How much a file's name differs from a notebook's: 0 not at all, 1 as that of a copy, 2 by other words; and minus the
#: number of the copy.
Fit = tuple[int, int]
#: A notebook of the course: the id of each cell → the cell.
Master = Mapping[str, Mapping[str, Any]]


def is_notebook(path: str) -> bool:
    """Tell whether a file is a notebook, by its name."""
    return path.casefold().endswith(ENDINGS)


def is_work(path: str) -> bool:
    """Tell whether a file is a notebook, or what a notebook of the course leaves."""
    return not is_hidden(path) and (is_notebook(path) or path.rpartition("/")[2] in (COURSE_FILE, ANSWERS_FILE))


# --- which notebook of the course a file is ---------------------------------------------------------------------------


def fitting(paths: Iterable[str], wanted: Sequence[str], *endings: str) -> dict[str, list[tuple[Fit, str]]]:
    """Find the files that may be a notebook (or a report) of the course, by their names.

    Browsers write ``x (1).ipynb`` and ``x.ipynb.txt``, JupyterLab ``x-Copy1.ipynb``, Canvas ``x-1.ipynb``, drives
    ``Copy of x.ipynb``, and platforms put people and numbers before it.

    Parameters
    ----------
    paths : of the files
    wanted : file names of the course's notebooks, or of its reports
    endings : of the files that are looked at

    Returns
    -------
    dict
        wanted name → how well each file's name fits, and its path; the best first
    """
    words = {name: _words(name) for name in wanted}
    found: dict[str, list[tuple[Fit, str]]] = {}
    for path in (path for path in paths if path.casefold().endswith(endings)):
        given = path.rpartition("/")[2]
        fits = [(len(words[name]), name, fit) for name in wanted if (fit := _fit(given, name, words[name]))]
        if fits:  # the longest name that is in it
            _length, name, fit = max(fits, key=lambda one: (one[0], [-part for part in one[2]]))
            found.setdefault(name, []).append((fit, path))
    return {name: sorted(found[name]) for name in wanted if name in found}


def _words(name: str) -> list[str]:
    folded = caseless(name)
    ending = next((ending for ending in (*ENDINGS, PDF) if folded.endswith(ending)), "")
    return _WORD.findall(folded.removesuffix(ending))


def _fit(given: str, wanted: str, words: Sequence[str]) -> Fit | None:
    if caseless(given) == caseless(wanted):
        return 0, 0
    there, length = _words(given), len(words)
    place = next((place for place in range(len(there)) if there[place : place + length] == words), None)
    if not words or place is None:
        return None
    before, after = there[:place], there[place + length :]
    numbers = [int(number) for number in re.findall(r"\d+", " ".join(after))[-1:] if len(number) < 4]
    return 1 if all(map(_OF_COPIES.fullmatch, before + after)) else 2, -sum(numbers)


def by_cells(cells: Sequence[Cell], masters: Mapping[str, Master]) -> str | None:
    """Return the notebook of the course that holds most of these cells; None for too few, or if two hold as many."""

    def alike(master: Master) -> int:
        texts = {source_of(cell).strip() for cell in master.values()} - {""}
        return sum(cell.id in master or cell.grade_id in master or cell.source.strip() in texts for cell in cells)

    counts = Counter({name: alike(master) for name, master in masters.items()}).most_common(2)
    if not counts or (len(counts) == 2 and counts[0][1] == counts[1][1]):
        return None
    name, most = counts[0]
    return name if most >= max(_FEWEST_CELLS, len(masters[name]) // 2) else None


def cells_written(cells: Iterable[Cell], master: Master) -> int:
    """Return how many cells a student changed so that they are longer than the course's."""
    released = {name: source_of(cell).strip() for name, cell in master.items()}
    changed = [cell for cell in cells if cell.source.strip() not in released.values()]
    return sum(len(cell.source.strip()) > len(released.get(cell.id, "")) for cell in changed)
