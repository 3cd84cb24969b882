"""Of responses (3.11 to 3.16) and tables: own numbers against own recordings, and against the specifications."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from labcourse.answers.parts import Part
from labcourse.answers.reflection import Check
from rotflex import response
from rotflex.config import Servo
from rotflex.course.questions import CATALOGUE
from rotflex.course.reflection.numbers import CARRIED, Array, alike, same_poles, unit_of
from rotflex.course.reflection.recordings import Kept, channel, recording, thin_indices
from rotflex.course.spare_design import SPARE_GAIN, runs_away
from rotflex.errors import RotflexError
from rotflex.signals import smooth_square_wave, time_axis
from rotflex.simulation import closed_loop, with_actuator
from rotflex.specifications import AMPLITUDE, DURATION, FREQUENCY, LIMITS, RATE, SAMPLE_TIME, SETTLING_BAND
from rotflex.units import DEG

#: Where a response is recorded → where it is measured.
MEASURED = {"3.11": "3.12", "3.13": "3.14", "3.15": "3.16"}

_OTHER_LOOP = 0.1  # of the step: simulations by Euler and exact ones, limited or not, differ by 3 %
_OTHER_COMMAND = 0.02  # of the step
_SAME_GAIN = 0.03  # relative: three digits
_NEAR_LIMIT = 0.05  # relative: rounded to two digits, a number may be on the other side of its limit
#: Of a quantity: its name in a summary, SI per unit of the answer, and how far an honest reading may be from what 400
#: points of the recording show: relative, and in the answer's unit.
_QUANTITIES = {
    "t_s": ("settling_time", 1.0, 0.1, 0.08, "s"),
    "PO": ("overshoot", 1.0, 0.15, 1.8, "%"),
    "alpha_max_deg": ("max_alpha", DEG, 0.08, 0.5, "deg"),
}
#: The band, and those of two counts less and more: between 400 points, a response may just leave it, or just not.
_BANDS = (SETTLING_BAND, 0.75 * SETTLING_BAND, 1.25 * SETTLING_BAND)
_PEAK_LOST = (0.9, 1.9)  # V_max over what 400 points show: a peak shorter than 25 ms may be missed


def checks(servo: Servo) -> tuple[Check, ...]:
    """What responses and tables can be asked.

    Parameters
    ----------
    servo : as the student is told it
    """
    found = [
        Check(
            (("3.11", "response"), ("3.8", "K"), ("2.14", "A"), ("2.14", "B")),
            lambda kept, K, A, B: _simulated(kept, K, *with_actuator(A, np.reshape(B, (4, 1)), servo)),
        )
    ]
    for recorded, measured in MEASURED.items():
        if recorded != "3.11":
            found.append(Check(((recorded, "response"), ("3.8", "K")), _recorded_with))
        found += [Check(((measured, name), (recorded, "response")), _quantity(name)) for name in _QUANTITIES]
        found.append(Check(((measured, "V_max"), (recorded, "response")), _voltage))
        found.append(Check(tuple((measured, name) for name in ("satisfied", *_ANSWERED)), _satisfied))
    return (*found, *_tables())


# --- recordings -------------------------------------------------------------------------------------------------------


def _simulated(kept: Kept, K: Array, A: Array, B: Array) -> str:
    """Whether the simulation is of the own model and gain. Where these run away, another gain stands in for them."""
    if runs_away(A, B, K):
        return ""
    command = smooth_square_wave(time_axis(DURATION, SAMPLE_TIME), FREQUENCY, AMPLITUDE, RATE)
    step, places = 2 * AMPLITUDE, thin_indices(kept)
    if kept["n"] != command.size:
        return ""
    if np.abs(command[places] - channel(kept, "theta_ref")).max() > _OTHER_COMMAND * step:
        return ""
    try:
        own = closed_loop(A, B, K, command, saturation=None)["theta"][places]
    except RotflexError:
        return ""
    if np.abs(own - channel(kept, "theta")).max() <= _OTHER_LOOP * step:
        return ""
    return (
        "Your own A, B (2.14, motor voltage as input) and K (3.8), simulated with this command, give another theta. "
        "Which model and which K were simulated?"
    )


def _recorded_with(kept: Kept, K: Array) -> str:
    used = kept["metadata"].get("K")
    if used is None or alike(used, K, _SAME_GAIN, 1e-3) or alike(used, SPARE_GAIN, 1e-3):
        return ""
    return "This was recorded with another gain than your K of question 3.8 is now. Is that the one you mean?"


def _quantity(name: str) -> Callable[[float, Kept], str]:
    key, unit, rtol, atol, symbol = _QUANTITIES[name]

    def ask(given: float, kept: Kept) -> str:
        seen = recording(kept)
        values = [getattr(response.worst(response.measure(seen, band)), key) for band in _BANDS]
        if None in values or not all(map(math.isfinite, values)):
            return ""
        shown, *others = (value / unit for value in values)
        least, most = min(shown, *others), max(shown, *others)
        if least <= given <= most or alike(given, least, rtol, atol) or alike(given, most, rtol, atol):
            return ""
        unit_meant = unit_of(given / shown, 0.3) if shown else ""
        if unit_meant:
            return f"Your own recording shows another size for {name}. Is it {unit_meant}?"
        return (
            f"Your {name} of {given:.3g} {symbol} is not what your own recording shows. Which step did you read, "
            "from where on, and in per cent of what?"
        )

    return ask


def _voltage(given: float, kept: Kept) -> str:
    shown = response.worst(response.measure(recording(kept))).max_vm
    if not shown or _PEAK_LOST[0] <= given / shown <= _PEAK_LOST[1]:
        return ""
    return (
        f"Your V_max of {given:.3g} V is not what your own recording shows. Is it the largest magnitude, from "
        "zero, of the steps of full size?"
    )


# --- specifications ---------------------------------------------------------------------------------------------------

_ANSWERED = ("t_s", "PO", "alpha_max_deg", "V_max")
_ALLOWED = (
    LIMITS["settling_time"],
    LIMITS["overshoot"],
    LIMITS["max_alpha"] / DEG,
    LIMITS["max_vm"],
)
_SYMBOLS = ("s", "%", "deg", "V")


def _satisfied(said: str, *measured: float) -> str:
    shares = [value / limit for value, limit in zip(measured, _ALLOWED, strict=True)]
    if said == "yes" and max(shares) > 1 + _NEAR_LIMIT:
        worst = int(np.argmax(shares))
        return (
            f"You say that all four are met, and your own {_ANSWERED[worst]} is {measured[worst]:.3g} "
            f"{_SYMBOLS[worst]}; the limit is {_ALLOWED[worst]:.3g} {_SYMBOLS[worst]}. Is it met?"
        )
    if said == "no" and max(shares) < 1 - _NEAR_LIMIT:
        return "You say that not all four are met, and each of your own four numbers is within its limit. Which is it?"
    return ""


# --- tables -----------------------------------------------------------------------------------------------------------


def _tables() -> list[Check]:
    """Whether a table repeats what the questions have, but where an entry is made of it."""
    return [
        Check(((table.number, part.name), part.shows), _repeats(part))
        for table in CATALOGUE.tables.values()
        for part in table.parts
        if part.shows is not None
    ]


def _repeats(part: Part) -> Callable[[Array, Array], str]:
    def ask(entry: Array, source: Array) -> str:
        if part.name == "K_psf":
            fed_back = np.ravel(entry)[[0, 2]]
            if alike(fed_back, np.ravel(source)[[0, 2]], CARRIED) and not np.any(np.ravel(entry)[[1, 3]]):
                return ""
            return "Which states does partial state feedback leave, and what is the gain on the others?"
        same = same_poles(entry, source) if part.kind == "poles" else _same(entry, source)
        if same:
            return ""
        return f"{part.name} in the table is not what you answered. Which of the two do you mean?"

    return ask


def _same(entry: Array, source: Array) -> bool:
    largest = float(np.abs(np.ravel(source)).max())
    return alike(entry, source, CARRIED, 1e-6 * largest)
