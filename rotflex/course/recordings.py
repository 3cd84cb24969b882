"""Recordings as answers of this course: which channels are kept of them, and in which units."""

from __future__ import annotations

from functools import partial

from labcourse.answers import parts
from rotflex.recording import UNITS

recording = partial(parts.recording, units=UNITS)
