"""A class with marks of every part of this course, made up at random: what is made of marks, without any run."""

import random
from dataclasses import replace
from pathlib import Path

from gradebooks import enrol, record
from made_courses import OURS

from labcourse.grading.gradebook import Gradebook, Graded, RunRecord
from labcourse.grading.marks import Mark, Status

SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)
BY_MACHINE = {0.0: "wrong", 1.0: "right"}


def marks(drawn: random.Random, waiting: float) -> list[Mark]:
    """Marks of one student: each part right, wrong, partly right, missing, given by a person, or waiting for one.

    Parameters
    ----------
    drawn : the same gives the same
    waiting : share of what a person reads that waits
    """
    found = []
    for number, question in OURS.catalogue.marked.items():
        for part in question.parts:
            share = drawn.choice(SHARES)
            if drawn.random() < 0.1:
                share, status = 0.0, "missing"
            elif part.marked != "person":
                status = BY_MACHINE.get(share, "partly right")
            elif drawn.random() < waiting:
                share, status = 0.0, "for a person"
            else:
                status = "given by a person"
            found.append(Mark(number, part.name, status, share * part.points, part.points, "So."))
    return found


def put(book: Gradebook, student: str, found: list[Mark]) -> None:
    """Put a run with these marks into a gradebook; those by a person are given by one."""
    by_person = [mark for mark in found if mark.status == Status.BY_A_PERSON]
    waiting = {mark.where: replace(mark, status=Status.FOR_A_PERSON, points=0.0) for mark in by_person}
    record(book, graded(student, [waiting.get(mark.where, mark) for mark in found]))
    for mark in by_person:
        book.set_mark(student, mark.question, mark.part, mark.points, reason="So.", actor="tutor")


def graded(student: str, found: list[Mark]) -> Graded:
    """A run with these marks."""
    run = RunRecord(
        key=f"run of {student}",
        student=student,
        submission="first",
        master="m",
        software="rotflex 0",
        probe_seed=7,
        isolation="Run in isolation.",
    )
    return Graded(run, tuple(found), "key 1")


def gradebook(folder: Path, sizes: dict[str, int]) -> Path:
    """A gradebook's file in a folder: name of a section → its size; a person has read one student of each section."""
    drawn = random.Random(1)
    students = [(section, number) for section, size in sizes.items() for number in range(size)]
    letter = {section: chr(ord("a") + index) for index, section in enumerate(sizes)}
    with Gradebook(folder / "book.sqlite") as book:
        enrol(book, folder, *((f"{letter[one]}-{n:02}", f"Student {n} of {one}", "", one) for one, n in students))
        for section, number in students:
            put(book, f"{letter[section]}-{number:02}", marks(drawn, waiting=1.0 if number else 0.3))
    return folder / "book.sqlite"


def by_definition(marks: list[Mark], codes: set[str]) -> tuple[float, float, float, int]:
    """Points earned, points decided, points possible, and parts that wait, of all parts with one of the codes."""
    earned = decided = possible = 0.0
    waiting = 0
    for number, question in {**OURS.catalogue.everything, **OURS.catalogue.judged}.items():
        for part in question.parts:
            for mark in marks:
                if (mark.question, mark.part) != (number, part.name) or part.outcome not in codes or not mark.out_of:
                    continue
                possible += mark.out_of
                if mark.status in ("for a person", "not marked: key fault"):
                    waiting += 1
                else:
                    earned += mark.points
                    decided += mark.out_of
    return earned, decided, possible, waiting
