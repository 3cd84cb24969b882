"""Two designs on one bench: the same bench for both, figures by hand, a push, and designs that are lost."""

import json

import numpy as np
import pytest
from explorer_events import change, control, notice, readout

import rotflex.course.lab
from rotflex import experiments, response, widgets
from rotflex.hil.controllers import StateFeedback
from rotflex.recording import Recording
from rotflex.signals import smooth_square_wave, step, time_axis
from rotflex.units import DEG
from rotflex.widgets import Trial, two_designs

K = np.array([18.2, -17.2, 1.59, 0.633])
WAVE = smooth_square_wave(time_axis(10.0, 0.002), 0.33, 20 * DEG, 100.0)


def wrong(reference, theta, alpha):
    return 20 * (theta - reference)


@pytest.fixture
def designs():
    slow = time_axis(1.8, 0.03)
    return {
        "K": Trial(StateFeedback(K), WAVE),
        "wrong sign": Trial(wrong, WAVE),
        "weak": Trial(StateFeedback(K / 100, sample_time=0.03, cutoff=1 / 0.03), step(slow, 40 * DEG, at=0.3), 0.03),
        "two voltages": Trial(lambda *_: [1.0, 2.0], WAVE),
    }


def row(explorer, name):
    (table, *_more) = explorer.scene["readouts"]
    return next(one["values"] for one in table["rows"] if one["label"] == name)


def test_a_design_moves_as_in_an_experiment_and_its_figures_are_those_of_the_specifications(lab, designs):
    with lab.bench() as bench:
        expected = experiments.tracking(bench, K, progress=False)
    explorer = widgets.compare_designs(lab, {"one": designs["K"], "same": designs["K"]})
    for arm in explorer.arms:
        assert all(np.array_equal(arm.recording[name], expected[name]) for name in expected.channels)
    found = response.worst(response.measure(expected))
    assert explorer.arms[0].figures["settling time"] == pytest.approx(found.settling_time)
    assert explorer.arms[0].figures["largest deflection"] == pytest.approx(found.max_alpha / DEG)
    assert explorer.arms[0].figures["largest voltage"] == found.max_vm
    assert explorer.arms[0].figures["swing after 0.5 s"] == pytest.approx(response.swing(expected) / DEG)
    assert explorer.arms[0].figures["voltage noise"] == pytest.approx(response.voltage_noise(expected))


def test_the_figures_of_a_made_up_run_whose_command_has_two_steps():
    t = time_axis(3.0, 0.002)
    unfinished = step(t, -20 * DEG, at=2.9)
    reference = step(t, 10 * DEG, at=0.1) + step(t, 10 * DEG, at=0.26) + unfinished
    theta = step(t, 20.7 * DEG, at=0.4)  # within 0.8 deg
    alpha = -9 * DEG * (t < 0.3) + 2 * DEG * (np.abs(t - 0.8) < 0.05)
    vm = np.where(t < 0.3, -7.0, np.where(np.arange(t.size) % 2, 0.3, -0.3))
    made_up = {"theta_ref": reference, "alpha": alpha, "vm": vm}
    found = two_designs._figures(Recording.of(t, theta=theta, **made_up))
    assert [*found.values()] == pytest.approx([0.3, 9.0, 2.0, 7.0, 0.6], rel=1e-3)
    for about, angle in (({}, 0 * t), ({"ended": "LimitExceeded: too far."}, theta)):
        assert np.isinf(two_designs._figures(Recording.of(t, about, theta=angle, **made_up))["settling time"])


def test_the_figures_of_a_made_up_run_in_which_the_command_rests():
    t = time_axis(2.0, 0.002)
    theta = 20 * DEG + 2 * DEG * ((t > 0.1) & (t < 0.399))
    alpha = -9 * DEG * (t < 0.3) + 2 * DEG * (np.abs(t - 0.8) < 0.05)
    vm = np.where(t <= 0.2, -7.0, np.where(np.arange(t.size) % 2, 0.3, -0.3))
    made_up = {"theta_ref": np.full(t.size, 20 * DEG), "alpha": alpha, "vm": vm}
    found = two_designs._figures(Recording.of(t, theta=theta, **made_up))
    assert [*found.values()] == pytest.approx([0.4, 9.0, 2.0, 7.0, 0.6], rel=1e-3)
    assert np.isinf(two_designs._figures(Recording.of(t, theta=0 * t, **made_up))["settling time"])


def test_the_push_is_the_same_at_every_sample_time_and_comes_while_all_commands_rest(lab, designs):
    explorer = widgets.compare_designs(lab, {name: designs[name] for name in ("K", "weak")})
    assert not any("tau_link" in arm.recording for arm in explorer.arms)
    change(explorer, "push the arm", "at rest")
    starts = []
    for arm in explorer.arms:
        torque, every = arm.recording["tau_link"], arm.recording.sample_time
        assert torque.sum() * every == pytest.approx(0.1 * 0.06)
        starts.append(arm.recording.time[np.flatnonzero(torque)[0]])
    # The commands move from 0 to 0.02 s, at 0.3 s, and from 1.516 s on: the middle is at 0.908 s.
    assert starts == pytest.approx([0.908, 0.9], abs=0.003)
    assert readout(explorer, "After the push")
    assert 1 < float(row(explorer, "largest deflection")[0].split()[0]) < 6  # in the turn after it, it is 10


def test_designs_of_any_length_and_one_that_is_lost_are_in_one_picture(lab, designs):
    explorer = widgets.compare_designs(lab, designs)
    assert row(explorer, "run") == ["complete", "lost"] and "complete and lost" in explorer.scene["alt"]
    assert "±180 deg" in readout(explorer, "Lost: wrong sign")["rows"][0]["values"][0]
    assert row(explorer, "settling time")[1] == "does not settle"
    assert explorer.arms[1].recording.time[-1] < 2
    assert explorer.scene["play"]["duration"] == pytest.approx(10.0)
    theta = explorer.view().columns[1].panels[0]
    assert [item["x"][-1] < 2 for item in theta.items if item["role"] == "reference"] == [False, True]
    change(explorer, "first", "weak")
    change(explorer, "second", "K")
    assert [arm.title for arm in explorer.arms] == ["weak", "K"] and row(explorer, "run") == ["complete"] * 2
    assert explorer.view().columns[1].panels[0].y[1] > 40
    change(explorer, "second", "two voltages")
    assert "one number" in notice(explorer)["text"] and control(explorer, "second")["value"] == "K"


def test_switching_back_runs_nothing_again(lab, designs):
    opened = []
    explorer = two_designs.DesignsExplorer(lambda: opened.append(1) or lab.bench(), designs)
    assert len(opened) == 2
    for name in ("weak", "wrong sign", "weak", "K"):
        change(explorer, "second", name)
    assert len(opened) == 3


def test_in_place_of_a_real_bench_another_arm_moves(tmp_path):
    about = {"student": "ada", "draw": 2, "bench": {"which": "real", "benches": ["north"]}}
    (tmp_path / "course.json").write_text(json.dumps(about), encoding="utf-8")
    lab = rotflex.course.lab.start("ada", folder=tmp_path, quiet=True)
    lab.record("3.8", K=[K.tolist()])
    explorer = widgets.compare_designs(lab)
    assert notice(explorer)["text"] == ""
    assert "Nothing moves a real bench" in readout(explorer, "Another arm")["rows"][0]["values"][0]
