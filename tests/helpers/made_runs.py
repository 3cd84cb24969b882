"""Runs with their marks, made up for tests of what a gradebook keeps."""

from labcourse.grading.gradebook import Graded, RunRecord
from labcourse.grading.marks import Mark
from labcourse.problems import Code, Problem


def mark(question="2.11", part="K_s", status="right", points=2.0, out_of=2.0, reason="Well.", given="1.3"):
    return Mark(question, part, status, points, out_of, reason, given)


def prose(given="Because it bends.", points=0.0, status="for a person", reason="A person will read this.", **more):
    return mark("2.12", "why", status, points, 3.0, reason, given, **more)


def graded(student="ada", submission="first", *marks, key="", key_digest="key 1", **run):
    values = {"master": "m", "software": "rotflex 0", "probe_seed": 7, "isolation": "isolated", "answers": b"{}"} | run
    key = key or f"{student.casefold()} {submission}"
    return Graded(
        RunRecord(key=key, student=student, submission=submission, **values), marks or (mark(), prose()), key_digest
    )


def record(book, what, actor="batch", reason="Graded."):
    return book.record(what, actor, reason)


def small_class():
    return [
        graded("ada"),
        graded("ada", "second", mark(points=1.0), prose()),
        graded("bob", answers=None, problems=(Problem.of(Code.NO_ANSWERS_LEFT),)),
        graded("bob", key="another key", software="rotflex 1"),
        graded("Çelik", "x", *[mark(str(number)) for number in range(12)]),
    ]
