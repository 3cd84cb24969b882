"""The kernels of a course's notebooks: the program that starts one, and what it says after a restart."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import Any

from labcourse.files import COURSE_FILE

SETTINGS = Path(__file__).parent / "jupyter"  #: folder of JupyterLab's settings, and of the kernel's programs
KERNEL = SETTINGS / "kernel.py"
STARTUP = SETTINGS / "startup.py"  #: run by each kernel of ``labcourse lab`` at its start; it calls :func:`watch`
WHAT_TO_DO = "Python was restarted, so this name is gone: choose Run → Run All Above Selected Cell, then run this cell."


def watch() -> None:
    """Explain each NameError of this kernel that comes before the set-up cell of a course's notebook has run."""
    from IPython.core.getipython import get_ipython

    shell = get_ipython()
    if shell is not None and Path(COURSE_FILE).is_file():
        shell.set_custom_exc((NameError,), _explain)


def _explain(
    shell: Any, kind: type[BaseException], error: BaseException, traceback: TracebackType, tb_offset: int | None = None
) -> None:
    """Show the error, and what to do where the set-up cell has not run."""
    shell.showtraceback((kind, error, traceback), tb_offset=tb_offset)
    if "lab" not in shell.user_ns:
        print(WHAT_TO_DO)
