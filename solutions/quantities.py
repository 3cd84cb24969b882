"""The quantities that this course's figures show, with the units in which they may be drawn."""

from dataclasses import replace

from labcourse.answers.units import UNITS, Unit
from labcourse.grading.marking.units import Quantity
from rotflex.units import DEG, HZ

_RADIAN, _DEGREE, _TURN, _VOLT, _HERTZ = (UNITS[name] for name in ("rad", "deg", "rev", "V", "Hz"))
ANGLE = Quantity((_DEGREE, _RADIAN, _TURN), (Unit("deg", DEG), Unit("rad", 1.0), Unit("mrad", 1e-3)))
VOLTAGE = Quantity((_VOLT,), (Unit("V", 1.0), Unit("mV", 1e-3)))
FREQUENCY = Quantity(
    (_HERTZ,),
    (Unit("Hz", 1.0), Unit("rad/s", 1 / HZ), Unit("kHz", 1e3)),
    per_time=(
        Unit("1", 1.0, "1", "cycles periods"),
        *(replace(unit, size=unit.size / HZ) for unit in (_RADIAN, _DEGREE, _TURN)),
    ),
)
