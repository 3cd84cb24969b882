"""A report put together: from a student's answers, and from the texts and captions in their saved notebook."""

from __future__ import annotations

import re
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from labcourse import course_file, files
from labcourse.answers import forms, own_files, words
from labcourse.answers.notebooks import Notebook, NotebookError
from labcourse.answers.parts import Question, ReportItem
from labcourse.errors import AnswerError
from labcourse.report import entries, fine_curves, front
from labcourse.report.document import Document, Notice, Place, Recorded, Section, Text

if TYPE_CHECKING:
    from labcourse.session import Session

FIGURE = "figure"  #: kind of a part


def compose(lab: Session, folder: Path, report: str, now: datetime) -> Document:
    """Compose a student's report as it stands now.

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
    return _Composer(lab, folder, report).document(now)


class _Composer:
    def __init__(self, lab: Session, folder: Path, report: str) -> None:
        self._lab, self._folder, self._report = lab, folder, report
        self._catalogue = lab.catalogue
        self._items = [item for item in lab.catalogue.items(report) if not item.judged]
        self._notebook = f"{lab.catalogue.reports[report].notebook}.ipynb"
        notebook = _read(folder / self._notebook)
        cells = notebook.content["cells"]
        masters = words.own_masters(cells)
        self._cells = {where: str(master.get("id", "")) for master in masters if (where := words.where_of(master))}
        own, _problems = own_files.read(folder, [f"{name}.ipynb" for name in lab.catalogue.notebooks])
        self._written = words.written(masters, notebook.cells, own)
        shown = [pair for item in self._items if not item.part for pair in self._shown(item)]
        labels = [self._label(question, name) for question, name in shown if self._has_caption(question, name)]
        self._front = front.read(cells, self._notebook, report, list(dict.fromkeys(labels)))

    def document(self, now: datetime) -> Document:
        """Return the report."""
        course = course_file.of(self._folder) or {}
        sections = tuple(map(self._section, self._items))
        lines = {name: " ".join(text.split()) for name, text in self._front.lines.items() if name != "Authors"}
        authors = re.split(r"[;,\n]", self._front.lines.get("Authors", ""))
        limit = course.get(course_file.PAGE_LIMIT)
        problems = [Notice(problem, Place(self._notebook)) for problem in self._written.problems]
        return Document(
            title=lines.get("Title") or self._catalogue.reports[self._report].title,
            course=lines.get("Course") or str(course.get("title") or ""),
            term=str(course.get("term") or ""),
            student=self._lab.student,
            authors=tuple(author.strip() for author in authors if author.strip()),
            date=lines.get("Date") or f"{now:%Y-%m-%d}",
            page_limit=limit if isinstance(limit, int) and limit > 0 else None,
            sections=sections,
            sources=self._front.sources,
            front=self._front.place,
            notices=(*self._front.notices, *problems),
        )

    def _shown(self, item: ReportItem) -> Iterator[tuple[Question, str]]:
        """Yield the questions and parts that a row shows; a table as a whole has the part ""."""
        for number, name in item.shows:
            question = self._catalogue.find(number)
            names = [""] if number in self._catalogue.tables else [name] if name else question.names
            yield from ((question, part) for part in names)

    def _has_caption(self, question: Question, name: str) -> bool:
        return not name or question.part(name).kind == FIGURE

    def _label(self, question: Question, name: str) -> str:
        """Return how texts refer to a figure or a table: by its question, and by its part if there are several."""
        if not name:
            return question.number
        several = sum(part.kind == FIGURE for part in question.parts) > 1
        return f"Figure {question.number} {name}" if several else f"Figure {question.number}"

    def _place(self, question: Question, name: str) -> Place:
        names = [name] if name else question.names
        cell = next((cell for part in names if (cell := self._lab.book.cell(question.number, part))), "")
        return Place(f"{question.notebook}.ipynb", cell)

    def _section(self, item: ReportItem) -> Section:
        if item.part:
            where = (self._report, item.part)
            place = Place(self._notebook, self._cells.get(where, ""))
            answer = self._written.words.get(where)
            text = Text(answer.text, place, answer.pictures) if answer else Text("", place)
            return Section(item.number, item.heading, (text,), place)
        shown = list(self._shown(item))
        pieces = tuple(piece for question, name in shown for piece in self._pieces(question, name))
        missing = {
            name: self._place(question, name)
            for question, name in shown
            if not self._has_caption(question, name) and not self._lab.content(question.number, name)
        }
        places = [*missing.values(), *(piece.place for piece in pieces), Place(self._notebook)]
        return Section(item.number, item.heading, pieces, places[0], tuple(missing))

    def _pieces(self, question: Question, name: str) -> Iterator[Text | Recorded]:
        place = self._place(question, name)
        if self._has_caption(question, name):
            label = self._label(question, name)
            own = self._front.captions.get(label, "")
            caption = own or (question.part(name).prompt if name else "") or question.title
            content = self._figure(question, name, label, place) if name else self._table(question)
            yield Recorded(label, Text(caption, self._front.place), bool(own), place, **content)
        elif latex := entries.equation(question.part(name), self._lab.content(question.number, name)):
            yield Text(f"$$ {latex} $$", place)

    def _table(self, question: Question) -> dict[str, Any]:
        """Return the table and what is missing in it."""
        contents = {part: self._lab.content(question.number, part) for part in question.names}
        rows = list(entries.rows(question, contents))
        lines = [entries.HEADINGS, ("---",) * len(entries.HEADINGS), *rows]
        missing = tuple(row[0] for row in rows if not row[2])
        return {"table": "\n".join(f"| {' | '.join(line)} |" for line in lines), "missing": missing}

    def _figure(self, question: Question, name: str, label: str, place: Place) -> dict[str, Any]:
        """Return the drawing of a figure, its description, and the labels of its axes."""
        content = self._lab.content(question.number, name)
        try:
            axes = forms.decode(question.part(name), content)["axes"] if content else []
        except AnswerError:
            axes = []
        if not axes or not content:
            return {"alt": "This figure is not recorded yet.", "missing": (label,)}
        from labcourse.report import drawing  # it loads matplotlib

        axes, all_points = fine_curves.refined(self._folder, question.number, name, content, axes)
        if not all_points:
            message = (
                f"{label} is drawn from the points that your answer keeps of each curve, which are few. "
                "For a finer picture, run the cell that records it again."
            )
            self._front.notices.append(Notice(message, place))
        svg, alt = drawing.draw(axes)
        return {"svg": svg, "alt": alt, "axes": tuple((axis["xlabel"], axis["ylabel"]) for axis in axes)}


def _read(path: Path) -> Notebook:
    try:
        return Notebook.read(files.read(path))  # with all pictures: only grading limits their size
    except (OSError, NotebookError) as error:
        raise AnswerError(
            f"The report's texts are in {path.name}, which cannot be read: {files.reason(error)}"
        ) from None
