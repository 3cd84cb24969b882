"""Ways in which capable, honest students of different schools answer rightly: all of them, by group.

Most were written down from what students read, before the key and the marking code were. A way says what is given in
place of the usual answers of ``working_through.py``.
"""

import contextlib
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import right_ways_functions
import right_ways_numbers
import right_ways_readings
import right_ways_symbols
from right_ways_types import Way, Written
from working_through import Pen, Where, design, modeling, prelab, responses

import rotflex.course.lab

WAYS: list[Way] = [
    *right_ways_symbols.WAYS,
    *right_ways_functions.WAYS,
    *right_ways_numbers.NUMBER_FORMS,
    *right_ways_numbers.ARRAY_FORMS,
    *right_ways_numbers.POLYNOMIAL_FORMS,
    *right_ways_numbers.POLE_FORMS,
    *right_ways_numbers.CHOICES,
    *right_ways_readings.WAYS,
    *right_ways_readings.ROUNDED,
]


def worked(name: str, folder: Path, way: Way | None = None) -> tuple[dict[Where, Any], bytes]:
    """A student who works through the course: what they answer, and their ``answers.json``."""
    with contextlib.redirect_stdout(io.StringIO()):
        lab = rotflex.course.lab.start(name, folder=folder, quiet=True)
        write = Pen(way.carried(lab) if way and way.carried else {})
        write("0.1", "resolution", 0.0015339807878856412)
        prelab(write)
        A, B, poles = modeling(lab, write)
        responses(lab, write, A, B, design(write, A, B, poles))
        for number, parts in write.answers.items():
            lab.answer(number, **parts)
    own = {(number, part): value for number, parts in write.answers.items() for part, value in parts.items()}
    return own, lab.book.path.read_bytes()


def rewritten(
    name: str, folder: Path, written: Mapping[Where, Written], own: Mapping[Where, Any], data: bytes
) -> tuple[bytes, list[str]]:
    """The ``answers.json`` of a student who gives some of their answers in another way, and what is said to them."""
    (folder / "answers.json").write_bytes(data)
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        lab = rotflex.course.lab.start(name, folder=folder, quiet=True)
        for (question, part), change in written.items():
            lab.answer(question, **{part: change(own[question, part], own)})
    return lab.book.path.read_bytes(), said.getvalue().splitlines()
