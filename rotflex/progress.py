"""A progress bar for what takes longer than a second: in a notebook, and in a terminal; none in a pipe or a log."""

from __future__ import annotations

import os
from collections.abc import Iterable
from threading import RLock
from typing import Any

AFTER = 1.0  #: s; what is done sooner shows no bar
SWITCH = "TQDM_DISABLE"  #: environment variable of tqdm; if it is set, no bar is shown, as where outputs are compared
_NOT_IN_LOGS = None  # as tqdm's ``disable``: no bar if stderr is no terminal; notebooks still show theirs


def progress(items: Iterable[Any] | None, what: str, unit: str, show: bool = True, most: int = 0) -> Any:
    """Make a bar of tqdm, which shows after a second: to iterate over, or without ``items`` to call ``update`` of.

    A bar that goes through items and is not shown is the items.

    Parameters
    ----------
    items : what to go through, or None
    what, unit : the bar's description, and what it counts
    show : whether to show it
    most : how many there can be, where ``items`` do not say it; 0 if that is not known
    """
    if not show or os.environ.get(SWITCH):
        if items is not None:  # also where there is no tqdm: in a browser
            return items
        from tqdm import tqdm

        if not hasattr(tqdm, "_lock"):  # its default holds a semaphore of the system, which a killed process leaks
            tqdm.set_lock(RLock())
        return tqdm(disable=True)
    from tqdm.auto import tqdm

    tqdm.monitor_interval = 0  # no thread that looks after bars: in a browser there is none
    return tqdm(items, desc=what, unit=unit, total=most or None, delay=AFTER, leave=False, disable=_NOT_IN_LOGS)
