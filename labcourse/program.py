"""The name of the program that messages mention: ``labcourse``, or that of a course's own command.

``python -m NAME`` runs it, too. Programs that it starts, such as a notebook's kernel, inherit the name.
"""

from __future__ import annotations

import os

_VARIABLE = "LABCOURSE_PROGRAM"


def name() -> str:
    """Return the name of the program, for messages such as "Run labcourse grade again."."""
    return os.environ.get(_VARIABLE, "labcourse")


def use(name: str) -> None:
    """Use this name in the messages of this process, and of those that it starts."""
    os.environ[_VARIABLE] = name


def use_by_default(name: str) -> None:
    """Use this name where no command line has set one, as in a notebook that was opened without it."""
    os.environ.setdefault(_VARIABLE, name)
