"""What a report contains: a student's answers, and the texts and captions in their saved notebook.

Authors, captions and sources are in a text cell of their own, as a list that reads well in a notebook::

    * **Authors:** Ada Lovelace, Charles Babbage
    * **Figure 1.2:** The speed against time.
    * **[1]** A. Author, *A title*, 2020.

Its metadata has ``{"front": NUMBER OF THE REPORT}`` (:data:`labcourse.answers.words.KEY`).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from labcourse import course_file, files
from labcourse.answers import figures, forms, own_files, report_files, words
from labcourse.answers.json_values import clean
from labcourse.answers.notebooks import TEXT, Notebook, NotebookError
from labcourse.answers.parts import Question, ReportItem
from labcourse.errors import AnswerError
from labcourse.report import recorded_figures, values
from labcourse.sentences import sentences

FIGURE = "figure"  #: kind of a part
FRONT = "front"  #: in the metadata of the cell: the report's number
_ENTRY = re.compile(
    r"^[ \t]{0,3}[*+-][ \t]+\*\*\s*(?P<name>[^*\n]{1,80}?)\s*:?\*\*[ \t]*:?[ \t]*"
    r"(?P<text>.*(?:\n(?![ \t]{0,3}[*+-][ \t]+\*\*)[ \t]*\S.*)*)",
    re.MULTILINE,
)
_SOURCE = re.compile(r"\[([\w.:-]{1,30})\]")
_COVER = ("Authors", "Title", "Course", "Date")  # entries for the cover
_LONGEST = 2000  # characters of an entry; a third of a page
_MOST = 100  # entries; twenty are many


@dataclass(frozen=True)
class Heading:
    """A heading of the course's: of level 1 or 2."""

    level: int
    text: str


@dataclass(frozen=True)
class Text:
    """A student's text in Markdown.

    Attributes
    ----------
    markdown : the text
    pictures : name, as the text has it in ``![…](name)`` → PNG
    source : key of the source that it describes, as in "1" for [1]; "" for a text of the report
    """

    markdown: str
    pictures: Mapping[str, bytes] = field(default_factory=dict)
    source: str = ""


@dataclass(frozen=True)
class Exhibit:
    """A figure or a results table that was recorded.

    Attributes
    ----------
    label : how texts refer to it: "Figure 1.2", after its question, or "Table 1", as the catalogue has it
    caption : Markdown
    table : Markdown; "" for a figure
    svg : of a figure; "" for a table
    alt : a description of a figure for readers who do not see it
    """

    label: str
    caption: str
    table: str = ""
    svg: str = ""
    alt: str = ""


@dataclass(frozen=True)
class Contents:
    """The contents of a report.

    Attributes
    ----------
    cover : "title", "course", "term", "authors", "student" (ID of the folder's owner), "date" → text; it may be ""
    pieces : in order
    keyword : of the PDF, see :func:`labcourse.answers.report_files.keyword`
    problems : what is not in it as the student left it, and why
    """

    cover: Mapping[str, str]
    pieces: tuple[Heading | Text | Exhibit, ...]
    keyword: str
    problems: tuple[str, ...] = ()


def read(lab: report_files.ReportSession, folder: Path, report: str, now: datetime) -> Contents:
    """Read the contents of a student's report as they are now.

    Parameters
    ----------
    lab : the student's session
    folder : of the notebooks
    report : its number, as in "First report"
    now : for the cover, unless the student gave a date

    Raises
    ------
    AnswerError
        If the notebook with the report's texts cannot be read.
    """
    lab.refresh()
    return _Reading(lab, folder, report).contents(now)


