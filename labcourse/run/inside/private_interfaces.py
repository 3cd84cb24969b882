"""Replace private interfaces of libraries: the libraries do not promise to keep them.

A library that has changed such an interface might still run, and quietly do something else. So before any notebook is
run, :func:`check_versions` requires the versions with which notebooks were compared with a real kernel's.
"""

from __future__ import annotations

import logging
import re
import select
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext, suppress
from importlib import metadata
from types import SimpleNamespace
from typing import Any
from unittest import mock

#: Library → first and last of the versions that were tested. The extra ``grading`` installs no others; at home, other
#: versions mean that kernels run the notebooks.
TESTED = {
    "ipykernel": ("7.1", "7.4"),
    "ipython": ("9.4", "9.18"),
    "jupyter_client": ("8.6", "8.10"),
    "matplotlib": ("3.10", "3.11"),
    "nbclient": ("0.10", "0.11"),
    "papermill": ("2.6", "2.7"),
    "scipy": ("1.16", "1.18"),
    "sympy": ("1.13", "1.14"),
}


class UntestedVersionError(Exception):
    """A library has a version that was not tested, or cells do not run with it."""


def check_versions() -> None:
    """Check that the libraries have versions that were tested.

    Raises
    ------
    UntestedVersionError
        If one has not. The message names the library, its version, and the versions that were tested.
    """
    for library, version in installed().items():
        first, last = TESTED[library]
        if not _minor(first) <= _minor(version) <= _minor(last):
            raise UntestedVersionError(
                f"Notebooks were not tested with {library} {version}. Install a version that was: {first} to {last}."
            )


def _minor(version: str) -> list[int]:
    return [int(number) for number in re.findall(r"\d+", version)[:2]]


def installed() -> dict[str, str]:
    """Return the versions of the libraries that are installed: not every course uses scipy."""
    versions = {}
    for library in TESTED:
        with suppress(metadata.PackageNotFoundError):
            versions[library] = metadata.version(library)
    return versions


# --- the kernel -------------------------------------------------------------------------------------------------------


def kernel_options() -> dict[str, dict[str, object]]:
    """Return a kernel's options: no history file, which a thread would write, and no pause after each cell.

    (The pause is for messages over the network.)
    """
    return {"HistoryManager": {"enabled": False}, "Kernel": {"_execute_sleep": 0.0}}


def run_in_main_thread(kernel: Any) -> None:
    """Tell a kernel, which has no thread for its messages here, that cells are run in the main thread."""
    kernel.shell_channel_thread = SimpleNamespace(parent_thread=threading.main_thread())


def discard_output(shell: Any) -> None:
    """Change a kernel's shell so that it makes and stores nothing that only a front end would show.

    Of what cells display, only the plain text is made, for a ``__repr__`` may be part of what a student tries. Figures
    are drawn when the code asks for it, and not because a cell has ended; they are closed as ever. Of errors, the last
    line is made. What was printed is not kept for the history.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    shell._tee = lambda channel: nullcontext()
    # There are no windows: whatever backend a notebook asks for, it gets the inline one.
    inline = shell.enable_matplotlib
    shell.enable_matplotlib = lambda gui=None: inline("inline")
    shell.display_formatter.active_types = ["text/plain"]
    shell.InteractiveTB.set_mode("Minimal")
    shell._format_exception_for_storage = lambda *args, **kwargs: {}
    FigureCanvasAgg.draw_idle = lambda *args, **kwargs: None  # type: ignore[method-assign]


def draw_inline() -> None:
    """Show the figures of a cell after it, as in a kernel: pyplot was imported before there was one."""
    from matplotlib_inline import backend_inline

    backend_inline._enable_matplotlib_integration()


def streams(session: Any) -> tuple[Any, Any]:
    """Return a kernel's standard output and error, which send what is written to their descriptors as well."""
    import zmq
    from ipykernel.iostream import IOPubThread, OutStream

    thread = IOPubThread(zmq.Context().socket(zmq.PUB))  # of a session that sends nothing through it
    thread.start()
    return OutStream(session, thread, "stdout", watchfd="force"), OutStream(session, thread, "stderr", watchfd="force")


def flush(streams: Iterable[Any]) -> None:
    """Send what is held of a kernel's streams, also what their threads have not yet read of the descriptors."""
    for stream in streams:
        with suppress(OSError, ValueError):  # a cell has closed them
            while select.select([stream._fid], [], [], 0)[0]:
                time.sleep(0.001)
        stream.flush()


def reseed_sympy() -> None:
    """Seed sympy's random numbers anew: a fork has copied their state from its parent."""
    import sympy.core.random

    sympy.core.random.rng.seed()


# --- papermill --------------------------------------------------------------------------------------------------------


def no_entry_points() -> AbstractContextManager[object]:
    """Keep papermill, when it is imported in the ``with`` block, from importing the engines that are installed."""
    return mock.patch("entrypoints.get_group_all", lambda group: [])


def silence_loggers() -> None:
    """Let papermill and nbformat write no log where nobody asked for one."""
    for name in ("papermill", "traitlets"):
        logging.getLogger(name).addHandler(logging.NullHandler())
        logging.getLogger(name).propagate = False


# --- docstrings -------------------------------------------------------------------------------------------------------


@contextmanager
def plain_docstrings() -> Iterator[None]:
    """Keep scipy and matplotlib from composing docstrings in a ``with`` block: a quarter of the time of all imports."""
    composers = {"scipy._lib._docscrape.FunctionDoc": _PlainDoc, "matplotlib.artist.kwdoc": lambda artist: ""}
    with ExitStack() as stack:
        for name, replacement in composers.items():
            with suppress(ImportError, AttributeError):  # where it is missing, imports only take longer
                stack.enter_context(mock.patch(name, replacement))
        yield


class _PlainDoc(defaultdict[str, list[object]]):
    """Replacement of scipy's FunctionDoc: the docstring of a function, unparsed and without additions."""

    def __init__(self, function: Callable[..., object], *_: object, **__: object) -> None:
        super().__init__(list)
        self._text = function.__doc__ or ""

    def __str__(self) -> str:
        return f"\n{self._text}"  # the first line is the signature
