"""What a scorer has before them: an answer as it was written, what belongs to it, and those that are nearly alike."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from labcourse.answers.parts import WHOLE, Part, Question
from labcourse.answers.report_files import NOT_WRITTEN, ReportFile, without_digests
from labcourse.grading.gradebook import Answer, MarkRecord, RunRecord
from labcourse.grading.graded_run import facts_of
from labcourse.grading.reports.feedback import figures_of, pictures_of
from labcourse.grading.reports.rendered_words import as_html
from labcourse.grading.scoring import remarks
from labcourse.grading.scoring.alike import Piece, difference
from labcourse.grading.scoring.desk import Desk, Where, key_of, seen, state
from labcourse.safe_text import no_escapes

_LONGEST = 300  # characters of a number or a matrix (four by four) that stands beside the text


@dataclass(frozen=True)
class Fact:
    """A mark of the student's that stands beside the text: what was asked, what they gave, what the machine found."""

    name: str
    given: str
    status: str
    reason: str


@dataclass(frozen=True)
class Shown:
    """An answer on the page.

    Attributes
    ----------
    key, seen : by which it is scored
    label : what it is called
    words : as the student wrote it, as harmless HTML
    pieces : in what it differs from the first; empty for the first, and for one that is word for word the same
    found : marks of the same question; of a report's text, of what it is about
    section : the student's other numbers of the same section
    figures : name and drawing of the figures that belong to it
    now : what became of it so far, in words; "" while it waits
    pdf : the report as it was handed in, in words, as in "PDF, 7 pages"; "" if there is none
    look_in_pdf : whether its text is nowhere but there
    some_in_pdf : of a report as a whole, whether texts of it may be nowhere but there
    """

    key: str
    seen: str
    label: str
    words: Markup
    pieces: list[Piece]
    found: list[Fact]
    section: list[Fact]
    figures: list[tuple[str, Markup]]
    now: str
    pdf: str = ""
    look_in_pdf: bool = False
    some_in_pdf: bool = False


@dataclass(frozen=True)
class Level:
    """A level that can be given: what it is worth, and what an answer of that level is like."""

    level: int
    points: float
    text: str


@dataclass(frozen=True)
class Card:
    """All that changes when the next answer comes."""

    where: Where
    out_of: float
    answers: list[Shown]
    levels: list[Level]
    remarks: list[tuple[str, str]]

    @property
    def first(self) -> Shown:
        """The answer that the others are nearly the same as."""
        return self.answers[0]


def card(desk: Desk, answers: Sequence[Answer]) -> Card:
    """Answers that are scored together, ready for a page."""
    where, out_of = answers[0].where, answers[0].mark.out_of
    item = desk.rubric.get(where)
    levels = [
        Level(level, desk.points(level, out_of), item.levels.get(level, "") if item else "")
        for level in sorted(desk.levels.shares, reverse=True)
    ]
    acts = desk.book.scores.acts([where])
    typed = remarks.used(item.remarks if item else (), acts, where)
    first = answers[0].mark.given
    shown = [_shown(desk, one, first) for one in answers]
    return Card(where, out_of, shown, levels, typed)


def _shown(desk: Desk, answer: Answer, first: str) -> Shown:
    where = answer.where
    graded = desk.book.current(answer.student)
    run, marks = (graded.run, graded.marks) if graded is not None else (None, ())
    related = _related(desk, where)
    beside = [mark for mark in marks if mark.where in related and mark.where != where]
    section = [mark for mark in marks if mark.where not in related and _in_section(desk, mark, where)]
    figures = figures_of(run, desk.catalogue, related) if run is not None else {}
    decided = answer.asked or not answer.waiting
    pdf = report_of(desk, run, where)
    return Shown(
        key_of(answer.student, where),
        seen(answer),
        desk.label(answer.student, where),
        _words(desk, run, answer),
        difference(first, answer.mark.given),
        [_fact(desk, mark, where) for mark in beside if mark.given or mark.reason],
        [_fact(desk, mark, where) for mark in section],
        [(f"{number} {name}", drawn) for (number, name), drawn in figures.items()],
        state(answer) if decided else "",
        "" if pdf is None else pdf.about,
        pdf is not None and answer.mark.given == pdf.given and where[0] not in desk.catalogue.report_judged,
        pdf is not None and where[0] in desk.catalogue.report_judged and NOT_WRITTEN in answer.mark.given,
    )


def report_of(desk: Desk, run: RunRecord | None, where: Where) -> ReportFile | None:
    """The PDF of the report that a text belongs to, or that is judged as a whole; None if none was handed in."""
    if run is None:
        return None
    return facts_of(run).reports_in_pdf.get(desk.catalogue.report_judged.get(where[0], where[0]))


def _words(desk: Desk, run: RunRecord | None, answer: Answer) -> Markup:
    """The text; of a report as a whole, all of its texts with their pictures."""
    words = run.words if run is not None else {}
    written = words.get(answer.question, {}).get(answer.part)
    if written is not None:
        return as_html(written["text"], pictures_of(written))
    pictures: dict[str, bytes] = {}
    for one in words.get(desk.catalogue.report_judged.get(answer.question, ""), {}).values():
        pictures |= pictures_of(one)
    return as_html(without_digests(answer.mark.given), pictures)


def _related(desk: Desk, where: Where) -> set[Where]:
    """Parts that belong to one: those of its question; of a report's text, those that it is about; of a report as a
    whole, those that it shows beside its texts."""
    catalogue, (number, name) = desk.catalogue, where
    report = catalogue.report_judged.get(number)
    items = catalogue.items(number if report is None else report)
    about = [shown for item in items if item.part == ("" if report else name) for shown in item.shows]
    if not about and report is None:
        about = [(number, "")]
    return {
        (question, part.name)
        for question, only in about
        for part in _parts(catalogue.marked.get(question))
        if only in ("", part.name)
    }


def _parts(question: Question | None) -> Iterable[Part]:
    return question.parts if question is not None else ()


def _in_section(desk: Desk, mark: MarkRecord, where: Where) -> bool:
    """Whether a mark is of a number that belongs to the same section, and not of words."""
    marked = desk.catalogue.marked
    own, other = marked.get(where[0]), marked.get(mark.question)
    if own is None or other is None or own.section != other.section or not mark.given:
        return False
    return any(
        part.name == mark.part and part.kind not in ("prose", WHOLE, "figure", "recording") for part in other.parts
    )


def _fact(desk: Desk, mark: MarkRecord, where: Where) -> Fact:
    """A mark beside a text; of words, only that they are there."""
    question = desk.catalogue.marked.get(mark.question)
    kinds = {part.name: part.kind for part in _parts(question)}
    name = mark.part if mark.question == where[0] else f"{mark.question} {mark.part}"
    given = " ".join(no_escapes(mark.given).split())
    given = given if len(given) <= _LONGEST else f"{given[:_LONGEST]} …"
    if kinds.get(mark.part) in ("prose", WHOLE):
        return Fact(name, given, "", "")  # another's marks are not to sway
    return Fact(name, given, mark.status, mark.reason)
