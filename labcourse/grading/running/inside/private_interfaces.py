"""What is used or replaced here of libraries though they have not promised to keep it.

A library that has changed such an interface might still run, and quietly do something else. So before any notebook is
run, :func:`check` looks whether each is there and takes the parameters that it took in the tested versions.
"""

from __future__ import annotations

import importlib
import inspect
import sys
import threading
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import dataclass
from importlib import metadata
from types import SimpleNamespace
from typing import Any

#: Library → first and last of the versions that were tested. The extra ``grading`` installs no others.
TESTED = {
    "ipykernel": ("7.1", "7.4"),
    "ipython": ("9.4", "9.18"),
    "jupyter_client": ("8.6", "8.10"),
    "matplotlib": ("3.10", "3.11"),
    "scipy": ("1.16", "1.18"),
    "sympy": ("1.13", "1.14"),
}


class InterfaceChangedError(Exception):
    """A library is not as it was tested."""


@dataclass(frozen=True)
class Interface:
    """A part of a library.

    Attributes
    ----------
    module, name : where it is; with dots for what belongs to a class
    parameters : names of what it takes; None for what is not called
    """

    module: str
    name: str
    parameters: tuple[str, ...] | None = None

    @property
    def library(self) -> str:
        """Return the library's name as it is installed, one of :data:`TESTED`."""
        return self.module.partition(".")[0].lower()

    def difference(self) -> str | None:
        """Return what is found instead; None if it is as it was tested."""
        try:
            attribute: Any = importlib.import_module(self.module)
            for name in self.name.split("."):
                attribute = getattr(attribute, name)
            if self.parameters is None:
                return None
            parameters = tuple(inspect.signature(attribute).parameters)
        except (ImportError, AttributeError):
            return "nothing"
        except (TypeError, ValueError):
            return "something that is not called"
        return None if parameters == self.parameters else _listed(parameters)

    def check(self) -> None:
        """Raise InterfaceChangedError unless it is as it was tested."""
        difference = self.difference()
        if difference is not None:
            first, last = TESTED[self.library]
            wanted = "an attribute" if self.parameters is None else _listed(self.parameters)
            raise InterfaceChangedError(
                f"{self.library} {metadata.version(self.library)} has another {self.module}.{self.name} than notebooks "
                f"can be run with ({difference} instead of {wanted}). Install a version of {self.library} that was "
                f"tested: {first} to {last}."
            )


_SEND = ("self", "stream", "msg_or_type", "content", "parent", "ident", "buffers", "track", "header", "metadata")
_STORED = ("self", "exception", "filename", "running_compiled_code")
_SHELL, _HISTORY = "IPython.core.interactiveshell", "IPython.core.history"
_KERNEL, _ZMQ_SHELL = "ipykernel.ipkernel", "ipykernel.zmqshell"
#: Without these, notebooks would not run as they do in a kernel, or would keep what they must not keep.
NEEDED = (
    Interface(_KERNEL, "IPythonKernel.shell_channel_thread"),
    Interface(_KERNEL, "IPythonKernel.set_parent", ("self", "ident", "parent", "channel")),
    Interface(_KERNEL, "IPythonKernel.execute_request", ("self", "stream", "ident", "parent")),
    Interface(_KERNEL, "IPythonKernel.pre_handler_hook", ("self",)),
    Interface(_KERNEL, "IPythonKernel.post_handler_hook", ("self",)),
    Interface(_ZMQ_SHELL, "ZMQInteractiveShell.enable_gui", ("self", "gui")),
    Interface(_ZMQ_SHELL, "ZMQInteractiveShell.exit_now"),
    Interface(_HISTORY, "HistoryManager.enabled"),
    Interface(_SHELL, "InteractiveShell._tee", ("self", "channel")),
    Interface(_SHELL, "InteractiveShell.enable_matplotlib", ("self", "gui")),
    Interface(
        _SHELL,
        "InteractiveShell._format_exception_for_storage",
        ("self", "exception", "filename", "running_compiled_code"),
    ),
    Interface("IPython.core.ultratb", "AutoFormattedTB.set_mode", ("self", "mode")),
    Interface("IPython.core.formatters", "DisplayFormatter.active_types"),
    Interface("jupyter_client.session", "Session.send", _SEND),
    Interface("matplotlib.backends.backend_agg", "FigureCanvasAgg.draw_idle", ("self", "args", "kwargs")),
    Interface("sympy.core.random", "rng.seed", ("a", "version")),
)
_PAUSE = Interface(_KERNEL, "IPythonKernel._execute_sleep")
_SCIPYS_PAGES = Interface("scipy._lib._docscrape", "FunctionDoc", ("func", "role", "doc", "config"))
_MATPLOTLIBS_PAGES = Interface("matplotlib.artist", "kwdoc", ("artist",))
#: Without these, everything works and takes longer.
SPARED = (_PAUSE, _SCIPYS_PAGES, _MATPLOTLIBS_PAGES)


