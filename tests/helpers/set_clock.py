"""Set the clock that the engine reads, for tests of a term: they have dates of their own, whenever they run."""

from datetime import UTC, datetime, timedelta
from itertools import count

import pytest

from labcourse import clock

#: Everything is due, whatever its deadline is, and later than anything that a test takes for late.
END_OF_TERM = datetime(2100, 1, 1, tzinfo=UTC)
_real = clock.now
_readings = count()


def set_clock(patch: pytest.MonkeyPatch, start: datetime) -> None:
    """Let it be a time for all of the engine. Each reading is a microsecond later, so that acts keep their order."""
    patch.setattr(clock, "now", lambda: start + timedelta(microseconds=next(_readings)))


def set_real_clock(patch: pytest.MonkeyPatch) -> None:
    """Let it be the time that it is, as it is for the processes that a test starts."""
    patch.setattr(clock, "now", _real)
