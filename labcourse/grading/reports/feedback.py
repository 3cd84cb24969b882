"""The page that a student gets back: one HTML file, no scripts, nothing loaded from anywhere, all text escaped."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from itertools import groupby
from typing import Any

from markupsafe import Markup

from labcourse import clock
from labcourse.answers import forms, reflection, report_files
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.json_values import clean
from labcourse.answers.parts import WHOLE, Question
from labcourse.errors import AnswerError
from labcourse.grading.assignments import State, Work
from labcourse.grading.course import Course
from labcourse.grading.gradebook import RunRecord
from labcourse.grading.graded_run import answers_of
from labcourse.grading.marks import UNDECIDED, Mark, Status
from labcourse.grading.reports import drawn_figure, markdown
from labcourse.grading.reports.result import Result, sums
from labcourse.grading.reports.templating import templates
from labcourse.grading.settings import FeedbackSettings
from labcourse.grading.verdicts import Key
from labcourse.sentences import sentence

_GOOD = (Status.RIGHT, Status.BY_A_PERSON)
_ABSENT = (State.MISSING, State.UNTOUCHED)
_MOST = 3  # questions on the first screen


def page(
    result: Result,
    course: Course,
    answer_link: Callable[[str, str, str], str] | None = None,
    executed: Mapping[str, str] | None = None,
) -> str:
    """Return a student's feedback as HTML. Before it opens, it has the date and problems with the submission only.

    Notebooks that are not due, or from which the student is excused, are left out if nothing of theirs is in them.

    Parameters
    ----------
    result : what came out
    course : with its questions, and the settings of what students see
    answer_link : student, question, part → address of the answer. With it, the page is an instructor's copy: it is
        complete, whatever students see, and has a link at each answer. It must not be written to a file.
    executed : notebook without ending → address of what it showed when it was run again, for an instructor's copy
    """
    seen, account = FeedbackSettings() if answer_link else course.settings.feedback, result.account
    grades = [one for one in account.assignments if one.title]
    works = {work.notebook: work for one in grades for work in one.works}
    blank = {name for name, work in works.items() if work.is_blank and not answer_link}
    questions = [one for one in shown_questions(result, course) if one["question"].notebook not in blank]
    sections = groupby(questions, key=lambda one: (one["question"].section, one["question"].notebook))
    context = {
        "result": result,
        "seen": seen,
        "opens": None if seen.is_open(clock.now()) else seen.opens,
        "questions": questions,
        "sections": [list(group) for _name, group in sections],
        "grades": grades,
        "works": works,
        "again": _look_again(questions, works, course),
        "cells": course.cells,
        "course": " · ".join(filter(None, (course.title, course.settings.term))),
        "undecided": UNDECIDED,
        "answer_link": answer_link,
        "executed": executed or {},
        "anchor": anchor,
    }
    return templates().get_template("feedback.html").render(**context) + "\n"


def _look_again(
    questions: Iterable[dict[str, Any]], works: Mapping[str, Work], course: Course
) -> list[tuple[dict[str, Any], Mark]]:
    """Return at most three questions that lost most points by their weights, each with the mark that lost most.

    Marks that are undecided or dropped lose nothing. Questions in work that is missing, untouched, excused or cannot be
    read are left out.
    """
    counted = course.settings.marks

    def lost(mark: Mark) -> float:
        counts = mark.status not in UNDECIDED and not counted.dropped_as(*mark.where)
        return (mark.out_of - mark.points) * counted.weight(*mark.where) if counts else 0.0

    found = []
    for one in questions:
        work = works.get(one["question"].notebook)
        if work is None or (work.state not in _ABSENT and work.excuse is None and not work.is_unread):
            found.append((sum(map(lost, one["marks"])), one))
    found.sort(key=lambda entry: -entry[0])
    return [(one, max(one["marks"], key=lost)) for points_lost, one in found[:_MOST] if points_lost > 0]


def shown_questions(result: Result, course: Course) -> list[dict[str, Any]]:
    """Return what the template needs of each question, in the order of the marks."""
    catalogue = course.catalogue
    figures, predicted = figures_of(result.run, catalogue), predictions_of(result.run, catalogue)
    shown = []
    for number, group in groupby(result.marks, key=lambda mark: mark.question):
        marks = list(group)
        question = catalogue.marked.get(number, Question(number, "", "", "", (), ()))
        comments = [comment for comment in result.comments if comment.question == number]
        all_right = all(mark.status in _GOOD and mark.points == mark.out_of for mark in marks)
        all_missing = all(mark.status == Status.MISSING and mark.reason == marks[0].reason for mark in marks)
        shown.append(
            {
                "question": question,
                "anchor": anchor(number),
                "marks": marks,
                "sums": sums(marks),
                "parts": [_part(mark, question, figures, result.run.words, course.key) for mark in marks],
                "comments": comments,
                "predicted": predicted.get(number),
                "is_folded": all_right and not comments,
                "common_reason": sentence(marks[0].reason) if all_missing else None,  # then it is shown once
            }
        )
    return shown


def anchor(number: str) -> str:
    """Return the id of a question on the page."""
    return "q-" + "-".join(number.replace(".", " ").split())


def _part(
    mark: Mark, question: Question, figures: Mapping[tuple[str, str], Markup], texts: Mapping[str, Any], key: Key
) -> dict[str, Any]:
    """Return what the template needs of a part: ``answer`` is HTML, if there is any; else ``text`` is shown.

    The key's text to compare with an answer in words is in it when a person has marked the answer.
    """
    part = next((part for part in question.parts if part.name == mark.part), None)
    kind, prompt = ("", "") if part is None else (part.kind, part.prompt)
    written = texts.get(mark.question, {}).get(mark.part)
    answer = figures.get(mark.where) if written is None else markdown.answer_as_html(written)
    # A report as a whole is made of texts that are on the page already.
    text = report_files.named_in(mark.given) if kind == WHOLE else report_files.without_digests(mark.given)
    compare = getattr(key.get(mark.question, {}).get(mark.part), "compare", "")
    shown = markdown.as_html(compare) if compare and mark.status == Status.BY_A_PERSON else None
    return {"mark": mark, "kind": kind, "prompt": prompt, "answer": answer, "text": text, "compare": shown}


def figures_of(
    run: RunRecord, catalogue: Catalogue, only: Collection[tuple[str, str]] | None = None
) -> dict[tuple[str, str], Markup]:
    """Draw a student's figures again: (question, part) → HTML. What is no valid figure is left out.

    Parameters
    ----------
    run : with the answers
    catalogue : of the course
    only : question and part of those to draw; all of them unless given
    """
    drawn = {}
    for number, parts in answers_of(run).get("answers", {}).items():
        question = catalogue.everything.get(number)
        for part in question.parts if question is not None else ():
            wanted = only is None or (number, part.name) in only
            if part.kind == "figure" and part.name in parts and wanted:
                try:
                    drawn[number, part.name] = drawn_figure.drawn(forms.decode(part, parts[part.name])["axes"])
                except (AnswerError, ArithmeticError, ValueError, RecursionError):
                    continue
    return drawn


def predictions_of(run: RunRecord, catalogue: Catalogue) -> dict[str, tuple[list[str], str]]:
    """Return the predictions in the answers of a run, which are never marked.

    Returns
    -------
    dict
        question → lines, each a prediction beside what was recorded; and what the student thought of it afterwards.
        Questions with neither are left out
    """
    content = answers_of(run)
    stored = content.get(reflection.SECTION, {})
    given = content.get("answers", {})

    def find(question: str, part: str) -> Any:
        return forms.decode(catalogue.everything[question].part(part), given.get(question, {}).get(part))

    predicted = {}
    for number, predictable in catalogue.predictions.items() if content else ():
        about = stored.get(number, {})
        lines = []
        for item, _value, text in reflection.read(predictable, about):
            recorded = reflection.describe_result(item, find)
            lines.append(f"{text}; recorded: {recorded}" if recorded else text)
        why = clean(about.get("why", ""))
        if lines or why:
            predicted[number] = (lines, why)
    return predicted
