"""The parts on the bench and their parameters: the rotary servo, the flexible joint, the data-acquisition board.

``srv02(...)`` and ``joint(...)`` answer to the laboratory's two configuration scripts. Inertias are derived from the
gear train and from the arm's geometry; only what a data sheet states is typed in.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from rotflex.errors import ConfigurationError, RotflexError
from rotflex.units import DEG, GRAM, INCH, OZ_IN, REV, RPM, Vector


def one_of(what: str, value: Any, allowed: Iterable[Any]) -> Any:
    """Return ``value`` if it is one of ``allowed``.

    Raises
    ------
    ConfigurationError
        Naming ``what`` and the allowed values.
    """
    choices = list(allowed)
    if value not in choices:
        listed = ", ".join(repr(choice) for choice in choices)
        raise ConfigurationError(f"{what} is {value!r}; allowed: {listed}.")
    return value


def in_radians(what: str, angle: float) -> float:
    """Return an angle (rad) that the servo may turn by.

    Raises
    ------
    ConfigurationError
        If it is more than half a turn, which looks like degrees.
    """
    if abs(angle) > REV / 2:
        raise ConfigurationError(f"{what} = {angle:g} rad is {angle / DEG:.0f} deg; did you mean {angle:g} * DEG?")
    return angle


def positive(what: str, value: float, unit: str) -> float:
    """Return ``value`` as a float if it is a positive, finite number of ``unit``.

    Raises
    ------
    ConfigurationError
        If it is not; the message calls it ``what``.
    """
    if not (np.isfinite(value) and value > 0):
        raise ConfigurationError(f"{what} is {value!r}; it must be a positive number, in {unit}.")
    return float(value)


def real_array(what: str, values: Any, error: type[RotflexError] = ConfigurationError) -> Vector:
    """Return a copy of ``values`` as an array of real numbers; imaginary parts within rounding are dropped.

    Raises
    ------
    RotflexError
        The ``error``, if they are anything else; the message calls them ``what``.
    """
    try:
        array = np.real_if_close(np.array(values))  # pole placement may leave imaginary parts of 1e-17
        if not np.iscomplexobj(array):
            return array.astype(np.float64, copy=False)
    except (TypeError, ValueError) as why:
        raise error(f"{what} must be an array of numbers: {why}.") from None
    raise error(f"{what} is complex: {array.tolist()}. Poles that are complex must come in conjugate pairs.")


def finite_vector(what: str, values: Any, error: type[RotflexError] = ConfigurationError) -> Vector:
    """Return a copy of ``values``, an array (n,) of finite numbers.

    Raises
    ------
    RotflexError
        The ``error``, if they are anything else; the message calls them ``what``.
    """
    vector = real_array(what, values, error)
    if vector.ndim != 1:
        raise error(f"{what} must be one-dimensional; its shape is {vector.shape}.")
    if not np.isfinite(vector).all():
        raise error(f"{what} has a value that is not finite at sample {int(np.argmin(np.isfinite(vector)))}.")
    return vector


# --- the servo -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Amplifier:
    """A power amplifier: the largest voltage (V) and current (A) that it can give."""

    name: str
    V_max: float
    I_max: float


AMPLIFIERS = {
    amplifier.name: amplifier
    for amplifier in (
        Amplifier("VoltPAQ-X1", 24.0, 4.16),
        Amplifier("UPM_2405", 24.0, 5.0),
        Amplifier("UPM_1503", 15.0, 3.0),
        Amplifier("Q3", 4.16, 1.6),  # as tabulated; the table writes 4.16 A, so look at the one you have
    )
}
CABLE_GAINS = (1, 3, 5)
ENCODERS = {"E": 4 * 1024, "EHR": 4 * 2048}  #: counts per revolution, in quadrature
DAC_LIMIT = 10.0  #: V, of the board's analog output
ROTOR_INERTIA = 5.523e-5 * OZ_IN  #: kg·m²
TACHOMETER_INERTIA = 1.0e-5 * OZ_IN  #: kg·m²
INTERNAL_GEAR_RATIO = 14
EXTERNAL_GEAR_RATIO = {"high": 5, "low": 1}


def _disc_inertia(mass: float, radius: float) -> float:
    """Moment of inertia (kg·m²) of a disc about its axis."""
    return mass * radius**2 / 2


_GEAR = {  # teeth -> inertia
    24: _disc_inertia(5 * GRAM, 0.25 * INCH),
    72: _disc_inertia(30 * GRAM, 0.75 * INCH),
    120: _disc_inertia(83 * GRAM, 1.25 * INCH),
}
# The gears that turn with the load: in high gear a pair of 72-tooth gears carries the sensors; in low gear three mesh.
_GEAR_TRAIN = {"high": (24, 72, 72, 120), "low": (72, 72, 72)}

_BAR_MASS, _BAR_LENGTH = 0.038, 0.1525
# The bar is not carried at its middle. The offset is the one that reproduces the tabulated inertia, 2.28346e-3 kg·m².
_BAR_OFFSET = 0.0575
LOAD_INERTIA = {
    "none": 0.0,
    "disc": _disc_inertia(0.04, 0.05),
    "bar": _BAR_MASS * _BAR_LENGTH**2 / 12 + _BAR_MASS * _BAR_OFFSET**2,
}
# Viscous damping at the load shaft, N·m/(rad/s): the workbook's figure for the bare servo in high gear; the servo
# manual's, measured with the disc, for the rest.
_DAMPING = {("high", "none"): 0.004, ("high", "disc"): 0.015, ("high", "bar"): 0.015}
_DAMPING_LOW_GEAR = 1.5e-4


@dataclass(frozen=True)
class Servo:
    """The rotary servo, seen at its load shaft. Make one with :func:`srv02`. SI units.

    Attributes
    ----------
    R_m, k_t, k_m : armature resistance (ohm), torque constant (N·m/A), back-EMF constant (V/(rad/s))
    K_g, eta_g, eta_m : total gear ratio, gearbox and motor efficiency
    J_eq : inertia of motor, tachometer, gears and ``load`` (not of the flexible joint) at the load shaft, kg·m²
    B_eq : viscous damping at the load shaft, N·m/(rad/s)
    K_enc, K_pot, K_tach : sensor gains: rad per count, rad per V, (rad/s) per V, all at the load shaft
    amplifier, cable_gain : the power amplifier and the gain of the cable into it
    """

    gear: str
    load: str
    encoder: str
    tachometer: bool
    amplifier: Amplifier
    cable_gain: int
    J_eq: float
    B_eq: float
    K_g: float
    R_m: float = 2.6
    k_t: float = 1.088 * OZ_IN
    k_m: float = 0.804e-3 / RPM
    eta_g: float = 0.90
    eta_m: float = 0.69

    @property
    def K_enc(self) -> float:
        """Encoder gain, rad per count."""
        return REV / ENCODERS[self.encoder]

    @property
    def K_pot(self) -> float:
        """Potentiometer gain, rad per V. There is a gap in its track."""
        return -35.2 * DEG

    @property
    def K_tach(self) -> float:
        """Tachometer gain at the load shaft, (rad/s) per V: 1.5 mV per rpm of the motor."""
        return -RPM / 1.5e-3 / self.K_g

    @property
    def V_max(self) -> float:
        """The largest motor voltage (V): the board's 10 V through the cable, or what the amplifier can give."""
        return min(DAC_LIMIT * self.cable_gain, self.amplifier.V_max)

    @property
    def torque_per_volt(self) -> float:
        """Torque at the load shaft per volt at standstill, N·m/V (from Equation 2.8)."""
        return self.eta_g * self.K_g * self.eta_m * self.k_t / self.R_m

    @property
    def back_emf_damping(self) -> float:
        """Damping at the load shaft that the back-EMF adds, N·m/(rad/s) (from Equation 2.8)."""
        return self.torque_per_volt * self.K_g * self.k_m


