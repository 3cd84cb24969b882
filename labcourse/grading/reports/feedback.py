"""The page that a student gets back: one HTML file, no scripts, nothing loaded from anywhere, all text escaped.

First a summary by section: what was earned, what waits, what to look at again. Then each question with what was given,
in full width; what is all well is folded away, and unfolded on paper.
"""

from __future__ import annotations

import base64
import binascii
import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import groupby
from typing import Any

from markupsafe import Markup

from labcourse.answers import answers, forms, report_files
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import WHOLE, Part, Question
from labcourse.errors import AnswerError
from labcourse.grading.accounts.account import Account
from labcourse.grading.accounts.exact import to_decimals
from labcourse.grading.gradebook import CommentRecord, RunRecord
from labcourse.grading.marking.marking import Mark
from labcourse.grading.reports import drawn_figure, rendered_words
from labcourse.grading.reports.predicted import Predicted, predicted
from labcourse.grading.reports.result import Result, asked, lapse, points, worth
from labcourse.grading.reports.templating import templates
from labcourse.grading.settings import FeedbackSettings
from labcourse.grading.verdicts import UNDECIDED, Status
from labcourse.safe_text import no_escapes

#: Style and sign; the words are there as well, for who cannot see colours or signs.
_LOOK = {
    Status.RIGHT: ("right", "✓"),
    Status.FOLLOW_THROUGH: ("follow", "✓"),
    Status.PARTLY: ("partly", "◐"),
    Status.WRONG: ("wrong", "✗"),
    Status.MISSING: ("missing", "○"),
    Status.FOR_A_PERSON: ("person", "…"),
    Status.BY_A_PERSON: ("person", "✎"),
    Status.NOT_MARKED: ("fault", "⚑"),
    Status.SUPPLIED: ("supplied", "↷"),
}
_LOST = (Status.PARTLY, Status.WRONG, Status.MISSING, Status.SUPPLIED)  # look at it again, whatever it is worth


@dataclass(frozen=True)
class Sums:
    """Points of several marks, in words; empty where there are none of that sort."""

    earned: str
    open: str
    out_of: str


def sums(marks: Iterable[Mark]) -> Sums:
    """The points of marks. What is not decided yet is not earned as 0."""
    marks = [mark for mark in marks if mark.out_of]
    decided = [mark for mark in marks if mark.status not in UNDECIDED]
    waiting = sum(mark.awaiting for mark in marks)
    faults = sum(mark.out_of for mark in marks if mark.status is Status.NOT_MARKED)
    left = [points(waiting)] if waiting else []
    left += [f"{points(faults)} not marked"] if faults else []
    return Sums(
        points(sum(mark.points for mark in decided)) if decided else "",
        " + ".join(left),
        points(sum(mark.out_of for mark in marks)) if marks else "",
    )


@dataclass(frozen=True)
class Shown:
    """A part of a question on the page: its mark, what was asked, and what was given, ready for the page."""

    mark: Mark
    prompt: str
    given: Markup

    @property
    def look(self) -> str:
        """The class of its style."""
        return _LOOK[self.mark.status][0]

    @property
    def sign(self) -> str:
        """A sign that says the same as the colour."""
        return _LOOK[self.mark.status][1]

    @property
    def status(self) -> str:
        """What became of it, in words."""
        return self.mark.status.value

    @property
    def earned(self) -> str:
        """Points in words."""
        mark = self.mark
        if mark.status in UNDECIDED:
            return f"{worth(mark.out_of)} not decided yet"
        return f"{points(mark.points)} of {worth(mark.out_of)}"


@dataclass(frozen=True)
class Asked:
    """A question on the page; section and notebook are empty where the catalogue does not have it any more."""

    number: str
    title: str
    section: str
    notebook: str
    parts: tuple[Shown, ...]
    comments: tuple[CommentRecord, ...]
    predicted: Predicted | None = None

    @property
    def place(self) -> str:
        """By which the page links to it."""
        return "q-" + re.sub(r"\W+", "-", self.number)

    @property
    def marks(self) -> list[Mark]:
        """Of its parts."""
        return [part.mark for part in self.parts]

    @property
    def sums(self) -> Sums:
        """Points of its parts."""
        return sums(self.marks)

    @property
    def all_well(self) -> bool:
        """Whether there is nothing to be seen in it but what is right."""
        well = (Status.RIGHT, Status.BY_A_PERSON)
        return not self.comments and all(one.status in well and one.points == one.out_of for one in self.marks)

    @property
    def nothing(self) -> bool:
        """Whether all of it is missing for one reason: then that is said once."""
        return all(one.status is Status.MISSING for one in self.marks) and len({one.reason for one in self.marks}) == 1

    @property
    def look_again(self) -> bool:
        """Whether points were lost in it, or would have been."""
        return any(
            one.status in _LOST or (one.status is Status.BY_A_PERSON and one.points < one.out_of) for one in self.marks
        )


@dataclass(frozen=True)
class Section:
    """A line of the summary."""

    section: str
    notebook: str
    questions: tuple[Asked, ...]

    @property
    def all_again(self) -> bool:
        """Whether every question of it is to be looked at again, and there are several."""
        return len(self.questions) > 1 and all(question.look_again for question in self.questions)

    @property
    def sums(self) -> Sums:
        """Points of its questions."""
        return sums(mark for question in self.questions for mark in question.marks)


