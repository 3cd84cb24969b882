"""Print how long each notebook takes, by one formula for all, and each text that states another time (exit code 1).

    python tools/reading_time.py

========================================  ==========
words that are not folded, a hundred      50 s
a figure                                  1 min
an answer in numbers, formulas or plots   3 min
an answer in words                        8 min
a function to write                       10 min
========================================  ==========

Folded is what a reader has to open: the inside of ``<details>``, the source of code cells whose source is hidden, and
all below a heading that is collapsed. The entries of a results table, which carry over earlier answers, count as one
answer. A report does not count: neither its texts nor what leads to them.
"""

from __future__ import annotations

import re
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from nbformat import NotebookNode

from labcourse.answers import words
from labcourse.answers.catalogue import Catalogue
from labcourse.grading import course
from labcourse.grading.course import Course
from labcourse.grading.release import student_notebooks

WORDS_A_MINUTE = 120
FIGURE, ANSWER, IN_WORDS, FUNCTION = 1, 3, 8, 10  # minutes
STEP = 5  #: minutes to which times are stated

_WORD = re.compile(r"\S*\w\S*")
_MARKUP = re.compile(r"<!--.*?-->|</?[a-z][^<>]*>", re.DOTALL)
_HIDDEN_MARKUP = re.compile(r"<details\b.*?</details>|<!--.*?-->|</?[a-z][^<>]*>", re.DOTALL)
_HEADING = re.compile(r"(#{1,6}) ")
_PICTURE = re.compile(r"!\[")
_TIME_IN_TITLE = re.compile(r"about (\d+) minutes")
_TIME_IN_TABLE = re.compile(r"^\| *\[?`(?P<notebook>\w+)`[^|]*\|.*\| *(?P<minutes>\d+) min\b", re.MULTILINE)


@dataclass(frozen=True)
class ReadingTime:
    """What a notebook asks of its reader.

    Attributes
    ----------
    words : words of text and code that are not folded
    folded : words of text and code that are folded; no time is counted for them
    figures : pictures that are not folded
    answers, in_words, functions : number of answers in numbers, formulas or plots; in words; and of functions to write
    """

    words: int
    folded: int
    figures: int
    answers: int
    in_words: int
    functions: int

    @property
    def minutes(self) -> float:
        """Time that it takes, in min."""
        asked = ANSWER * self.answers + IN_WORDS * self.in_words + FUNCTION * self.functions
        return self.words / WORDS_A_MINUTE + FIGURE * self.figures + asked

    @property
    def stated(self) -> int:
        """Time as a notebook states it, in min."""
        return STEP * round(self.minutes / STEP)


