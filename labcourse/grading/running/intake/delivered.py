"""What came in, as plain bytes with names, and the hand-in that the newest of it makes.

Hand-ins come in stages: a whole course, and later some notebooks again. The newest of each counts. What a gradebook
keeps of earlier ones goes in here together with what just came.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Protocol

from labcourse.answers.notebooks import HandIn, Notebook
from labcourse.files import ANSWERS_FILE, COURSE_FILE
from labcourse.grading.running.intake.places import course_data


class Delivery(Protocol):
    """Something that was delivered; a gradebook's record of it is such a thing, too."""

    @property
    def name(self) -> str:
        """File name of a notebook, path of an own file, ``answers.json``, or ``course.json``."""

    @property
    def content(self) -> bytes:
        """What it holds."""

    @property
    def received(self) -> datetime:
        """When it was handed in, UTC."""

    @property
    def source(self) -> str:
        """What it came in, for people."""

    @property
    def clock(self) -> str | None:
        """How the time is known."""


@dataclass(frozen=True)
class Item:
    """A :class:`Delivery` that was just read."""

    name: str
    content: bytes
    received: datetime
    source: str
    clock: str | None = None


def newest(items: Iterable[Delivery], wanted: Sequence[str], reports: Sequence[str] = ()) -> tuple[HandIn, list[str]]:
    """The hand-in that counts, of all that was delivered, and notes on what came when.

    Parameters
    ----------
    items : in order of arrival, which decides between those of one time
    wanted : file names of the course's notebooks
    reports : file names of the course's reports, as PDF
    """
    latest: dict[str, Delivery] = {}
    earlier: dict[str, list[Delivery]] = {}
    for item in sorted(items, key=lambda item: item.received):
        if item.name in latest:
            earlier.setdefault(item.name, []).append(latest[item.name])
        latest[item.name] = item
    hand_in = HandIn(
        notebooks={name: Notebook.read(latest[name].content).cells for name in wanted if name in latest},
        files={
            name: item.content
            for name, item in sorted(latest.items())
            if name not in (*wanted, *reports, ANSWERS_FILE, COURSE_FILE)
        },
        claim=latest[ANSWERS_FILE].content if ANSWERS_FILE in latest else None,
        course=course_data(latest[COURSE_FILE].content) if COURSE_FILE in latest else {},
        reports={name: latest[name].content for name in reports if name in latest},
    )
    return hand_in, _notes(latest, earlier, wanted, reports)


def _notes(
    latest: dict[str, Delivery], earlier: dict[str, list[Delivery]], wanted: Sequence[str], reports: Sequence[str]
) -> list[str]:
    notes = []
    deliveries = {(item.received, item.source) for items in earlier.values() for item in items}
    deliveries |= {(item.received, item.source) for item in latest.values()}
    there = [name for name in wanted if name in latest]
    if len(deliveries) > 1:
        by_delivery: dict[tuple[datetime, str], list[str]] = {}
        for name in (*there, *(name for name in reports if name in latest)):
            by_delivery.setdefault((latest[name].received, latest[name].source), []).append(name)
        for (received, source), names_of_it in sorted(by_delivery.items()):
            notes.append(f"Of {received:%Y-%m-%d %H:%M} UTC ({source}): {', '.join(names_of_it)}.")
    if there:
        notes += [f"{name} was not handed in." for name in wanted if name not in latest]
    return notes
