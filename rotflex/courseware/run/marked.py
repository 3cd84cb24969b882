"""The mark that runs by programs bear: what starts such a run, or writes into a student's folder, then does nothing."""

from __future__ import annotations

import os

RUN = "ROTFLEX_RUN"  #: environment variable: by what notebooks are run, where it is not by a person
CHECK, GRADE, DERIVE = "check", "grade", "derive"  #: what it may be
_NBVAL = ".ipynb::"  # in the name of a test that is a notebook's cell


def by_program() -> bool:
    """Whether this notebook is run by a check, by grading, or by nbval, and not by a person."""
    return bool(os.environ.get(RUN)) or _NBVAL in os.environ.get("PYTEST_CURRENT_TEST", "")
