"""The bench that an address like ``serial:/dev/ttyACM0?supply=12`` names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from rotflex.config import Amplifier, Servo, joint, one_of, srv02
from rotflex.errors import BenchError
from rotflex.hil import real
from rotflex.hil.bench import Bench
from rotflex.hil.real import Setup
from rotflex.hil.serial.board import SerialBoard
from rotflex.hil.serial.port import open_port

OPTIONS = ("supply", "encoder", "arm_position")
EXAMPLE = "serial:/dev/ttyACM0?supply=12"
SUPPLY = (3.0, 32.0)  #: V that the motor's driver may be fed with


def bench(uri: str, name: str, options: Mapping[str, str], setup: Setup | None = None) -> Bench:
    """The bench at a serial port.

    Parameters
    ----------
    uri : the address, as it was given
    name : the port
    options : supply (V), which has to be told; encoder, arm_position, unless a setup has them
    setup : what else is known of the bench. Its servo's voltage ends at the supply.

    Raises
    ------
    BenchError
        If the port or the supply is missing, or the supply is none, or the parts are told twice.
    ConfigurationError
        If there is no such encoder or arm position.
    """
    if not name:
        raise BenchError(f"The address {uri!r} names no port; it is like {EXAMPLE!r}.")
    supply = _supply(uri, options.get("supply"))
    chosen = _setup(uri, options) if setup is None else setup
    twice = [one for one in OPTIONS if one != "supply" and one in options and setup is not None]
    if twice:
        raise BenchError(
            f"The address {uri!r} says {twice[0]}=, which the bench's own file or setup says as well: leave it out."
        )
    driven = replace(chosen, servo=_driven(chosen.servo, supply))
    return real.bench(uri, lambda: SerialBoard(open_port(name), supply), driven)


def _setup(uri: str, options: Mapping[str, str]) -> Setup:
    """The parts that an address names."""
    position = one_of("arm_position", options.get("arm_position", "1"), "123")
    return Setup(servo=srv02(encoder=options.get("encoder", "E")), joint=joint(int(position)))


def _supply(uri: str, value: str | None) -> float:
    try:
        supply = float(value or "")
    except ValueError:
        supply = 0.0
    lowest, highest = SUPPLY
    if not lowest <= supply <= highest:
        raise BenchError(
            f"The address {uri!r} has to say what the motor's driver is fed with, {lowest:g} to {highest:g} V, "
            f"as in {EXAMPLE!r}: the board makes each voltage out of it."
        )
    return supply


def _driven(servo: Servo, supply: float) -> Servo:
    """A servo whose amplifier is a driver with that supply (V), with no cable that has a gain."""
    amplifier = servo.amplifier
    driver = Amplifier("motor driver", min(supply, amplifier.V_max), amplifier.I_max)
    return replace(servo, amplifier=driver, cable_gain=1)
