"""A controller: any function ``(reference, theta, alpha) -> V``, called once a sample, or a discrete system.

Angles are in rad. A function with a state also has a method ``reset()``, which is called before each run.

A system is a ``control.StateSpace`` or ``control.TransferFunction`` in discrete time, with the voltage as its one
output. Its state is zero before each run. It gets what its inputs are named after:

* inputs named ``theta_ref``, ``theta``, ``alpha``, or some of them: these signals. Without ``theta_ref``, the input
  ``theta`` gets theta - theta_ref: such a system has the minus inside, as ``StateFeedback(K).system()`` has it;
* one input of another name: the error theta_ref - theta;
* three inputs of other names: theta_ref, theta and alpha, in this order.

A function or an object may say in its attribute ``sample_time`` (s) for which one it is made: a run with another one is
refused.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from rotflex.config import real_array
from rotflex.errors import DesignError
from rotflex.units import Array

if TYPE_CHECKING:
    from control import StateSpace

#: (reference, theta, alpha), in rad (an open loop's reference in V) → the motor voltage, V
Controller = Callable[[float, float, float], float]

_SIGNALS = {"theta_ref": (1, 0, 0), "theta": (0, 1, 0), "alpha": (0, 0, 1)}
_ERROR, _FROM_REFERENCE = (1, -1, 0), (-1, 1, 0)  # theta_ref - theta, and theta - theta_ref
_RATES = {"theta_dot", "alpha_dot"}  # states that nothing measures
_SAME_PERIOD = 1e-6  # of the sample time
_USUAL = 0.002  # s, the sample time of the laboratory's loop


class SystemController:
    """A discrete system of python-control as a controller, see the module.

    Parameters
    ----------
    system : control.StateSpace or control.TransferFunction
    sample_time : s, of the run, for the advice in errors

    Attributes
    ----------
    sample_time : s, which the system is made for; None if it does not say

    Raises
    ------
    DesignError
        If it is in continuous time, has not one output or inputs that cannot be measured, or is not causal.
    """

    def __init__(self, system: Any, sample_time: float | None = None) -> None:
        import control

        if not isinstance(system, control.StateSpace | control.TransferFunction):
            raise DesignError(
                f"A {type(system).__name__} cannot be run: give a discrete control.StateSpace or TransferFunction, or "
                "a function (theta_ref, theta, alpha) that returns a voltage."
            )
        inputs = _inputs(system.input_labels)
        if system.noutputs != 1:
            raise DesignError(
                f"A controller has one output, the voltage; this has {', '.join(system.output_labels)}. Choose it: "
                "controller = controller[0, :]"
            )
        matrices = _matrices(system)
        if system.dt == 0 and matrices[0].size:
            raise DesignError(
                "The controller is in continuous time. Sample it: controller = control.sample_system(controller, "
                f"{sample_time or _USUAL:g}, method='bilinear')"
            )
        self._A, B, self._C, D = (
            real_array(f"The controller's matrix {name}", matrix, DesignError)
            for name, matrix in zip("ABCD", matrices, strict=True)
        )
        self._B, self._D = B @ inputs, D @ inputs
        self.sample_time = None if system.dt in (None, 0) or system.dt is True else float(system.dt)
        self.reset()

    @classmethod
    def of(
        cls, A: ArrayLike, B: ArrayLike, C: ArrayLike, D: ArrayLike, sample_time: float | None = None
    ) -> SystemController:
        """Return the controller of ``numbers``: matrices with the inputs theta_ref, theta and alpha."""
        import control

        n = len(np.asarray(A))
        shaped = (np.reshape(matrix, shape) for matrix, shape in ((A, (n, n)), (B, (n, 3)), (C, (1, n)), (D, (1, 3))))
        return cls(control.StateSpace(*shaped, True if sample_time is None else sample_time, inputs=[*_SIGNALS]))

    @property
    def numbers(self) -> dict[str, Any]:
        """Its matrices and its sample time, plain data."""
        return {name: getattr(self, f"_{name}").tolist() for name in "ABCD"} | {"sample_time": self.sample_time}

    def system(self) -> StateSpace:
        """Return it as a discrete system of python-control, from theta and alpha to the voltage."""
        import control

        inputs, dt = ["theta", "alpha"], True if self.sample_time is None else self.sample_time
        return control.StateSpace(self._A, self._B[:, 1:], self._C, self._D[:, 1:], dt, inputs=inputs, outputs=["vm"])

    def reset(self) -> None:
        """Begin again, with a state of zero."""
        self._state = np.zeros(len(self._A))

    def __call__(self, reference: float, theta: float, alpha: float) -> float:
        """Return the voltage (V) for a commanded servo angle (rad) and measured angles (rad)."""
        signals = np.array([reference, theta, alpha])
        voltage = self._C @ self._state + self._D @ signals
        self._state = self._A @ self._state + self._B @ signals
        return float(voltage[0])


def _inputs(labels: list[str]) -> Array:
    """Return a system's inputs, one a row, in terms of theta_ref, theta and alpha.

    Raises
    ------
    DesignError
        If they cannot be made from these.
    """
    named = set(labels) & {*_SIGNALS, *_RATES}
    if set(labels) <= _SIGNALS.keys():
        signals = _SIGNALS if "theta_ref" in labels else _SIGNALS | {"theta": _FROM_REFERENCE}
        return np.array([signals[label] for label in labels])
    if not named and len(labels) in (1, 3):
        return np.array([_ERROR] if len(labels) == 1 else [*_SIGNALS.values()])
    if named & _RATES or len(labels) > len(_SIGNALS):  # as those of create_statefbk_iosystem
        advice = "A gain on all states needs no system: experiments.tracking(bench, K), or StateFeedback(K)"
    else:
        names = ", ".join(map(repr, [*_SIGNALS][: len(labels)]))
        advice = (
            "Without theta_ref, theta gets theta - theta_ref, and not the error. Name what they get: "
            f"controller.set_inputs([{names}])"
        )
    raise DesignError(
        f"A controller's inputs are some of {', '.join(_SIGNALS)}; this has {', '.join(labels)}. {advice}"
    )


def _matrices(system: Any) -> tuple[Array, Array, Array, Array]:
    """Return A, B, C and D; of a transfer function, each input has states of its own (Slycot would share them)."""
    import control

    if isinstance(system, control.TransferFunction):
        try:
            parts = control.append(*(control.ss(system[0, place]) for place in range(system.ninputs)))
        except ValueError:
            raise DesignError(
                "The controller needs samples that are still to come: its numerator has more powers of z than its "
                "denominator. Wait a sample: controller = controller * control.tf([1], [1, 0], controller.dt)"
            ) from None
        return parts.A, parts.B, parts.C.sum(axis=0, keepdims=True), parts.D.sum(axis=0, keepdims=True)
    return system.A, system.B, system.C, system.D


def runnable(controller: Controller, sample_time: float | None = None) -> Controller:
    """Return a controller that can be called: itself, or a system as a :class:`SystemController`.

    Parameters
    ----------
    controller : a function, or a discrete system of python-control
    sample_time : s, of the run; None where it is not known yet

    Raises
    ------
    DesignError
        If it is neither, or is made for another sample time.
    """
    if hasattr(controller, "input_labels"):  # a system can be called, too: with a frequency
        controller = SystemController(controller, sample_time)
    if not callable(controller):
        raise DesignError(
            f"A controller is a function (reference, theta, alpha) that returns a voltage; this is {controller!r}. For "
            "a gain on the four states: rotflex.hil.controllers.StateFeedback(K)"
        )
    made_for = getattr(controller, "sample_time", None)
    if made_for is not None and sample_time is not None and abs(made_for / sample_time - 1) > _SAME_PERIOD:
        raise DesignError(
            f"The controller is made for a sample_time of {made_for:g} s; the run has {sample_time:g} s. Design it for "
            f"that, or use its own: experiments.follow(bench, controller, reference, sample_time={made_for:g})"
        )
    return controller


def begun(controller: Controller, sample_time: float | None = None) -> Controller:
    """Reset a controller, and return a function that checks what it returns.

    Raises
    ------
    DesignError
        As :func:`runnable` says. The returned function raises it, too, if the controller does not return one real
        number.
    """
    controller = runnable(controller, sample_time)
    if hasattr(controller, "reset"):
        controller.reset()

    def checked(reference: float, theta: float, alpha: float) -> float:
        answer = controller(reference, theta, alpha)
        if type(answer) is float:
            return answer
        value = np.asarray(answer)  # an array of one number, as K @ x may be
        try:
            if value.dtype.kind in "iufO":  # neither True nor "1.0"
                return float(value.item())
        except (TypeError, ValueError):
            pass
        raise DesignError(f"A controller should return the motor voltage, one number of V; it returned {answer!r}.")

    return checked


def name_of(controller: Controller) -> str:
    """Name of a function, or of an object's class."""
    return str(getattr(controller, "__name__", type(controller).__name__))
