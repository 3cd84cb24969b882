"""What the parent does once, so that its children need not: imports, and what is slow the first time.

Only what is the same for every notebook. No thread may be running when a child is forked.
"""

from __future__ import annotations

import gc
import importlib
import os
import sys
import threading
from collections.abc import Sequence

from . import private_interfaces

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


def set_environment() -> None:
    """Environment variables as a kernel sets them, and that nobody looks at pictures."""
    os.environ["MPLBACKEND"] = "module://matplotlib_inline.backend_inline"
    os.environ["LABCOURSE_PICTURES"] = "off"


def import_all(others: Sequence[str]) -> None:
    """Import what notebooks use: any, and those of a course. The libraries' reference pages are not composed.

    Parameters
    ----------
    others : modules that the course's notebooks use
    """
    gc.disable()  # nothing of this is garbage
    for name in _KEPT_OUT:
        sys.modules[name] = None  # type: ignore[assignment]
    with private_interfaces.docstrings_as_they_stand():
        for name in (*_IMPORTED, *others):
            importlib.import_module(name)


def freeze() -> None:
    """What there is by now, children share; their garbage collectors need not look at it."""
    assert threading.active_count() == 1, threading.enumerate()
    gc.freeze()
    gc.enable()
