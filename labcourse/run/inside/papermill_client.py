"""papermill's client for a notebook that a warm process runs, and how papermill is kept from some of its ways."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Callable, Generator, Mapping
from typing import Any
from unittest.mock import Mock

import nbformat
import papermill.execute
from nbclient.exceptions import CellExecutionError, CellTimeoutError, DeadKernelError
from nbformat import NotebookNode
from papermill.clientwrap import PapermillNotebookClient
from papermill.engines import NotebookExecutionManager, papermill_engines

from . import TIMED_OUT, outputs

ENGINE = "labcourse"  #: name of the engine
#: Runs a notebook as :meth:`.kernel.Kernel.run` takes it; yields as :func:`.watch.follow` does.
Run = Callable[[dict[str, Any]], Generator[int | None]]
_ERRORS_ALLOWED = "errors_allowed"  # in papermill's metadata of a notebook, until papermill has looked at it


class Client(PapermillNotebookClient):  # type: ignore[misc]  # papermill has no types
    """papermill's client for a notebook that a warm process runs. It takes nbclient's options.

    Parameters
    ----------
    manager : of the notebook
    run : runs its cells
    name : of the notebook, in reports on cells
    reports : file for these (:mod:`labcourse.answers.cell_reports`); "" for none
    """

    def __init__(self, manager: Any, run: Run, *, name: str = "", reports: str = "", **options: Any) -> None:
        super().__init__(manager, **options)
        self._run, self._request = run, {"name": name, "reports": reports, "timeout": self.timeout or float("inf")}
        self.kc = Mock()  # the mimic of an output widget would tell a kernel what it holds
        self._allowance = outputs.Allowance()
        self._ended: int | None = None

    def execute(self, **_: object) -> None:
        """Run the cells, and put their outputs into the notebook."""
        self.reset_execution_trackers()
        cells = [(cell.source, cell.get("id"), self._may_fail(cell)) for cell in self.nb.cells if self._is_run(cell)]
        folder = tempfile.TemporaryDirectory(prefix="labcourse-outputs-", ignore_cleanup_errors=True)
        with folder, open(f"{folder.name}/messages", "w+b") as self._file:
            reports = self._run({**self._request, "cells": cells, "outputs": self._file.name})
            with contextlib.closing(reports) as self._reports:
                self.papermill_execute_cells()
                self._wait_for_end()
        with contextlib.suppress(Exception):  # a cell has written what no widget sends
            self.set_widgets_metadata()

    def execute_cell(self, cell: NotebookNode, cell_index: int, **_: object) -> NotebookNode:
        """Wait until a cell has been run, and put its outputs into it.

        Raises
        ------
        CellExecutionError
            If it failed, and may not.
        CellTimeoutError
            If it failed because it was interrupted after its time.
        DeadKernelError
            If the process has ended.
        """
        if not self._is_run(cell):
            return cell
        cell.outputs = []
        self.clear_before_next_output = False
        while (end := self._read(cell, cell_index)) is None:
            if self._ended is not None:
                raise DeadKernelError("Kernel died")
            self._ended = next(self._reports)
        if end["cut"]:
            cell.outputs.append(nbformat.v4.new_output("stream", name="stderr", text=outputs.CUT))
        if end["failed"] and not self._may_fail(cell):
            self._wait_for_end()
            if self._ended == TIMED_OUT:
                raise CellTimeoutError.error_from_timeout_and_cell("Cell execution timed out", self.timeout, cell)
            raise CellExecutionError("", "", "")
        return cell

    def _is_run(self, cell: NotebookNode) -> bool:
        is_skipped = self.skip_cells_with_tag in cell.metadata.get("tags", [])
        return cell.cell_type == "code" and bool(cell.source.strip()) and not is_skipped

    def _may_fail(self, cell: NotebookNode) -> bool:
        allowed = self.allow_errors or "raises-exception" in cell.metadata.get("tags", [])
        return bool(allowed and not self.force_raise_errors)

    def _wait_for_end(self) -> None:
        for ended in self._reports:
            self._ended = ended

    def _read(self, cell: NotebookNode, cell_index: int) -> outputs.Message | None:
        """Process the messages that there are; return that with which the cell has ended, if it is there."""
        for message in outputs.read(self._file, self._allowance):
            if message["msg_type"] == outputs.END:
                return message
            with contextlib.suppress(Exception):  # a cell has written what no kernel sends
                if message["msg_type"] == outputs.BEGIN:
                    self.nb.metadata["language_info"] = message["content"]["language_info"]
                else:
                    self.process_message(message, cell, cell_index)
        return None


class _Manager(NotebookExecutionManager):  # type: ignore[misc]  # papermill has no types
    def get_cell_description(self, cell: Any, escape_str: str = "papermill_description=") -> str | None:
        """Return what a cell says of itself; papermill fails if that is empty."""
        with contextlib.suppress(IndexError):
            return str(super().get_cell_description(cell, escape_str) or "") or None
        return None


def execute(notebook: NotebookNode, client: Callable[..., PapermillNotebookClient], **options: Any) -> NotebookNode:
    """Run a notebook as an engine of papermill's does: the errors that ``allow_errors`` allows are not raised.

    Parameters
    ----------
    notebook : with papermill's metadata
    client : is given a manager and the options of a client
    options : of papermill's engines, or the client's
    """
    if isinstance(options.pop("input_path", None), NotebookNode):  # papermill has put all of it into the metadata
        notebook.metadata.papermill["input_path"] = options.get("name", "")
    limits = {"timeout": options.pop("execution_timeout", None), "startup_timeout": options.pop("start_timeout", 60)}
    of_manager = ("output_path", "progress_bar", "autosave_cell_every")
    managed = {name: options.pop(name) for name in of_manager if name in options}
    manager = _Manager(notebook, log_output=options.get("log_output", False), **managed)
    manager.notebook_start()
    try:
        client(manager, log=papermill.execute.logger, **limits, **options).execute()
    finally:
        manager.cleanup_pbar()
        manager.notebook_complete()
    if options.get("allow_errors"):
        notebook.metadata.papermill[_ERRORS_ALLOWED] = True
    return notebook


def run_unattended(
    engine: Any, name: str, notebook: Mapping[str, Any], parameters: Mapping[str, str], **options: Any
) -> None:
    """Let papermill run a notebook of which nobody reads the outputs. After an error, the next cell is run.

    Parameters
    ----------
    engine : papermill's, registered here: it need not be installed
    name : of the notebook
    notebook : content
    parameters : of the notebook
    options : of papermill or the engine
    """
    papermill_engines.register(ENGINE, engine)
    options |= {"engine_name": ENGINE, "kernel_name": "python3", "language": "python", "progress_bar": False}
    with contextlib.suppress(DeadKernelError):  # a cell has ended the process
        node = nbformat.from_dict(notebook)
        papermill.execute_notebook(node, None, parameters, name=name, allow_errors=True, **options)


_raise_for_execution_errors = papermill.execute.raise_for_execution_errors


def _raise_unless_allowed(notebook: NotebookNode, output_path: Any) -> None:
    """Raise for a cell that failed, and mark it, as papermill does even where nbclient's option allows it."""
    if not notebook.metadata.papermill.pop(_ERRORS_ALLOWED, False):
        _raise_for_execution_errors(notebook, output_path)


papermill.execute.raise_for_execution_errors = _raise_unless_allowed
