"""The figures: what they show, and how they read."""

import functools
import itertools
import re

import matplotlib as mpl
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg

from rotflex import figures
from rotflex.figures import png
from rotflex.recording import Recording

PER_RADIAN = 180 / np.pi
T = np.arange(0, 10, 0.005)
SQUARE = np.where(np.sin(2 * np.pi * 0.33 * T) >= 0, 20.0, -20.0) / PER_RADIAN
DECAY = Recording.of(T, alpha=0.14 * np.exp(-0.4 * T) * np.cos(20 * T))
VALIDATION = Recording.of(
    T, theta=np.sin(T), theta_model=1.1 * np.sin(T), alpha=0.1 * np.cos(3 * T), alpha_model=0.11 * np.cos(3 * T)
)
TRACKING = Recording.of(
    T, theta_ref=SQUARE, theta=0.97 * SQUARE, alpha=0.1 * np.sin(9 * T), vm=6 * np.cos(9 * T) * np.exp(-T)
)
SWINGING = Recording.of(
    T, theta_ref=SQUARE, theta=0.95 * SQUARE, alpha=0.2 * np.sin(2 * np.pi * T), vm=5 * np.cos(9 * T) * np.exp(-T)
)
F = np.linspace(0, 20, 401)
HUMP = 1 / (0.01 + (F - 3.17) ** 2)
OPEN_LOOP = [0, -18.86, -8.092 + 26.984j, -8.092 - 26.984j]
CLOSED_LOOP = [-12 + 16j, -12 - 16j, -30, -40]

PLOTS = {
    "compound_sine_spectrum": figures.compound_sine_spectrum,
    "free_decay": lambda: figures.free_decay(DECAY),
    "validation": lambda: figures.validation(VALIDATION),
    "tracking": lambda: figures.tracking(TRACKING),
    "compare_tracking": lambda: figures.compare_tracking(TRACKING, SWINGING),
    "naive_against_true": lambda: figures.naive_against_true((F, np.roll(HUMP, 20)), (F, HUMP), (F, 9 * HUMP), 3.17),
    "pole_map": lambda: figures.pole_map({"open loop": OPEN_LOOP, "closed loop": CLOSED_LOOP}),
    "pole_map_bare": lambda: figures.pole_map(OPEN_LOOP),
    "reading_a_response": figures.reading_a_response,
}
EVERY = PLOTS | {"motions_of_poles": figures.motions_of_poles}  # its panels share one label


@functools.cache
def drawn(name):
    """A figure, laid out as a notebook shows it."""
    figure = EVERY[name]()
    png(figure)
    return figure


@pytest.fixture(params=EVERY)
def figure(request):
    return drawn(request.param)


@pytest.fixture(params=PLOTS)
def plot(request):
    return drawn(request.param)


def labelled(axes):
    return {line.get_label(): line for line in axes.lines if not line.get_label().startswith("_")}


def test_has_a_description_in_sentences(figure):
    assert len(figure.alt_text) > 50
    assert figure.alt_text[0].isupper()
    assert figure.alt_text.endswith(".")
    assert not re.search(r"[\n$\\{}]|\bnan\b|\w- \w|  ", figure.alt_text)


def test_no_words_are_cut_off_or_on_top_of_each_other(figure):
    with figures.style():
        canvas = FigureCanvasAgg(figure)
        figure.draw_without_rendering()
        words = [text for text in figure.findobj(mpl.text.Text) if text.get_text().strip() and text.get_visible()]
        # A tick beyond the axes' limits has a label that is not drawn.
        hidden = {
            label
            for axes in figure.axes
            for axis, limits in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim()))
            for tick in axis.get_major_ticks()
            for label in (tick.label1, tick.label2)
            if not min(limits) <= tick.get_loc() <= max(limits)
            or (axis is axes.xaxis and not tick.label1.get_visible())
        }
        boxes = [
            (text.get_text(), text.get_window_extent(canvas.get_renderer())) for text in words if text not in hidden
        ]
    width, height = canvas.get_width_height()
    for words, box in boxes:
        assert box.x0 >= -0.5 and box.y0 >= -0.5 and box.x1 <= width + 0.5 and box.y1 <= height + 0.5, (
            f"{words!r} is cut"
        )
    for (one, a), (other, b) in itertools.combinations(boxes, 2):
        overlap = (min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0))
        assert min(overlap) < 2, f"{one!r} and {other!r} overlap"


def test_drawing_leaves_pyplot_and_the_settings_alone():
    import matplotlib.pyplot as plt

    before = plt.get_fignums(), dict(mpl.rcParams)
    for draw in EVERY.values():
        draw()
    assert (plt.get_fignums(), dict(mpl.rcParams)) == before


def test_axes_are_labelled_with_units(plot):
    for axes in plot.axes:
        assert re.search(r"\(.+\)$", axes.get_ylabel()), axes.get_ylabel()
        below = [other for other in plot.axes if other in axes.get_shared_x_axes().get_siblings(axes)]
        assert re.search(r"\(.+\)$", below[-1].get_xlabel()), "x axis"


def assert_draws(axes, label, recording, channel):
    scale = 1 if channel == "vm" else PER_RADIAN
    x, y = labelled(axes)[label].get_data()
    np.testing.assert_array_equal(x, T)
    np.testing.assert_allclose(y, recording[channel] * scale)


