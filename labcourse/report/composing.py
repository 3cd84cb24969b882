"""A report put together: from a student's answers, and from the texts and captions in their saved notebook."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from labcourse import course_file, files
from labcourse.answers import forms, own_files, words
from labcourse.answers.attached_pictures import PICTURE
from labcourse.answers.notebooks import Notebook, NotebookError
from labcourse.answers.parts import Question, ReportItem
from labcourse.errors import AnswerError
from labcourse.report import counting, entries, fine_curves, front
from labcourse.report.document import (
    Axes,
    Block,
    Document,
    Equation,
    Figure,
    Place,
    Prose,
    Section,
    Table,
)
from labcourse.report.front import Front

if TYPE_CHECKING:
    from labcourse.session import Session

FIGURE = "figure"  #: kind of a part


def composed(lab: Session, folder: Path, report: str, now: datetime) -> Document:
    """A student's report as it stands now.

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
    return _Composing(lab, folder, report).document(now)


class _Composing:
    def __init__(self, lab: Session, folder: Path, report: str) -> None:
        self._lab, self._folder, self._report = lab, folder, report
        self._about: Question = lab.catalogue.reports[report]
        self._items = [item for item in lab.catalogue.items(report) if not item.judged]
        self._notebook = f"{self._about.notebook}.ipynb"
        notebook = _read(folder / self._notebook)
        cells = notebook.content["cells"]
        masters = words.own_masters(cells)
        self._cells = {where[1]: str(master.get("id", "")) for master in masters if (where := words.where_of(master))}
        self._written = words.written(masters, notebook.cells, self._files(cells))
        labels = dict(named for item in self._items for named in self._labels(item))
        self._front: Front = front.read(cells, self._notebook, report, labels)
        self._numbers = {kind: 0 for kind in (Figure, Table, Equation)}

    def document(self, now: datetime) -> Document:
        """All of it."""
        course = course_file.of(self._folder) or {}
        sections = tuple(self._section(item) for item in self._items)
        problems = ((problem, Place(self._notebook)) for problem in self._written.problems)
        return Document(
            title=self._front.title or self._about.title,
            course=self._front.course or str(course.get("title") or ""),
            term=str(course.get("term") or ""),
            student=self._lab.student,
            authors=self._front.authors,
            date=self._front.date or f"{now:%Y-%m-%d}",
            page_limit=_limit(course),
            sections=sections,
            references=self._front.references,
            front=self._front.place,
            told=(*self._front.told, *problems),
        )

    # --- sections --------------------------------------------------------------------------------------------------

    def _section(self, item: ReportItem) -> Section:
        heading = item.heading
        if item.part:
            place = Place(self._notebook, self._cells.get(item.part, ""))
            return Section(item.number, heading, tuple(self._text(item.part, place)), place)
        blocks = tuple(block for number, name in item.shows for block in self._shown(number, name))
        missing = dict(self._missing(item))
        place = next(iter([*missing.values(), *(block.place for block in blocks)]), Place(self._notebook))
        return Section(item.number, heading, blocks, place, tuple(missing))

    def _missing(self, item: ReportItem) -> Iterator[tuple[str, Place]]:
        """Yield the results that a row shows as equations and that are not recorded, each with its cell."""
        for number, name in item.shows:
            question = self._lab.catalogue.find(number)
            for part in question.parts if number not in self._lab.catalogue.tables else ():
                if name in ("", part.name) and part.kind != FIGURE and not self._lab.content(number, part.name):
                    yield part.name, Place(f"{question.notebook}.ipynb", self._lab.book.cell(number, part.name))

    def _text(self, part: str, place: Place) -> Iterator[Block]:
        found = self._written.words.get((self._report, part))
        text, pictures = (found.text, found.pictures) if found else ("", {})
        yield Prose(text, place, pictures)
        for one in counting.counted(text):
            if one.kind == counting.EQUATION:
                yield Equation(self._next(Equation), one.content, one.name, place)
            elif one.kind == counting.TABLE:
                head, *rows = one.rows
                yield Table("", self._next(Table), one.content, bool(one.content), head, tuple(rows), place, place)
            elif one.name in pictures:
                yield Figure(
                    one.name, self._next(Figure), one.content, bool(one.content), "", one.content, (), place, place
                )

    def _shown(self, number: str, name: str) -> Iterator[Block]:
        """What a row shows of a question: figures, a results table, or results as equations."""
        question = self._lab.catalogue.find(number)
        names = [name] if name else list(question.names)
        contents = {one: content for one in names if (content := self._lab.content(number, one))}
        place = Place(f"{question.notebook}.ipynb", next((self._lab.book.cell(number, one) for one in names), ""))
        if number in self._lab.catalogue.tables:
            yield self._table(question, contents, place)
            return
        for one in names:
            if question.part(one).kind == FIGURE:
                cell = Place(place.notebook, self._lab.book.cell(number, one))
                yield self._figure(question, one, contents.get(one), cell)
        for latex in entries.equations(question, names, contents):
            yield Equation(self._next(Equation), latex, "", place)

    def _figure(self, question: Question, name: str, content: dict[str, Any] | None, place: Place) -> Figure:
        part = question.part(name)
        label = _figure_label(question, name)
        own = self._front.captions.get(label, "")
        try:
            axes = forms.decode(part, content)["axes"] if content else []
        except AnswerError:
            axes = []
        svg, alt = "", "This figure is not recorded yet."
        if axes and content:
            from labcourse.report import drawing  # matplotlib loads where it is used

            fine = fine_curves.find(self._folder, question.number, name, content)
            svg, alt = drawing.drawn(axes, fine)
            if fine is None and any(line["n"] > line["x"].size for axis in axes for line in axis["lines"]):
                self._front.told.append(
                    (
                        (
                            f"{label} is drawn from the points that your answer keeps of each curve, which are few. "
                            "For a finer picture, run the cell that records it again."
                        ),
                        place,
                    )
                )
        return Figure(
            label=label,
            number=self._next(Figure),
            caption=own or part.prompt or question.title,
            own_caption=bool(own),
            svg=svg,
            alt=alt,
            axes=tuple(Axes(axis["xlabel"], axis["ylabel"]) for axis in axes),
            place=place,
            written=self._front.place,
        )

    def _table(self, table: Question, contents: dict[str, Any], place: Place) -> Table:
        own = self._front.captions.get(table.number, "")
        rows = tuple(entries.rows(table, contents))
        caption = own or table.title
        written = self._front.place
        return Table(table.number, self._next(Table), caption, bool(own), entries.head(), rows, place, written)

    def _labels(self, item: ReportItem) -> Iterator[tuple[str, str]]:
        """What a row shows that has a caption: what its caption may be written behind → what it is called by."""
        if item.part:
            return
        for number, name in item.shows:
            question = self._lab.catalogue.find(number)
            if number in self._lab.catalogue.tables:
                yield number, number
                continue
            for one in [name] if name else question.names:
                if question.part(one).kind == FIGURE:
                    yield _figure_label(question, one), _figure_label(question, one)

    def _next(self, kind: type[Figure | Table | Equation]) -> int:
        self._numbers[kind] += 1
        return self._numbers[kind]

    def _files(self, cells: list[Any]) -> Mapping[str, bytes]:
        """The student's own files, where a text shows a picture from there."""
        texts = [words.source_of(cell) for cell in cells if isinstance(cell, dict) and words.where_of(cell)]
        targets = [match["in"] or match["out"] for text in texts for match in PICTURE.finditer(text)]
        if all(target.startswith(("attachment:", "data:")) for target in targets):
            return {}
        return own_files.read(self._folder, [f"{name}.ipynb" for name in self._lab.catalogue.notebooks])[0]


def _figure_label(question: Question, name: str) -> str:
    """What a figure is called by: after its question, and its part where a question has several."""
    return f"Figure {_figure_number(question, name)}"


def _figure_number(question: Question, name: str) -> str:
    several = sum(part.kind == FIGURE for part in question.parts) > 1
    return f"{question.number} {name}" if several else question.number


def _limit(course: Mapping[str, Any]) -> int | None:
    limit = course.get(course_file.PAGE_LIMIT)
    return limit if isinstance(limit, int) and not isinstance(limit, bool) and limit > 0 else None


def _read(path: Path) -> Notebook:
    try:
        return Notebook.read(files.read(path))  # with all pictures: only grading limits their size
    except (OSError, NotebookError) as error:
        raise AnswerError(
            f"The report's texts are in {path.name}, which cannot be read: {files.reason(error)}"
        ) from None
