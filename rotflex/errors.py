"""The errors that rotflex raises on purpose. Each says what was wrong, where, and what to do.

::

    RotflexError
    ├── ConfigurationError   a combination of parts that does not exist (also a ValueError)
    ├── RecordingError       a file or an array that is not a usable recording (also a ValueError)
    │   └── UnknownColumns   a table that does not say what its columns are
    ├── IdentificationError  data from which the asked-for quantity cannot be found (also a ValueError)
    ├── DesignError          a control design that cannot be done (also a ValueError)
    └── BenchError           anything between us and the bench (also a RuntimeError)
        ├── HILError         the board refused or failed a call
        │   ├── WatchdogExpired  the program was not quick enough
        │   └── MotorNotStopped  the board did not take 0 V: the motor may still be driven
        ├── NotRecorded      an experiment of which there is no recording
        ├── LimitExceeded    a limit of the bench was passed
        └── RunStopped       somebody stopped the experiment
"""

from __future__ import annotations

import linecache
import traceback
from collections.abc import Iterator
from types import TracebackType

_RED, _PLAIN = "\x1b[31m", "\x1b[39m"


class RotflexError(Exception):
    """Anything that rotflex raises on purpose."""

    def _render_traceback_(self) -> list[str]:
        """What IPython shows below a cell in place of its traceback: the message, and the lines that led to it.

        These are the notebook's; what our own code did in between is of no use to who reads it there. In plain Python,
        the whole traceback is printed, as ever.
        """
        notes = getattr(self, "__notes__", [])
        return [f"{_RED}{type(self).__name__}{_PLAIN}: {self}", *notes, *_lines_of_cells(self.__traceback__)]


def _lines_of_cells(trace: TracebackType | None) -> Iterator[str]:
    """The lines of a notebook's cells that were being run, the outermost first."""
    this = ""
    for frame, number in traceback.walk_tb(trace):
        if frame.f_globals.get("__name__") == "__main__":
            name = frame.f_code.co_filename
            this = this or name
            where = f"line {number}" if name == this else f"line {number} of a cell that was run before"
            yield f"  {where}:  {linecache.getline(name, number, frame.f_globals).strip()}".rstrip(" :")


class ConfigurationError(RotflexError, ValueError):
    """A combination of parts or parameters that does not exist."""


class RecordingError(RotflexError, ValueError):
    """A file or an array that is not a usable recording."""


class UnknownColumns(RecordingError):
    """A table that does not say what its columns are.

    Attributes
    ----------
    guess : name of a channel → the number and the unit of its column, ``"2 deg"``
    """

    def __init__(self, *args: object) -> None:
        super().__init__(*args)
        self.guess: dict[str, str] = {}

    def __str__(self) -> str:
        asked = ",".join("{}_{}={}".format(name, *found.split()[::-1]) for name, found in self.guess.items())
        return (
            f"{super().__str__()}\nSay what they are; a guess is columns='{asked}', in a command --columns '{asked}'."
        )


class IdentificationError(RotflexError, ValueError):
    """Data from which the asked-for quantity cannot be found."""


class DoubtfulRecording(UserWarning):
    """A recording is measured on, and there is a reason to doubt it: see :mod:`rotflex.doubts`."""


class DesignError(RotflexError, ValueError):
    """A control design that cannot be done."""


class BenchError(RotflexError, RuntimeError):
    """Anything that goes wrong between us and the bench.

    Attributes
    ----------
    outcome : what is known of the motor since the bench was stopped for it, a
        :class:`rotflex.hil.connection.Outcome`; it ends the message. None where no bench was stopped
    """

    outcome: object = None

    def __str__(self) -> str:
        text = super().__str__()
        return text if self.outcome is None else f"{text} {self.outcome}"


class HILError(BenchError):
    """The data-acquisition board refused or failed a call."""

    def get_error_message(self) -> str:
        """The message, under the name that the maker's error uses."""
        return str(self)


class WatchdogExpired(HILError):
    """The program did not show in time that it was alive, so that the board's watchdog has expired."""


class MotorNotStopped(HILError):
    """The board did not take 0 V: the motor may still be driven. This is said first."""

    def __str__(self) -> str:
        return f"{self.outcome} {RuntimeError.__str__(self)}"


class NotRecorded(BenchError):
    """An experiment that a bench of recordings has no recording of."""


class LimitExceeded(BenchError):
    """A limit of the bench was passed."""


class RunStopped(BenchError):
    """Somebody stopped the experiment."""