def test_plots_draw_what_was_recorded_in_degrees_and_volts():
    for axes, angle in zip(figures.validation(VALIDATION).axes, ("theta", "alpha"), strict=True):
        assert_draws(axes, "measured", VALIDATION, angle)
        assert_draws(axes, "model", VALIDATION, f"{angle}_model")
    theta, alpha, vm = figures.tracking(TRACKING).axes
    assert_draws(theta, r"$\theta$", TRACKING, "theta")
    assert_draws(theta, "reference", TRACKING, "theta_ref")
    assert_draws(alpha, r"$\alpha$", TRACKING, "alpha")
    assert_draws(vm, "$V_m$", TRACKING, "vm")


def test_descriptions_have_the_numbers_of_what_is_drawn():
    """A sine of 0.2 rad, 11.5 deg, has a root mean square of 8.1 deg; 0.15 rad is 8.6 deg."""
    for figure, *numbers in (
        (figures.compare_tracking(TRACKING, SWINGING), "8.1 deg with partial"),
        (figures.compare_tracking(SWINGING, TRACKING), "8.1 deg with full"),
        (figures.pole_map([-1e-15 + 0j, *OPEN_LOOP[1:]]), " 0, -18.9, -8.1 + 27j, -8.1 - 27j."),
    ):
        assert all(number in figure.alt_text for number in numbers)


def test_tracking_draws_the_specifications_of_section_3_1_where_asked():
    theta, alpha, vm = figures.tracking(TRACKING).axes
    data = theta.transData.inverted()
    bands = sorted(tuple(patch.get_extents().transformed(data).intervaly) for patch in theta.patches)
    np.testing.assert_allclose(bands, [(-20.8, -19.2), (19.2, 20.8)])
    for axes, limit in ((alpha, 12.5), (vm, 10.0)):
        levels = sorted(float(line.get_ydata()[0]) for line in axes.lines if len(line.get_ydata()) == 2)
        assert levels == pytest.approx([-limit, limit])
        assert axes.get_ylim()[0] < -limit and axes.get_ylim()[1] > limit
    theta, alpha, vm = figures.tracking(TRACKING, specifications=False).axes
    assert not theta.patches
    assert len(alpha.lines) == len(vm.lines) == 1


def test_compare_tracking_draws_both_recordings_also_of_different_length():
    theta, alpha, vm = figures.compare_tracking(TRACKING, SWINGING).axes
    assert_draws(theta, "reference", TRACKING, "theta_ref")
    for name, recording in (("full", TRACKING), ("partial", SWINGING)):
        for axes, channel in ((theta, "theta"), (alpha, "alpha"), (vm, "vm")):
            assert_draws(axes, name, recording, channel)
    theta, *_ = figures.compare_tracking(TRACKING, SWINGING.between(0, 4)).axes
    assert labelled(theta)["partial"].get_xdata()[-1] < 4
    assert theta.get_xlim() == (T[0], T[-1])


def test_compound_sine_shows_its_three_amplitudes_and_nothing_else():
    signal, spectrum = figures.compound_sine_spectrum().axes
    t, g = signal.lines[0].get_data()
    np.testing.assert_allclose(g, 3 * np.sin(2 * np.pi * t) + 2 * np.sin(4 * np.pi * t) + 0.5 * np.sin(10 * np.pi * t))
    f, amplitude = spectrum.lines[0].get_data()
    expected = np.zeros_like(f)
    for frequency, height in ((1, 3), (2, 2), (5, 0.5)):
        expected[np.isclose(f, frequency)] = height
    assert np.count_nonzero(expected) == 3
    np.testing.assert_allclose(amplitude, expected, atol=1e-9)


def test_naive_against_true_finds_each_peak_and_marks_the_resonance():
    shifted = 1 / (0.01 + (F - 4.5) ** 2)
    figure = figures.naive_against_true((F, shifted), (F, HUMP), (F, 7 * HUMP), resonance=3.17)
    for axes, peak in zip(figure.axes, (4.5, 3.15, 3.15), strict=True):
        assert f"peak at {peak:.2f} Hz" in axes.get_title(loc="left")
        assert any(np.allclose(line.get_xdata(), 3.17) for line in axes.lines)
    assert "peaks at 4.5 Hz" in figure.alt_text


CONJUGATES = st.tuples(st.floats(-80, 5), st.floats(0, 60)).map(lambda z: [complex(*z), complex(z[0], -z[1])])


@settings(max_examples=10, deadline=None)
@given(st.lists(CONJUGATES, min_size=1, max_size=3).map(lambda pairs: list(itertools.chain(*pairs))))
def test_pole_map_draws_every_pole_within_its_axes(poles):
    (axes,) = figures.pole_map(poles).axes
    x, y = labelled(axes)["poles"].get_data()
    np.testing.assert_array_equal(x + 1j * y, poles)
    assert all(axes.viewLim.fully_contains(*pole) for pole in zip(x, y, strict=True))


def test_groups_of_poles_differ_in_shape():
    (axes,) = figures.pole_map({name: CLOSED_LOOP for name in "abcd"}).axes
    assert len({line.get_marker() for line in labelled(axes).values()}) == 4