def check() -> None:
    """Check that everything needed is as it was tested.

    Raises
    ------
    InterfaceChangedError
        If something is not. The message names the library, its version, and the versions that were tested.
    """
    for interface in NEEDED:
        interface.check()


def versions() -> str:
    """Return a message for where cells do not run though everything is as it was tested."""
    libraries = [
        f"{library} {metadata.version(library)} (tested: {first} to {last})"
        for library, (first, last) in TESTED.items()
    ]
    return f"Cells do not run with these libraries: {', '.join(libraries)}."


def _listed(parameters: tuple[str, ...]) -> str:
    return f"({', '.join(parameters)})"


# --- the kernel -------------------------------------------------------------------------------------------------------


def kernel_options() -> dict[str, dict[str, object]]:
    """No history file, which a thread would write; and no pause after each cell, which is for the network's sake."""
    options: dict[str, dict[str, object]] = {"HistoryManager": {"enabled": False}}
    return {**options, "Kernel": {"_execute_sleep": 0.0}} if _PAUSE.difference() is None else options


def run_in_main_thread(kernel: Any) -> None:
    """Let a kernel that has no thread for its messages know in which thread cells are run."""
    kernel.shell_channel_thread = SimpleNamespace(parent_thread=threading.main_thread())


def discard_output(shell: Any) -> None:
    """Make and keep nothing that only a front end would show.

    Of what cells display, only the plain text is made, for a ``__repr__`` may be part of what a student tries. Figures
    are drawn when the code asks for it, and not because a cell has ended; they are closed as ever. Of errors, the last
    line is made. What was printed is not kept for the history.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    shell._tee = lambda channel: nullcontext()
    # There are no windows: pictures are drawn as if into the page, wherever a notebook wants them.
    inline = shell.enable_matplotlib
    shell.enable_matplotlib = lambda gui=None: inline("inline")
    shell.display_formatter.active_types = ["text/plain"]
    shell.InteractiveTB.set_mode("Minimal")
    shell._format_exception_for_storage = lambda *args, **kwargs: {}
    FigureCanvasAgg.draw_idle = lambda *args, **kwargs: None  # type: ignore[method-assign]


def reseed_sympy() -> None:
    """Give sympy other random numbers than the process has that this one was forked from."""
    import sympy.core.random

    sympy.core.random.rng.seed()


# --- docstrings -------------------------------------------------------------------------------------------------------


@contextmanager
def docstrings_as_they_stand() -> Iterator[None]:
    """Keep scipy and matplotlib from composing docstrings, which takes a quarter of the time of all imports."""
    with ExitStack() as stack:
        for interface, replacement in ((_SCIPYS_PAGES, _PlainDoc), (_MATPLOTLIBS_PAGES, lambda artist: "")):
            if interface.difference() is None:
                module = sys.modules[interface.module]
                stack.callback(setattr, module, interface.name, getattr(module, interface.name))
                setattr(module, interface.name, replacement)
        yield


class _PlainDoc(defaultdict[str, list[object]]):
    """A function's docstring as it stands, where scipy would take it apart and put it together with more in it."""

    def __init__(self, function: Callable[..., object], *_: object, **__: object) -> None:
        super().__init__(list)
        self._text = function.__doc__ or ""

    def __str__(self) -> str:
        return f"\n{self._text}"  # the first line is the signature
