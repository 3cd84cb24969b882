"""How long a notebook takes, by one formula for all, held against what the notebooks say.

========================================  ==========
words that are not folded, a hundred      50 s
a figure                                  1 min
an answer in numbers, formulas or plots   3 min
an answer in words                        8 min
a function to write                       10 min
========================================  ==========

Folded is what a reader has to open: the inside of ``<details>``, the source of code cells whose source is hidden, and
all below a heading that is collapsed. The entries of a results table, which carry over what was answered before, are
one answer. A report is apart: neither its texts nor what leads to them is counted.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator
from dataclasses import dataclass

from nbformat import NotebookNode

from labcourse.answers import words
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import Part
from labcourse.errors import GradingError
from labcourse.grading.course import Course
from labcourse.grading.course_check.finding import Finding, in_cell
from labcourse.grading.release import student_notebooks

WORDS_A_MINUTE = 120
FIGURE, ANSWER, IN_WORDS, FUNCTION = 1, 3, 8, 10  # minutes
STEP = 5  #: minutes to which times are stated

_WORD = re.compile(r"\S*\w\S*")
_NOT_READ = re.compile(r"<details\b.*?</details>|<!--.*?-->|</?[a-z][^<>]*>", re.DOTALL)
_HEADING = re.compile(r"(#{1,6}) ")
_PICTURE = re.compile(r"!\[")
_TITLE = re.compile(r"about (\d+) minutes")
_ROW = re.compile(r"^\| *`(?P<notebook>\w+)` *\|.*\| *(?P<minutes>\d+) min\b", re.MULTILINE)


@dataclass(frozen=True)
class ReadingTime:
    """What a notebook asks of its reader.

    Attributes
    ----------
    words, folded : words of text and code that are read at once, and those that have to be opened
    figures : pictures that are not folded
    answers, in_words, functions : how many there are to give
    """

    words: int
    folded: int
    figures: int
    answers: int
    in_words: int
    functions: int

    @property
    def minutes(self) -> float:
        """How long it takes, in min."""
        asked = ANSWER * self.answers + IN_WORDS * self.in_words + FUNCTION * self.functions
        return self.words / WORDS_A_MINUTE + FIGURE * self.figures + asked

    @property
    def stated(self) -> int:
        """As it is stated, in min."""
        return STEP * round(self.minutes / STEP)


def reading_time(notebook: NotebookNode, name: str, catalogue: Catalogue) -> ReadingTime:
    """How long the student version of a notebook takes.

    Parameters
    ----------
    notebook : the instructor's, whose stored outputs have the figures
    name : of the notebook, without its ending
    catalogue : of the course

    Raises
    ------
    GradingError
        If there is no student version of it.
    """
    pictures = {cell.id: _pictures(cell) for cell in notebook.cells if not student_notebooks.is_answer(cell)}
    open_words = folded_words = figures = 0
    for cell, folded in _before_report(student_notebooks.student_version(notebook, name, catalogue), catalogue):
        everything = len(_WORD.findall(cell.source))
        at_once = 0 if folded else _read_at_once(cell)
        open_words += at_once
        folded_words += everything - at_once
        figures += 0 if folded else pictures.get(cell.id, 0)
    asked = [question for question in catalogue.everything.values() if question.notebook == name]
    parts = [part for question in asked if question.number not in catalogue.reports for part in question.parts]
    carried_over = any(part.shows is not None for part in parts)
    kinds = [_kind(part) for part in parts if part.shows is None]
    return ReadingTime(
        open_words,
        folded_words,
        figures,
        kinds.count("answer") + carried_over,
        kinds.count("prose"),
        kinds.count("function"),
    )


def check(course: Course) -> Iterator[Finding]:
    """Times that a notebook states otherwise than the formula has them."""
    notebooks = {path.stem: student_notebooks.read(path) for path in course.notebooks}
    times = {}
    for name, notebook in notebooks.items():
        with contextlib.suppress(GradingError):  # why there is no student version of it, the check of the cells tells
            times[name] = reading_time(notebook, name, course.catalogue)
    for name, notebook in notebooks.items():
        title = next((index for index, cell in enumerate(notebook.cells) if cell.cell_type == "markdown"), -1)
        for index, cell in enumerate(notebook.cells):
            stated = [(name, match[1]) for match in _TITLE.finditer(cell.source)] if index == title else []
            stated += [(match["notebook"], match["minutes"]) for match in _ROW.finditer(cell.source)]
            for which, minutes in stated:
                if which in times and int(minutes) != times[which].stated:
                    yield Finding(in_cell(f"{name}.ipynb", cell.id), _otherwise(which, times[which], minutes))


def _otherwise(notebook: str, time: ReadingTime, given: str) -> str:
    return f"{notebook} takes {time.stated} minutes by the formula ({time.minutes:.1f}); this text says {given}."


def _kind(part: Part) -> str:
    """What counts: an answer in words, a function, or any other."""
    return part.kind if part.kind in ("prose", "function") else "answer"


def _pictures(cell: NotebookNode) -> int:
    """How many pictures a cell shows: those of a text, or the stored ones of a code cell."""
    if cell.cell_type == "markdown":
        return len(_PICTURE.findall(_NOT_READ.sub(" ", cell.source)))
    return sum("image/png" in output.get("data", {}) for output in cell.get("outputs", []))


def _read_at_once(cell: NotebookNode) -> int:
    """How many words of a cell are seen without opening anything."""
    if cell.cell_type == "markdown":
        return len(_WORD.findall(_NOT_READ.sub(" ", cell.source)))
    hidden = cell.metadata.get("jupyter", {}).get("source_hidden", False)
    return 0 if hidden else len(_WORD.findall(cell.source))


def _before_report(notebook: NotebookNode, catalogue: Catalogue) -> Iterator[tuple[NotebookNode, bool]]:
    """The cells before the section in which a report begins, and whether each is below a collapsed heading."""
    cells = notebook.cells
    texts = [i for i, cell in enumerate(cells) if cell.metadata.get(words.KEY, {}).get("question") in catalogue.reports]
    if texts:
        cells = cells[: max(i for i, cell in enumerate(cells[: texts[0]]) if cell.source.startswith("## "))]
    below = 7  # the level of the collapsed heading; there are six
    for cell in cells:
        heading = _HEADING.match(cell.source) if cell.cell_type == "markdown" else None
        level = len(heading[1]) if heading else 7
        if level <= below:
            below = level if heading and cell.metadata.get(student_notebooks.COLLAPSED) else 7
            folded = False
        else:
            folded = True
        yield cell, folded
