"""The explorers that open the notebooks: on another arm until the questions are answered, then on the student's own."""

import json

import numpy as np
import pytest
import working_through
from explorer_events import change, control, notice, press
from PIL import Image

import rotflex.course.lab
from rotflex import response, widgets
from rotflex.plant import PlantParameters
from rotflex.recording import Recording
from rotflex.widgets import another_arm, arms

OPENINGS = {
    "01": lambda lab: widgets.watch_energy(),
    "02": widgets.explore_sweep,
    "03": widgets.explore_validation,
    "04": widgets.watch_model,
    "05": lambda lab: widgets.explore_poles(lab=lab),
    "07": widgets.explore_loop,
    "11": widgets.compare_designs,
    "10": widgets.show_arm,
}


@pytest.fixture(scope="module")
def worked(tmp_path_factory):
    """A session in which all is answered, and the recordings behind answers 3.13 and 3.15."""
    folder = tmp_path_factory.mktemp("worked")
    lab, whole = rotflex.course.lab.start("ada", folder=folder, quiet=True), {}

    def write(question, name, value):
        if isinstance(value, Recording):
            whole[question] = value
        lab.record(question, **{name: value})
        return value

    A, B, poles = working_through.modeling(lab, write)
    working_through.responses(lab, write, A, B, working_through.design(write, A, B, poles))
    return lab, whole


def titles(explorer):
    return [one["title"] for one in explorer.scene["readouts"]]


@pytest.mark.parametrize("real", [False, True], ids=["virtual", "real"])
def test_each_opening_runs_when_nothing_is_answered(tmp_path, monkeypatch, real):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("LABCOURSE_PICTURES", raising=False)
    if real:
        about = {"student": "ada", "draw": 2, "bench": {"which": "real", "benches": ["north"]}}
        (tmp_path / "course.json").write_text(json.dumps(about), encoding="utf-8")
    lab = rotflex.course.lab.start("ada", folder=tmp_path, quiet=True)
    for name, make in OPENINGS.items():
        explorer = make(lab)
        data, metadata = explorer._repr_mimebundle_()
        assert len(data["image/png"]) > 5_000 and metadata["image/png"]["alt"], name
        assert notice(explorer)["text"] == "", name
    assert (explorer.arms[0].title == "servo alone") is not real  # nothing was recorded there, so it is simulated


def test_what_a_question_asks_for_is_shown_only_after_its_answer(lab, worked):
    done, _whole = worked
    sweeps, poles, loops = (OPENINGS[name] for name in ("02", "05", "07"))
    assert "Stiffness by the cursor" not in titles(sweeps(lab)) and "Stiffness by the cursor" in titles(sweeps(done))
    hidden, own = poles(lab), poles(done)
    for one in (hidden, own):
        change(one, "zeta", 0.6)
        change(one, "omega_n", 20.0)
    assert not {"Gain K", "Characteristic polynomial"} & set(titles(hidden))
    assert "16.0j" in json.dumps(own.scene, ensure_ascii=False)
    assert "16.0j" not in json.dumps(hidden.scene, ensure_ascii=False)
    assert {"Gain K", "Characteristic polynomial"} <= set(titles(own)) and control(own, "keep")
    assert not any(one["name"] == "keep" for row in hidden.scene["controls"] for one in row)
    assert np.ravel(own._own.K) == pytest.approx(np.ravel(done.value("3.8", "K")))
    assert "your K" in dict(control(loops(done), "controller")["options"])
    assert "your K" not in dict(control(loops(lab), "controller")["options"])
    for name in ("02", "03", "04", "05", "07", "11"):
        assert "Another arm" in titles(OPENINGS[name](lab)) and "Another arm" not in titles(OPENINGS[name](done)), name