def srv02(
    gear: str = "high",
    load: str = "none",
    encoder: str = "E",
    tachometer: bool = True,
    amplifier: str = "VoltPAQ-X1",
    cable_gain: int = 1,
) -> Servo:
    """Parameters of the rotary servo in a given configuration.

    Parameters
    ----------
    gear : "high" or "low"
    load : "none", "disc" or "bar"
    encoder : "E" (4096 counts per revolution) or "EHR" (8192)
    tachometer : whether a tachometer (and its rotor) is fitted
    amplifier : a name in ``AMPLIFIERS``
    cable_gain : 1, 3 or 5

    Raises
    ------
    ConfigurationError
        If a value is not one that exists; the message names those that do.
    """
    one_of("gear", gear, EXTERNAL_GEAR_RATIO)
    one_of("load", load, LOAD_INERTIA)
    one_of("encoder", encoder, ENCODERS)
    one_of("tachometer", tachometer, (True, False))
    one_of("amplifier", amplifier, AMPLIFIERS)
    one_of("cable_gain", cable_gain, CABLE_GAINS)
    K_g = INTERNAL_GEAR_RATIO * EXTERNAL_GEAR_RATIO[gear]
    motor_inertia = ROTOR_INERTIA + (TACHOMETER_INERTIA if tachometer else 0.0)
    gear_inertia = sum(_GEAR[teeth] for teeth in _GEAR_TRAIN[gear])
    return Servo(
        gear=gear,
        load=load,
        encoder=encoder,
        tachometer=tachometer,
        amplifier=AMPLIFIERS[amplifier],
        cable_gain=cable_gain,
        J_eq=Servo.eta_g * K_g**2 * motor_inertia + gear_inertia + LOAD_INERTIA[load],
        B_eq=_DAMPING.get((gear, load), _DAMPING_LOW_GEAR),
        K_g=K_g,
    )


