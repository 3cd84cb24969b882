"""The explorers without a page: what they show, what they do with events, what they leave on paper."""

import asyncio
from dataclasses import replace

import numpy as np
import pytest
from explorer_events import change, control, notice, press, readout

import rotflex.course.lab
from labcourse.scene.explorer import Explorer
from labcourse.scene.scene import Scene
from rotflex import experiments, widgets
from rotflex.errors import BenchError, IdentificationError, RotflexError
from rotflex.hil.student_benches import student_bench, student_seed
from rotflex.model import state_space
from rotflex.plant import PlantParameters
from rotflex.recording import Recording
from rotflex.units import DEG
from rotflex.widgets.sweeps import SweepExplorer, spectra, stiffness_at
from rotflex.widgets.validations import ValidationExplorer


class Fragile(Explorer):
    value = 1.0

    def view(self):
        return Scene(f"value {1 / self.value:g}")

    def set(self, name, value):
        if name == "known":
            raise RotflexError("Say it another way.")
        self.value = value


def test_what_goes_wrong_in_a_callback_is_seen_and_what_was_there_stays():
    explorer = Fragile()
    first = explorer.scene["version"]
    change(explorer, "value", 0.0)
    assert explorer.scene["version"] == first + 1
    assert notice(explorer)["kind"] == "error"
    assert "ZeroDivisionError" in notice(explorer)["text"]
    assert explorer.scene["alt"] == "value 1"
    change(explorer, "known", 1.0)
    assert notice(explorer)["text"] == "Say it another way."
    change(explorer, "value", 2.0)
    assert notice(explorer)["text"] == ""
    assert explorer.scene["alt"] == "value 0.5"


@pytest.mark.parametrize(
    "event",
    [
        {"kind": "set", "name": "value", "value": float("nan")},
        {"kind": "set", "name": "value"},
        {"kind": "moved", "name": "value", "x": "far", "y": 0},
    ],
)
def test_a_strange_event_is_answered_with_a_word(event):
    explorer = Fragile()
    explorer.receive({**event, "view": "page", "n": 7})
    assert notice(explorer)["kind"] == "error"
    assert explorer.scene["answered"] == {"view": "page", "n": 7}
    assert explorer.value == 1.0


def test_the_sweep_explorer_shows_why_the_voltage_misleads(lab):
    explorer = SweepExplorer(lab)
    with lab.bench() as bench:
        expected = spectra(experiments.sweep(bench, progress=False))
    assert explorer.spectra.peak() == expected.peak()
    by_position = explorer.spectra.peak()
    change(explorer, "drive", "voltage")
    assert control(explorer, "amplitude")["unit"] == "V" and control(explorer, "amplitude")["value"] == 0.8
    assert explorer.spectra.peak() > 1.1 * by_position
    assert explorer.spectra.peak("ratio") == pytest.approx(by_position, rel=0.05)


def test_the_spectrum_and_the_ratio_of_a_known_link():
    t = np.arange(0, 20, 0.002)
    theta = 3 * DEG * np.sin(2 * np.pi * 2.5 * t)
    recording = Recording.of(t, theta=theta, alpha=4 * theta, vm=0 * t)
    found = spectra(recording)
    assert found.peak() == pytest.approx(2.5, abs=found.spacing)
    assert found.height(2.5) == pytest.approx(12 * DEG, rel=1e-3)
    near = np.abs(found.f_ratio - 2.5) < 0.05
    assert found.ratio[near] == pytest.approx(4.0, rel=1e-6)


def test_the_stiffness_under_the_cursor_and_its_uncertainty(lab):
    explorer = SweepExplorer(lab)
    explorer.receive({"kind": "moved", "name": "cursor", "x": 3.0, "y": 9.9})
    found = stiffness_at(3.0, lab.joint.J_l, explorer.spectra.spacing)
    assert found.value == pytest.approx(lab.joint.J_l * (2 * np.pi * 3) ** 2)
    # The slope of K_s(f) times the spread of a frequency that is somewhere in its bin.
    bins = np.random.default_rng(1).uniform(-0.5, 0.5, 200_000) * explorer.spectra.spacing
    spread = np.std(lab.joint.J_l * (2 * np.pi * (3.0 + bins)) ** 2)
    assert found.uncertainty == pytest.approx(spread, rel=0.01)
    said = " ".join(readout(explorer, "Stiffness by the cursor")["rows"][-1]["values"])
    assert f"{found.value:.3f} ± {found.uncertainty:.3f}" in said
    press(explorer, "peak")
    assert explorer.cursor == explorer.spectra.peak()


def test_a_number_that_is_typed_is_held_to_its_sliders_range(lab):
    explorer = SweepExplorer(lab)
    for name, asked, taken in (("duration", 1e5, 30.0), ("f_start", -3.0, 0.5), ("amplitude", 0.0, 0.5)):
        change(explorer, name, asked)
        assert explorer.settings[name] == taken == control(explorer, name)["value"]


def test_a_recording_of_another_bench_is_looked_at_and_not_run_again(lab):
    with lab.bench() as bench:
        recording = experiments.sweep(bench, duration=6.0, progress=False)
    explorer = widgets.explore_sweep(recording=recording, J_l=3e-3)
    assert SweepExplorer(lab, recording).settings["duration"] == pytest.approx(6.0)
    assert not any(one["kind"] == "slider" for row in explorer.scene["controls"] for one in row)
    live = rotflex.course.lab.start("ada", "virtual:?clock=wall", quiet=True)
    with pytest.raises(BenchError, match="recording=") as error:
        SweepExplorer(live)
    assert "simulated" in str(error.value)
    assert SweepExplorer(live, recording).recording is recording


