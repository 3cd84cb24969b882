"""The pole explorer without a page: what it shows, what it does with events."""

import json

import numpy as np
import pytest
from explorer_events import change, control, notice, press, readout
from hypothesis import given
from hypothesis import strategies as st

from rotflex import widgets
from rotflex.errors import DesignError
from rotflex.units import DEG
from rotflex.widgets.placement import COUNT, Dominant, cloud, spread_of
from rotflex.widgets.poles import OMEGA_RANGE, PLANE, REAL_RANGE, ZETA_RANGE, PoleExplorer, dragged


def shown_gain(explorer):
    return [float(row["values"][0].replace("−", "-")) for row in readout(explorer, "Gain K")["rows"]]


def test_dragging_the_pair_is_the_same_as_the_plain_function(model):
    explorer = PoleExplorer(*model)
    explorer.receive({"kind": "moved", "name": "pair", "x": -18.0, "y": 13.0, "view": "page", "n": 3})
    expected = widgets.design(*model, [-18 + 13j, -18 - 13j, -30, -40])
    assert pytest.approx(expected.K) == explorer.design.K
    assert shown_gain(explorer) == pytest.approx(expected.K.ravel().tolist(), rel=1e-3)
    marks = [row["mark"] for row in readout(explorer, "Specifications")["rows"]]
    assert marks == ["met" if finding.met else "missed" for finding in expected.findings]
    assert control(explorer, "zeta")["value"] == pytest.approx(18 / np.hypot(18, 13))
    assert explorer.scene["answered"] == {"view": "page", "n": 3}


def test_an_unstable_design_is_shown_running_away_and_said_in_words(model):
    explorer = PoleExplorer(*model)
    explorer.receive({"kind": "moved", "name": "pair", "x": 2.0, "y": 16.0})
    where, swings, reached, then = readout(explorer, "Specifications")["rows"]  # as many as there are specifications
    assert (where["mark"], where["words"], where["values"]) == ("missed", "unstable", ["at 2 rad/s"])
    assert "twice as large every 0.35 s" in swings["values"][0] and "30 deg of deflection after" in reached["values"][0]
    assert then["values"] == ["stopped by the safety, 0 V"]
    theta = explorer.scene["columns"][1]["panels"][0]
    assert "stopped by the safety" in [item["label"] for item in theta["items"] if "label" in item]
    offset, count = explorer.scene["play"]["signals"]["alpha"]
    played = np.degrees(np.frombuffer(explorer.data, np.float32)[offset : offset + count])
    assert np.abs(played).max() == pytest.approx(30, abs=3)
    assert explorer.scene["play"]["auto"]
    assert "unstable" in explorer.scene["alt"]
    assert len(explorer._repr_mimebundle_()[0]["image/png"]) > 5_000
    press(explorer, "keep")
    assert "nothing can be recorded with it" in notice(explorer)["text"]


def test_the_arm_goes_through_the_response_that_is_shown(model):
    explorer = PoleExplorer(*model)
    (arm,) = explorer.scene["columns"][2]["panels"]
    assert arm["signals"]["theta"] == pytest.approx(-20 * DEG)
    play = explorer.scene["play"]
    offset, count = play["signals"]["theta"]
    played = np.frombuffer(explorer.data, np.float32)[offset : offset + count]
    recording = explorer.design.recording
    instants = np.linspace(0, play["duration"], count)
    assert played == pytest.approx(np.interp(instants, recording.time, recording["theta"]), abs=1e-5)


def handles(explorer):
    (plane,) = explorer.scene["columns"][0]["panels"]
    return {one["name"]: (one["x"], one["y"]) for one in plane["handles"]}


def test_a_damping_ratio_beyond_one_is_two_real_poles_to_be_dragged(model):
    explorer = PoleExplorer(*model)
    assert set(handles(explorer)) == {"pair", "p3", "p4"}
    change(explorer, "zeta", 1.25)
    assert handles(explorer)["pair"] == pytest.approx((-10.0, 0.0))
    assert handles(explorer)["partner"] == pytest.approx((-40.0, 0.0))
    assert np.sort(explorer.design.poles.real) == pytest.approx([-40, -40, -30, -10], abs=0.1)
    explorer.receive({"kind": "moved", "name": "partner", "x": -25.0, "y": 0.0})
    assert handles(explorer)["partner"] == pytest.approx((-25.0, 0.0))
    assert control(explorer, "zeta")["value"] == pytest.approx(35 / (2 * np.sqrt(250)))
    for zeta in (0.0, 0.05):
        change(explorer, "zeta", zeta)
        assert explorer.wanted.zeta == zeta


def test_the_cloud_is_of_the_students_own_uncertainty(model):
    explorer = PoleExplorer(*model)
    change(explorer, "beside", "cloud")
    (plane,) = explorer.scene["columns"][0]["panels"]
    (points,) = [item for item in plane["items"] if item["kind"] == "points"]
    offset, count = points["x"]
    assert count == 4 * COUNT
    spread = spread_of(model[0])
    expected = cloud(*model, explorer.design.K, spread)
    found = np.frombuffer(explorer.data, np.float32)[offset : offset + count]
    assert found == pytest.approx(expected.poles.real.ravel(), rel=1e-5)
    rows = {row["label"]: row["values"] for row in readout(explorer, "If K_s is not quite that")["rows"]}
    assert rows["all four met on"] == [f"{100 * expected.share:.0f} %"]
    assert rows["u(K_s)/K_s"] == [f"{100 * spread:.2g} %"]


