"""What a curve or a shape stands for, and how it is drawn."""

from __future__ import annotations

from typing import Any

from labcourse import pictures
from labcourse.errors import CourseError

#: Of the page as well (drawing.js); as keyword arguments of ``Axes.plot`` for a still picture.
ROLES: dict[str, dict[str, Any]] = {
    **pictures.ROLES,
    "ghost": {"color": "#777777", "linestyle": (0, (3, 4)), "linewidth": 1.2},
    "grid": {"color": "#BBBBBB", "linewidth": 0.8},
    "axis": {"color": pictures.BLACK, "linewidth": 0.8},
    "text": {"color": pictures.BLACK, "linewidth": 1.0},
    "body": {"color": "#CFD8DC", "linewidth": 1.0},
}


def checked(role: str) -> str:
    """Return a role.

    Raises
    ------
    CourseError
        If there is none of that name.
    """
    if role not in ROLES:
        raise CourseError(f"There is no role {role!r}; the roles are {', '.join(ROLES)}.")
    return role
