"""The quantities that this course's figures show, with the units in which they may be drawn."""

from dataclasses import replace

from labcourse.grading.marking.units import Quantity, Unit
from rotflex.units import DEG, HZ

_RADIAN = Unit("rad", 1.0, "rad rads", "radian radians", prefixed=True)
_DEGREE = Unit("deg", DEG, "° deg degs", "degree degrees")
_TURN = Unit("rev", HZ, "rev revs", "turn turns revolution revolutions")
_VOLT = Unit("V", 1.0, "v", "volt volts", prefixed=True)
_HERTZ = Unit("Hz", 1.0, "hz", "hertz", prefixed=True)

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
