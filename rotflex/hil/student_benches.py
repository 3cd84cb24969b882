"""Which virtual benches there are: each student's own, drawn around nominal from a seed, and named presets.

The ranges keep the natural frequency inside the 1 to 5 Hz sweep, and the closed loop stable on every bench. They do
not keep every specification within reach: where a bench misses one, "no" is the right answer.
A student's own machine holds this code, and so, for a determined reader, their bench's parameters: that is accepted.
"""

from __future__ import annotations

import hashlib
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from rotflex.config import Joint, joint, one_of, srv02
from rotflex.errors import ConfigurationError
from rotflex.hil.virtual import AT_ONCE, Timing
from rotflex.plant import PlantParameters
from rotflex.specifications import SAMPLE_TIME

#: The version of the draw. Work begun under an earlier one needs the version of rotflex that it was begun with.
DRAW = 4
FIRST_RUN = 1  #: the run of whoever names none
#: N·m; between these is the largest friction of the servo in a run of a drawn bench, in its stronger direction
LEAST_FRICTION, MOST_FRICTION = 0.016, 0.028
ASYMMETRY = 2.0  #: at most so many times the friction in the other direction
LINK_FRICTION = 1e-4  #: N·m; the largest of the link
RUN_FRICTION = 0.2  #: by how much, relative, another run's friction may differ on a bench that is not drawn
#: of R_m, k_t, eta_g and eta_m, relative, as the data sheet has them
MOTOR_TOLERANCES = np.array([0.12, 0.12, 0.10, 0.05])


@dataclass(frozen=True)
class VirtualPlantSpec:
    """What a virtual bench is made of.

    Parameters
    ----------
    joint : the arms, which the student is told
    parameters : the true plant
    timing : the board's
    is_drawn : whether another run has friction drawn as that of run 1; else it has that of run 1 within 20 %
    """

    joint: Joint
    parameters: PlantParameters
    timing: Timing = AT_ONCE
    is_drawn: bool = False

    def run(self, number: int) -> VirtualPlantSpec:
        """Return the bench on another run: its friction is not what it was.

        Grease warms up and gears turn on: between logs of one real bench the servo's friction differs by a factor of 2.
        Run 1 is the bench as it stands here; any other number gives its own friction and its own jitter: the same for
        the same number, always.

        Raises
        ------
        ConfigurationError
            If the number is not 1 or more.
        """
        if not (isinstance(number, int) and not isinstance(number, bool) and number >= FIRST_RUN):
            raise ConfigurationError(f"A run is a whole number from {FIRST_RUN} on; it is {number!r}.")
        if number == FIRST_RUN:
            return self
        draw, plant = np.random.default_rng([self.timing.seed, number]), self.parameters
        if self.is_drawn:
            changed = with_drawn_friction(plant, draw)
        else:
            servo, link = 1 + draw.uniform(-RUN_FRICTION, RUN_FRICTION, (2, 2))
            changed = with_friction(plant, servo * plant.servo_friction, link * plant.link_friction)
        return replace(self, parameters=changed, timing=replace(self.timing, seed=int(draw.integers(2**32))))


def with_friction(plant: PlantParameters, servo: Iterable[float], link: Iterable[float]) -> PlantParameters:
    """Return a plant with other friction of servo and link, each in the positive and in the negative direction, N·m."""
    servo_friction, link_friction = ((float(plus), float(minus)) for plus, minus in (servo, link))
    return replace(plant, servo_friction=servo_friction, link_friction=link_friction)


def with_drawn_friction(plant: PlantParameters, draw: np.random.Generator) -> PlantParameters:
    """Return a plant with the friction of another run; what is drawn is its largest, with gear and Stribeck's curve."""
    largest = draw.uniform(LEAST_FRICTION, MOST_FRICTION) * draw.permutation([1.0, draw.uniform(1 / ASYMMETRY, 1)])
    peak = (1 + plant.stribeck) * (1 + sum(height for _number, height, _phase in plant.gear))
    return with_friction(plant, largest / peak, [draw.uniform(0, LINK_FRICTION)] * 2)


def student_seed(student: str) -> int:
    """Return the seed (32 bits) of a student's own bench; the same on every machine, however the ID is typed."""
    name = unicodedata.normalize("NFC", student).strip()
    digest = hashlib.sha256(f"rotflex bench: {name.casefold()}".encode()).digest()
    return int.from_bytes(digest[:4], "big")


