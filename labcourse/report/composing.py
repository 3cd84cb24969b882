"""A report put together: from a student's answers, and from the texts and captions in their saved notebook.

Authors, captions and sources are in a text cell of their own, as a list that reads well in a notebook::

    * **Authors:** Ada Lovelace, Charles Babbage
    * **Figure 1.2:** The speed against time.
    * **[1]** A. Author, *A title*, 2020.

Its metadata has ``{"front": NUMBER OF THE REPORT}`` (:data:`labcourse.answers.words.KEY`).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from labcourse import course_file, files
from labcourse.answers import forms, own_files, report_files, words
from labcourse.answers.figures import readable
from labcourse.answers.json_values import clean
from labcourse.answers.notebooks import TEXT, Notebook, NotebookError
from labcourse.answers.parts import Part, Question, ReportItem
from labcourse.errors import AnswerError
from labcourse.report import fine_curves
from labcourse.report.document import Document, Notice, Place, Recorded, Section, Text

if TYPE_CHECKING:
    from labcourse.session import Session

FIGURE = "figure"  #: kind of a part
FRONT = "front"  #: in the metadata of the cell: the report's number
_ENTRY = re.compile(r"[ \t]{0,3}[*+-][ \t]+\*\*\s*(?P<name>[^*\n]{1,80}?)\s*:?\*\*[ \t]*:?[ \t]*(?P<text>.*)")
_SOURCE = re.compile(r"\[(?P<key>[\w.:-]{1,30})\]")
_COVER = ("Authors", "Title", "Course", "Date")  # entries for the cover
_LONGEST = 2000  # characters of an entry; a third of a page
_MOST = 100  # entries; twenty are many
_NOISE = 1e-9  # of a matrix's largest entry: below, it is what rounding has left of a zero
_LONGEST_SYMBOL = 3  # letters of a name that is a symbol, and no word
_HEADINGS = ("Description", "Symbol", "Value", "Unit")  # of a results table
_MARKDOWN = re.compile(r"([\\`*_{}\[\]<>()#+.!|$~-])")


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
        self._keyword = report_files.keyword(notebook.cells)
        self._written = words.written(masters, notebook.cells, own)
        front = [cell for cell in cells if _is_front(cell, report)]
        self._front = Place(self._notebook, str(front[0].get("id", "")) if front else "")
        self._notices = [Notice(problem, Place(self._notebook)) for problem in self._written.problems]
        if not front:
            message = "The cell for authors, captions and sources is missing: lab.restore() gives it back."
            self._notices.append(Notice(message, self._front))
        self._entries: dict[str, Text] = {}
        for name, entry in (pair for cell in front for pair in _entries(cell, self._notebook)):
            if name in self._entries and self._entries[name].place == entry.place:
                self._notices.append(Notice(f"There are two entries {name}; the last counts.", entry.place))
            self._entries[name] = entry

    def document(self, now: datetime) -> Document:
        """Return the report."""
        course = course_file.of(self._folder) or {}
        limit = course.get(course_file.PAGE_LIMIT)
        about = {name: str(course.get(name) or "") for name in ("title", "term")}
        cover = {"title": self._catalogue.reports[self._report].title, "course": about["title"], "term": about["term"]}
        cover |= {"authors": "", "student": self._lab.student, "date": f"{now:%Y-%m-%d}"}
        written = {name.casefold(): self._entries[name].markdown for name in _COVER if name in self._entries}
        cover |= {name: " ".join(text.split()) for name, text in written.items()}
        sections = tuple(map(self._section, self._items))
        return Document(
            cover=cover,
            page_limit=limit if isinstance(limit, int) and limit > 0 else None,
            sections=sections,
            sources={match[1]: entry for name, entry in self._entries.items() if (match := _SOURCE.fullmatch(name))},
            front=self._front,
            keyword=self._keyword,
            notices=(*self._notices, *self._unknown(sections)),
        )

    def _unknown(self, sections: Sequence[Section]) -> Iterator[Notice]:
        """Yield a notice about each entry of the front cell that is none of the report's."""
        pieces = [piece for section in sections for piece in section.pieces]
        labels = [*_COVER, *dict.fromkeys(piece.label for piece in pieces if isinstance(piece, Recorded))]
        for name, entry in self._entries.items():
            if name not in labels and not _SOURCE.fullmatch(name):
                known = ", ".join([*labels, "[1]"])
                message = f"{name!r} is none of the report's entries, and is left out; there are {known}."
                yield Notice(message, entry.place)

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
        results = [pair for pair in shown if not self._has_caption(*pair)]
        missing = [(question, name) for question, name in results if not self._lab.content(question.number, name)]
        place = next((self._place(*pair) for pair in [*missing, *shown]), Place(self._notebook))
        return Section(item.number, item.heading, pieces, place, tuple(name for _question, name in missing))

    def _pieces(self, question: Question, name: str) -> Iterator[Text | Recorded]:
        place = self._place(question, name)
        if self._has_caption(question, name):
            label = self._label(question, name)
            own = self._entries.get(label)
            caption = own or Text((question.part(name).prompt if name else "") or question.title, self._front)
            content = self._figure(question, name, label, place) if name else self._table(question)
            yield Recorded(label, caption, bool(own), place, **content)
        elif latex := _equation(question.part(name), self._lab.content(question.number, name)):
            yield Text(f"$$ {latex} $$", place)

    def _table(self, question: Question) -> dict[str, Any]:
        """Return the table and what is missing in it."""
        contents = {part: self._lab.content(question.number, part) for part in question.names}
        rows = list(_rows(question, contents))
        lines = [_HEADINGS, ("---",) * len(_HEADINGS), *rows]
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
            self._notices.append(Notice(message, place))
        svg, alt = drawing.draw(axes)
        return {"svg": svg, "alt": alt, "axes": tuple((axis["xlabel"], axis["ylabel"]) for axis in axes)}


