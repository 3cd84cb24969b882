"""How papermill runs a notebook here: cell after cell, in this process."""

from __future__ import annotations

import asyncio
import importlib
import random
from collections.abc import Coroutine, Mapping
from contextlib import suppress
from typing import Any

import nbformat
import numpy as np
import papermill
from papermill.engines import Engine, NotebookExecutionManager, papermill_engines
from papermill.exceptions import PapermillExecutionError

from . import private_interfaces
from .kernel import Kernel
from .watch import ReportStep

try:
    from labcourse.answers import cell_reports
except ImportError:  # of an early release; the bundle brings it along
    cell_reports = importlib.import_module(f"{__package__}.cell_reports")

ENGINE = "inside"
_EMPTY = {
    "cells": [
        {
            "cell_type": "code",
            "execution_count": None,
            "id": "parameters",
            "metadata": {"tags": ["parameters"]},
            "outputs": [],
            "source": 'student = ""\nbench = ""',
        }
    ],
    "metadata": {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}},
    "nbformat": 4,
    "nbformat_minor": 5,
}
# What comes after an await is seen to as well: IPython runs such cells in another way.
_TRIAL = "import asyncio\nawait asyncio.sleep(0)\nran = 6 * 7"


class InsideEngine(Engine):
    """Runs the cells of a notebook with a kernel in this process."""

    @classmethod
    def execute_managed_notebook(
        cls,
        nb_man: NotebookExecutionManager,
        kernel_name: str,
        *,
        kernel: Kernel,
        name: str,
        report_step: ReportStep,
        **_: Any,
    ) -> None:
        _run_with(kernel, _run_cells(nb_man, kernel, report_step), name)


def _run_with(kernel: Kernel, cells: Coroutine[Any, Any, None], name: str = "") -> None:
    """Run cells; those of a notebook that has a name are reported on."""
    kernel.start()
    if name:
        cell_reports.begin(cell_reports.REPORTS_FILE, name)
    # It is not closed in the end: what a cell has left running in it need not be waited for.
    loop = asyncio.new_event_loop()
    asyncio.set_event_loop(loop)
    loop.run_until_complete(cells)


async def _run_cells(nb_man: NotebookExecutionManager, kernel: Kernel, report_step: ReportStep) -> None:
    """Run cell after cell, whatever happens in one; as with a kernel, only ``exit()`` ends it early."""
    for index, cell in enumerate(nb_man.nb.cells):
        if cell.cell_type != "code" or not cell.source.strip():
            continue
        nb_man.cell_start(cell, index)
        report_step()
        await kernel.execute(cell.source, cell.id)
        report_step()
        nb_man.cell_complete(cell, index)
        if not kernel.running:
            raise SystemExit


class Job:
    """What is the same for all notebooks of a submission. Made before the fork."""

    def __init__(self, parameters: Mapping[str, Any]) -> None:
        self.parameters = dict(parameters)
        papermill_engines.register(ENGINE, InsideEngine)
        self.kernel = Kernel()
        # Once in vain, so that schemas are compiled, and all is imported, before the fork.
        self._execute(_EMPTY, prepare_only=True)

    def try_out(self, report_step: ReportStep) -> None:
        """Run a cell whose outcome is known, in a process of its own.

        Raises
        ------
        RuntimeError
            If it does not come out: an error in a kernel's own code is lost, as if a cell had broken it.
        """
        report_step()
        _run_with(self.kernel, self.kernel.execute(_TRIAL))
        if self.kernel.names.get("ran") != 42:
            raise RuntimeError("Cells do not run.")

    def run(self, name: str, notebook: Mapping[str, Any], report_step: ReportStep) -> None:
        """Run one notebook, in a process of its own. Errors in cells are no errors of the run."""
        _reseed()
        notebook = {**notebook, "cells": [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]}
        with suppress(PapermillExecutionError):
            self._execute(notebook, kernel=self.kernel, name=name, report_step=report_step)

    def _execute(self, notebook: Mapping[str, Any], **options: Any) -> None:
        papermill.execute_notebook(
            nbformat.from_dict(notebook),
            None,
            parameters=self.parameters,
            engine_name=ENGINE,
            kernel_name="python3",
            language="python",
            progress_bar=False,
            request_save_on_cell_execute=False,
            autosave_cell_every=0,
            **options,
        )


def _reseed() -> None:
    """Random numbers of this process's own, which the fork has copied from the parent."""
    random.seed()
    np.random.seed()
    private_interfaces.reseed_sympy()