def student_bench(seed: int, arm_position: int | None = None, draw: int = DRAW) -> VirtualPlantSpec:
    """Draw the bench of a seed. The same seed and version of the draw give the same bench, always.

    The student is told the arms. Of the motor they are told what the data sheet says, and of the friction nothing.

    ===================  =========================================================================================
    arm position         1, 2 or 3
    m_1, m_2; L_1, L_2   0.92 to 1.08 of nominal; 0.97 to 1.03
    natural frequency    18 to 27.5 rad/s, on a logarithmic scale; with J_l, it gives K_s
    R_m, k_t, eta_g,     within the data sheet's tolerances (12, 12, 10 and 5 %), most often near the middle; k_m goes
    eta_m                with k_t: in SI units the two are one constant
    J_eq                 0.97 to 1.03 of nominal
    B_eq                 0.004 to 0.012 N·m/(rad/s)
    B_l                  0.001 to 0.0025 N·m/(rad/s)
    servo friction       at most 0.016 to 0.028 N·m in one direction, and 0.5 to 1 times that in the other: at
                         standstill, where the gear is roughest. Another run has another
    Stribeck's curve     at standstill friction is 1.0 to 1.4 times as large as at high rates
    rough gear           friction varies by 3 to 12 % over the servo's angle: in five waves a turn, as the pinion goes
                         round, and in 70, as the motor does; how much in which, and from where, is drawn
    load                 0.10 to 0.16 of the spring's torque comes on top
    link friction        0 to 0.0001 N·m either way: the joint of a real bench rings on for seconds
    output               1 to 3.5 ms after the sample, by 0.25 ms sooner or later; one in 1000 a sample later
    ===================  =========================================================================================

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
    if draw != DRAW:
        raise ConfigurationError(
            f"Benches of the draw {draw!r} are not known to this version of rotflex, which knows {DRAW}. Install the "
            "version that the bench was drawn by."
        )
    draws = np.random.default_rng([seed, draw])
    drawn_position = int(draws.integers(1, 4))
    nominal = joint(drawn_position)
    m_1, m_2 = 1 + draws.uniform(-0.08, 0.08, 2)
    L_1, L_2 = 1 + draws.uniform(-0.03, 0.03, 2)
    arm = replace(
        nominal,
        m_1=_rounded(nominal.m_1 * m_1, 1e-4),
        m_2=_rounded(nominal.m_2 * m_2, 1e-4),
        L_1=_rounded(nominal.L_1 * L_1, 5e-4),
        L_2=_rounded(nominal.L_2 * L_2, 5e-4),
    )
    omega_n = 18.0 * (27.5 / 18.0) ** draws.uniform()
    R_m, k_t, eta_g, eta_m = 1 + draws.triangular(-1, 0, 1, 4) * MOTOR_TOLERANCES
    sheet = srv02()
    servo = replace(
        sheet,
        R_m=sheet.R_m * float(R_m),
        k_t=sheet.k_t * float(k_t),
        k_m=sheet.k_m * float(k_t),
        eta_g=sheet.eta_g * float(eta_g),
        eta_m=sheet.eta_m * float(eta_m),
        J_eq=sheet.J_eq * float(draws.uniform(0.97, 1.03)),
        B_eq=float(draws.uniform(0.004, 0.012)),
    )
    K_s = arm.J_l * float(omega_n) ** 2
    if arm_position is not None:
        arm = replace(arm, arm_position=arm_position, d_12=joint(arm_position).d_12)
    height, share, pinion, motor, stribeck, load = draws.uniform(
        (0.03, 0, 0, 0, 0, 0.1), (0.12, 1, 1, 1, 0.4, 0.16)
    ).tolist()
    parameters = replace(
        PlantParameters.of(servo, arm, K_s),
        B_l=float(draws.uniform(0.001, 0.0025)),
        stribeck=stribeck,
        load=load,
        gear=((5, height * share, pinion), (70, height * (1 - share), motor)),
    )
    delay = float(draws.uniform(1e-3, 3.5e-3))
    return VirtualPlantSpec(
        joint=arm,
        parameters=with_drawn_friction(parameters, draws),
        timing=Timing(delay=delay, jitter=0.25e-3, late=1e-3, late_by=SAMPLE_TIME, seed=int(draws.integers(2**32))),
        is_drawn=True,
    )


def _rounded(value: float, step: float) -> float:
    """Round a measure as the student is given it: to a tenth of a gram, or half a millimetre. The arm has it."""
    return round(round(value / step) * step, 6)


#: Parameters fitted to a log of a real bench, rests and all, without a Coulomb friction of the link: with one, the link
#: stops dead within a second of a turn, where the log's rings on. Of these, such logs tell ω_n = sqrt(K_s/J_l) alone
#: for certain: lighter arms and gears than the data sheet's fit, as here, and so do the data sheet's arm and a tenth
#: more torque per volt (and then K_s is 1.74). Run 1 is the run of that log, and rests where that bench does: 2.3 deg
#: off on one side under the gain (4.74, 0, 0.2133, 0), at -0.19 V.
REAL_BENCH = VirtualPlantSpec(
    joint=joint(1),
    parameters=replace(
        PlantParameters.of(srv02(), joint(1), 1.555),
        J_eq=1.74e-3,
        J_l=2.94e-3,
        B_eq=0.0048,
        B_l=0.0017,  # between those that leave least of the link's equation on two logs: 0.001 and 0.002
        servo_friction=(0.0145, 0.0246),  # the logs stick harder one way than the other
    ),
    timing=Timing(delay=2.06e-3, jitter=0.25e-3, late=1e-3, late_by=SAMPLE_TIME),
)

#: The plant of the workbook: nominal parts, K_s = 1.4 N·m/rad, no Coulomb friction.
WORKBOOK = VirtualPlantSpec(joint=joint(1), parameters=PlantParameters.of(srv02(), joint(1), 1.4))

PRESETS = {"real_bench": REAL_BENCH, "workbook": WORKBOOK}


def preset(name: str) -> VirtualPlantSpec:
    """Return a named bench.

    Raises
    ------
    ConfigurationError
        If there is none of that name; the message lists those that exist.
    """
    return PRESETS[one_of("preset", name, PRESETS)]
