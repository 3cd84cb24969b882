"""A bench to practise on: drawn anew each time, and told of once an answer is given. Nothing of it is kept or marked.

::

    practice = lab.practice()
    with practice.bench() as bench:
        sweep = experiments.sweep(bench)
    practice.answer(omega_n=21.3)
"""

from __future__ import annotations

import math
import secrets
from dataclasses import replace
from types import TracebackType

import numpy as np

from labcourse.errors import AnswerError
from labcourse.run import by_program
from rotflex import hil
from rotflex.errors import ConfigurationError
from rotflex.hil.controllers import StateFeedback
from rotflex.hil.student_benches import DRAW, FIRST_RUN, VirtualPlantSpec, student_bench
from rotflex.plant import State, driven
from rotflex.specifications import SAMPLE_TIME

MOST = 1_000_000  #: numbers of practice benches
_OFFSET = 2**32  # beyond all seeds of students' benches (32 bits) and of benches that are everybody's
_IN_A_RUN = 1  # the number where a program runs the notebooks, so that a run repeats to the byte
#: How near is near enough here: omega_n to 3 %, as a peak is read off a plot by eye; K_s goes with its square.
NEAR = {"omega_n": 0.03, "K_s": 0.06}
#: Of the ready-made controller: the cost of theta, alpha (1/rad²) and their rates (s²/rad²), beside 1 of a volt².
_WEIGHTS = (180.0, 180.0, 0.1, 0.1)
_UNITS = {"omega_n": "rad/s", "K_s": "N·m/rad"}


class Practice:
    """A practice bench. Made by ``lab.practice()``.

    Parameters
    ----------
    number : of the bench, to have one again; a new one unless given

    Attributes
    ----------
    number : of the bench
    joint, servo : the parts as the data sheets and the scales state them (:mod:`rotflex.config`)

    Raises
    ------
    ConfigurationError
        If there is no bench of that number.
    """

    def __init__(self, number: int | None = None) -> None:
        if number is None:
            number = _IN_A_RUN if by_program() else 1 + secrets.randbelow(MOST)
        if not isinstance(number, int) or isinstance(number, bool) or not 1 <= number <= MOST:
            raise ConfigurationError(f"A practice bench has a whole number from 1 to {MOST}; this is {number!r:.40}.")
        self.number = number
        closed = self.bench()
        self.joint, self.servo = closed.joint, closed.servo
        self._open: hil.Bench | None = None

    def __repr__(self) -> str:
        return f"<practice bench {self.number}: arm in position {self.joint.arm_position}>"

    def bench(self, run: int = FIRST_RUN) -> hil.Bench:
        """The bench, to be opened in a ``with`` statement; ``run`` as for ``lab.bench``."""
        return hil.open("virtual", seed=_OFFSET + self.number, draw=DRAW, run=run)

    def controller(self) -> StateFeedback:
        """Return a ready-made controller of this bench: full state feedback with :meth:`gain`."""
        return StateFeedback(self.gain())

    def gain(self) -> list[float]:
        """Return the gain (4,) of a ready-made controller of this bench: a sampled linear quadratic regulator."""
        import control  # slow to load, and most sessions need no controller

        none = (0.0, 0.0)
        linear = replace(
            self._spec().parameters, servo_friction=none, link_friction=none, V_max=math.inf, I_max=math.inf
        )
        columns = [driven(linear, State(*unit[:4]), [unit[4]] * 2, SAMPLE_TIME)[1] for unit in np.eye(5).tolist()]
        A, B = np.array(columns[:4]).T, np.array(columns[4:]).T
        return list(np.ravel(control.dlqr(A, B, np.diag(_WEIGHTS), np.eye(1))[0]))

    def __enter__(self) -> hil.Bench:
        self._open = self.bench()
        return self._open.__enter__()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._open is not None:
            self._open.__exit__(kind, error, trace)
            self._open = None

    def answer(self, **given: float) -> None:
        """Say what you found: you are told how near that is, and what is true. As often as you like; nothing is kept.

        Parameters
        ----------
        given : ``omega_n`` (rad/s), ``K_s`` (N·m/rad), one of them or both

        Raises
        ------
        AnswerError
            If nothing was given, or something else than these two, or what is no number.
        """
        unknown = [name for name in given if name not in NEAR]
        if unknown or not given:
            asked = f"not for {', '.join(unknown)}" if given else "nothing was given"
            raise AnswerError(f"A practice bench is asked for {' and '.join(NEAR)}; {asked}.")
        numbers = {name: _number(name, value) for name, value in given.items()}
        parameters = self._spec().parameters
        truth = {"omega_n": math.sqrt(parameters.K_s / parameters.J_l), "K_s": parameters.K_s}
        for name, value in numbers.items():
            print(_told(name, value, truth[name]))

    def _spec(self) -> VirtualPlantSpec:
        return student_bench(_OFFSET + self.number, draw=DRAW)


def _number(name: str, value: object) -> float:
    try:
        number = float(value)  # type: ignore[arg-type]  # whatever a student gives: what is no number is told
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number):
        raise AnswerError(f"{name} should be a number; it is {value!r:.40}.")
    return number


def _told(name: str, value: float, true: float) -> str:
    off = value / true - 1
    unit = _UNITS[name]
    near = "near enough" if abs(off) <= NEAR[name] else "not near enough yet"
    return (
        f"{name} = {value:.4g} {unit}: {100 * off:+.1f} %, {near} (within {100 * NEAR[name]:g} % is). The bench "
        f"has {true:.4g} {unit}."
    )
