"""Take a person who is erased out of other students' runs and files, above all out of those of their partners."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

from labcourse import files
from labcourse.benches import OWN, SAME, BenchPolicy
from labcourse.files import ANSWERS_FILE, COURSE_FILE
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Gradebook, RunRecord
from labcourse.grading.gradebook.persons import OfOthers, Person
from labcourse.grading.graded_run import Facts, facts_of
from labcourse.student_id import caseless


def of_others(book: Gradebook, course: Course, student: str) -> OfOthers:
    """Return how other students' runs and files change when a student is erased.

    Partners keep their work and their marks. Their bench was drawn from the student's ID: it is stored by its seed
    instead, under the ID of the first of the partners. Recordings of a laboratory's bench name nobody.
    """
    partners = [
        graded.run.student
        for graded in book.all_current()
        if _is(student, facts_of(graded.run).bench_of) and not _is(student, graded.run.student)
    ]
    first = min(partners, key=caseless, default="")

    def run(record: RunRecord, person: Person) -> RunRecord:
        before = facts_of(record)
        new = _struck(before, person)
        content = record.answers
        if _is(student, before.bench_of):
            policy = _same_bench(before, course, student)
            if policy is not None:
                new = new.model_copy(update={"policy": policy, "bench_of": first or record.student})
                content = _of_student(content, first or record.student)
        if new == before and content == record.answers:
            return record
        cells = new.as_json() if record.cells else ()
        problems, notes = (tuple(map(person.redacted, texts)) for texts in (record.problems, record.notes))
        return replace(record, answers=content, cells=cells, problems=problems, notes=notes)

    return OfOthers(run, _file, lambda record, person: _is(student, facts_of(record).bench_of))


def _is(student: str, other: str) -> bool:
    return caseless(student) == caseless(other)


def _struck(facts: Facts, person: Person) -> Facts:
    messages = {name: tuple(map(person.redacted, getattr(facts, name))) for name in ("ended", "problems", "notes")}
    missing = [(question, part, person.redacted(why)) for question, part, why in facts.missing]
    return facts.model_copy(update={**messages, "missing": missing})


def _same_bench(facts: Facts, course: Course, student: str) -> BenchPolicy | None:
    """Return the policy that gives the same bench without the student's ID; None if there is none."""
    policy = course.settings.bench if facts.policy is None else facts.policy
    if policy.which != OWN:
        return policy
    return None if course.own_seed is None else BenchPolicy(SAME, course.own_seed(student), draw=policy.draw)


def _object(content: bytes) -> dict[str, Any] | None:
    """Return the object in a file of JSON; None if there is none."""
    try:
        data = files.from_json(content)
    except ValueError:
        return None
    return data if isinstance(data, dict) else None


def _of_student(content: bytes | None, student: str) -> bytes | None:
    """Return an ``answers.json`` with another student's ID."""
    data = _object(content or b"")
    return content if data is None else json.dumps({**data, "student": student}).encode()


def _file(name: str, content: bytes, person: Person) -> bytes:
    """Take the person out of a file that names its students. Other files stay as they are."""
    data = _object(content) if name in (COURSE_FILE, ANSWERS_FILE) and person.named_in(content) else None
    if data is None:
        return content
    if _is(person.student, str(data.get("student"))):
        data["student"] = ""
    if isinstance(data.get("with"), list):
        data["with"] = [partner for partner in data["with"] if not _is(person.student, str(partner))]
    return (json.dumps(data, ensure_ascii=False) + "\n").encode()
