"""Numbers in SI units, and conversion factors: multiply by the name to get SI, divide to leave it.

Everything inside the package is in radians, seconds, volts, kilograms and metres. Degrees, inches and ounce-inches
appear only where a data sheet or a person speaks them.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]  #: numbers in SI units
Vector = Array  #: the same, of one dimension as a rule

DEG = math.pi / 180  #: rad per degree
REV = 2 * math.pi  #: rad per revolution
RPM = REV / 60  #: rad/s per revolution per minute
HZ = REV  #: rad/s per hertz
INCH = 0.0254  #: m per inch
GRAM = 1e-3  #: kg per gram
OUNCE_FORCE = 0.45359237 * 9.80665 / 16  #: N per ounce-force
OZ_IN = OUNCE_FORCE * INCH  #: N·m per ounce-inch; also kg·m² per oz·in·s²
