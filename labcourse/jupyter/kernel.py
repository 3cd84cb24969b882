"""A Python kernel that finds a student's modules, and none of them in place of Python's own.

It is run as ``python -P kernel.py``: whatever lies in the folder of the notebooks, nothing of it is imported before a
cell asks for it. Then it comes last, behind what is installed: what IPython itself imports while cells are typed is no
student's. (Where work is graded, own modules that are named like installed ones do not come along, either.)
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
