"""The laboratory's benches whose truth is known: a file each, ``solutions/benches/NAME.toml``.

``docs/real_bench_marks.md`` has the format, with an example.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from rotflex.config import Joint, Servo, joint, srv02
from rotflex.errors import ConfigurationError
from rotflex.plant import PlantParameters

from . import tolerances

FOLDER = Path(__file__).resolve().parent / "benches"
_ARM = ("m_1", "L_1", "m_2", "L_2")
_TOLD = ("arm_position", "encoder", *_ARM)
#: Identified, SI; what is not given is as the data sheet has it. omega_n and its uncertainty have to be.
_TRUTH = ("omega_n", "omega_n_u", "J_eq", "B_eq", "B_l", "torque_per_volt", "back_emf")


@dataclass(frozen=True)
class KnownBench:
    """A bench of the laboratory's.

    Attributes
    ----------
    name : of the bench, and of its file
    servo, joint : as students are told them
    parameters : as they were identified
    """

    name: str
    servo: Servo
    joint: Joint
    parameters: PlantParameters


def faults(folder: Path = FOLDER) -> dict[str, str]:
    """Names of all benches whose truth is known, and what is wrong with their files; empty text for nothing."""
    return {path.stem: _fault(path.stem, folder) for path in sorted(folder.glob("*.toml"))}


def _fault(name: str, folder: Path) -> str:
    try:
        read(name, folder)
    except ConfigurationError as error:
        return str(error)
    return ""


def read(name: str, folder: Path = FOLDER) -> KnownBench:
    """A bench of the laboratory's.

    Raises
    ------
    ConfigurationError
        If its file cannot be read or understood, or the bench is not known well enough to mark by.
    """
    file = folder / f"{name}.toml"
    try:
        content = tomllib.loads(file.read_text(encoding="utf-8"))
        if "keys" in content:
            raise ValueError("it has the entry keys, and signatures are no longer checked: delete that line")
        told, truth = content["told"], content["truth"]
        unknown = [*(content.keys() - {"told", "truth"}), *(told.keys() - set(_TOLD))]
        unknown += truth.keys() - set(_TRUTH)
        if unknown:
            raise ValueError(f"it knows no entry {unknown[0]!a}")
        servo, arm = _parts(told)
        return KnownBench(name, servo, arm, _parameters(truth, servo, arm))
    except KeyError as error:
        raise ConfigurationError(f"{file}: {error} is missing.") from None
    except (OSError, ValueError, TypeError, AttributeError) as error:
        raise ConfigurationError(f"{file} cannot be used: {error}") from None


def _parts(told: Mapping[str, Any]) -> tuple[Servo, Joint]:
    measured: dict[str, Any] = {name: _number(told, name) for name in _ARM if name in told}
    return srv02(encoder=told.get("encoder", "E")), replace(joint(told["arm_position"]), **measured)


def _parameters(truth: Mapping[str, Any], servo: Servo, arm: Joint) -> PlantParameters:
    omega_n, uncertainty = _number(truth, "omega_n"), _number(truth, "omega_n_u")
    if uncertainty > tolerances.NEAR_TRUE * omega_n:
        raise ValueError(
            f"omega_n is known to {uncertainty / omega_n:.1%} only, and answers are marked to "
            f"{tolerances.NEAR_TRUE:.1%}: identify it from more recordings"
        )
    given = {field.name for field in fields(PlantParameters)} & truth.keys()
    identified: dict[str, Any] = {name: _number(truth, name) for name in given}
    return replace(PlantParameters.of(servo, arm, arm.J_l * omega_n**2), **identified)


def _number(given: Mapping[str, Any], name: str) -> float:
    value = given[name]
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < math.inf:
        raise ValueError(f"{name} is {value!a}, and should be a number in SI units")
    return float(value)
