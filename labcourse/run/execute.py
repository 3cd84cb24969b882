"""Run notebooks one after the other in a folder, as a student's own computer can: without a sandbox.

papermill runs them, by the engine that grading uses, too: on Linux, a warm process imports what notebooks use once, and
forks for each; elsewhere, each notebook gets a kernel (:mod:`labcourse.run.warm`).
What cells show is discarded; ``cell_reports`` writes down what became of them.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from labcourse import course_file, job
from labcourse.answers.cell_reports import REPORTS_FILE
from labcourse.errors import CheckError
from labcourse.files import IN_BROWSER
from labcourse.run import RUNNING
from labcourse.run.engine import Engine
from labcourse.run.inside import private_interfaces

CELL_TIMEOUT = 60.0  #: s; the longest cell takes seconds
_BEGIN = 120  # s that a kernel may take to start

# jsonschema, which nbformat uses, imports a grammar of web addresses if it is installed. That takes seconds.
sys.modules.setdefault("rfc3987_syntax", None)  # type: ignore[arg-type]  # None: the import fails at once


def run(
    notebooks: Mapping[str, dict[str, Any]],
    folder: Path,
    *,
    parameters: Mapping[str, str],
    imports: Sequence[str] = (),
    cell_timeout: float = CELL_TIMEOUT,
    report: Callable[[str], None] = lambda name: None,
) -> None:
    """Run the code cells of notebooks. After an error in a cell, the next cell is run.

    Parameters
    ----------
    notebooks : file name → content
    folder : in which they are run; answers and reports on cells are left there
    parameters : the student of the run, and the bench unless it is virtual; no cell changes them (:mod:`labcourse.job`)
    imports : import statements of what notebooks use, for the warm process
    cell_timeout : time for a cell, s; then it is interrupted, and some seconds later its process is ended
    report : called with the file name of each notebook that begins

    Raises
    ------
    CheckError
        If they cannot be run here.
    """
    environment = {
        **{name: value for name, value in os.environ.items() if name != "PYTHONSAFEPATH"},  # cells may start Python
        job.VARIABLE: json.dumps({**parameters, "course": course_file.read(folder)}),
        RUNNING: "check",
        "TQDM_DISABLE": "1",
        job.PICTURES: "off",
        "PYTHONBREAKPOINT": "0",  # nobody is there to debug: breakpoint() does nothing
        # As where it is graded; and two processes share the processors.
        **dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"),
    }
    if IN_BROWSER:
        from labcourse.run import in_worker

        in_worker.run_cells(notebooks, folder, environment, report)
        return
    private_interfaces.silence_loggers()
    with private_interfaces.no_entry_points():  # not before: the commands' help needs none of it
        from labcourse.run import warm
        from labcourse.run.inside import papermill_client

    # JupyterLab's own settings, and what a student's IPython does when it starts, are not part of the work.
    with tempfile.TemporaryDirectory(prefix="labcourse-ipython-", ignore_cleanup_errors=True) as settings:
        own = ("student", "bench") if parameters.get("student") else ()  # the job's: no cell sets them
        given = {name: value for name, value in {"bench": job.BENCH, **parameters}.items() if name not in own}
        options: dict[str, Any] = {
            "cwd": folder,
            "environment": {**environment, "IPYTHONDIR": settings},
            "execution_timeout": cell_timeout,
            "imports": imports,
            "muted": True,
            "reports": str(folder / REPORTS_FILE),
            "start_timeout": _BEGIN,
        }
        try:
            for name, notebook in notebooks.items():
                report(name)
                papermill_client.run_unattended(Engine, name, notebook, given, **options)
        except ChildProcessError as error:
            raise CheckError(
                f"The run of your notebooks ended early, perhaps for lack of memory: {error} Try again."
            ) from None
        except RuntimeError:
            raise CheckError(
                "A Python kernel does not start here. Try whether JupyterLab starts one; if it does not, "
                f"install ipykernel anew: {sys.executable} -m pip install --force-reinstall ipykernel"
            ) from None
        finally:
            warm.end()
