"""The private interfaces of libraries that are used or replaced here: the libraries do not promise to keep them.

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
    """A private interface of a library: a function, a method or an attribute.

    Attributes
    ----------
    module : import name of its module
    name : its name in the module; with dots for what belongs to a class
    parameters : names of its parameters; None for what is not called
    """

    module: str
    name: str
    parameters: tuple[str, ...] | None = None

    @property
    def library(self) -> str:
        """Return the library's name as it is installed, one of :data:`TESTED`."""
        return self.module.partition(".")[0].lower()

    def difference(self) -> str | None:
        """Return what there is instead, as text for a message; None if it is as it was tested."""
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
        return None if parameters == self.parameters else _in_parentheses(parameters)

    def check(self) -> None:
        """Raise InterfaceChangedError unless it is as it was tested."""
        difference = self.difference()
        if difference is not None:
            first, last = TESTED[self.library]
            wanted = "an attribute" if self.parameters is None else _in_parentheses(self.parameters)
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
    Interface(_SHELL, "InteractiveShell._format_exception_for_storage", _STORED),
    Interface("IPython.core.ultratb", "AutoFormattedTB.set_mode", ("self", "mode")),
    Interface("IPython.core.formatters", "DisplayFormatter.active_types"),
    Interface("jupyter_client.session", "Session.send", _SEND),
    Interface("matplotlib.backends.backend_agg", "FigureCanvasAgg.draw_idle", ("self", "args", "kwargs")),
    Interface("sympy.core.random", "rng.seed", ("a", "version")),
)
_PAUSE_AFTER_CELLS = Interface(_KERNEL, "IPythonKernel._execute_sleep")
_SCIPY_DOCSTRINGS = Interface("scipy._lib._docscrape", "FunctionDoc", ("func", "role", "doc", "config"))
_MATPLOTLIB_DOCSTRINGS = Interface("matplotlib.artist", "kwdoc", ("artist",))
#: Without these, everything works and takes longer.
OPTIONAL = (_PAUSE_AFTER_CELLS, _SCIPY_DOCSTRINGS, _MATPLOTLIB_DOCSTRINGS)


def check() -> None:
    """Check that everything needed is as it was tested.

    Raises
    ------
    InterfaceChangedError
        If something is not. The message names the library, its version, and the versions that were tested.
    """
    for interface in NEEDED:
        interface.check()


def versions_message() -> str:
    """Return a message with the libraries' versions: cells do not run, though the interfaces are as tested."""
    libraries = [
        f"{library} {metadata.version(library)} (tested: {first} to {last})"
        for library, (first, last) in TESTED.items()
    ]
    return f"Cells do not run with these libraries: {', '.join(libraries)}."


def _in_parentheses(parameters: tuple[str, ...]) -> str:
    return f"({', '.join(parameters)})"


# --- the kernel -------------------------------------------------------------------------------------------------------


def kernel_options() -> dict[str, dict[str, object]]:
    """Return a kernel's options: no history file, which a thread would write, and no pause after each cell.

    (The pause is for messages over the network. It is left out only if this version of ipykernel has that option.)
    """
    options: dict[str, dict[str, object]] = {"HistoryManager": {"enabled": False}}
    return {**options, "Kernel": {"_execute_sleep": 0.0}} if _PAUSE_AFTER_CELLS.difference() is None else options


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
    with ExitStack() as stack:
        for interface, replacement in ((_SCIPY_DOCSTRINGS, _PlainDoc), (_MATPLOTLIB_DOCSTRINGS, lambda artist: "")):
            if interface.difference() is None:
                module = sys.modules[interface.module]
                stack.callback(setattr, module, interface.name, getattr(module, interface.name))
                setattr(module, interface.name, replacement)
        yield


class _PlainDoc(defaultdict[str, list[object]]):
    """Replacement of scipy's FunctionDoc: the docstring of a function, unparsed and without additions."""

    def __init__(self, function: Callable[..., object], *_: object, **__: object) -> None:
        super().__init__(list)
        self._text = function.__doc__ or ""

    def __str__(self) -> str:
        return f"\n{self._text}"  # the first line is the signature