def _read(path: Path) -> Notebook:
    try:
        return Notebook.read(files.read(path))  # with all pictures: only grading limits their size
    except (OSError, NotebookError) as error:
        raise AnswerError(
            f"The report's texts are in {path.name}, which cannot be read: {files.reason(error)}"
        ) from None


# --- authors, captions and sources ------------------------------------------------------------------------------------


def _is_front(cell: Any, report: str) -> bool:
    about = cell["metadata"].get(words.KEY)
    return isinstance(about, Mapping) and about.get(FRONT) == report and cell.get("cell_type") == TEXT


def _entries(cell: Any, notebook: str) -> Iterator[tuple[str, Text]]:
    """Yield name and text of each entry that is not empty. A text may go on over several lines, up to a blank one."""
    entries: list[tuple[str, list[str]]] = []
    is_open = False
    for line in clean(words.source_of(cell)).split("\n"):
        if match := _ENTRY.fullmatch(line):
            entries.append((match["name"], [match["text"]]))
        elif line.strip() and is_open:
            entries[-1][1].append(line.strip())
        is_open = bool(match or (line.strip() and is_open))
    for name, lines in entries[:_MOST]:
        if text := "\n".join(lines).strip()[:_LONGEST]:
            yield name, Text(text, Place(notebook, str(cell.get("id", ""))))


# --- recorded results ------------------------------------------------------------------------------------------------


def _symbol(part: Part) -> str:
    """Return the name of a part as LaTeX: ``mu_n`` as ``\\mu_{n}``. A unit at its end is left out."""
    first, *rest = part.name.split("_")
    rest = [word for word in rest if word != part.unit or len(word) == 1]
    if len(readable(rf"$\{first}$")) == 1 < len(first):  # a Greek letter
        head = f"\\{first}"
    elif len(first) > _LONGEST_SYMBOL:
        return rf"\text{{{' '.join([first, *rest])}}}"
    else:
        head = first if len(first) == 1 else rf"\mathrm{{{first}}}"
    below = r",\,".join(word if len(word) == 1 else rf"\mathrm{{{word}}}" for word in rest)
    return f"{head}_{{{below}}}" if rest else head


def _number(value: float) -> str:
    """Return a number as LaTeX, with four significant digits: ``1.2 \\cdot 10^{-3}``."""
    digits, _e, power = f"{value + 0.0:.4g}".partition("e")
    return rf"{digits} \cdot 10^{{{int(power)}}}" if power else digits


def _unit(part: Part) -> str:
    """Return the unit of a part; "" if it has none, or several."""
    return part.unit or part.usual.unit or ("1/s" if part.kind == "poles" else "")


def _formula(part: Part, content: Any) -> str | None:
    """Return a stored answer as LaTeX; None for a kind that is not a formula, and for an answer that cannot be read."""
    try:
        value = forms.decode(part, content)
    except AnswerError:
        return None
    if part.kind in ("expression", "equation", "symbolic_matrix"):
        import sympy

        return str(sympy.latex(value))
    shown: dict[str, Callable[[Any], str]] = {"number": _number, "matrix": _matrix, "poles": _poles}
    return shown[part.kind](value) if part.kind in shown else None


def _matrix(value: Any) -> str:
    values = np.atleast_2d(value)
    noise = _NOISE * np.abs(values).max()
    rows = [" & ".join(_number(entry if abs(entry) > noise else 0.0) for entry in row) for row in values]
    return r"\begin{bmatrix} " + r" \\ ".join(rows) + r" \end{bmatrix}"


def _poles(values: Any) -> str:
    """Return LaTeX for poles (n,): a column, with a conjugate pair in one row."""
    rows, left = [], list(values)
    while left:
        value = left.pop(0)
        pair = next((other for other in left if value.imag and np.isclose(other, value.conjugate())), None)
        if pair is not None:
            left.remove(pair)
        sign = r"\pm" if pair is not None else "+" if value.imag > 0 else "-"
        rows.append(_number(value.real) + (f" {sign} {_number(abs(value.imag))}j" if value.imag else ""))
    return r"\begin{matrix} " + r" \\ ".join(rows) + r" \end{matrix}"


def _equation(part: Part, content: Any) -> str | None:
    """Return a stored answer as an equation in LaTeX, with its unit; None if it cannot be shown as one."""
    latex = _formula(part, content)
    if latex is None or part.kind == "equation":
        return latex
    unit = _unit(part)
    return f"{_symbol(part)} = {latex}" + (rf"\ \text{{{unit}}}" if unit else "")


def _rows(table: Question, contents: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """Yield the rows of a results table in Markdown: description, symbol, value, unit.

    The value of an entry that is not filled in, or cannot be read, is "".
    """
    for part in table.parts:
        latex = _formula(part, contents[part.name])
        value = f"${latex}$" if latex is not None else ""
        if latex is None and contents[part.name]:
            shown = forms.show(part, contents[part.name]).removeprefix(part.name)
            value = _MARKDOWN.sub(r"\\\1", shown.removeprefix(" = ").removeprefix(": "))
        unit = _unit(part) or ("SI" if part.kind == "matrix" else "–")  # entries of a matrix may have several
        yield part.prompt.rstrip(".").replace("|", r"\|"), f"${_symbol(part)}$", value, unit
