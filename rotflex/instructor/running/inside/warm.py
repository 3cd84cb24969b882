"""What the parent does once, so that its children need not: imports, and what is slow the first time.

Only what is the same for every notebook. No thread may be running when a child is forked.
"""

from __future__ import annotations

import gc
import importlib
import os
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext

#: What any notebook needs; what those of a course need besides, the specification says.
_IMPORTED = (
    "IPython.core.logger",
    "IPython.core.pylabtools",
    "bdb",
    "ipykernel.ipkernel",
    "matplotlib.backends.backend_agg",
    "matplotlib.pyplot",
    "numpy",
    "papermill",
)
#: What some library would import if it could, and what no notebook needs: jsonschema's ways to check dates and web
#: addresses, of which one takes seconds to load; a debugger, which starts threads.
_KEPT_OUT = ("isoduration", "rfc3986_validator", "rfc3987_syntax", "debugpy")


def set_environment(deaf: bool) -> None:
    """Environment variables as a kernel sets them."""
    os.environ["MPLBACKEND"] = "module://matplotlib_inline.backend_inline"
    if deaf:
        os.environ["ROTFLEX_PICTURES"] = "off"


def import_all(deaf: bool, others: Sequence[str]) -> None:
    """Import what notebooks use; the libraries' reference pages, only if somebody might read them."""
    gc.disable()  # nothing of this is garbage
    for name in _KEPT_OUT:
        sys.modules[name] = None  # type: ignore[assignment]
    with _reference_pages_as_they_are() if deaf else nullcontext():
        for name in (*_IMPORTED, *others):
            importlib.import_module(name)


@contextmanager
def _reference_pages_as_they_are() -> Iterator[None]:
    """Spare scipy and matplotlib the trouble of composing docstrings, a quarter of the time that all imports take."""
    from matplotlib import artist

    try:
        from scipy._lib import _docscrape
    except ImportError:  # another scipy has it elsewhere: then it takes its time
        yield
        return
    scipys, matplotlibs = _docscrape.FunctionDoc, artist.kwdoc
    _docscrape.FunctionDoc, artist.kwdoc = _PlainDoc, lambda _: ""  # type: ignore[assignment, misc]
    try:
        yield
    finally:
        _docscrape.FunctionDoc, artist.kwdoc = scipys, matplotlibs  # type: ignore[misc]


class _PlainDoc:
    """A function's docstring as it stands, where scipy would take it apart and put it together with more in it."""

    def __init__(self, function: Callable[..., object], *_: object, **__: object) -> None:
        self._text = function.__doc__ or ""

    def __getitem__(self, section: str) -> list[object]:
        return []

    def __setitem__(self, section: str, content: object) -> None:
        pass

    def __str__(self) -> str:
        return f"\n{self._text}"  # the first line is the signature


def freeze() -> None:
    """What there is by now, children share; their garbage collectors need not look at it."""
    assert threading.active_count() == 1, threading.enumerate()
    gc.freeze()
    gc.enable()
