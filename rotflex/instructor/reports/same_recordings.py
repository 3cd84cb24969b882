"""Recordings whose samples are another's: each student's bench differs, and so does what is measured on it.

Looked at are what was recorded at home, by the ``answers.json`` that was handed in, and what was recorded when it was
run. Where all students have one bench, equal samples say nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotflex.courseware import answers
from rotflex.courseware.benches import OWN, REAL
from rotflex.courseware.messages import _
from rotflex.errors import AnswerError
from rotflex.instructor.gradebook import Graded
from rotflex.instructor.graded_run import facts_of

SAME = 0.002  #: of a channel's largest sample: less than a step of a sensor
_KIND, _BENCH = "recording", "bench"  # of an answer, and what its metadata have of whatever was measured

Where = tuple[str, str]


@dataclass(frozen=True)
class Recorded:
    """What a student recorded.

    Attributes
    ----------
    student : the ID
    group : the same for all who work together
    samples : where it is the answer → names of the channels, and their samples, each with a largest of 1
    """

    student: str
    group: str
    samples: Mapping[Where, Sequence[tuple[tuple[str, ...], NDArray[np.float64]]]]


def recorded(graded: Graded, group: str, claim: bytes | None = None) -> Recorded:
    """What a student recorded, on a bench of their own.

    Parameters
    ----------
    graded : the run that counts
    group : the same for all who work together
    claim : the ``answers.json`` that was handed in
    """
    policy = facts_of(graded.run).policy
    found: dict[Where, list[tuple[tuple[str, ...], NDArray[np.float64]]]] = {}
    if policy is None or policy.which in (OWN, REAL):
        for data in (graded.run.answers, claim):
            for where, content in _answers(data):
                samples = _samples(content)
                if samples is not None:
                    found.setdefault(where, []).append(samples)
    return Recorded(graded.run.student, group, found)


def _answers(data: bytes | None) -> Iterator[tuple[Where, Mapping[str, Any]]]:
    try:
        content = answers.parse(data or b"")["answers"]
    except AnswerError:
        return
    for question, parts in content.items():
        for part, one in parts.items():
            if isinstance(one, Mapping) and one.get("kind") == _KIND:
                yield (question, part), one


def _samples(content: Mapping[str, Any]) -> tuple[tuple[str, ...], NDArray[np.float64]] | None:
    """The channels of a recording of a bench, one row each; None where it is none. What says so is a stranger."""
    try:
        if not isinstance(content["metadata"][_BENCH], Mapping):
            return None
        names = tuple(sorted(content["channels"]))
        rows = np.array([content["channels"][name]["values"] for name in names], dtype=float)
    except (KeyError, TypeError, ValueError, OverflowError):
        return None
    if rows.ndim != 2 or not rows.size or not np.isfinite(rows).all():
        return None
    largest = np.abs(rows).max(axis=1, keepdims=True)
    moves = np.ptp(rows, axis=1) > 0
    return (names, rows / np.where(largest > 0, largest, 1.0)) if moves.any() else None


def hints(everybody: Sequence[Recorded]) -> list[tuple[tuple[str, str], str]]:
    """Pairs of students who do not work together and have the same recording, and a line on each."""
    found: dict[tuple[str, str], list[Where]] = {}
    wheres = dict.fromkeys(where for one in everybody for where in one.samples)
    for where in wheres:
        for one, other in combinations((each for each in everybody if where in each.samples), 2):
            if one.group != other.group and _same(one.samples[where], other.samples[where]):
                found.setdefault((one.student, other.student), []).append(where)
    line = _("{students} have the same samples in {where}, though each has a bench of their own.")
    return [(pair, line.format(students=", ".join(pair), where=_places(those))) for pair, those in found.items()]


def _same(some: Iterable[tuple[Any, NDArray[np.float64]]], others: Sequence[tuple[Any, NDArray[np.float64]]]) -> bool:
    return any(
        names == theirs and rows.shape == samples.shape and bool((np.abs(rows - samples) <= SAME).all())
        for names, rows in some
        for theirs, samples in others
    )


def _places(wheres: Iterable[Where]) -> str:
    return ", ".join(f"{question} {part}" for question, part in wheres)
