"""What a single slip costs: the course worked through with it, and marked."""

import contextlib
import io
import tempfile
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from made_courses import OURS
from single_slips import STUDENT, Slip
from working_through import FULL, Pen, Where, recorded

import rotflex.course.lab
from labcourse.answers import forms
from labcourse.grading.marking.decoding import decode
from labcourse.grading.marking.marking import mark
from labcourse.grading.submission import Submission
from labcourse.sentences import sentence
from rotflex.hil.student_benches import student_seed
from solutions.true_bench import TrueBench

Lost = dict[Where, tuple[float, str]]  # points lost, and the reason that is told


@cache
def _bench() -> TrueBench:
    return TrueBench(STUDENT)


@cache
def right() -> tuple[dict[str, dict[str, Any]], bytes]:
    """The answers without a slip, as they are given and as they are recorded."""
    given: dict[str, dict[str, Any]] = {}
    return given, answers_with(None, given)


def secrets() -> list[str]:
    """What the bench really is, as a reason would say it."""
    bench = _bench()
    return [f"{value:#.4g}" for value in (bench.K_s, bench.omega_n, bench.omega_n / (2 * np.pi))]


def alone(slip: Slip) -> tuple[float, str]:
    """Share of its part's points that a slip loses where all else is right, and the reason."""
    given, data = right()
    (question, name), seed = slip.where, student_seed(STUDENT)
    part, claims = OURS.catalogue.find(question).part(name), decode(data, seed, OURS.catalogue)
    changed = slip.change(given[question][name], given)
    claims.contents[slip.where] = forms.encode(part, changed, seed).content
    claims.values[slip.where] = forms.decode(part, claims.contents[slip.where])
    marks = mark(
        replace(OURS, key={question: OURS.key[question]}),
        claims,
        _bench(),
        Submission(student=STUDENT, probe_seed=seed),
    )
    (one,) = [one for one in marks if one.part == name]
    return 1 - one.points / one.out_of, sentence(one.reason)


def answers_with(slip: Slip | None, given: dict[str, dict[str, Any]] | None = None) -> bytes:
    """The bytes of the ``answers.json`` of a student with a slip, or with none. Answers go into ``given``."""
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        lab = rotflex.course.lab.start(STUDENT, folder=Path(folder), quiet=True)
        write = Pen({})
        if given is not None:
            write.answers = given
        if slip is not None:
            write.mistakes = {slip.where: lambda right: slip.change(right, write.answers)}
        return recorded(lab, write)


def lost_by(data: bytes) -> Lost:
    """What a file of answers loses, of the parts that are marked automatically."""
    seed = student_seed(STUDENT)
    submission = Submission(student=STUDENT, probe_seed=seed)
    claims = decode(data, seed, OURS.catalogue)
    marks = {(one.question, one.part): one for one in mark(OURS, claims, _bench(), submission)}
    return {
        where: (one.out_of - one.points, f"{one.status.value}: {sentence(one.reason)}")
        for where, one in marks.items()
        if where in FULL and one.points < one.out_of
    }
