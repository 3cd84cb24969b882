"""A class on some day of the term, made up: what is missing, stopped, waits, went wrong, and was given back."""

import json
from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from hashlib import sha256
from pathlib import Path
from typing import Any

import gradebooks
from gradebooks import enrol, facts, mark, prose, record, report_text
from made_courses import OURS

from labcourse.grading.course import Course
from labcourse.grading.gradebook import Delivery, Gradebook, Graded
from labcourse.grading.marking.marking_processes import marking_digest
from labcourse.grading.marks import Mark
from labcourse.grading.settings import Assignment
from labcourse.problems import Code, Problem

FIRST, SECOND = "02_finding_stiffness", "03_model_validation"
HANDED_IN = datetime(2026, 3, 2, 12, tzinfo=UTC)
NOW = datetime(2026, 4, 1, 12, tzinfo=UTC)
NAMES = {"ada": "Ada Lovelace", "bob": "Bob Bell", "cleo": "", "dan": "Dan Dee", "eve": "Eve <b>Early</b>"}
NAMES |= {"fay": "Fay Foot", "gus": "Gus Gray"}
IN_HZ = "It is {off:.3g} rad/s off; it looks like Hz."
NEAR = "It is {off:.3g} rad/s off."


def stiffness(status: str = "right", points: float = 2.0, reason: str = "Well.") -> Mark:
    return Mark("2.12", "K_s", status, points, 2.0, reason, "1.5 N·m/rad")


def off(pattern: str, by: float) -> Mark:
    return mark("wrong", 0.0, pattern.format(off=by), f"{by} rad/s")


def graded(student: str, *marks: Mark, **run: Any) -> Graded:
    """A run that is marked by the present key."""
    return gradebooks.graded(student, *marks, **{"key": marking_digest(OURS), **run})


def term(**settings: Any) -> Course:
    """The course in which 02 and 03 are due two days before NOW, and all else 60 days after it."""
    names = [name for name in OURS.asked_catalogue.notebooks if name not in (FIRST, SECOND)]
    labs = [Assignment(f"Lab {name[:2]}", (name,), NOW - timedelta(days=2)) for name in (FIRST, SECOND)]
    later = Assignment("Later", tuple(names), NOW + timedelta(days=60))
    return replace(OURS, settings=replace(OURS.settings, **{"assignments": (*labs, later), **settings}))


def notebook(code: str = "") -> bytes:
    cell = {"cell_type": "code", "id": "own", "metadata": {}, "source": code}
    return json.dumps({"cells": [cell], "metadata": {}, "nbformat": 4, "nbformat_minor": 5}).encode()


def deliver(book: Gradebook, student: str, files: Mapping[str, bytes], when: datetime = HANDED_IN) -> None:
    made = [Delivery(name, sha256(content).hexdigest(), content, when, "a zip") for name, content in files.items()]
    book.deliver(student, made)


def fill(book: Gradebook, folder: Path) -> None:
    """Seven on the roster; gus hands in nothing, and hal is on no roster."""
    enrol(book, folder, *((student, name, f"{student}@uni", "A") for student, name in NAMES.items()))
    both = ("02_finding_stiffness.ipynb", "03_model_validation.ipynb")
    for student in ("ada", "bob", "cleo", "dan", "eve"):
        deliver(book, student, dict.fromkeys(both, notebook(f"{student} = 1")))
    deliver(book, "fay", {both[0]: notebook("fay = 2")})
    deliver(book, "hal", {both[0]: notebook("hal = 3")})
    ended = (Problem.of(Code.RUN_TIMED_OUT, seconds=600),)
    fault = Problem.of(Code.KEY_FAILED, question="2.12", part="K_s", error="KeyError, key.py, line 5.")
    record(
        book,
        graded("ada", mark(), stiffness(), prose(), report_text()),
        graded("bob", off(IN_HZ, 16.3), stiffness("wrong", 0.0, "With the frequency in Hz."), prose(), report_text()),
        graded("cleo", off(IN_HZ, 15.9), stiffness(), prose("missing", given=""), report_text()),
        graded("dan", off(NEAR, 3.25), stiffness("partly right", 1.0, "Two digits."), prose(), report_text()),
        graded(
            "eve",
            mark("missing", 0.0, given=""),
            stiffness("not marked: key fault", 0.0, "ask"),
            prose("missing", given=""),
            report_text("missing", given=""),
            cells=facts(ended=ended),
            problems=(*ended, fault, Problem.of(Code.SAID_BY_COURSE, text="Odd: <i>")),
            supplied={"2.9.sweep": 1},
        ),
        graded("fay", mark(), stiffness(), prose(), report_text()),
    )


def score(book: Gradebook) -> None:
    """The scorer tia decides two, and asks about one; fay and ada ask for another look; ada gets an answer."""
    book.scores.give("ada", ("2.11", "explanation"), 1.0, "tia", level=4)
    book.scores.give("bob", ("2.11", "explanation"), 0.5, "tia", level=2, remark="Say why.")
    book.scores.ask("dan", ("2.11", "explanation"), "tia", remark="Is <this> right?\x1b[2J")
    book.comment("fay", "I think <b>it</b> is right.", actor="lea", question="2.12", part="K_s", asks=True)
    book.comment("ada", "Please look again.", actor="lea", question="2.11", part="omega_n", asks=True)
    book.comment("ada", "It stays as it is.", actor="tia", question="2.11", part="omega_n")
