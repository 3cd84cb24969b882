"""Observability and observers against python-control, and against sums and simulations."""

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.linalg import solve_continuous_lyapunov

from rotflex import design, model, observers, sampled
from rotflex.config import joint, srv02
from rotflex.errors import DesignError

PLANT = model.state_space(srv02(), joint(), 1.4, link_damping=0.0)
A, C = PLANT.A, PLANT.C
RESOLUTION = srv02().K_enc
LINK = [0, 0, 0, 1 / joint().J_l]  # torque on the link → acceleration of the deflection


@pytest.mark.parametrize(("outputs", "rank"), [([0], 4), ([1], 3), ([0, 1], 4)])
def test_the_servos_encoder_sees_all_and_the_links_does_not_see_theta(outputs, rank):
    found = observers.observability(A, C[outputs])
    assert (found.rank, found.observable) == (rank, rank == 4)
    assert_allclose(found.matrix, control.obsv(A, C[outputs]))


@settings(deadline=None)
@given(st.lists(st.floats(-4, 4), min_size=4, max_size=4), st.floats(-4, 4), st.sampled_from([[0], [1], [0, 1]]))
def test_the_rank_depends_on_no_unit(exponents, rate, outputs):
    units = 10.0 ** np.array(exponents)
    other = 10.0**rate * A * units / units[:, np.newaxis]
    assert observers.observability(other, C[outputs] * units).rank == observers.observability(A, C[outputs]).rank


def test_after_a_long_time_the_gramian_is_that_over_all_time():
    stable = A - PLANT.B @ design.gain_by_place(PLANT, design.desired_poles(0.6, 20, -30, -400))
    for horizon in (3.0, 100.0):
        assert_allclose(
            observers.gramian(stable, C, horizon), solve_continuous_lyapunov(stable.T, -C.T @ C), rtol=1e-9, atol=1e-14
        )


def test_the_uncertainty_is_that_of_least_squares_over_the_samples():
    h, horizon, rng = 1e-4, 0.1, np.random.default_rng(1)
    Phi, rows = control.c2d(PLANT, h).A, []
    row = C[:1]
    for _sample in range(round(horizon / h)):
        rows.append(row[0])
        row = row @ Phi
    scale = np.linalg.norm(rows, axis=0)
    rounding = RESOLUTION * (rng.random((len(rows), 4000)) - 0.5)
    errors = np.linalg.lstsq(np.array(rows) / scale, rounding, rcond=None)[0] / scale[:, np.newaxis]
    assert_allclose(observers.uncertainty(A, C[:1], horizon, h, RESOLUTION), errors.std(axis=1), rtol=0.05)
    with pytest.raises(DesignError, match="not observable"):
        observers.uncertainty(A, C[1:], horizon, h, RESOLUTION)


@pytest.mark.parametrize(("sample_time", "delay"), [(0.002, 0.0), (0.03, 0.002)])
@pytest.mark.parametrize("servo_only", [True, False])
def test_kalmans_gain_leaves_the_smallest_covariance(sample_time, delay, servo_only):
    """The covariance is iterated; a gain beside the optimum leaves more."""
    plant = sampled.sample(PLANT, sample_time, delay)
    held = [sampled.sample(A, B, sample_time).B for B in (PLANT.B, LINK)]
    process = observers.process_noise(plant, (held[0], 0.1), (held[1], 0.005))
    L = observers.kalman_gain(plant, process, RESOLUTION, servo_only)
    used = plant.C[: L.shape[1]]
    R = RESOLUTION**2 / 12 * np.eye(len(used))

    def left(gain):
        P, corrected = np.eye(plant.nstates), np.eye(plant.nstates) - gain @ used
        for _sample in range(3000):
            P = plant.A @ (corrected @ P @ corrected.T + gain @ R @ gain.T) @ plant.A.T + process
        return np.trace(corrected @ P @ corrected.T + gain @ R @ gain.T)

    assert all(left(L) < left(factor * L) for factor in (0.98, 1.02))
    assert np.abs(observers.observer_poles(plant, L)).max() < 1


def test_poles_of_the_error_are_placed_as_the_module_says():
    plant, desired = sampled.sample(PLANT, 0.02, 0.002), [0, 0.3, 0.4, 0.2 - 0.1j, 0.2 + 0.1j]
    L = control.place(plant.A.T, (plant.C[:1] @ plant.A).T, desired).T
    assert_allclose(np.sort_complex(observers.observer_poles(plant, L)), np.sort_complex(desired), atol=1e-7)


def test_an_observer_is_made_for_a_sampled_plant_and_C_has_a_column_for_each_state():
    with pytest.raises(DesignError, match="Sample it first"):
        observers.kalman_gain(PLANT, np.eye(4), RESOLUTION)
    with pytest.raises(DesignError, match="column"):
        observers.gramian(A, [[1, 0, 0]], 1.0)
