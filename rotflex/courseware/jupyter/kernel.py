# ruff: noqa: INP001 (no module: JupyterLab starts it by its path)
"""A Python kernel that finds a student's modules, and none of them in place of Python's own.

It is run as ``python -P kernel.py``: whatever lies in the folder of the notebooks, nothing of it is imported before a
cell asks for it. IPython puts that folder behind Python's own modules; with ``-P``, version 9.7 and newer leave it out.
"""

import os
import sys

from ipykernel.kernelapp import IPKernelApp


class Kernel(IPKernelApp):
    """A kernel that imports from the folder of the notebooks when its cells do."""

    def init_path(self) -> None:
        """Put the folder of the notebooks behind Python's own modules."""
        super().init_path()  # type: ignore[no-untyped-call]
        if "" not in sys.path:
            last = (os.path.basename(path) in ("site-packages", "dist-packages") for path in sys.path)
            sys.path.insert(next((place for place, found in enumerate(last) if found), len(sys.path)), "")


if __name__ == "__main__":
    os.environ.pop("PYTHONSAFEPATH", None)  # a student's own programs, which cells may start, run as ever
    Kernel.launch_instance()
