"""What becomes of others' runs and files that name a person who is erased: who worked with them, above all."""

from __future__ import annotations

import json
from dataclasses import replace

from labcourse import files
from labcourse.benches import OWN, SAME, BenchPolicy
from labcourse.files import ANSWERS_FILE, COURSE_FILE
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Gradebook, RunRecord
from labcourse.grading.gradebook.persons import OfOthers, Person
from labcourse.grading.graded_run import Facts, facts_of
from labcourse.student_id import caseless


def of_others(book: Gradebook, course: Course, student: str) -> OfOthers:
    """What becomes of what others have, when a student is erased.

    Who handed in with them keeps their work and their marks. Its bench, which was drawn from the student's ID, is kept
    by its seed; it bears the ID of the first of those who are left. Recordings of a laboratory's bench name nobody.
    """
    with_them = [
        one.run.student
        for one in book.all_current()
        if _is(student, facts_of(one.run).bench_of) and not _is(student, one.run.student)
    ]
    heir = min(with_them, key=caseless, default="")

    def run(record: RunRecord, person: Person) -> RunRecord:
        before = facts_of(record)
        new = _struck(before, person)
        content = record.answers
        if _is(student, before.bench_of):
            policy = _kept_bench(before, course, student)
            if policy is not None:
                new = new.model_copy(update={"policy": policy, "bench_of": heir or record.student})
                content = _of_student(content, heir or record.student)
        if new == before and content == record.answers:
            return record
        cells = new.as_json() if record.cells else ()
        problems, notes = (tuple(map(person.struck, said)) for said in (record.problems, record.notes))
        return replace(record, answers=content, cells=cells, problems=problems, notes=notes)

    return OfOthers(run, _file, lambda record, person: _is(student, facts_of(record).bench_of))


def _is(student: str, other: str) -> bool:
    return caseless(student) == caseless(other)


def _struck(facts: Facts, person: Person) -> Facts:
    messages = {name: tuple(map(person.struck, getattr(facts, name))) for name in ("ended", "problems", "notes")}
    missing = [(question, part, person.struck(why)) for question, part, why in facts.missing]
    return facts.model_copy(update={**messages, "missing": missing})


def _kept_bench(facts: Facts, course: Course, student: str) -> BenchPolicy | None:
    """The policy by which the same bench is given without the student's ID; None where there is none."""
    policy = course.settings.bench if facts.policy is None else facts.policy
    if policy.which != OWN:
        return policy
    return None if course.own_seed is None else BenchPolicy(SAME, course.own_seed(student), draw=policy.draw)


def _of_student(content: bytes | None, student: str) -> bytes | None:
    """An ``answers.json`` that says of whose bench it is, with another ID."""
    try:
        said = files.from_json(content or b"")
    except ValueError:
        return content
    return json.dumps({**said, "student": student}).encode() if isinstance(said, dict) else content


def _file(name: str, content: bytes, person: Person) -> bytes:
    """A file that another handed in. Those that say whose it is do so without the person; others stay as they are."""
    if name not in (COURSE_FILE, ANSWERS_FILE) or not person.named_in(content):
        return content
    try:
        said = files.from_json(content)
    except ValueError:
        return content
    if not isinstance(said, dict):
        return content
    if _is(person.student, str(said.get("student"))):
        said["student"] = ""
    if isinstance(said.get("with"), list):
        said["with"] = [one for one in said["with"] if not _is(person.student, str(one))]
    return (json.dumps(said, ensure_ascii=False) + "\n").encode()
