"""Collect what a scorer needs to read an answer: the answer as it was written, and what belongs to it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from markupsafe import Markup

from labcourse.answers.parts import WHOLE, Part, Question
from labcourse.answers.report_files import NOT_WRITTEN, ReportFile, without_digests
from labcourse.grading.gradebook import Answer, MarkRecord, RunRecord
from labcourse.grading.graded_run import facts_of
from labcourse.grading.reports.feedback import figures_of
from labcourse.grading.reports.markdown import answer_as_html, as_html, pictures_of
from labcourse.grading.scoring.desk import Desk, Where, key_of, seen, state

_WORDS = ("prose", WHOLE)  # kinds of parts


def card(desk: Desk, answers: Sequence[Answer]) -> dict[str, Any]:
    """Return what the card's template needs of answers that are scored together."""
    where, out_of = answers[0].where, answers[0].mark.out_of
    item = desk.rubric.get(where)
    return {
        "where": where,
        "out_of": out_of,
        "answers": [_shown(desk, answer) for answer in answers],
        "levels": [
            (level, desk.points(level, out_of), item.levels.get(level, "") if item else "")
            for level in sorted(desk.levels.shares, reverse=True)
        ],
        "remarks": desk.remarks(where),
    }


def _shown(desk: Desk, answer: Answer) -> dict[str, Any]:
    where, judged = answer.where, desk.catalogue.report_judged
    graded = desk.book.current(answer.student)
    run, marks = (None, ()) if graded is None else (graded.run, graded.marks)
    related = _related(desk, where)
    figures = {} if run is None else figures_of(run, desk.catalogue, related)
    pdf = report_of(desk, run, where)
    return {
        "key": key_of(answer.student, where),
        "seen": seen(answer),
        "label": desk.label(answer.student, where),
        "text": _text(desk, run, answer),
        "facts": [_fact(desk, one, where) for one in marks if one.where in related and (one.given or one.reason)],
        "figures": [(f"{number} {name}", drawn) for (number, name), drawn in figures.items()],
        "state": state(answer) if answer.asked or not answer.waiting else "",
        "pdf": pdf,
        "look_in_pdf": pdf is not None and answer.mark.given == pdf.given and where[0] not in judged,
        "some_in_pdf": pdf is not None and where[0] in judged and NOT_WRITTEN in answer.mark.given,
    }


def report_of(desk: Desk, run: RunRecord | None, where: Where) -> ReportFile | None:
    """Return the PDF of the report that a text belongs to, or that is judged as a whole; None if there is none."""
    if run is None:
        return None
    return facts_of(run).reports_in_pdf.get(desk.catalogue.report_judged.get(where[0], where[0]))


def _text(desk: Desk, run: RunRecord | None, answer: Answer) -> Markup:
    """Return the text; of a report as a whole, all of its texts with their pictures."""
    words = {} if run is None else run.words
    written = words.get(answer.question, {}).get(answer.part)
    if written is not None:
        return answer_as_html(written)
    pictures: dict[str, bytes] = {}
    for text in words.get(desk.catalogue.report_judged.get(answer.question, ""), {}).values():
        pictures |= pictures_of(text)
    return as_html(without_digests(answer.mark.given), pictures)


def _related(desk: Desk, where: Where) -> set[Where]:
    """Return the other parts that belong to one.

    They are those of its question; of a report's text, those that it is about; of a report as a whole, those that it
    shows beside its texts.
    """
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
    } - {where}


def _parts(question: Question | None) -> Iterable[Part]:
    return question.parts if question is not None else ()


def _fact(desk: Desk, mark: MarkRecord, where: Where) -> dict[str, str]:
    """Return a mark beside the text: what the student gave, and, if it is no text, what the machine found."""
    name = mark.part if mark.question == where[0] else f"{mark.question} {mark.part}"
    kinds = {part.name: part.kind for part in _parts(desk.catalogue.marked.get(mark.question))}
    if kinds.get(mark.part) in _WORDS:
        return {"name": name, "given": mark.given, "status": "", "reason": ""}  # another's marks are not to sway
    return {"name": name, "given": mark.given, "status": mark.status, "reason": mark.reason}
