"""A model laid over a recording, without a page: the same voltage into both (Section 2.3.2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rotflex.errors import IdentificationError
from rotflex.identification import channel
from rotflex.plant import Plant, PlantParameters, State
from rotflex.recording import Channel, Recording

Vector = NDArray[np.float64]


def overlay(recording: Recording, parameters: PlantParameters) -> Recording:
    """A recording with what a plant does under the same voltage: channels theta_model and alpha_model, rad.

    The model starts where the recording does, at rest; the voltage is held from each sample to the next.

    Parameters
    ----------
    recording : with theta, alpha and vm
    parameters : of the plant; with no friction, it is the linear model

    Raises
    ------
    IdentificationError
        If a channel is missing, or an angle does not move.
    """
    theta, alpha = channel(recording, "theta"), channel(recording, "alpha")
    volts = channel(recording, "vm", may_be_constant=True)
    plant = Plant(parameters, State(float(theta[0]), float(alpha[0]), 0.0, 0.0))
    dt = recording.sample_time
    angles = np.empty((2, theta.size))
    for index, voltage in enumerate(volts.tolist()):
        angles[:, index] = plant.state[:2]
        plant.advance(voltage, dt)
    modelled = {"theta_model": Channel(angles[0], "rad"), "alpha_model": Channel(angles[1], "rad")}
    kept = {name: recording.channels[name] for name in ("theta", "alpha", "vm")}
    return Recording(recording.time, {**kept, **modelled}, recording.metadata)


def fit_percent(measured: Vector, model: Vector) -> float:
    """How much of the measured motion the model explains, per cent: 100 (1 - |y - y_model| / |y - mean of y|).

    100 is a perfect fit; 0 is no better than a constant, and less is worse than that.

    Raises
    ------
    IdentificationError
        If the measured signal does not move.
    """
    motion = float(np.linalg.norm(measured - measured.mean()))
    if motion == 0:
        raise IdentificationError("The measured signal does not move: there is nothing to explain.")
    return 100 * (1 - float(np.linalg.norm(measured - model)) / motion)


def alt_text_of(compared: Recording) -> str:
    """A comparison in words, for somebody who cannot see it."""
    fits = {name: fit_percent(compared[name], compared[f"{name}_model"]) for name in ("theta", "alpha")}
    return (
        f"Measured and modelled servo angle and deflection over {compared.time[-1] - compared.time[0]:.3g} s. "
        f"The model explains {fits['theta']:.0f} % of the servo angle's motion and {fits['alpha']:.0f} % of the "
        "deflection's."
    )