@pytest.fixture
def validated(lab, model):
    with lab.bench() as bench:
        return experiments.validation(bench, *model, duration=4.0, progress=False)


def test_the_sliders_begin_at_the_students_own_stiffness_on_every_bench(lab, validated):
    stiffest = max(student_bench(seed).parameters.K_s for seed in range(1000))
    assert stiffest > 3
    explorer = ValidationExplorer(validated, lab.servo, lab.joint, K_s=stiffest)
    assert control(explorer, "K_s")["value"] == explorer.parameters.K_s == stiffest


def test_the_overlay_without_friction_is_the_linear_model(lab, validated):
    K_s = 1.5
    parameters = replace(PlantParameters.of(lab.servo, lab.joint, K_s), B_eq=lab.servo.B_eq, V_max=np.inf, I_max=np.inf)
    system = state_space(lab.servo, lab.joint, K_s, input="voltage")
    compared = widgets.overlay(validated, parameters)
    import control as python_control

    discrete = python_control.c2d(system, validated.sample_time, "zoh")
    expected = python_control.forced_response(discrete, U=validated["vm"]).outputs
    assert compared["theta_model"] == pytest.approx(expected[0], abs=1e-8)
    assert compared["alpha_model"] == pytest.approx(expected[1], abs=1e-8)


def test_the_fit_figure():
    y = np.sin(np.linspace(0, 9, 500))
    assert widgets.fit_percent(y, y) == 100
    assert widgets.fit_percent(y, np.full_like(y, y.mean())) == pytest.approx(0)
    assert widgets.fit_percent(y, y + (y - y.mean())) == pytest.approx(0)
    with pytest.raises(IdentificationError, match="does not move"):
        widgets.fit_percent(np.ones(9), np.ones(9))


def drawn(explorer):
    """Kinds of what each panel shows."""
    return [[item["kind"] for item in panel.items] for panel in explorer.view().columns[0].panels]


def test_a_fit_begins_where_the_sliders_stand_and_leaves_a_kernels_loop_free(lab, validated):
    async def scenario():
        explorer = ValidationExplorer(validated, lab.servo, lab.joint, K_s=1.2)
        assert control(explorer, "K_s")["value"] == 1.2
        poor = [row["values"][0] for row in readout(explorer, "Model against measurement")["rows"]]
        change(explorer, "K_s", 1.5)
        assert [row["values"][0] for row in readout(explorer, "Model against measurement")["rows"]] != poor
        press(explorer, "fit")
        assert explorer.busy and "Fitting" in notice(explorer)["text"]
        while explorer.busy:
            await asyncio.sleep(0.01)
        assert "Fitted" in notice(explorer)["text"] and not control(explorer, "K_s")["disabled"]
        return explorer

    explorer = asyncio.run(asyncio.wait_for(scenario(), 120))
    truth = student_bench(student_seed("ada")).parameters
    assert explorer.fitted.estimates["K_s"].value == pytest.approx(truth.K_s, rel=0.01)
    assert explorer.parameters.K_s == explorer.fitted.parameters.K_s
    assert explorer.friction == "fitted" and "doubted" not in explorer.notice
    (prediction,) = explorer.fitted.predictions
    assert [row["label"] for row in readout(explorer, "Model against measurement")["rows"]][2] == "inside the band"
    inside = explorer.band(validated)
    assert min(inside) > 0.9
    assert readout(explorer, "Model against measurement")["rows"][2]["values"][1] == f"α {inside.alpha:.1%}"
    bad = replace(explorer.fitted, predictions=(replace(prediction, rms={"theta": 0.1, "alpha": 0.0}),))
    explorer._fitted((bad, explorer.band))
    assert explorer.notice.startswith("This fit is doubted")
    assert drawn(explorer) == [["area", "line", "line"]] * 2 + [["area", "line"] * 2]
    change(explorer, "friction", "none")  # the curves are not those of the fit any more
    assert explorer.parameters.servo_friction == (0.0, 0.0)
    assert drawn(explorer) == [["line", "line"]] * 3
    press(explorer, "reset")
    assert explorer.parameters.K_s == 1.2


def test_a_fit_that_is_refused_leaves_the_explorer_usable(lab, model):
    with lab.bench() as bench:
        short = experiments.validation(bench, *model, signal="step", duration=1.5, progress=False)
    explorer = ValidationExplorer(short, lab.servo, lab.joint)
    change(explorer, "friction", "fitted")
    assert "press Fit" in notice(explorer)["text"]
    press(explorer, "fit")
    assert notice(explorer)["kind"] == "error" and "Record for longer" in notice(explorer)["text"]
    assert not control(explorer, "K_s")["disabled"]


def test_every_explorer_leaves_something_for_a_page_without_widgets(lab, model, monkeypatch):
    """Pictures: see test_openings.py."""
    data, _ = widgets.results_table(lab, "Table 3")._repr_mimebundle_()
    assert {"application/vnd.jupyter.widget-view+json", "text/plain"} < set(data) and "<table>" in data["text/html"]
    data, _ = widgets.open_console(lab)._repr_mimebundle_()
    assert "image/png" not in data and "ready" in data["text/plain"]  # without a run
    monkeypatch.setenv("LABCOURSE_PICTURES", "off")
    unseen = widgets.explore_poles(*model)
    assert set(unseen._repr_mimebundle_()[0]) == {"text/plain"} and unseen._live is None
