"""Tell the time: the one clock that all of the engine reads, so that a test can set it."""

from datetime import UTC, datetime


def now() -> datetime:
    """Return the time, in UTC."""
    return datetime.now(UTC)  # noqa: TID251
