"""Figures of a report: as the student drew them; without that, from the points of the answer."""

import re

import matplotlib.pyplot as plt
import numpy as np
import pytest

from labcourse.answers import parts
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import Question
from labcourse.report import recorded_figures
from labcourse.session import Session

T = np.linspace(0, 10, 5000)
PARTS = (parts.figure("figure", "A-1", "The speed over time."), parts.figure("other", "A-1", "The angle."))
CATALOGUE = Catalogue([Question("1.2", "1", "02_measuring", "The speed", (), PARTS)])


@pytest.fixture
def lab(tmp_path, monkeypatch):
    monkeypatch.setattr("labcourse.session.by_program", lambda: False)
    return Session("ada", tmp_path, CATALOGUE, {}, 1)


def speed(frequency=40):
    figure, ax = plt.subplots()
    ax.plot(T, np.sin(frequency * T), label="measured")
    ax.set(xlabel="time (s)", ylabel=r"speed $\omega$ (rad/s)")
    plt.close(figure)
    return figure


def drawn(lab, part="figure"):
    axes = [axis("", T[:200], T[:200])]
    return recorded_figures.drawing(lab._folder, "1.2", part, lab.content("1.2", part), axes)


def saved(lab):
    return sorted((lab._folder / recorded_figures.FOLDER).iterdir())


def test_a_figure_is_saved_with_all_its_points_when_it_is_recorded(lab):
    lab.answer("1.2", figure=speed())
    svg, is_own = drawn(lab)
    assert is_own and svg == saved(lab)[0].read_text() and "<text" not in svg
    assert max(len(re.findall(r"[ML] ", path)) for path in re.findall(r'd="([^"]*)"', svg)) > 4 * 200
    lab.answer("1.2", figure="no figure")  # is refused
    assert drawn(lab) == (svg, True)


def test_a_figure_that_is_recorded_anew_takes_the_place_of_its_own_file_alone(lab):
    lab.answer("1.2", figure=speed(), other=speed(20))
    first = saved(lab)
    lab.answer("1.2", figure=speed(30))
    second = saved(lab)
    assert len(first) == len(second) == 2 and len({*first, *second}) == 3
    assert drawn(lab)[1] and drawn(lab, "other")[1]


def test_without_its_file_a_figure_is_drawn_from_the_answer(lab, monkeypatch):
    lab.answer("1.2", figure=speed())
    (path,) = saved(lab)
    path.write_bytes(b"\xff")  # no text
    assert not drawn(lab)[1]
    path.unlink()
    svg, is_own = drawn(lab)
    assert "<svg" in svg and not is_own
    monkeypatch.setattr(recorded_figures, "_MAX_BYTES", 1000)
    lab.answer("1.2", figure=speed(30))
    assert saved(lab) == []


def test_what_cannot_be_drawn_or_written_is_recorded_in_spite_of_that(lab):
    figure = speed()
    figure.axes[0].set_title(r"$\nonsense{$")
    lab.answer("1.2", figure=figure)
    (lab._folder / recorded_figures.FOLDER).write_text("no folder")
    lab.answer("1.2", other=speed())
    assert lab.content("1.2", "figure") and lab.content("1.2", "other")
    assert not drawn(lab)[1] and not drawn(lab, "other")[1]


def axis(label, x, y, ylabel="y", title=""):
    line = {"label": label, "n": len(x), "x": np.asarray(x, float), "y": np.asarray(y, float)}
    return {"title": title, "xlabel": "time (s)", "ylabel": ylabel, "lines": [line]}


def test_odd_answers_are_drawn_always_the_same(tmp_path):
    for one in (
        axis("$\\nonsense{", T, T, ylabel="$x_{$ (m)", title="50 $"),
        axis("", [1.0], [1.0]),
        axis("", [], []),
        axis("", T, 1e308 * np.ones(T.size)),
    ):
        found = recorded_figures.drawing(tmp_path, "1.2", "figure", {}, [one, one])
        assert "<svg" in found[0] and found == recorded_figures.drawing(tmp_path, "1.2", "figure", {}, [one, one])
