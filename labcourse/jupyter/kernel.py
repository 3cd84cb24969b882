"""A Python kernel that finds a student's modules, but never uses them in place of Python's or installed ones.

It is run as ``python -P kernel.py``, so that it imports nothing from the folder of the notebooks at its start, nor
while the course's first cells run by themselves (:mod:`labcourse.jupyter.opening`). With any other cell, this folder is
put last in the search path: modules that IPython imports later are never the student's. (Grading leaves out students'
modules that are named like installed ones, too.)
"""

import os
import sys
from pathlib import Path
from types import TracebackType
from typing import Any

from ipykernel.kernelapp import IPKernelApp

from labcourse.files import COURSE_FILE
from labcourse.jupyter import opening

WHAT_TO_DO = "The first cells have not run yet: choose Run → Run All Above Selected Cell, then run this cell."


class NotebookKernel(IPKernelApp):
    """A kernel that imports from the folder of the notebooks when its cells do."""

    def init_path(self) -> None:
        """Leave out the folder of the notebooks, wherever this version of IPython puts it."""
        sys.path[:] = filter(None, sys.path)

    def init_shell(self) -> None:
        """Explain each NameError that comes before the set-up cell of a course's notebook has run."""
        super().init_shell()  # type: ignore[no-untyped-call]  # ipykernel's
        if self.shell is not None:
            self.shell.events.register("pre_run_cell", _find_own_modules)
        if self.shell is not None and Path(COURSE_FILE).is_file():
            self.shell.set_custom_exc((NameError,), _explain)


def _find_own_modules(cell: Any) -> None:
    """Put the folder of the notebooks last, before a cell that was not run by itself."""
    if "" not in sys.path and cell.raw_cell not in opening.granted:
        sys.path.append("")


def _explain(
    shell: Any, kind: type[BaseException], error: BaseException, traceback: TracebackType, tb_offset: int | None = None
) -> None:
    """Show the error, and what to do where the set-up cell has not run."""
    shell.showtraceback((kind, error, traceback), tb_offset=tb_offset)
    if "lab" not in shell.user_ns:
        print(WHAT_TO_DO)


if __name__ == "__main__":
    os.environ.pop("PYTHONSAFEPATH", None)  # a student's own programs, which cells may start, run as ever
    NotebookKernel.launch_instance()
