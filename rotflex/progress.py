"""A progress bar for what takes longer than a second: in a notebook, and in a terminal; none in a pipe or a log."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

T = TypeVar("T")

AFTER = 1.0  #: s; what is done sooner shows no bar
_IN_LOGS = None  # as tqdm's ``disable``: no bar where stderr is not a terminal; notebooks still show theirs
SWITCH = "TQDM_DISABLE"  #: environment variable of tqdm; if it is set, no bar is shown, as where outputs are compared


def wanted(show: bool = True) -> bool:
    """Whether a bar may be shown at all."""
    return show and not os.environ.get(SWITCH)


def progress(items: Collection[T], what: str, unit: str, show: bool = True) -> Iterable[T]:
    """Go through items, with a progress bar if that takes longer than a second."""
    if not wanted(show):
        return items
    from tqdm.auto import tqdm

    bar: Iterable[T] = tqdm(items, desc=what, unit=unit, delay=AFTER, leave=False, disable=_IN_LOGS)
    return bar


@contextmanager
def counter(what: str, unit: str, show: bool = True) -> Iterator[Callable[[], object]]:
    """Count what has no known end: gives a function to call each time, with a bar if it takes longer than a second."""
    if not wanted(show):
        yield lambda: None
        return
    from tqdm.auto import tqdm

    with tqdm(desc=what, unit=unit, delay=AFTER, leave=False, disable=_IN_LOGS) as bar:
        yield bar.update
