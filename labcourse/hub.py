"""A JupyterHub: its user, and whether this program runs on one."""

from __future__ import annotations

import os

from labcourse import program, student_id
from labcourse.errors import ConfigurationError, StudentIDError

USER = "JUPYTERHUB_USER"  #: environment variable that a hub sets for each user's server
_BINDER = ("BINDER_LAUNCH_HOST", "BINDER_REPO_URL", "BINDER_REQUEST")  # its hub invents a user for each visit


def user() -> str:
    """Return the hub's name for its user as a student ID; "" without a hub, or if its users are anonymous.

    Raises
    ------
    ConfigurationError
        If the hub's name for the user cannot be an ID.
    """
    named = _name()
    try:
        return student_id.normalised(named) if named else ""
    except StudentIDError as error:
        raise ConfigurationError(
            f"This hub's name for you is no student ID. {error} Give your ID: {program.name()} lab --student YOUR-ID."
        ) from None


def other_user(student: str) -> str | None:
    """Return a message if a student is not the hub's user; None if they are the same, or without a hub."""
    named = _name()
    if not named or student_id.caseless(named) == student_id.caseless(student):
        return None
    return f"The hub knows you as {named[: student_id.LONGEST]!r}. The work here is that of {student!r}."


def is_here() -> bool:
    """Check whether a hub runs the server: then JupyterLab runs already, at the hub's address."""
    return bool(os.environ.get("JUPYTERHUB_SERVICE_PREFIX"))


def _name() -> str:
    if any(name in os.environ for name in _BINDER):
        return ""
    return os.environ.get(USER, "").strip()
