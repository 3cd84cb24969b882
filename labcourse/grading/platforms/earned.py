"""What each student has by the gradebook, as it would stand in a platform; or what they still wait for."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from labcourse import program
from labcourse.grading.accounts.account import Account
from labcourse.grading.accounts.exact import exact
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Gradebook, StudentRecord
from labcourse.grading.reports.result import result_in
from labcourse.messages import listed
from labcourse.student_id import caseless

_NAMED = 6  # parts that wait, in a message


@dataclass(frozen=True)
class Earned:
    """What a student has.

    Attributes
    ----------
    share : of all that there is, exactly, 1 for everything; None where there is nothing of theirs
    waits : what a person has yet to decide, in words; "" where all is decided
    why_none : why there is nothing, in words
    """

    share: Fraction | None
    waits: str = ""
    why_none: str = ""


def earned(book: Gradebook, course: Course) -> dict[str, Earned]:
    """What everybody in the gradebook and its roster has by a course's settings, by ID."""
    handed_in = set(map(caseless, book.handed_in()))
    return {one.student: _of_student(book, course, one, caseless(one.student) in handed_in) for one in book.students()}


def _of_student(book: Gradebook, course: Course, about: StudentRecord, handed_in: bool) -> Earned:
    graded = book.current(about.student)
    if graded is None:
        why = "handed in, and not graded yet" if handed_in else "nothing handed in"
        return Earned(None, why_none=why)
    result = result_in(book, course, graded, about)
    if result.not_graded:
        return Earned(None, why_none=f"not graded, as grading failed; say {program.name()} grade again")
    account = result.account
    return Earned(None, why_none="it is out of no points") if account is None else of_account(account)


def of_account(account: Account) -> Earned:
    """What an account comes to, with weights, lateness and rounding; undecided, as far as it is decided."""
    if not account.out_of:
        return Earned(None, why_none="it is out of no points")
    if account.final is None:
        waits = listed([f"{mark.question} {mark.part}" for mark in account.undecided], _NAMED)
        return Earned(account.earned / account.out_of, waits)
    return Earned(exact(account.final) / exact(account.final_out_of))
