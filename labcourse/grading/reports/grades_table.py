"""``grades.csv``: a row for each student, with and without a submission.

=====================  ================================================================================================
student, name, email,  as the roster has them
section
one for each question  points earned; empty where nothing of it is decided yet, and where nothing was handed in
total                  points earned so far; empty as above
out_of                 maximum of the points
final                  the final grade by the course's settings; empty while something that counts is not decided
final out of           its scale
how it counts          what is special about it: what was left out, has another weight, came late, ...
awaiting a person      points that wait for a person; out_of includes them, total does not
not marked             points that could not be marked, through a fault of the key; in out_of, not in total
undecided              question and part of what waits, or could not be marked
notes                  trouble, what else is worth knowing, how it was run; or why there are no points
=====================  ================================================================================================
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from labcourse.grading.accounts import Account
from labcourse.grading.accounts.exact import exact, in_full, to_decimals
from labcourse.grading.gradebook import StudentRecord
from labcourse.grading.reports.result import Result, asked, lapse, points
from labcourse.safe_text import as_csv

NOTHING_HANDED_IN = "nothing handed in"
NOT_GRADED_YET = "handed in, not graded yet"
_TOTALS = ("total", "out_of", "final", "final out of", "how it counts")
_LAST = (*_TOTALS, "awaiting a person", "not marked", "undecided")


@dataclass(frozen=True)
class Unmarked:
    """A student without marks, and why."""

    about: StudentRecord
    why: str = NOTHING_HANDED_IN


def text(rows: Sequence[Result | Unmarked], order: Iterable[str] = ()) -> str:
    """The whole table.

    Parameters
    ----------
    rows : everybody, in the order of the rows
    order : the questions, in the order of their columns; those that only a row has come behind
    """
    earned = [row.by_question() for row in rows if isinstance(row, Result)]
    there = dict.fromkeys(number for one in earned for number in one)
    questions = list(dict.fromkeys([*(number for number in order if number in there), *there]))
    heads = ["student", "name", "email", "section", *questions, *_LAST, "notes"]
    lines = (_marked(row, questions) if isinstance(row, Result) else _unmarked(row, questions) for row in rows)
    return as_csv([heads, *lines])


def _marked(row: Result, questions: Sequence[str]) -> list[str]:
    sums = row.by_question()
    earned = [sums.get(number, (None, 0.0))[0] for number in questions]
    some = not sums or any(one is not None for one, _possible in sums.values())
    undecided = "; ".join(f"{mark.question} {mark.part}" for mark in row.undecided())
    requests = [f"{one.question}, {one.part}: {asked(one)}" for one in row.requests]
    notes = [*row.problems, *map(lapse, row.lapsed), *requests, *row.notes, row.stamp]
    return [
        *(row.student, row.name, row.email, row.section),
        *("" if one is None else points(one) for one in earned),
        points(row.total) if some else "",
        points(row.out_of),
        *_final(row.account),
        points(row.awaiting),
        points(row.not_marked),
        undecided,
        " ".join(notes),
    ]


def _final(account: Account | None) -> list[str]:
    if account is None:
        return ["", "", ""]
    final = "" if account.final is None else to_decimals(account.final, account.marks.decimals)
    return [final, in_full(exact(account.final_out_of)), "; ".join(account.how())]


def _unmarked(row: Unmarked, questions: Sequence[str]) -> list[str]:
    about = row.about
    return [about.student, about.name, about.email, about.section, *("" for _number in (*questions, *_LAST)), row.why]
