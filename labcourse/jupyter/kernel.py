"""A Python kernel that finds a student's modules, but never uses them in place of Python's or installed ones.

It is run as ``python -P kernel.py``, so that it imports nothing from the folder of the notebooks at its start. This
folder is then put last in the search path: modules that IPython imports later are never the student's. (Grading leaves
out students' modules that are named like installed ones, too.)
"""

import os
import sys

from ipykernel.kernelapp import IPKernelApp


class Kernel(IPKernelApp):
    """A kernel that imports from the folder of the notebooks when its cells do."""

    def init_path(self) -> None:
        """Put the folder of the notebooks last, wherever this version of IPython puts it."""
        sys.path[:] = [*filter(None, sys.path), ""]


if __name__ == "__main__":
    os.environ.pop("PYTHONSAFEPATH", None)  # a student's own programs, which cells may start, run as ever
    Kernel.launch_instance()
