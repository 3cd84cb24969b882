"""Which virtual benches there are: each student's own, drawn around nominal from a seed, and named presets.

The ranges keep the laboratory's design feasible on every bench, and the natural frequency inside the 1 to 5 Hz sweep.
A student's own machine holds this code, and so, for a determined reader, their bench's parameters: that is accepted.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rotflex.config import joint, one_of, srv02
from rotflex.courseware.messages import _
from rotflex.courseware.student_id import composed
from rotflex.errors import ConfigurationError
from rotflex.plant import PlantParameters

#: The version of the draw that new releases have. Work begun under an older one is marked on the benches of that one:
#: a version is never changed, and never taken away.
DRAW = 1


@dataclass(frozen=True)
class VirtualPlantSpec:
    """What a virtual bench is made of: the anchor of the top arm (which the student is told) and the true plant."""

    arm_position: int
    parameters: PlantParameters


def student_seed(student: str) -> int:
    """The seed (32 bits) of a student's own bench; the same on every machine, however the ID is typed."""
    digest = hashlib.sha256(f"rotflex bench: {composed(student).casefold()}".encode()).digest()
    return int.from_bytes(digest[:4], "big")


def student_bench(seed: int, arm_position: int | None = None, draw: int = DRAW) -> VirtualPlantSpec:
    """Draw the bench of a seed. The same seed and version of the draw give the same bench, always.

    Parameters
    ----------
    seed : any non-negative integer
    arm_position : the anchor to use in place of the drawn one; nothing else changes with it
    draw : version of the draw

    Raises
    ------
    ConfigurationError
        If there is no such anchor, or no such version.
    """
    if draw not in _DRAWS:
        raise ConfigurationError(
            _(
                "Benches of the draw {draw!r} are not known to this version of rotflex, which knows {known}. Install "
                "the release of the course that your course.json names."
            ).format(draw=draw, known=", ".join(map(str, _DRAWS)))
        )
    return _DRAWS[draw](seed, arm_position)


def _first_draw(seed: int, arm_position: int | None) -> VirtualPlantSpec:
    """Draw number 1.

    Everything not in this table is nominal, as :mod:`rotflex.config` has it.

    ==============  ========================================================================
    arm position    1, 2 or 3
    K_s             1.15 to 1.65 N·m/rad
    J_eq            0.97 to 1.03 of nominal
    B_eq            0.004 to 0.012 N·m/(rad/s)
    B_l             0.0005 to 0.0025 N·m/(rad/s)
    servo friction  0.006 to 0.013 N·m, up to 30 % more one way and as much less the other
    link friction   0.0008 to 0.0032 N·m, up to 20 % more one way and as much less the other
    ==============  ========================================================================
    """
    draw = np.random.default_rng(seed)
    drawn_position = int(draw.integers(1, 4))
    K_s = draw.uniform(1.15, 1.65)
    B_eq = draw.uniform(0.004, 0.012)
    inertia_factor = draw.uniform(0.97, 1.03)
    B_l = draw.uniform(0.0005, 0.0025)
    servo_friction = draw.uniform(0.006, 0.013) * (1 + draw.uniform(-0.3, 0.3) * np.array([1, -1]))
    link_friction = draw.uniform(0.0008, 0.0032) * (1 + draw.uniform(-0.2, 0.2) * np.array([1, -1]))

    arm = joint(drawn_position if arm_position is None else arm_position)
    nominal = PlantParameters.of(srv02(), arm, float(K_s))
    return VirtualPlantSpec(
        arm_position=arm.arm_position,
        parameters=replace(
            nominal,
            J_eq=nominal.J_eq * float(inertia_factor),
            B_eq=float(B_eq),
            B_l=float(B_l),
            servo_friction=(float(servo_friction[0]), float(servo_friction[1])),
            link_friction=(float(link_friction[0]), float(link_friction[1])),
        ),
    )


_DRAWS: dict[int, Callable[[int, int | None], VirtualPlantSpec]] = {1: _first_draw}

#: Parameters fitted to logs of a real bench. Its arm is lighter than the data sheet's at any anchor.
REAL_BENCH = VirtualPlantSpec(
    arm_position=1,
    parameters=replace(
        PlantParameters.of(srv02(), joint(1), 1.454),
        J_eq=2.12e-3,
        J_l=2.77e-3,
        B_eq=0.0095,
        B_l=0.0021,
        servo_friction=(0.0076, 0.0140),  # 0.0108 on average; the logs stick harder one way than the other
        link_friction=(0.0032, 0.0032),
    ),
)

#: The plant of the workbook: nominal parts, K_s = 1.4 N·m/rad, no Coulomb friction.
WORKBOOK = VirtualPlantSpec(arm_position=1, parameters=PlantParameters.of(srv02(), joint(1), 1.4))

PRESETS = {"real_bench": REAL_BENCH, "workbook": WORKBOOK}


def preset(name: str) -> VirtualPlantSpec:
    """A named bench.

    Raises
    ------
    ConfigurationError
        If there is none of that name; the message lists those that exist.
    """
    return PRESETS[one_of("preset", name, PRESETS)]
