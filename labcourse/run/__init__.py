"""Running a course's notebooks with a student's work in them: what is run, in what frame, and what became of it."""

from __future__ import annotations

import os

SESSION = "JPY_SESSION_NAME"  #: environment variable: the notebook's path, set by the server that starts its kernel
#: Environment variable, set while notebooks are run by a program: "grade" or "check".
RUNNING = "LABCOURSE_RUNNING"
_NBVAL = ".ipynb::"  # in the name of a test that is a notebook's cell


def by_program() -> bool:
    """Return whether notebooks are run by a check, by grading, or by nbval, and not by a person."""
    return bool(os.environ.get(RUNNING)) or _NBVAL in os.environ.get("PYTEST_CURRENT_TEST", "")