# --- the flexible joint ----------------------------------------------------------------------------------------------

_ANCHOR = {1: 8.25 * INCH, 2: 9.25 * INCH, 3: 10.25 * INCH}  #: d_12 by arm position


@dataclass(frozen=True)
class Joint:
    """The flexible joint module: a long bottom arm on the pivot and a short top arm fixed to it. SI units.

    Attributes
    ----------
    arm_position : where the top arm is anchored, 1, 2 or 3
    m_1, L_1 : mass (kg) and length (m) of the bottom arm
    m_2, L_2 : mass (kg) and length (m) of the top arm
    d_12 : distance from the pivot to the middle of the top arm (m)
    B_l : viscous damping of the link, N·m/(rad/s); the workbook neglects it
    """

    arm_position: int
    d_12: float
    m_1: float = 0.064
    L_1: float = 11.75 * INCH
    m_2: float = 0.030
    L_2: float = 6.125 * INCH
    B_l: float = 0.0

    @property
    def J_l(self) -> float:
        """Moment of inertia of the link about the pivot, kg·m², by the parallel-axis theorem."""
        return self.m_1 * self.L_1**2 / 3 + self.m_2 * self.L_2**2 / 12 + self.m_2 * self.d_12**2


def joint(arm_position: int = 1) -> Joint:
    """Parameters of the flexible joint with the top arm at anchor 1, 2 or 3.

    Raises
    ------
    ConfigurationError
        If there is no such anchor.
    """
    one_of("arm_position", arm_position, _ANCHOR)
    return Joint(arm_position=arm_position, d_12=_ANCHOR[arm_position])


def check_mounted(servo: Servo) -> Servo:
    """Return ``servo`` if the flexible joint can be mounted on it (Section 4.3: high gear, no other load).

    Raises
    ------
    ConfigurationError
        If the servo carries a load or is in low gear.
    """
    one_of("gear, with the flexible joint mounted,", servo.gear, ("high",))
    one_of("load, with the flexible joint mounted,", servo.load, ("none",))
    return servo