#: What the key decided, and says why; all other reasons say what happened, or are a person's.
_BY_KEY = (Status.RIGHT, Status.FOLLOW_THROUGH, Status.PARTLY, Status.WRONG)


def page(
    result: Result,
    catalogue: Catalogue,
    title: str = "",
    run: RunRecord | None = None,
    term: str = "",
    seen: FeedbackSettings | None = None,
) -> str:
    """The feedback for a student as HTML.

    Parameters
    ----------
    result : what came out
    catalogue : what the questions are called, where they stand, and what they ask for
    title, term : of the course
    run : the run that counts, for figures and for answers in words
    seen : what students see of their marks; all of it unless given
    """
    seen = seen or FeedbackSettings()
    questions = _questions(result if seen.reasons else _without_reasons(result), catalogue, run)
    sections = [
        Section(section, notebook, tuple(group))
        for (section, notebook), group in groupby(questions, key=lambda one: (one.section, one.notebook))
    ]
    return (
        templates()
        .get_template("feedback.html")
        .render(
            result=result,
            seen=seen,
            questions=questions,
            sections=sections,
            total=sums(result.marks),
            account=result.account,
            final=_final(result.account),
            general=[one for one in result.comments if one.question is None],
            lapsed=list(map(lapse, result.lapsed)),
            course=" · ".join(filter(None, (title, term))),
            points=points,
            asked=asked,
        )
        + "\n"
    )


def _final(account: Account | None) -> str:
    """The final grade, with all of its decimals; "" while there is none."""
    return "" if account is None or account.final is None else to_decimals(account.final, account.marks.decimals)


def not_open_yet(result: Result, opens: datetime, title: str = "", term: str = "") -> str:
    """What stands in the feedback's place until it opens: when that is, and what went wrong with the hand-in.

    Parameters
    ----------
    result : what came out
    opens : when feedback may be seen
    title, term : of the course
    """
    course = " · ".join(filter(None, (title, term)))
    return (
        templates()
        .get_template("not_open_yet.html")
        .render(result=result, opens=f"{opens:%Y-%m-%d %H:%M %Z}", course=course)
        + "\n"
    )


def _without_reasons(result: Result) -> Result:
    marks = tuple(replace(mark, reason="") if mark.status in _BY_KEY else mark for mark in result.marks)
    return replace(result, marks=marks)


def _questions(result: Result, catalogue: Catalogue, run: RunRecord | None) -> list[Asked]:
    figures = {} if run is None else figures_of(run, catalogue)
    words = {} if run is None else run.words
    foretold = predicted(run, catalogue)
    found = []
    for number, marks in groupby(result.marks, key=lambda mark: mark.question):
        question = catalogue.marked.get(number, Question(number, "", "", "", (), ()))
        parts = {part.name: part for part in question.parts}
        shown = tuple(_shown(mark, parts.get(mark.part), figures, words) for mark in marks)
        comments = tuple(one for one in result.comments if one.question == number)
        found.append(
            Asked(
                number,
                question.title,
                question.section,
                question.notebook,
                shown,
                comments,
                foretold.get(number),
            )
        )
    return found


def _shown(mark: Mark, part: Part | None, figures: Mapping[tuple[str, str], Markup], words: Mapping[str, Any]) -> Shown:
    written = words.get(mark.question, {}).get(mark.part)
    figure = figures.get((mark.question, mark.part))
    if written is not None:
        words_shown = rendered_words.as_html(written["text"], pictures_of(written))
        given = Markup('<div class="given words">{}</div>').format(words_shown)
    elif figure is not None:
        given = figure
    elif part is not None and part.kind == WHOLE:  # its texts stand on the page by themselves
        pdf = report_files.named_in(mark.given)
        given = Markup('<div class="given data">{}</div>').format(pdf) if pdf else Markup("")
    elif mark.given:
        kind = "prose" if part is not None and part.kind == "prose" else "data"
        given = Markup('<div class="given {}">{}</div>').format(
            kind, no_escapes(report_files.without_digests(mark.given))
        )
    else:
        given = Markup("")
    return Shown(mark, part.prompt if part is not None else "", given)


def pictures_of(written: Mapping[str, Any]) -> dict[str, bytes]:
    """The pictures of an answer in words; one that cannot be read is left out."""
    pictures = {}
    for name, coded in written.get("pictures", {}).items():
        try:
            pictures[name] = base64.b64decode(coded, validate=True)
        except (binascii.Error, TypeError, ValueError):
            continue
    return pictures


def figures_of(
    run: RunRecord, catalogue: Catalogue, only: Collection[tuple[str, str]] | None = None
) -> dict[tuple[str, str], Markup]:
    """The student's figures, drawn again; what the strict reader does not take is none. All of them, or only some."""
    try:
        claimed = answers.parse(run.answers or b"")["answers"]
    except AnswerError:
        return {}
    drawn = {}
    for number, parts in claimed.items():
        question = catalogue.everything.get(number)
        for part in question.parts if question is not None else ():
            wanted = only is None or (number, part.name) in only
            if part.kind == "figure" and part.name in parts and wanted:
                try:
                    drawn[number, part.name] = drawn_figure.drawn(forms.decode(part, parts[part.name])["axes"])
                except (AnswerError, ArithmeticError, ValueError, RecursionError):
                    continue
    return drawn
