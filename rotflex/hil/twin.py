"""A fitted plant as a file, ``twin.toml``: what a virtual bench in a real one's place is made of."""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from rotflex import files
from rotflex.config import Servo, joint, srv02
from rotflex.errors import ConfigurationError
from rotflex.hil.bench_file import toml_table
from rotflex.hil.student_benches import VirtualPlantSpec
from rotflex.hil.terminals import Timing
from rotflex.plant import PlantParameters

_OF_DRAWN_BENCHES = {"breakaway", "gear"}  # which no fit finds
_NAMES = tuple(one.name for one in dataclasses.fields(PlantParameters) if one.name not in _OF_DRAWN_BENCHES)
_PARTS = ("encoder", "amplifier", "cable_gain", "tachometer")


@dataclass(frozen=True)
class Twin:
    """A fitted plant, the servo that its bench is said to have, and the name of the bench that it stands in for."""

    spec: VirtualPlantSpec
    servo: Servo
    name: str = ""


def save(path: str | Path, twin: Twin, about: Mapping[str, Any]) -> None:
    """Write a ``twin.toml``.

    Parameters
    ----------
    path : the file
    twin : what is written
    about : plain values that say where it comes from

    Raises
    ------
    OSError
        If it cannot be written.
    """
    servo = twin.servo
    parts = {name: getattr(servo, name) for name in _PARTS} | {"amplifier": servo.amplifier.name}
    lines = [f"# A plant fitted to recordings: open it as virtual:{Path(path).name}."]
    lines += toml_table("about", about)
    lines += toml_table("parts", {**parts, "arm_position": twin.spec.joint.arm_position})
    lines += toml_table(
        "plant", {name: asdict(twin.spec.parameters)[name] for name in _NAMES} | {"delay": twin.spec.timing.delay}
    )
    files.write(path, "\n".join(lines) + "\n")


def load(path: str | Path) -> Twin:
    """Read a ``twin.toml``.

    Raises
    ------
    ConfigurationError
        If it is not there, is no TOML, or lacks what a plant is made of, or has what cannot be.
    """
    try:
        told = tomllib.loads(Path(path).read_text(encoding="utf-8-sig"))
    except (OSError, ValueError) as error:
        raise ConfigurationError(f"{path} cannot be read: {error}.") from None
    plant, parts = told.get("plant"), told.get("parts")
    if not isinstance(plant, dict) or not isinstance(parts, dict) or {*plant} != {*_NAMES, "delay"}:
        raise ConfigurationError(
            f"{path} is no fitted plant: it needs [parts], and [plant] with {', '.join(_NAMES)}, delay. `rotflex "
            "bench fit` writes one."
        )
    try:
        values: dict[str, Any] = {
            name: tuple(plant[name]) if name.endswith("_friction") else float(plant[name]) for name in _NAMES
        }
        arm = joint(parts.get("arm_position", 1))
        servo = srv02(**{name: parts[name] for name in _PARTS if name in parts})
        spec = VirtualPlantSpec(arm, PlantParameters(**values), Timing(delay=float(plant["delay"])))
    except (TypeError, ValueError) as error:
        raise ConfigurationError(f"{path}: {error}") from None
    return Twin(spec, servo, str(told.get("name", "")))
