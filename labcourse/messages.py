"""Counts and lists in messages."""

from __future__ import annotations

import errno
import textwrap
from collections.abc import Sequence

DISK_FULL = (errno.ENOSPC, errno.EDQUOT)  #: errors of a full disk, and of a user's full quota
LONGEST = 300  #: characters of what somebody wrote, in a message
FREE_SPACE = "Free some space, and run the same command again."


def number_of(count: int, noun: str) -> str:
    """Return a count and its noun: ``number_of(2, "curve")`` is "2 curves"."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


def shortened(text: str, most: int = LONGEST) -> str:
    """Return the beginning of a text of at most so many characters, in one line."""
    return textwrap.shorten(text, most, placeholder="…")


def listed(texts: Sequence[str], most: int) -> str:
    """Join the first ``most`` texts and count the others, as in "1.2, 1.3 and 12 more"."""
    some, more = ", ".join(texts[:most]), len(texts) - most
    return f"{some} and {more} more" if more > 0 else some
