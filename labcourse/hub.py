"""A JupyterHub: where this runs on one, it says who its user is, and has a server of its own."""

from __future__ import annotations

import os

from labcourse import program, student_id
from labcourse.errors import ConfigurationError, StudentIDError

USER = "JUPYTERHUB_USER"  #: environment variable that a hub sets for each user's server
_BINDER = ("BINDER_LAUNCH_HOST", "BINDER_REPO_URL", "BINDER_REQUEST")  # its hub makes up a user for each visit


def user() -> str:
    """The student ID that the hub knows its user by; "" where there is no hub, or nobody in particular uses it.

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


def another(student: str) -> str:
    """What is to be said where a student is not whom the hub knows; "" where they are the same, or there is no hub."""
    named = _name()
    if not named or student_id.caseless(named) == student_id.caseless(student):
        return ""
    return f"The hub knows you as {named[: student_id.LONGEST]!r}. The work here is that of {student!r}."


def is_here() -> bool:
    """Whether a hub runs the server: then JupyterLab is there already, at an address that the hub gives."""
    return bool(os.environ.get("JUPYTERHUB_SERVICE_PREFIX"))


def _name() -> str:
    if any(name in os.environ for name in _BINDER):
        return ""
    return os.environ.get(USER, "").strip()
