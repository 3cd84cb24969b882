"""Labels of axes, out of TeX, and where on them a unit may stand."""

from __future__ import annotations

from rotflex.courseware.kinds.axis_labels import plain, unit_places


def test_a_label_is_read_without_tex_and_in_small_letters():
    labels = {"Time (s)": "time (s)", r"$t\ [\mathrm{ms}]$": "t [ms]", r"$\alpha$ / $^{\circ}$": "alpha / °"}
    labels |= {r"$\theta\,/\,\text{rad}$": "theta / rad", "θ （º）": "θ (°)", "角度【度】": "角度(度)"}
    labels |= {r"$10^{-3}$ rad": "10^-3 rad", "×10⁻³ rad": "×10^-3 rad", r"$\frac{t}{\mathrm{s}}$": "t/s"}
    labels |= {r"\unit{\milli\second}": "(millisecond)", r"$t$ in $\mu$ s": "t in μs"}
    labels |= {"\u200fالزمن\u200f (ث)": "الزمن (ث)"}
    assert {label: plain(label) for label in labels} == labels


def test_a_unit_may_stand_in_many_places():
    seconds = ["time (s)", "time [s]", "time {s}", "time <s>", "time, s", "time: s", "time - s", "t/s", "time in s"]
    places = dict.fromkeys([*seconds, "tiempo en s", "czas w s", "time (s"], "s")
    places |= {"時間（秒）": "秒", "ω / rad/s": "rad/s", "время в с": "с", "angle (theta, in °)": "°"}
    places |= {"angle (deg, unwrapped)": "deg", "theta / deg, alpha / rad": "rad"}
    assert [label for label, place in places.items() if place not in unit_places(label)] == []


def test_a_label_may_have_no_place_for_a_unit():
    for label in ("", "time", "the sweep's time", "integral", "t_s", "( )", "$$", "\\", "{"):
        assert unit_places(label) == []


def test_a_label_made_to_be_slow_has_few_places():
    for piece in ("in ", "(", ",", "\\frac{", "a.", "x^-1 ", "\\mathrm{", "[(<", "$\\", "_{", "10^9"):
        assert len(unit_places(piece * (200 // len(piece)))) <= 16
