"""What learning platforms write into the names of files and folders that an instructor downloads.

===========  =========================================================================================================
Moodle       ``Ada Lovelace_1234567_assignsubmission_file_`` (a folder; newer ones without the last ``_``), or, without
             folders, the same and the file's name. A group's name comes first, as ``Group 3-Ada Lovelace_…``; where
             marking is blind, it is ``Participant_1234567_…``.
Canvas       ``lovelaceada_12345_678901_report.zip``, or ``lovelaceada_LATE_12345_678901_report.zip``: last and first
             name, the number of the user and of the file; ``anon_a1b2c_678901_…`` where marking is blind.
Blackboard   ``Assignment_alovelace_attempt_2026-11-21-13-05-59_report.zip``, and one ending in ``.txt`` without a
             file's name, which says what was handed in
Brightspace  ``12345-678910 - Ada Lovelace - Nov 21, 2026 105 PM`` (a folder), or, without folders, the same and
             ``- report.zip``; with an ``index.html`` beside them
===========  =========================================================================================================
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import TypeVar

from labcourse.grading.running.intake import times

MOODLE, CANVAS, BLACKBOARD, BRIGHTSPACE = "Moodle", "Canvas", "Blackboard", "Brightspace"

_MOODLE = re.compile(r"(?P<who>.+?)_(?P<number>\d+)_assignsubmission_(?P<kind>[a-z]+)(?:_(?P<rest>.*))?", re.DOTALL)
_CANVAS = re.compile(r"(?P<who>\w+?)(?P<late>_late)?_(?P<number>\d+)_(?P<file>\d+)_(?P<rest>.+)", re.I | re.DOTALL)
_CANVAS_BLIND = re.compile(r"(?:late_)?anon_(?P<number>[a-z0-9]+)_(?P<file>\d+)_(?P<rest>.+)", re.I | re.DOTALL)
#: The first time counts, and none behind Canvas's two numbers: a student's own name for a file stands last.
_BLACKBOARD = re.compile(
    r"(?P<who>(?!\w+?_\d{3,}_\d{4,}_).+?)"
    r"_attempt_(?P<time>\d{4}(?:-\d\d){5})(?:_(?P<rest>.+)|(?P<receipt>\.txt))?",
    re.DOTALL,
)
_BRIGHTSPACE = re.compile(r"\d+-\d+ ?- (?P<parts>.+)", re.DOTALL)
_DASH, _YEAR = re.compile(r" ?- "), re.compile(r"\b(?:19|20)\d\d\b")
_BRIGHTSPACE_TIME = re.compile(r"([A-Za-z]{3})[a-z]*\.? (\d{1,2}), (\d{4}) (\d{1,2}?)[:.]?(\d\d)(?: ?([AP])M)?", re.I)
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_LONGEST = 300  # characters of a name that any of them writes; a file system's longest, and some
#: How Moodle calls everybody where marking is blind.
_BLIND = {"participant", "teilnehmerin", "teilnehmer", "participante", "deelnemer", "partecipante"}
_ONLINE_TEXT = {"onlinetext", "comments"}
_AGAIN = re.compile(
    r"(?P<name>.+?)(?: ?\((?P<bracketed>\d{1,3})\)|[-_](?P<dashed>\d{1,2})| ?-? ?[Cc]opy ?(?P<copy>\d*))"
)
_CANVAS_COUNT = re.compile(r"-\d{1,2}(?=\.[^.]+$)")

Content = TypeVar("Content")


@dataclass(frozen=True)
class Label:
    """What a name says.

    Attributes
    ----------
    platform : which platform wrote it
    people : what may be the person, as a name or as the platform's name for them, the likeliest first; none where
        marking is blind
    number : by which the platform knows them; "" where the name has none that can be relied on
    time : when it was handed in, on the platform's clock
    attempt : the higher, the later, of those with one time
    rest : the file's own name; "" for a folder
    own : whether the platform itself wrote what is in it, and no student
    """

    platform: str
    people: tuple[str, ...]
    number: str = ""
    time: datetime | None = None
    attempt: int = 0
    rest: str = ""
    own: bool = False


def read(name: str) -> Label | None:
    """What a platform wrote into a name; None if it is none of theirs."""
    if len(name) > _LONGEST:
        return None
    for reader in (_moodle, _brightspace, _blackboard, _canvas):
        label = reader(name)
        if label is not None:
            return label
    return None


def _moodle(name: str) -> Label | None:
    found = _MOODLE.fullmatch(name)
    if found is None:
        return None
    who = found["who"]
    # A group's name, or the person's, may have a - of its own.
    people = [who, *(who[place + 1 :] for place, letter in enumerate(who) if letter == "-")]
    if people[-1].casefold() in _BLIND:
        people = []
    own = found["kind"] in _ONLINE_TEXT
    return Label(MOODLE, tuple(people), found["number"], rest=found["rest"] or "", own=own)


def _canvas(name: str) -> Label | None:
    blind = _CANVAS_BLIND.fullmatch(name)
    if blind is not None:
        return Label(CANVAS, (), blind["number"], attempt=int(blind["file"]), rest=blind["rest"])
    found = _CANVAS.fullmatch(name)
    if found is None:
        return None
    return Label(CANVAS, (found["who"],), found["number"], attempt=int(found["file"]), rest=found["rest"])


def _blackboard(name: str) -> Label | None:
    found = _BLACKBOARD.fullmatch(name)
    if found is None:
        return None
    who = found["who"]
    # The assignment's name comes first, and may have a _ of its own, as may the student's.
    people = tuple(who[place + 1 :] for place, letter in enumerate(who) if letter == "_")
    try:
        time = datetime.strptime(found["time"], "%Y-%m-%d-%H-%M-%S")
    except ValueError:
        time = None
    own = found["receipt"] is not None
    return Label(BLACKBOARD, people, time=time, rest=found["rest"] or "", own=own)


def _brightspace(name: str) -> Label | None:
    found = _BRIGHTSPACE.fullmatch(name)
    if found is None:
        return None
    parts = _DASH.split(found["parts"])
    dated = next((place for place, part in enumerate(parts) if place and _YEAR.search(part)), None)
    if dated is None:
        return None
    people = parts[:dated]  # some have a number or user name before the name
    own = parts[dated + 1 :]
    named = tuple(dict.fromkeys((" - ".join(people), *people)))
    return Label(BRIGHTSPACE, named, time=_brightspace_time(parts[dated]), rest=" - ".join(own))


def _brightspace_time(text: str) -> datetime | None:
    found = _BRIGHTSPACE_TIME.fullmatch(text.strip())
    if found is None:
        return None
    month, day, year, hour, minute, half = found.groups()
    try:
        month_number = _MONTHS.index(month.lower()) + 1
        return datetime(int(year), month_number, int(day), times.hour_of(hour, half), int(minute))
    except ValueError:
        return None


def again(name: str) -> tuple[str, int] | None:
    """Name and number of what was handed in, or downloaded, again: ``ada (1)``, ``ada-1``, ``ada copy``."""
    found = _AGAIN.fullmatch(name) if len(name) <= _LONGEST else None
    if found is None:
        return None
    number = found["bracketed"] or found["dashed"] or found["copy"]
    return found["name"].strip(), int(number) if number else 1


def before_canvas(files: Mapping[str, Content]) -> dict[str, Content]:
    """Files by the names that they had before Canvas counted them: ``tools-1.py`` may have been ``tools.py``.

    Which of the two it was cannot be told, so they are had by both names. Notebooks are told by their names anyhow.
    """
    found: dict[str, list[Content]] = {}
    for name, content in files.items():
        if _CANVAS_COUNT.search(name) and not name.endswith(".ipynb"):
            found.setdefault(_CANVAS_COUNT.sub("", name), []).append(content)
    return {name: contents[0] for name, contents in found.items() if len(contents) == 1 and name not in files}