def reading_time(notebook: NotebookNode, name: str, catalogue: Catalogue) -> ReadingTime:
    """Compute how long the student version of a notebook takes.

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
    pictures = {cell.id: _count_pictures(cell) for cell in notebook.cells if not student_notebooks.is_answer(cell)}
    open_words = folded_words = figures = 0
    for cell, folded in _cells_before_report(student_notebooks.student_version(notebook, name, catalogue), catalogue):
        seen = 0 if folded else _count_open_words(cell)
        open_words += seen
        folded_words += _count_words(cell) - seen
        figures += 0 if folded else pictures.get(cell.id, 0)
    asked = [question for question in catalogue.everything.values() if question.notebook == name]
    parts = [part for question in asked if question.number not in catalogue.reports for part in question.parts]
    carried_over = any(part.shows is not None for part in parts)
    kinds = Counter(part.kind for part in parts if part.shows is None)
    in_words, functions = kinds.pop("prose", 0), kinds.pop("function", 0)
    answers = kinds.total() + carried_over
    return ReadingTime(open_words, folded_words, figures, answers, in_words, functions)


def other_times(course: Course) -> Iterator[str]:
    """Yield a message for each time that a notebook's title or table states, and that differs from the formula's."""
    notebooks = {path.stem: student_notebooks.read(path) for path in course.notebooks}
    times = {name: reading_time(notebook, name, course.catalogue) for name, notebook in notebooks.items()}
    for name, notebook in notebooks.items():
        title = next((index for index, cell in enumerate(notebook.cells) if cell.cell_type == "markdown"), -1)
        for index, cell in enumerate(notebook.cells):
            stated = [(name, match[1]) for match in _TIME_IN_TITLE.finditer(cell.source)] if index == title else []
            stated += [(match["notebook"], match["minutes"]) for match in _TIME_IN_TABLE.finditer(cell.source)]
            for which, minutes in stated:
                if which in times and int(minutes) != times[which].stated:
                    right = f"{which} takes {times[which].stated} minutes by the formula ({times[which].minutes:.1f})"
                    yield f"{name}.ipynb, cell {cell.id!r}: {right}; this text says {minutes}."


def _count_pictures(cell: NotebookNode) -> int:
    """Return the number of pictures that a cell shows: those of a text, or the stored outputs of a code cell."""
    if cell.cell_type == "markdown":
        return len(_PICTURE.findall(_HIDDEN_MARKUP.sub(" ", cell.source)))
    shown = [output.get("data", {}) for output in cell.get("outputs", [])]
    return sum("image/png" in data or data.get("text/html", "").startswith("<img ") for data in shown)


def _count_open_words(cell: NotebookNode) -> int:
    """Return the number of words of a cell that are seen without opening anything."""
    if cell.cell_type == "markdown":
        return len(_WORD.findall(_HIDDEN_MARKUP.sub(" ", cell.source)))
    hidden = cell.metadata.get("jupyter", {}).get("source_hidden", False)
    return 0 if hidden else len(_WORD.findall(cell.source))


def _count_words(cell: NotebookNode) -> int:
    """Return the number of words of a cell, those that are folded as well."""
    return len(_WORD.findall(_MARKUP.sub(" ", cell.source) if cell.cell_type == "markdown" else cell.source))


def _cells_before_report(notebook: NotebookNode, catalogue: Catalogue) -> Iterator[tuple[NotebookNode, bool]]:
    """Yield the cells before the section in which a report begins, and whether each is below a collapsed heading."""
    cells = notebook.cells
    texts = [i for i, cell in enumerate(cells) if cell.metadata.get(words.KEY, {}).get("question") in catalogue.reports]
    if texts:
        sections = [i for i, cell in enumerate(cells[: texts[0]]) if cell.source.startswith("## ")]
        cells = cells[: max(sections, default=texts[0])]
    folded_level = 7  # level of the collapsed heading above; 7 for none, as headings have six levels
    for cell in cells:
        heading = _HEADING.match(cell.source) if cell.cell_type == "markdown" else None
        level = len(heading[1]) if heading else 7
        folded = level > folded_level
        if not folded:
            folded_level = level if heading and cell.metadata.get(student_notebooks.COLLAPSED) else 7
        yield cell, folded


HEADINGS = ("words", "folded", "figures", "answers", "in words", "functions", "min")


def main() -> int:
    """Print a line for each notebook, and their sum; return 1 if a text states another time."""
    ours, total, words, folded = course.find(with_optional=True), 0, 0, 0
    print(f"{'notebook':28}" + "".join(f"{heading:>11}" for heading in HEADINGS))
    for path in ours.notebooks:
        time = reading_time(student_notebooks.read(path), path.stem, ours.catalogue)
        total, words, folded = total + time.stated, words + time.words, folded + time.folded
        made_of = (time.words, time.folded, time.figures, time.answers, time.in_words, time.functions)
        counts = "".join(f"{count:11}" for count in made_of)
        print(f"{path.stem:28}{counts}{time.minutes:11.1f}, stated as {time.stated}")
    print(f"in all: {words} words, {folded} folded; as stated {total} min, {total / 60:.1f} h")
    other = list(other_times(ours))
    print(*other, sep="\n", end="\n" if other else "")
    return 1 if other else 0


if __name__ == "__main__":
    sys.exit(main())
