"""Replace private interfaces of libraries: the libraries do not promise to keep them.

A library that has changed such an interface might still run, and quietly do something else. So before any notebook is
run, :func:`check_versions` requires the versions with which notebooks were compared with a real kernel's.
"""

from __future__ import annotations

import re
import threading
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext, suppress
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


def reseed_sympy() -> None:
    """Seed sympy's random numbers anew: a fork has copied their state from its parent."""
    import sympy.core.random

    sympy.core.random.rng.seed()


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
