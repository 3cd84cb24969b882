"""Collect what a scorer needs to read an answer: the answer as it was written, and what belongs to it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from markupsafe import Markup

from labcourse.answers.parts import WHOLE, Part, Question
from labcourse.answers.report_files import NOT_WRITTEN, ReportFile, without_digests
from labcourse.grading.counting import bench_of
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Answer, RunRecord
from labcourse.grading.graded_run import submission_of
from labcourse.grading.marks import Mark
from labcourse.grading.reports.feedback import figures_of
from labcourse.grading.reports.markdown import answer_as_html, as_html, pictures_of
from labcourse.grading.scoring.desk import Desk, key_of, seen, state
from labcourse.problems import Where
from labcourse.safe_text import no_escapes
from labcourse.sentences import sentence

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


def opened(desk: Desk, course: Course, answer: Answer) -> dict[str, Any]:
    """Return what the template needs of an answer that was opened by name: all that is known of it."""
    book, student, where = desk.book, answer.student, answer.where
    graded, comments = book.current(student), book.comments(student)
    return {
        "answer": answer,
        "shown": _shown(desk, answer),
        "compared": "" if graded is None else _compared(course, graded.run, where),
        "acts": [act for act in book.scores.acts([where]) if act.student == student],
        "audit": [entry for entry in book.audit(student, where[0]) if entry.part == where[1]],
        "comments": [one for one in comments if one.question == where[0] and not one.asks],
        "requests": sorted(
            (one for one in comments if one.where == where and one.asks), key=lambda one: not one.is_open
        ),
        "lapsed": [given for given in (graded.lapsed if graded else ()) if given.mark.where == where],
    }


def alike(desk: Desk, answers: Sequence[Answer]) -> list[dict[str, Any]]:
    """Return what the template needs of other students' answers to a part of one kind."""
    labels = desk.labels(answers[0].where) if answers else {}
    shown = []
    for answer in answers:
        graded = desk.book.current(answer.student) if _kind(desk, answer.where) in ("figure", *_WORDS) else None
        run = None if graded is None else graded.run
        figures = {} if run is None else figures_of(run, desk.catalogue, {answer.where})
        about = _basics(desk, run, answer, labels[answer.student])
        shown.append({**about, "mark": answer.mark, "figure": figures.get(answer.where)})
    return shown


def _basics(desk: Desk, run: RunRecord | None, answer: Answer, label: str) -> dict[str, Any]:
    """Return what the template needs of each answer."""
    text = _text(desk, run, answer)
    return {"key": key_of(answer.student, answer.where), "seen": seen(answer), "label": label, "text": text}


def _compared(course: Course, run: RunRecord, where: Where) -> str:
    """Describe what the key, as it is now, compares an answer with on the run's bench; "" if the check cannot say.

    An error of the course's code is returned as text.
    """
    check: Any = course.key.get(where[0], {}).get(where[1])
    compared: Any = getattr(check, "compared", None)
    own: Any = getattr(check, "own_bench", None)
    if compared is None and own is None:
        return ""
    submission, part = submission_of(run), course.catalogue.find_marked(where[0]).part(where[1])
    try:
        owner = bench_of(run, course.notebook_of(where[0]))
        bench = course.true_bench(owner, submission.policy, submission.evidence)
        return compared(part, bench) if compared else f"{own.expected(bench):.5g} {part.unit} on this student’s bench."
    except Exception as error:  # of the course's own code; an answer is to be seen in any case
        return f"The key does not say: {type(error).__name__}: {error}"


def _kind(desk: Desk, where: Where) -> str:
    """Return the kind of a part; "" if the course does not ask it any more."""
    kinds = {part.name: part.kind for part in _parts(desk.catalogue.marked.get(where[0]))}
    return kinds.get(where[1], "")


def _shown(desk: Desk, answer: Answer) -> dict[str, Any]:
    """Return what the template needs of an answer and of what belongs to it, also if there is no run."""
    where, judged = answer.where, desk.catalogue.report_judged
    graded = desk.book.current(answer.student)
    run, marks = (None, ()) if graded is None else (graded.run, graded.marks)
    related = _related(desk, where)
    figures = {} if run is None else figures_of(run, desk.catalogue, {where, *related})
    pdf = report_of(desk, run, where)
    return {
        **_basics(desk, run, answer, desk.label(answer.student, where)),
        "facts": [_fact(desk, one, where) for one in marks if one.where in related and (one.given or one.reason)],
        "figures": [(f"{number} {name}", drawn) for (number, name), drawn in figures.items()],
        "state": state(answer) if answer.referred or not answer.waiting else "",
        "pdf": pdf,
        "look_in_pdf": pdf is not None and answer.mark.given == pdf.given and where[0] not in judged,
        "some_in_pdf": pdf is not None and where[0] in judged and NOT_WRITTEN in answer.mark.given,
    }


def report_of(desk: Desk, run: RunRecord | None, where: Where) -> ReportFile | None:
    """Return the PDF of the report that a text belongs to, or that is judged as a whole; None if there is none."""
    if run is None:
        return None
    return submission_of(run).documents.get(desk.catalogue.report_judged.get(where[0], where[0]))


def _text(desk: Desk, run: RunRecord | None, answer: Answer) -> Markup:
    """Return an answer as HTML: a text with its pictures; a report as a whole with those of all its texts.

    Other answers are shown as plain text.
    """
    if _kind(desk, answer.where) not in ("", *_WORDS):
        return Markup('<p class="value">{}</p>').format(no_escapes(answer.mark.given))
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


def _fact(desk: Desk, mark: Mark, where: Where) -> dict[str, str]:
    """Return a mark beside the text: what the student gave, and, if it is no text, what the machine found."""
    name = mark.part if mark.question == where[0] else f"{mark.question} {mark.part}"
    if _kind(desk, mark.where) in _WORDS:
        return {"name": name, "given": mark.given, "status": "", "reason": ""}  # another's marks are not to sway
    return {"name": name, "given": mark.given, "status": mark.status, "reason": sentence(mark.reason)}
