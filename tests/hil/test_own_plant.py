"""A plant of one's own on the virtual bench."""

from __future__ import annotations

from types import SimpleNamespace

import control
import numpy as np
import pytest

from rotflex import experiments, hil, model
from rotflex.config import joint, srv02
from rotflex.errors import BenchError, ConfigurationError, RotflexError
from rotflex.units import DEG

LINEAR = model.state_space(srv02(), joint(1), 1.4)


class Exact:
    """The linear model, sampled by python-control."""

    def __init__(self):
        self.state = np.zeros(4)

    def advance(self, voltage, duration):
        held = control.sample_system(LINEAR, duration)
        self.state = held.A @ self.state + held.B[:, 0] * voltage


class Changed(Exact):
    """A plant whose state becomes something else once it has moved."""

    def __init__(self, after):
        super().__init__()
        self.after = after

    def advance(self, voltage, duration):
        self.state = self.after


def test_an_object_with_state_and_advance_is_a_plant_and_each_experiment_begins_with_a_copy():
    own = Exact()
    with hil.open("virtual:?encoder=EHR", plant=own) as bench:
        first, second = (
            experiments.validation(bench, LINEAR, "step", duration=1.0, progress=False) for _again in range(2)
        )
    count = srv02(encoder="EHR").K_enc
    np.testing.assert_allclose(first["theta"], first["theta_model"], atol=0.51 * count)
    np.testing.assert_allclose(first["alpha"], first["alpha_model"], atol=0.51 * count)
    np.testing.assert_array_equal(first["theta"], second["theta"])
    assert first["theta"].max() > 10 * DEG and not own.state.any()
    assert (first.metadata["source"], first.metadata["bench"]["plant"]) == ("virtual bench", "Exact")


STILL = {"state": (0.0, 0.0, 0.0, 0.0)}
NO_PLANTS = [3, SimpleNamespace(), SimpleNamespace(**STILL), SimpleNamespace(**STILL, advance=3), Exact, LINEAR]


@pytest.mark.parametrize("plant", NO_PLANTS)
def test_what_is_no_plant_is_refused_at_once(plant):
    with pytest.raises(BenchError, match=r"advance\(voltage, duration\)"):
        hil.open("virtual", plant=plant)


@pytest.mark.parametrize("after", [None, 1.0, (0.0, 1.0), (0.0, 0.0, np.nan, 0.0), ("a",) * 4, (1j,) * 4])
def test_a_state_that_is_none_is_told_where_it_is_met(after):
    with hil.open("virtual", plant=Changed(after)) as bench, pytest.raises(BenchError, match="state of your Changed"):
        experiments.watch(bench, 0.1, progress=False)
    wrong = Exact()
    wrong.state = after
    with pytest.raises(BenchError, match="state of your Exact"):
        hil.open("virtual", plant=wrong)


def test_an_address_that_draws_a_plant_takes_none_besides():
    for option in ("seed=1", "preset=workbook", "arm_position=2", "run=2"):
        with pytest.raises((BenchError, ConfigurationError), match=option.partition("=")[0]) as caught:
            hil.open(f"virtual:?{option}", plant=Exact())
        assert isinstance(caught.value, RotflexError)
