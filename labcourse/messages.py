"""Counts and lists in messages."""

from __future__ import annotations

import errno
from collections.abc import Sequence

DISK_FULL = (errno.ENOSPC, errno.EDQUOT)  #: what the system says of a full disk, and of a user's full share of it
FREE_SPACE = "Free some space, and run the same command again."


def plural(count: int, one: str, many: str) -> str:
    """Return the form that a count needs: ``plural(2, "{count} curve", "{count} curves")`` is "2 curves"."""
    return (one if count == 1 else many).format(count=count)


def listed(texts: Sequence[str], most: int) -> str:
    """Join the first ``most`` texts and count the others, as in "1.2, 1.3 and 12 more"."""
    some, more = ", ".join(texts[:most]), len(texts) - most
    return f"{some} and {more} more" if more > 0 else some