def test_an_own_model_that_cannot_be_used_is_said_and_another_arm_is_shown(lab):
    lab.record("2.14", A=np.eye(4), B=np.zeros((4, 1)))
    lab.record("3.8", K=[[20.0, -17.0, 1.5, 0.6]])
    explorer = OPENINGS["05"](lab)
    assert "placed" in notice(explorer)["text"] and "Another arm" in titles(explorer)


def test_the_stored_energies_only_flow_and_get_less():
    for servo in ("free", "held"):
        stored = another_arm.numbers()[servo]
        parts = np.array([stored[name] for name in ("spring", "servo", "link")], dtype=float)
        assert parts[0, 0] > 50 and not parts[1:, 0].any()  # mJ: all of it begins in the spring
        whole = parts.sum(axis=0)
        assert (whole - np.minimum.accumulate(whole)).max() <= 3  # six roundings of half a mJ each
        assert (parts[1].max() > 20) == (servo == "free")
    explorer = widgets.watch_energy()
    change(explorer, "servo", "held")
    assert explorer.scene["play"]["at_once"] and "held" in explorer.scene["alt"]
    assert not hasattr(PlantParameters, "energy")  # it is what questions 2.1 and 2.2 ask for


def test_another_arms_loop_follows_command_and_controller(lab):
    explorer = OPENINGS["07"](lab)
    swings = np.abs(explorer.loop.motion["alpha"]).max()
    change(explorer, "controller", "soft")
    assert np.abs(explorer.loop.motion["alpha"]).max() < swings
    change(explorer, "amplitude", 10.0)
    assert explorer.loop.motion.degrees("theta_ref")[[0, -1]] == pytest.approx([-10, 10])
    change(explorer, "ramp", 0.4)
    rising = np.diff(explorer.loop.motion["theta_ref"]) > 0
    assert rising.sum() * explorer.loop.motion.sample_time == pytest.approx(0.4, abs=0.005)


def test_the_rewards_figures_are_those_of_the_responses(worked):
    lab, whole = worked
    before, full, partial = widgets.show_arm(lab).arms
    for arm, question in ((full, "3.13"), (partial, "3.15")):
        worst = response.worst(response.measure(whole[question]))
        expected = (worst.settling_time, worst.overshoot, np.rad2deg(worst.max_alpha), worst.max_vm)
        assert [arm.figures[name] for name in working_through.MEASURED] == pytest.approx(expected, rel=1e-5)
        assert widgets.figures_of(whole[question])["t_s"] == worst.settling_time
    assert before.figures["end"] > full.figures["end"]  # what the design is for


def test_the_arm_is_kept_as_a_film_and_a_picture(worked, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(arms, "_FRAMES_PER_SECOND", 3)
    explorer = widgets.show_arm(worked[0])
    press(explorer, "keep")
    assert "my_arm.gif" in notice(explorer)["text"] and not explorer.busy
    assert {path.name for path in tmp_path.iterdir()} == {"my_arm.gif", "my_arm.png"}
    with Image.open("my_arm.gif") as film:
        assert 5 < film.n_frames <= 10 and film.info["loop"] == 0  # 3 s; frames that are alike are one
        first = np.asarray(film.convert("RGB"), dtype=float)
        film.seek(film.n_frames // 2)
        assert np.abs(np.asarray(film.convert("RGB"), dtype=float) - first).max() > 50
    monkeypatch.setattr("rotflex.widgets.arms.Path.cwd", lambda: tmp_path / "not there")
    press(explorer, "keep")
    assert "cannot be written" in notice(explorer)["text"] and not explorer.busy


def test_no_response_leaves_its_axes_as_the_pair_comes_near_the_imaginary_axis(lab, model):
    explorer = widgets.explore_poles(*model)
    for zeta in (0.3, 0.1, 0.02):
        change(explorer, "zeta", zeta)
        panels = explorer.view().columns[1].panels
        for panel, name in zip(panels, ("theta", "alpha"), strict=False):
            values = explorer.design.motion.degrees(name)
            assert panel.y[0] <= values.min() and values.max() <= panel.y[1], (zeta, name)
