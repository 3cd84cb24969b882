"""Run a submission's notebooks, one after the other, each in a fresh kernel. A program, run in a child process.

It stands alone, so that it can be started where the package is the students' (without this room). What kernels say is
thrown away; what counts is the ``answers.json`` that they leave in the working folder. How it ended is told by the exit
code, and is worth a note, never a mark.

    python run_notebooks.py SPEC     SPEC: {"notebooks": [...], "student": ..., "bench": ..., "cell_timeout": s}
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

FINE, TIMED_OUT, DIED = 0, 10, 11  # exit codes
_TIMEOUT = "CellTimeout"
_STARTUP = 60  # s for a kernel to start


def _engine() -> Any:
    """Papermill's own way to run a notebook, with our options."""
    from papermill.clientwrap import PapermillNotebookClient
    from papermill.engines import NBClientEngine

    class DeafClient(PapermillNotebookClient):
        """Keeps nothing of what a kernel says, so that no amount of it fills the memory."""

        def output(self, outs: Any, msg: Any, display_id: Any, cell_index: Any) -> None:
            return None

        def handle_comm_msg(self, outs: Any, msg: Any, cell_index: Any) -> None:
            return None

    class Engine(NBClientEngine):
        @classmethod
        def execute_managed_notebook(cls, nb_man: Any, kernel_name: str, **options: Any) -> None:
            DeafClient(
                nb_man,
                kernel_name=kernel_name,
                startup_timeout=_STARTUP,
                timeout=options["timeout"],
                interrupt_on_timeout=True,
                # Without this, a cell that takes no notice of the interrupt would be waited for for ever.
                error_on_timeout={"ename": _TIMEOUT, "evalue": "", "traceback": []},
                raise_on_iopub_timeout=False,
                on_cell_error=options["on_cell_error"],
                shutdown_kernel="immediate",
            ).execute()

    return Engine


def run(spec: dict[str, Any]) -> int:
    """Run the notebooks of a specification in the current folder, and return the exit code."""
    # jsonschema would load a grammar of web addresses, which takes seconds and which no notebook needs.
    sys.modules["rfc3987_syntax"] = None  # type: ignore[assignment]
    from nbclient.exceptions import CellTimeoutError, DeadKernelError
    from papermill import execute_notebook
    from papermill.engines import papermill_engines

    papermill_engines.register("rotflex", _engine())
    ended = {FINE}

    def on_cell_error(cell: Any, cell_index: int, execute_reply: Any) -> None:
        if execute_reply["content"].get("ename") == _TIMEOUT:
            ended.add(TIMED_OUT)

    for name in spec["notebooks"]:
        try:
            execute_notebook(
                name,
                None,
                parameters={"student": spec["student"], "bench": spec["bench"]},
                engine_name="rotflex",
                kernel_name="python3",
                language="python",
                progress_bar=False,
                request_save_on_cell_execute=False,
                autosave_cell_every=0,
                timeout=spec["cell_timeout"],
                on_cell_error=on_cell_error,
            )
        except CellTimeoutError:
            ended.add(TIMED_OUT)
        except DeadKernelError:
            ended.add(DIED)
    return max(ended)


if __name__ == "__main__":
    sys.exit(run(json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))))