class _Reading:
    def __init__(self, lab: report_files.ReportSession, folder: Path, report: str) -> None:
        self._lab, self._folder, self._report = lab, folder, report
        self._catalogue = lab.catalogue
        name = f"{lab.catalogue.reports[report].notebook}.ipynb"
        try:
            notebook = Notebook.read(files.read(folder / name))  # with all pictures: only grading limits their size
        except (OSError, NotebookError) as error:
            raise AnswerError(
                f"The report's texts are in {name}, which cannot be read: {files.reason(error)}"
            ) from None
        cells = notebook.content["cells"]
        own, _problems = own_files.read(folder, [f"{name}.ipynb" for name in lab.catalogue.notebooks])
        self._keyword = report_files.keyword(notebook.cells)
        self._written = words.written(words.own_masters(cells), notebook.cells, own)
        self._problems = sentences(self._written.problems)
        front = [words.source_of(cell) for cell in cells if _is_front(cell, report)]
        if not front:
            self._problems.append("The cell for authors, captions and sources is missing: lab.restore() gives it back.")
        self._entries = {name: text for source in front for name, text in _entries(source)}

    def contents(self, now: datetime) -> Contents:
        course = course_file.of(self._folder) or {}
        about = {name: str(course.get(name) or "") for name in ("title", "term")}
        cover = {"title": self._catalogue.reports[self._report].title, "course": about["title"], "term": about["term"]}
        cover |= {"authors": "", "student": self._lab.student, "date": f"{now:%Y-%m-%d}"}
        cover |= {name.casefold(): " ".join(self._entries[name].split()) for name in _COVER if name in self._entries}
        pieces = (*self._sections(), *self._sources())
        labels = {*_COVER, *(piece.label for piece in pieces if isinstance(piece, Exhibit))}
        unknown = [name for name in self._entries if name not in labels and not _SOURCE.fullmatch(name)]
        if unknown:
            known = ", ".join([*sorted(labels), "[1]"])
            self._problems.append(f"Nothing in the report is called {', '.join(unknown)}. There are {known}.")
        return Contents(cover, pieces, self._keyword, tuple(self._problems))

    def _sections(self) -> Iterator[Heading | Text | Exhibit]:
        items = [item for item in self._catalogue.items(self._report) if not item.judged]
        for number, group in groupby(items, lambda item: item.number.partition(".")[0]):
            rows = list(group)
            # "Procedure: measuring" and "Procedure: modelling" are in the part "Procedure".
            titles = {row.heading.partition(": ")[0] for row in rows}
            is_part = len(titles) == 1 and all(": " in row.heading for row in rows)
            if is_part:
                yield Heading(1, f"{number} {titles.pop()}")
            for row in rows:
                text = row.heading.partition(": ")[2] if is_part else row.heading
                text = text[:1].upper() + text[1:]
                if text in self._catalogue.tables:
                    text = f"{text}: {self._catalogue.tables[text].title}"
                yield Heading(2, f"{row.number} {text}")
                yield from list(self._section(row)) or [Text("*Nothing is written or recorded yet.*")]

    def _section(self, item: ReportItem) -> Iterator[Text | Exhibit]:
        if item.part:
            if answer := self._written.words.get((self._report, item.part)):
                yield Text(answer.text, answer.pictures)
            return
        for number, name in item.shows:
            question = self._catalogue.find(number)
            if number in self._catalogue.tables:
                yield self._table(question)
            else:
                yield from (
                    piece for part in ([name] if name else question.names) for piece in self._part(question, part)
                )

    def _part(self, question: Question, name: str) -> Iterator[Text | Exhibit]:
        part, content = question.part(name), self._lab.content(question.number, name)
        if part.kind == FIGURE:
            several = sum(other.kind == FIGURE for other in question.parts) > 1
            label = f"Figure {question.number} {name}" if several else f"Figure {question.number}"
            yield self._figure(question, name, label, content)
        elif latex := values.equation(part, content):
            yield Text(f"$$ {latex} $$")
        else:
            yield Text(f"*{name} is not recorded yet.*")

    def _table(self, question: Question) -> Exhibit:
        contents = {part: self._lab.content(question.number, part) for part in question.names}
        lines = [values.HEADINGS, ("---",) * len(values.HEADINGS), *values.rows(question, contents)]
        caption = self._entries.get(question.number) or question.title
        return Exhibit(question.number, caption, table="\n".join(f"| {' | '.join(line)} |" for line in lines))

    def _figure(self, question: Question, name: str, label: str, content: Any) -> Exhibit:
        caption = self._entries.get(label) or question.part(name).prompt or question.title
        try:
            axes = forms.decode(question.part(name), content)["axes"] if content else []
        except AnswerError:
            axes = []
        if not axes:
            return Exhibit(label, caption, alt="This figure is not recorded yet.")
        svg, is_own = recorded_figures.drawing(self._folder, question.number, name, content, axes)
        if not is_own:
            self._problems.append(
                f"{label} is drawn from the points that your answer keeps of each curve, which are few. To have it as "
                "you drew it, run the cell that records it again."
            )
        return Exhibit(label, caption, svg=svg, alt=" ".join(map(_described, axes)))

    def _sources(self) -> Iterator[Heading | Text]:
        sources = [(match[1], text) for name, text in self._entries.items() if (match := _SOURCE.fullmatch(name))]
        if sources:
            yield Heading(1, "References")
        yield from (Text(text, source=key) for key, text in sources)


def _is_front(cell: Any, report: str) -> bool:
    about = cell["metadata"].get(words.KEY)
    return isinstance(about, Mapping) and about.get(FRONT) == report and cell.get("cell_type") == TEXT


def _entries(source: str) -> Iterator[tuple[str, str]]:
    """Yield name and text of each entry that is not empty. A text may go on over several lines, up to a blank one."""
    for match in list(_ENTRY.finditer(clean(source)))[:_MOST]:
        if text := "\n".join(line.strip() for line in match["text"].split("\n")).strip()[:_LONGEST]:
            yield match["name"], text


def _described(axis: Mapping[str, Any]) -> str:
    lines = [line for line in axis["lines"] if line["x"].size]
    x = np.concatenate([line["x"] for line in lines] or [np.zeros(1)])
    return figures.describe(axis, lines, float(x.min()), float(x.max()))
