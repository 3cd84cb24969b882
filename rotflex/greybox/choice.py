"""What to fit, where nobody says it: all that is usually told, less what these recordings do not tell.

A parameter that a recording does not tell takes some value all the same, and others with it. So it is fixed, one after
the other, and the rest is fitted again: a friction or a delay whose interval holds zero is taken as none, and what is
left open by more than a quarter is taken from the data sheet.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from rotflex.greybox.problem import Problem, changed, known
from rotflex.greybox.solving import Found, Sureness, search, sureness, untold
from rotflex.identification import Estimate, Vector
from rotflex.plant import PlantParameters

FREE = ("K_s", "J_eq", "torque_per_volt", "braking", "B_l", "servo_friction", "link_friction", "delay")
_MAY_BE_NONE = ("link_friction", "delay", "B_l")  # in the order in which they are given up
_ON_DATA_SHEETS = ("torque_per_volt", "braking", "J_eq")
_OPEN = 0.25  # of the value: half an interval so wide tells less than a data sheet

_NONE = "{name}: not told from none (95 %: {low:.2g} to {high:.2g}), so it is taken as none."
_SHEET = "{name}: left open (95 %: {low:.2g} to {high:.2g}), so it stays at {value:.4g}, where the fit began."
_NOT_AT_ALL = "{name}: nothing tells it, so it is taken as {value:.4g}."

#: A problem from the plant to start from, the delay, and what is free.
Make = Callable[[PlantParameters, float, Sequence[str]], Problem]


class Fixed(NamedTuple):
    """A parameter that was given up: its value with what the fit said of it while it was free, and why, in words."""

    estimate: Estimate
    interval: tuple[float, float]
    why: str


class Chosen(NamedTuple):
    """A fit of what is told, and what is not."""

    problem: Problem
    found: Found
    sure: Sureness
    fixed: dict[str, Fixed]


def choose(make: Make, nominal: PlantParameters, progress: bool) -> Chosen:
    """Fit, give up what is told least, and fit again from there.

    Raises
    ------
    IdentificationError
        If something is not told that nobody knows, such as the stiffness.
    """
    free: tuple[str, ...] = FREE
    plant, delay, fixed = nominal, 0.0, dict[str, Fixed]()
    while True:
        problem = make(plant, delay, free)
        found = search(problem, progress)
        name, sure = _without_effect(problem, found), None
        if name is None:
            sure = sureness(problem, found)
            name = _least_told(problem, found, sure)
            if name is None:
                return Chosen(problem, found, sure, fixed)
        plant, delay = problem.plant(found.values, 0), problem.values(found.values, 0).get("delay", delay)
        value = 0.0 if name in _MAY_BE_NONE else known(nominal, name)
        fixed[name] = _fix(name, value, problem, found, sure)
        free = tuple(other for other in free if other != name)
        plant, delay = changed(plant, {name: value}), 0.0 if name == "delay" else delay


def _without_effect(problem: Problem, found: Found) -> str | None:
    """The first to be given up of what is not told at all."""
    keys = {name.partition("[")[0] for name in untold(problem, found)}
    return next((name for name in (*_MAY_BE_NONE, *_ON_DATA_SHEETS) if name in keys), None)


def _least_told(problem: Problem, found: Found, sure: Sureness) -> str | None:
    """The first to be given up of what is told too little."""
    values = np.abs(found.values) * problem.units
    for names, enough in ((_MAY_BE_NONE, 1.0), (_ON_DATA_SHEETS, 1 / _OPEN)):
        for name in names:
            places = _places(problem, name)
            if name in problem.free and (values[places] / _reaches(problem, name, sure)).max() < enough:
                return name
    return None


def _reaches(problem: Problem, name: str, sure: Sureness) -> Vector:
    """Half widths that decide whether a parameter is given up: of a friction or a delay, those that are reported.

    Of two recordings, Student's t is 12.7: damping and delay would be given up that each of the two tells. So would
    what stands on data sheets, of any number. Without a Coulomb friction of the link, B_l still damps it.
    """
    reported = name == "link_friction" or (name in _MAY_BE_NONE and len(problem.records) != 2)
    return (sure.reaches if reported else sure.within)[_places(problem, name)]


def _fix(name: str, value: float, problem: Problem, found: Found, sure: Sureness | None) -> Fixed:
    """What is kept of a parameter that is given up; without ``sure`` it is not told at all."""
    if sure is None:
        return Fixed(Estimate(value, np.inf), (-np.inf, np.inf), _NOT_AT_ALL.format(name=name, value=value))
    places = _places(problem, name)
    values, reaches = (found.values * problem.units)[places], _reaches(problem, name, sure)
    low, high = float((values - reaches).min()), float((values + reaches).max())
    why = (_NONE if name in _MAY_BE_NONE else _SHEET).format(name=name, low=low, high=high, value=value)
    return Fixed(Estimate(value, float(sure.errors[places].max())), (low, high), why)


def _places(problem: Problem, name: str) -> list[int]:
    """Where a parameter stands among the unknowns: once, or once for each recording."""
    return [place for place, one in enumerate(problem.unknowns) if one.key == name]
