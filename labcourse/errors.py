"""The errors of labcourse. Each message says what is wrong, where, and what to do.

::

    CourseError
    ├── ConfigurationError   a setting or a file of settings that is not valid (also a ValueError)
    │   └── StudentIDError   text that cannot be a student's ID
    ├── AnswerError          an answer to a question or a part that does not exist (also a ValueError)
    ├── CheckError           work that cannot be checked, packed or restored as asked
    └── GradingError         a class that cannot be graded as asked
        ├── IsolationError   students' code cannot be isolated here; says which layer failed and what to do
        └── GradebookError   a gradebook that cannot be read or written
"""

from __future__ import annotations

import linecache
import traceback
from collections.abc import Iterator
from types import TracebackType

_RED, _PLAIN = "\x1b[31m", "\x1b[39m"


class CourseError(Exception):
    """The base class of labcourse's errors."""

    def _render_traceback_(self) -> list[str]:
        """Show the message and the lines of cells that led to it, in place of IPython's traceback.

        The lines of our own code in between are of no use there. Plain Python prints the whole traceback, as usual.
        """
        return [f"{_RED}{type(self).__name__}{_PLAIN}: {self}", *_lines_of_cells(self.__traceback__)]


def speaks_for_itself(error: BaseException) -> bool:
    """Check whether an error has a message for people: it is of labcourse or of a course's package.

    A notebook shows such errors by the method that IPython looks for.
    """
    return hasattr(error, "_render_traceback_")


def _lines_of_cells(trace: TracebackType | None) -> Iterator[str]:
    """List the lines of a notebook's cells that were being run, the outermost first."""
    this = ""
    for frame, number in traceback.walk_tb(trace):
        if frame.f_globals.get("__name__") == "__main__":
            name = frame.f_code.co_filename
            this = this or name
            where = f"line {number}" if name == this else f"line {number} of a cell that was run before"
            yield f"  {where}:  {linecache.getline(name, number, frame.f_globals).strip()}".rstrip(" :")


class ConfigurationError(CourseError, ValueError):
    """A setting, a parameter or a file of settings that is not valid."""


class StudentIDError(ConfigurationError):
    """Text that cannot be a student's ID."""


class AnswerError(CourseError, ValueError):
    """An answer to a question or a part that does not exist."""


class CheckError(CourseError):
    """A student's work that cannot be checked, packed or restored as asked."""


class GradingError(CourseError):
    """A class that cannot be graded as asked."""


class IsolationError(GradingError):
    """Students' code cannot be isolated here.

    Attributes
    ----------
    layer : what failed, in a word or two
    remedy : what to do about it
    """

    def __init__(self, message: str, layer: str = "", remedy: str = "") -> None:
        super().__init__(" ".join(filter(None, (message, remedy))))
        self.layer = layer
        self.remedy = remedy


class GradebookError(GradingError):
    """A gradebook that cannot be read or written."""
