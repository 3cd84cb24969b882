"""Figures of responses, plotted in the ways that students plot, rightly and wrongly."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from labcourse.answers import forms
from labcourse.grading.marks import Status
from labcourse.grading.verdicts import Case
from rotflex.course.questions import CATALOGUE
from rotflex.recording import Recording
from solutions.design_checks import Design
from solutions.key import KEY
from solutions.true_bench import TrueBench

PART, RESPONSE = CATALOGUE.find("3.13").part("figure"), CATALOGUE.find("3.13").part("response")
OWN = ("3.13", "response")
CHECK = KEY["3.13"]["figure"]


def gain(bench):
    return tuple(np.ravel(Design(bench.servo, bench.joint, bench.K_s).K).tolist())


BENCH = TrueBench("ada")
RUN = BENCH.tracking(gain(BENCH), "full")
T, THETA, ALPHA, VOLTS = RUN.time, RUN.degrees("theta"), RUN.degrees("alpha"), RUN["vm"]
TURN = 1 / 0.33  # s


def stored(part, value):
    return forms.decode(part, forms.encode(part, value, 1).content)


def case(bench=BENCH, response=None):
    answers = {("3.8", "K"): np.array([gain(bench)])} | ({} if response is None else {OWN: response})
    return Case(bench, lambda question, part: answers[question, part], 7, True)


def panels(t=T, curves=(THETA, ALPHA, VOLTS), x="time (s)", y=("θ (deg)", "α (deg)", "V (V)"), draw="plot", **limits):
    figure = Figure()
    for ax, values, label in zip(figure.subplots(len(curves), 1, squeeze=False)[:, 0], curves, y, strict=True):
        getattr(ax, draw)(t, values)
        ax.set(xlabel=x, ylabel=label, **limits)
    return figure


def part_of(start, stop, count=None):
    inside = np.flatnonzero((start <= T) & (stop >= T))
    return inside if count is None else inside[np.linspace(0, inside.size - 1, count).astype(int)]


def window(start, stop, zero=0.0, scale=1.0, x="time (s)", count=None):
    """A part of the recording, its time counted from ``zero``."""
    some = part_of(start, stop, count)
    return panels(scale * (T[some] - zero), [values[some] for values in (THETA, ALPHA, VOLTS)], x)


def together():
    """The angles on one diagram, the voltage on its twin, the command with them, and lines that mark the limits."""
    figure = Figure()
    ax = figure.subplots()
    for place in range(12):
        ax.axhline(place, color="grey")
        ax.plot(T, np.full(T.size, 20 + 0.1 * place))
    for values in (RUN.degrees("theta_ref"), THETA, ALPHA):
        ax.plot(T, values)
    ax.set(xlabel="time (s)", ylabel="angles (deg)")
    other = ax.twinx()
    other.plot(T, VOLTS)
    other.set_ylabel("voltage (V)")
    return figure


def on_one_diagram():
    figure = Figure()
    ax = figure.subplots()
    ax.plot(T, np.column_stack([RUN["theta"], RUN["alpha"], VOLTS]))
    ax.set(xlabel="t / s", ylabel="θ (rad), α (rad), V (V)")
    return figure


RADIANS = (RUN["theta"], RUN["alpha"], VOLTS)
MIXED = (THETA, 1e3 * RUN["alpha"], VOLTS)

#: Labels and pieces of every sort: tests/grading/marking/test_figure_checks.py.
RIGHTLY = {
    "s, deg, V": panels,
    "ms, rad, mV": lambda: panels(1e3 * T, (*RADIANS[:2], 1e3 * VOLTS), "t / ms", ("θ/rad", "α/rad", "V/mV")),
    "angles in different units": lambda: panels(curves=MIXED, y=("θ (°)", "α (mrad)", "V (V)")),
    "a window": lambda: window(3, 8),
    "a window from 0": lambda: window(3, 8, zero=3),
    "a window about a step": lambda: window(4, 7.2, zero=4.55),
    "40 points": lambda: window(0, 10, count=40),
    "all together, a twin, the limits": together,
    "on one diagram": on_one_diagram,
}  # fmt: skip


@pytest.mark.parametrize("how", RIGHTLY)
def test_a_response_plotted_rightly_has_full_marks(how):
    verdict = CHECK.verdict(PART, stored(PART, RIGHTLY[how]()), case())
    assert verdict.status is Status.RIGHT, verdict.reason


OTHER = next(
    bench for name in ("bob", "cy", "di", "eve") if abs((bench := TrueBench(name)).omega_n / BENCH.omega_n - 1) > 0.1
)


@pytest.mark.parametrize("how", RIGHTLY)
def test_the_own_recording_plotted_rightly_has_full_marks_too(how):
    """On a bench that gives another, from the few samples that are kept of it."""
    value = stored(RESPONSE, RUN)
    value["metadata"]["K"] = None
    verdict = CHECK.verdict(PART, stored(PART, RIGHTLY[how]()), case(OTHER, response=value))
    assert verdict.status is Status.RIGHT, verdict.reason


WRONGLY = {
    "no units": (lambda: panels(x="time", y=("θ", "α", "V ")), 0.5, "horizontal axis lacks its unit: write a symbol"),
    "ms said, s drawn": (lambda: panels(x="time (ms)"), 0.5, "the horizontal axis says ms, and the curve is in s"),
    "rad said": (lambda: panels(y=("θ (rad)", "α (rad)", "V (V)")), 0.67, "says rad, and the curve is in deg"),
    "no voltage": (lambda: panels(curves=(THETA, ALPHA), y=("θ (°)", "α (°)")), 0.67, "no curve of its own follows vm"),
    "the deflection upside down": (lambda: panels(curves=(THETA, -ALPHA, VOLTS)), 0.67, "alpha: a curve follows it"),
    "the command for the angle": (lambda: panels(curves=(RUN.degrees("theta_ref"), ALPHA, VOLTS)), 0.67, "theta"),
    "too short": (lambda: panels(xlim=(3, 5.5)), 0.0, "theta: a curve follows it, but over too short a time"),
    "another's": (lambda: panels(*others()), 0.0, "No curve in the figure follows the recording"),
    "the angles against each other": (lambda: panels(THETA, (ALPHA, VOLTS), y=("α (deg)", "V (V)")), 0.0, "No curve"),
}  # fmt: skip


def others():
    """A recording that is no response of this bench with this gain."""
    run = OTHER.tracking(tuple(0.15 * k for k in gain(OTHER)), "full")
    return run.time, (run.degrees("theta"), run.degrees("alpha"), run["vm"])


@pytest.mark.parametrize("how", WRONGLY)
def test_a_response_plotted_wrongly_earns_what_it_shows_and_the_reason_is_told(how):
    draw, share, reason = WRONGLY[how]
    verdict = CHECK.verdict(PART, stored(PART, draw()), case())
    assert verdict.share == share, verdict.reason
    assert reason in verdict.reason


COMPARED = CATALOGUE.find("2.15").part("figure")


def validation(signal):
    A, B = Design(BENCH.servo, BENCH.joint, BENCH.K_s).voltage_model
    run = BENCH.validation(A, B, signal)
    answers = {("2.15", "validation"): stored(CATALOGUE.find("2.15").part("validation"), run)}
    return run, Case(BENCH, lambda question, part: answers[question, part], 7, True)


def beside(run, channels=("theta", "theta_model", "alpha", "alpha_model"), **limits):
    figure = Figure()
    for ax, angle in zip(figure.subplots(2, 1), ("theta", "alpha"), strict=True):
        for channel in channels:
            if channel.startswith(angle):
                ax.plot(run.time, run.degrees(channel))
        ax.set(xlabel="time (s)", ylabel=f"{angle} (deg)", **limits)
    return figure


@pytest.mark.parametrize(
    ("signal", "limits", "share"),
    [
        ("square", (0, 10), 1),
        ("square", (3, 5), 1),
        ("step", (0, 2.5), 1),
        ("step", (0.4, 2), 1),
        ("step", (0.4, 1), 0),
    ],
)
def test_a_validation_is_to_be_seen_over_a_turn_or_half_of_a_step(signal, limits, share):
    run, own = validation(signal)
    verdict = KEY["2.15"]["figure"].verdict(COMPARED, stored(COMPARED, beside(run, xlim=limits)), own)
    assert verdict.share == share, verdict.reason


def test_one_curve_does_not_show_both_the_bench_and_a_model_that_is_just_like_it():
    """Half is missing, however good the model is."""
    run, own = validation("square")
    same = {**run.channels, "theta_model": run.channels["theta"], "alpha_model": run.channels["alpha"]}
    twice = Recording(run.time, same, run.metadata)
    check = replace(KEY["2.15"]["figure"], again=lambda case, metadata: [twice])
    once = check.verdict(COMPARED, stored(COMPARED, beside(twice, ("theta", "alpha"))), own)
    assert once.share == 0.5
    assert "no curve of its own follows" in once.reason
    assert check.verdict(COMPARED, stored(COMPARED, beside(twice)), own).share == 1


@pytest.mark.parametrize(("off", "share"), [(0.147, 1), (-0.147, 1), (0.153, 0.0), (-0.156, 0.0)])
def test_curves_follow_within_fifteen_per_cent(off, share):
    """A lower voltage follows a little better half a sample later, where steps between samples are halved."""
    figure = panels(curves=[(1 + off) * values for values in (THETA, ALPHA, VOLTS)])
    assert CHECK.verdict(PART, stored(PART, figure), case()).share == share


@pytest.mark.parametrize(("turns", "share"), [(1.0, 1), (0.95, 0.0)])
@pytest.mark.parametrize("start", [0.0, 2.0])
def test_a_turn_of_the_command_is_enough(turns, share, start):
    for zero in (0, start):
        figure = window(start, start + turns * TURN, zero=zero)
        assert CHECK.verdict(PART, stored(PART, figure), case()).share == share


@pytest.mark.parametrize(("zero", "found"), [(0.0, True), (2.0, False)])
def test_a_window_shorter_than_a_turn_is_found_where_its_time_says_and_looked_for_nowhere_else(zero, found):
    """So short a piece may follow somewhere by chance."""
    verdict = CHECK.verdict(PART, stored(PART, window(2.0, 2.0 + 0.9 * TURN, zero=zero)), case())
    assert verdict.share == 0 and ("follows it, but over too short a time" in verdict.reason) == found


def test_a_figure_with_as_much_as_can_be_kept_is_judged_in_time():
    noise = np.random.default_rng(4).normal(size=(24, 200))
    label = "(s), (ms), (min), (deg), (rad), (mrad), (V), (mV)"
    lines = [{"label": "", "n": 200, "x": np.linspace(0, 10, 200), "y": 10 * values} for values in noise]
    figure = {"axes": [{"title": "", "xlabel": label, "ylabel": label, "lines": lines}] * 8}
    assert CHECK.verdict(PART, figure, case(response=stored(RESPONSE, RUN))).share == 0