def test_partial_feedback_reset_and_ghosts(model):
    explorer = PoleExplorer(*model)
    first = shown_gain(explorer)
    press(explorer, "ghost")
    change(explorer, "feedback", "partial")
    assert explorer.design.feedback == "partial"
    drawn = [item for panel in explorer.scene["columns"][1]["panels"] for item in panel["items"]]
    assert sum(item["role"] == "ghost" for item in drawn) == 3
    change(explorer, "zeta", 0.9)
    press(explorer, "forget")
    press(explorer, "reset")
    assert shown_gain(explorer) == first
    assert not explorer.ghosts and explorer.feedback == "full"


def test_a_design_is_kept_as_a_line_of_code_and_no_answer_changes(model, lab):
    lab.record("2.14", A=model[0], B=model[1])
    lab.record("3.8", K=[[20.0, -17.0, 1.5, 0.6]])
    explorer = widgets.explore_poles(lab=lab)
    before = lab.value("3.8", "K")
    for zeta, asked in ((None, False), (0.8, True)):
        if zeta:
            change(explorer, "zeta", zeta)
        press(explorer, "keep")
        (line,) = [line for line in notice(explorer)["text"].splitlines() if line.startswith("K =")]
        names = {"np": np}
        exec(line, names)
        assert names["K"] == pytest.approx(explorer.design.K, rel=1e-5) and names["K"].shape == (1, 4)
        assert ("workbook's poles" in notice(explorer)["text"]) is asked
    assert (lab.value("3.8", "K") == before).all()


def test_the_students_own_gain_is_drawn_where_its_poles_are(model):
    K = widgets.design(*model, widgets.Dominant(0.7, 18.0).poles).K
    explorer = PoleExplorer(*model, K=K)
    (plane,) = explorer.scene["columns"][0]["panels"]
    squares = [complex(*item["at"]) for item in plane["items"] if item.get("shape") == "square"]
    assert np.sort_complex(squares) == pytest.approx(np.sort_complex(widgets.Dominant(0.7, 18.0).poles), rel=1e-4)
    json.dumps(explorer.scene, allow_nan=False)


def test_what_cannot_be_is_said(model):
    for A, B, named in ((model[0], 0 * model[1], "placed"), (np.eye(2), np.ones(2), r"\(4, 4\)")):
        with pytest.raises(DesignError, match=named):
            PoleExplorer(A, B)
    explorer = PoleExplorer(*model)
    change(explorer, "beside", "nyquist")
    assert "'nyquist'" in notice(explorer)["text"] and explorer.beside == "step"
    change(explorer, "zeta", 0.0)  # on the border of stability
    where, swings, reached, _ = readout(explorer, "Specifications")["rows"]
    assert where["values"] == ["at 0 rad/s"] and swings["values"] == ["for ever"]
    assert "not within" in reached["values"][0]


def test_a_figure_for_the_report(model, lab, tmp_path, monkeypatch):
    explorer = PoleExplorer(*model)
    press(explorer, "figure")
    assert (tmp_path / "pole_design.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (tmp_path / "pole_design.svg").read_text(encoding="utf-8")
    assert not list(tmp_path.glob(".pole_design*"))
    assert "pole_design.svg" in notice(explorer)["text"]
    monkeypatch.setattr("labcourse.scene.explorer.Path.cwd", lambda: tmp_path / "not there")
    press(explorer, "figure")
    assert "cannot be written" in notice(explorer)["text"]


# --- where poles come to lie when they are dragged ---

PLACE = st.tuples(st.floats(*PLANE[0]), st.floats(*PLANE[1]))


def test_a_pair_that_comes_to_the_axis_splits_into_two_real_poles_and_comes_together_again():
    double = dragged(Dominant(), "pair", -20.0, 0.3)
    assert double.zeta == 1 and double.poles == pytest.approx([-20, -20, -30, -40])
    split = dragged(double, "pair", -10.0, -0.3)
    assert (split.pair, split.partner) == pytest.approx((-10, -20)) and split.zeta > 1
    wider = dragged(split, "partner", -40.0, 0.0)
    assert (wider.pair, wider.partner) == pytest.approx((-10, -40))
    assert wider.zeta == pytest.approx(50 / (2 * 20)) and wider.omega_n == pytest.approx(20)
    passed = dragged(wider, "pair", -60.0, 0.0)  # one does not pass the other
    assert (passed.pair, passed.partner) == pytest.approx((-40, -40))
    again = dragged(wider, "partner", -15.0, 9.0)
    assert again.zeta < 1 and again.pair == pytest.approx(-15 + 9j)


@given(PLACE, PLACE, st.sampled_from(["pair", "partner", "p3", "p4"]), st.sampled_from(["pair", "partner", "p3", "p4"]))
def test_wherever_poles_are_dragged_they_are_on_the_plane_and_in_range(first, second, one, other):
    found = dragged(dragged(Dominant(), one, *first), other, *second)
    assert ZETA_RANGE[0] <= found.zeta <= ZETA_RANGE[1] and OMEGA_RANGE[0] <= found.omega_n <= OMEGA_RANGE[1]
    assert all(REAL_RANGE[0] - 1e-6 <= pole.real for pole in found.poles)
    assert np.abs(np.imag(np.poly(found.poles))).max() < 1e-6
