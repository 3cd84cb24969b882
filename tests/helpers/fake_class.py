"""A class whose runs are made up: what a batch does with what comes in and what runs leave, without a sandbox."""

import json

from made_courses import loaded

from labcourse.answers.cell_reports import REPORTS_FILE
from labcourse.benches import THEIR_OWN
from labcourse.files import ANSWERS_FILE
from labcourse.grading import batch, counting
from labcourse.grading.batch import Batch, Settings
from labcourse.grading.gradebook import Gradebook
from labcourse.grading.marking import marking_processes as marker
from labcourse.grading.running.bundle import Bundle, Chosen
from solutions.true_bench import TrueBench

KEY = """
from labcourse.grading.marking.checks import ForAPerson, Number

KEY = {{
    "2.11": {{
        "omega_n": Number("the natural frequency", lambda bench: {factor} * bench.omega_n, rtol=0.05),
        "explanation": ForAPerson(),
    }},
    "0.1": {{"resolution": Number("the resolution", lambda bench: 0.0015, rtol=0.1)}},
}}
"""


def left(answers=None, problems=(), reports=b""):
    """Return what a run leaves: its files, and what went wrong."""
    files = {REPORTS_FILE: reports} | ({} if answers is None else {ANSWERS_FILE: answers})
    return files, tuple(problems)


class InlineMarker:
    """Marks in this process."""

    def __init__(self, course, processes):
        self.course = course

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def warm_up(self):
        pass

    def mark(self, submission):
        marker._courses[:] = [self.course]
        submission.marks, problems, notes = marker._mark_answers(submission)
        submission.problems += problems
        submission.notes += notes


class OneBundle:
    """Every hand-in is run with the same."""

    def __init__(self, made):
        self.current, self.names = made, tuple(made.pristine)
        self.problems = []

    def digest(self):
        return self.current.digest

    def masters(self, name):
        return [{cell["id"]: cell for cell in self.current.pristine[name]["cells"]}]

    def choose(self, notebooks, course_json):
        return Chosen(self.current)


CELLS = [
    {"id": "q1", "cell_type": "code", "source": "", "metadata": {"nbgrader": {"grade_id": "q1", "solution": True}}},
    {"id": "q1-answer", "cell_type": "code", "source": 'lab.answer("2.11", omega_n=omega_n)', "metadata": {}},
    {"id": "q2", "cell_type": "code", "source": "", "metadata": {"nbgrader": {"grade_id": "q2", "solution": True}}},
    {"id": "q2-answer", "cell_type": "code", "source": 'lab.answer("0.1", resolution=omega_n)', "metadata": {}},
]


class FakeClass:
    """Submissions of one cell each, whose runs are made up.

    Attributes
    ----------
    runs : students that were run, in order
    leaves : what a run leaves: student → files and problems, or an exception; a perfect run without
    """

    def __init__(self, folder, monkeypatch):
        self.folder, self.runs, self.leaves, self.seeds, self.asked = folder, [], {}, {}, {}
        self.key(1.0)
        self.made = Bundle(b"", {"a.ipynb": {"cells": CELLS}}, {}, (), "0" * 64, self.course.catalogue)
        monkeypatch.setattr(batch, "Bundles", lambda course: OneBundle(self.made))
        monkeypatch.setattr(batch.runner, "run", self.work)
        for grading in (batch, counting):
            monkeypatch.setattr(grading, "Marker", InlineMarker)

    def key(self, factor):
        self.terms = getattr(self, "terms", 0) + 1  # a course is loaded once in a program
        self.course = loaded(self.folder / f"term-{self.terms}", key=KEY.format(factor=factor))

    def hand_in(self, *students, source="omega_n = 1"):
        for student in students:
            (self.folder / "in" / student).mkdir(parents=True, exist_ok=True)
            cell = {"id": "q1", "cell_type": "code", "source": source, "metadata": {}}
            (self.folder / "in" / student / "a.ipynb").write_text(json.dumps({"cells": [cell]}))

    def work(self, packed, job, cancelled=None):
        self.runs.append(job.student)
        self.seeds[job.student] = job.probe_seed
        came = self.leaves.get(job.student) or left(perfect(job.student, job.probe_seed))
        if isinstance(came, Exception):
            raise came
        self.asked[job.student] = job
        return came

    def grade(self, book="book.sqlite", **settings):
        """Grade; each student's points."""
        with Gradebook(self.folder / book) as gradebook:
            steps = list(Batch(self.folder / "in", self.course, gradebook, Settings(**settings)).grade())
        return {step.graded.run.student: sum(mark.points for mark in step.graded.marks) for step in steps}

    def book(self, name="book.sqlite"):
        return Gradebook(self.folder / name)


def perfect(student, seed, omega_n=None, bench=None):
    """What is left by a run of somebody who answers 2.11 rightly."""
    value = TrueBench(student, THEIR_OWN).omega_n if omega_n is None else omega_n
    answers = {"omega_n": {"kind": "number", "value": value}, "explanation": {"kind": "prose", "value": "So."}}
    book = {"format": 2, "student": student, "bench": bench or {"uri": "virtual"}}
    book |= {"software": "rotflex", "probe_seed": seed}
    return json.dumps({**book, "answers": {"2.11": answers}}).encode()
