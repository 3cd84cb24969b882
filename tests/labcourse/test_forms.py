"""The form of answers: what is taken, what is refused with which hint, and that it comes back."""

import json
import re
from fractions import Fraction
from types import SimpleNamespace

import control
import matplotlib as mpl
import numpy as np
import pytest
import scipy.fft
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.figure import Figure

from labcourse.answers import schema
from labcourse.answers.forms import FormError, NotAnswered, decode, encode, show
from labcourse.answers.json_values import LONGEST_PROSE, thin
from labcourse.answers.parts import Part, matrix, number, poles
from labcourse.errors import AnswerError
from rotflex.course.probes import COMPOUND_SINES, PLANT_PARAMETERS
from rotflex.course.questions import CATALOGUE
from rotflex.recording import Channel, Recording

mpl.use("Agg")
SEED = 7


def part(question, name):
    return CATALOGUE.find(question).part(name)


def through_json(wanted, value, seed=SEED):
    encoded = encode(wanted, value, seed)
    return decode(wanted, json.loads(json.dumps(encoded.content, allow_nan=False))), encoded


def refused(wanted, value, fragment):
    with pytest.raises(FormError, match=fragment):
        encode(wanted, value, SEED)


OMEGA_N = part("2.11", "omega_n")
A = part("2.14", "A")
C, D = part("2.14", "C"), part("2.14", "D")
B = part("2.14", "B")
K = part("3.8", "K")
POLYNOMIAL = part("3.2", "polynomial")
POLES = part("2.18", "poles")
SPECTRUM = part("2.10", "spectrum")
STATE_SPACE = part("2.13", "state_space")
FIGURE = part("2.9", "figure")
SWEEP = part("2.9", "sweep")


def test_a_number_is_taken_in_whatever_type_it_comes():
    values = [19.5, np.float64(19.5), np.float32(19.5), np.array(19.5), np.array([19.5]), [[19.5]], Fraction(39, 2)]
    values += [sympy.Rational(39, 2), sympy.Float(19.5), sympy.Matrix([[19.5]]), 19.5 + 0j, np.complex128(19.5)]
    for value in values:
        back, encoded = through_json(OMEGA_N, value)
        assert back == 19.5
        assert encoded.content == {"kind": "number", "value": 19.5}
        assert encoded.hints == ()


def test_what_a_notebook_begins_with_is_no_answer():
    parts = [wanted for question in CATALOGUE.everything.values() for wanted in question.parts]
    nothings = [(wanted, nothing) for wanted in parts for nothing in (None, ...)]
    stubs = ("", "   \n", "...", "Your answer here.", "your answer here")
    nothings += [(part("2.16", "comparison"), stub) for stub in stubs]
    nothings += [(SPECTRUM, lambda x, dt, value=value: value) for value in (None, ..., (None, None))]
    nothings += [(STATE_SPACE, lambda *p: (None, None, None, None)), (A, [[None] * 4] * 4)]
    nothings += [(K, (1.0, 2.0, ..., 4.0)), (K, {"row": [1.0, (2.0, ...)]}), (POLES, np.array([-1, ...], dtype=object))]
    nothings += [(SPECTRUM, lambda x, dt: ([0.0, 1.0], [x[0], ...])), (SWEEP, {"alpha": [...]})]
    for wanted, nothing in nothings:
        with pytest.raises(NotAnswered):
            encode(wanted, nothing, SEED)


def test_a_function_without_return_is_told_and_one_that_is_not_written_is_no_answer():
    def forgotten(x, dt):
        """Amplitudes."""
        2 * np.abs(np.fft.rfft(x)) / len(x)

    def unwritten(x, dt):
        """Amplitudes."""
        ...

    refused(SPECTRUM, forgotten, "return")
    with pytest.raises(NotAnswered):
        encode(SPECTRUM, unwritten, SEED)


@pytest.mark.parametrize(("wanted", "shape"), [(C, (4, 4)), (D, (4, 1)), (D, (4,))])
def test_of_the_outputs_of_all_states_those_asked_for_are_recorded_and_it_is_said(wanted, shape):
    given = np.arange(np.prod(shape)).reshape(shape)
    back, encoded = through_json(wanted, given)
    np.testing.assert_array_equal(back, given[:2].reshape(wanted.shape))
    assert encoded.hints == ("the rows for theta and alpha are recorded; the others are not asked for",)


@pytest.mark.parametrize(
    ("wanted", "value", "hint"),
    [
        (OMEGA_N, 3.17, "in hertz; give rad/s"),
        (OMEGA_N, 1140.0, "in degrees per second; give rad/s"),
        (OMEGA_N, 190.0, "in revolutions per minute"),
        (OMEGA_N, 0.347, "degrees and radians"),
        (OMEGA_N, 19900.0, "factor of 1000|degrees"),
        (OMEGA_N, 1e9, "unusually large for this plant"),
        (OMEGA_N, 1e-9, "unusually small for this plant"),
        (OMEGA_N, -19.9, "check the sign"),
        (part("2.12", "J_l"), 3.28, "in g·m²"),
        (part("2.12", "J_l"), 32.8, "in kg·cm²"),
        (part("2.12", "K_s"), 0.0329, "from a frequency in hertz"),
        (part("2.12", "K_s"), 0.0227, "per degree"),
        (number("T", "K", (250.0, 400.0), "", ""), 21, "in celsius; give K"),
        (number("rise", "K", (5.0, 60.0), "", ""), 21, None),
        (number("gain", "K/V", (4.0, 8.0), "", ""), 0.005, "per millivolt; give K/V"),
        (number("tau", "s", (100.0, 900.0), "", ""), 8, "in minutes; give s"),
        (number("zeta", "", (0.1, 1.0), "", ""), 60, "in percent"),
        (number("m", "kg", (0.1, 2.0), "", ""), 500, "in grams; give kg"),
        (number("p", "Pa", (5e4, 2e5), "", ""), 1.2, "in bar; give Pa"),
        (part("3.12", "t_s"), 380, "in milliseconds; give s"),
        (part("3.12", "alpha_max_deg"), 0.19, "in radians; give deg"),
        (part("3.12", "V_max"), 8600, "in millivolts; give V"),
        (part("3.12", "PO"), -2, "check the sign"),
        (part("3.12", "PO"), 0.035, "a fraction; give %"),
        (part("3.12", "PO"), 0.0, None),
        (part("0.1", "resolution"), 360 / 4096, "in degrees; give rad"),
        (part("0.1", "resolution"), 1 / 4096, None),
    ],
)
def test_a_slip_of_units_is_kept_and_hinted_at_without_the_value(wanted, value, hint):
    back, encoded = through_json(wanted, value)
    assert back == value
    if hint is None:
        assert encoded.hints == ()
    else:
        (said,) = encoded.hints
        assert re.search(hint, said)
        numbers = {float(number) for number in re.findall(r"[\d.]*\d", said)}
        assert numbers <= {180, 2, 1000}


NUMBERS = [[0, 0, 1, 0], [0, 0, 0, 1], [0, 671.7, -1.9, 0], [0, -1098.8, 1.9, 0]]


@pytest.mark.filterwarnings("ignore:the matrix subclass")
def test_a_matrix_is_taken_in_whatever_type_it_comes():
    array = np.array(NUMBERS)
    for value in (NUMBERS, tuple(map(tuple, NUMBERS)), array, np.matrix(NUMBERS), sympy.Matrix(NUMBERS), array + 0j):
        back, encoded = through_json(A, value)
        assert back.tolist() == array.tolist()
        assert show(A, encoded.content) == "A: 4 × 4 matrix"


FOUND = [0, -18.9, -8.09 + 27j, -8.09 - 27j]


def test_multiple_poles_of_sympys_eigenvalues_count_as_often_as_they_occur():
    back, _ = through_json(POLES, sympy.diag(-1, -1, -1, -2).eigenvals())
    assert sorted(back.real) == [-2, -1, -1, -1]


def test_values_are_shown_without_noise_from_rounding():
    noisy = [1.2e-14, -18.9, -8.09 + 27j, -8.09 - 27j]
    assert show(POLES, encode(POLES, noisy, SEED).content) == "poles = -18.9, -8.09 - 27j, -8.09 + 27j, 0"
    for value in ([-0.0, 0.0, -0.0, 0.0], [-1e-20, 0.0, -1e-20, 3.0]):
        assert show(K, encode(K, np.array([value]), SEED).content) == f"K = [0, 0, 0, {value[3]:g}]"


def test_prose_is_kept_as_it_is_and_counted():
    back, encoded = through_json(part("2.16", "comparison"), "  The model leads\r\nby 5 °. ")
    assert back == "The model leads\nby 5 °."
    assert through_json(part("2.16", "comparison"), "a\x00b\ud800c")[0] == "a\ufffdb\ufffdc"  # for a database
    assert show(part("2.16", "comparison"), encoded.content) == "comparison: 6 words"


def test_expressions_equations_and_matrices_of_them_come_back():
    K_s, J_eq, alpha, tau = sympy.symbols("K_s J_eq alpha tau")
    back, encoded = through_json(part("2.1", "V"), K_s * alpha**2 / 2)
    assert back == K_s * alpha**2 / 2
    assert show(part("2.1", "V"), encoded.content) == "V: expression in alpha, K_s"
    back, encoded = through_json(part("2.5", "equation"), sympy.Eq(K_s * alpha, tau))
    assert (back.lhs, back.rhs) == (K_s * alpha, tau)
    assert show(part("2.5", "equation"), encoded.content) == "equation: equation in alpha, tau, K_s"
    back, encoded = through_json(part("2.7", "B"), sympy.Matrix([0, 0, 1 / J_eq, -1 / J_eq]))
    assert back == sympy.Matrix([0, 0, 1 / J_eq, -1 / J_eq])
    assert show(part("2.7", "B"), encoded.content) == "B: 4 × 1 matrix in J_eq"
    assert through_json(part("2.7", "B"), [0, 0, 1 / J_eq, -1 / J_eq])[0] == back


def spectrum(x, dt):
    """Single-sided amplitudes by scipy, zero-padded to a power of two."""
    size = 2 ** int(np.ceil(np.log2(len(x))))
    return scipy.fft.rfftfreq(size, dt), 2 * np.abs(scipy.fft.rfft(x, size)) / len(x)


def test_a_probe_draws_the_same_inputs_from_a_seed_and_others_from_another():
    same, again, other = (COMPOUND_SINES.inputs(seed) for seed in (3, 3, 4))
    assert all(np.array_equal(a[0], b[0]) and a[1] == b[1] for a, b in zip(same, again, strict=True))
    assert not np.array_equal(same[0][0], other[0][0])


def test_the_outputs_of_a_spectrum_are_kept_up_to_10_hz():
    outputs, encoded = through_json(SPECTRUM, spectrum)
    assert len(outputs) == 4
    for (f, amplitude), (x, dt) in zip(outputs, COMPOUND_SINES.inputs(SEED), strict=True):
        f_all, amplitude_all = spectrum(x, dt)
        kept = f_all <= 10
        assert f == pytest.approx(f_all[kept], rel=1e-5)
        assert amplitude == pytest.approx(amplitude_all[kept], rel=1e-5)
    assert show(SPECTRUM, encoded.content) == "spectrum: a function, tried on 4 inputs"
    assert len(json.dumps(encoded.content)) < 30_000
    assert encode(SPECTRUM, lambda x, dt: np.array(spectrum(x, dt)), SEED) == encoded


def test_a_long_spectrum_is_thinned_out_as_documented():
    def fine(x, dt):
        return np.fft.rfftfreq(2**16, dt), 2 * np.abs(np.fft.rfft(x, 2**16)) / len(x)

    outputs, _ = through_json(SPECTRUM, fine)
    f_all = np.fft.rfftfreq(2**16, 0.002)
    f_all = f_all[f_all <= 10]
    assert outputs[1][0] == pytest.approx(f_all[thin(f_all.size, 600)], rel=1e-5)


def test_of_a_two_sided_spectrum_the_positive_half_is_kept():
    def two_sided(x, dt):
        return np.fft.fftfreq(len(x), dt), np.abs(np.fft.fft(x)) / len(x)

    outputs, _ = through_json(SPECTRUM, two_sided)
    for (f, _amplitude), (x, dt) in zip(outputs, COMPOUND_SINES.inputs(SEED), strict=True):
        f_all = np.fft.rfftfreq(len(x), dt)
        assert f == pytest.approx(f_all[f_all <= 10], rel=1e-5)


def test_a_function_gets_a_copy_of_its_inputs():
    def careless(x, dt):
        x *= 0
        return spectrum(x, dt)

    encode(SPECTRUM, careless, SEED)
    assert np.abs(COMPOUND_SINES.inputs(SEED)[0][0]).max() > 0.3


def test_a_state_space_function_is_kept_whatever_form_its_matrices_have():
    def lists(K_s, J_l, J_eq, B_eq):
        A = [[0, 0, 1, 0], [0, 0, 0, 1], [0, K_s, J_l, 0], [0, J_eq, B_eq, 0]]
        return A, [0, 0, 1, 2], [[1, 0, 0, 0], [0, 1, 0, 0]], [0, 0]

    def model(*parameters):
        a, b, c, d = lists(*parameters)
        return control.ss(a, np.reshape(b, (4, 1)), c, np.reshape(d, (2, 1)))

    outputs, encoded = through_json(STATE_SPACE, lists)
    assert [array.shape for array in outputs[0]] == [(4, 4), (4, 1), (2, 4), (2, 1)]
    drawn = [arguments[0] for arguments in PLANT_PARAMETERS.inputs(SEED)]
    assert [out[0][2, 1] for out in outputs] == pytest.approx(drawn, rel=1e-5)
    assert encode(STATE_SPACE, model, SEED) == encoded


def labelled(n=7500):
    figure = Figure()
    ax = figure.subplots()
    t = np.linspace(0, 15, n)
    ax.plot(t, np.sin(t), label="measured")
    ax.set(title="Sweep", xlabel="time (s)", ylabel="alpha (deg)")
    return figure


def test_a_figure_is_kept_by_its_labels_and_thinned_curves():
    back, encoded = through_json(FIGURE, labelled())
    (axes,) = back["axes"]
    assert (axes["title"], axes["xlabel"], axes["ylabel"]) == ("Sweep", "time (s)", "alpha (deg)")
    (line,) = axes["lines"]
    assert (line["label"], line["n"], line["x"].size) == ("measured", 7500, 200)
    assert (line["x"][0], line["x"][-1]) == (0, 15)
    assert line["y"] == pytest.approx(np.sin(line["x"]), abs=1e-4)
    assert encoded.hints == ()
    assert show(FIGURE, encoded.content) == "figure: 1 diagram, 1 curve"


def test_axes_lines_and_what_subplots_returns_stand_for_their_figure():
    figure = labelled()
    expected = encode(FIGURE, figure, SEED)
    ax = figure.axes[0]
    for value in (ax, [ax], np.array([ax]), (figure, ax), ax.lines[0], list(ax.lines)):
        assert encode(FIGURE, value, SEED) == expected


def test_a_part_of_a_subfigure_stands_for_the_whole_figure():
    figure = Figure()
    left, _ = figure.subfigures(1, 2)
    ax = left.subplots()
    ax.plot([0, 1, 2], [1, 2, 3])
    figure.supxlabel("time (s)")
    expected = encode(FIGURE, figure, SEED)
    assert expected.content["axes"][0]["xlabel"] == "time (s)"
    for value in (left, ax, ax.lines[0]):
        assert encode(FIGURE, value, SEED) == expected


def test_gaps_in_a_curve_are_left_out():
    figure = labelled()
    figure.axes[0].lines[0].set_data([0, 1, 2, 3], [0, np.nan, 2, np.inf])
    figure.axes[0].plot([0, 1, 2], [1, 2, 3], label="whole")
    line = through_json(FIGURE, figure)[0]["axes"][0]["lines"][0]
    assert line["x"].tolist() == [0, 2]


def test_the_fullest_figure_is_refused_before_the_file_grows_too_large():
    figure = Figure()
    rng = np.random.default_rng(1)
    for ax in figure.subplots(2, 4).ravel():
        ax.plot(rng.normal(size=(1000, 24)))
    refused(FIGURE, figure, "too large")


def recorded(n=7501, **metadata):
    t = 0.002 * np.arange(n)
    return Recording.of(t, {"experiment": "sweep", **metadata}, theta=np.cos(t), alpha=np.sin(t), vm=t)


def test_a_recording_is_kept_by_its_metadata_and_thinned_channels():
    recording = recorded(bench={"seed": 3})
    back, encoded = through_json(SWEEP, recording)
    assert back["metadata"] == {"experiment": "sweep", "bench": {"seed": 3}}
    assert (back["n"], back["sample_time"]) == (7501, pytest.approx(0.002))
    assert back["channels"].keys() == {"theta", "alpha", "vm"}
    alpha = back["channels"]["alpha"]
    assert alpha["unit"] == "rad"
    assert alpha["values"] == pytest.approx(recording["alpha"][thin(7501, 400)], rel=1e-5)
    assert encoded.hints == ()
    assert show(SWEEP, encoded.content) == "sweep: 15 s, 3 channels"
    assert len(json.dumps(encoded.content)) < 20_000


def test_channels_that_no_file_knows_are_left_out():
    t = np.arange(5) * 0.1
    extra = Recording(t, {"alpha": Channel(t, "rad"), "noise": Channel(t, "m")})
    assert through_json(SWEEP, extra)[0]["channels"].keys() == {"alpha"}


def plotted(count=1, **labels):
    figure = Figure()
    for ax in np.ravel(figure.subplots(count, 1)):
        ax.plot([0, 1, 2], [0, 1, 0])
        ax.set(**labels)
    return figure


def test_whatever_cannot_be_an_answer_is_refused():
    """Each message names what is asked for, and where what was given differs."""
    s, J, J_eq, K_s = sympy.symbols("s J J_eq K_s")
    stability, symbolic_B = part("3.1", "stability"), part("2.7", "B")
    ones, eye, zeros = np.ones(4), np.eye(2, 4), np.zeros(2)
    empty = Figure()
    empty.subplots()

    def matrix_with(hole):
        return [*NUMBERS[:2], [0, hole, 1, 0], NUMBERS[3]]

    table = [
        (OMEGA_N, "True or False", [True, np.bool_(True), [True]]),
        (OMEGA_N, "text", ["19.9", np.array(["19.9"])]),
        (OMEGA_N, "not finite", [np.nan, np.inf, sympy.zoo]),
        (OMEGA_N, "2 values", [[1.0, 2.0]]),
        (OMEGA_N, "not one number", [[[1, 2], [3]]]),
        (OMEGA_N, "complex", [19.9 + 1j]),
        (OMEGA_N, "K_s", [2 * K_s]),
        (A, "4 × 4 matrix; it is 3 × 4", [NUMBERS[:3]]),
        (A, "row of 3", [[1, 2, 3]]),
        (A, "rows differ", [[[1, 2], [3]]]),
        (A, "4 × 4 matrix; it is a (int|str)", [5, "eye"]),
        (A, "row 3, column 2: it is not finite", [matrix_with(np.nan)]),
        (A, "row 3, column 2 is still empty", [matrix_with(None)]),
        (A, "row 1, column 1: it still contains K_s", [sympy.Matrix(4, 4, lambda i, j: K_s)]),
        (B, "4 numbers; it is 2 × 2", [np.eye(2)]),
        (K, "4 numbers; it is a row of 3", [[1, 2, 3]]),
        (K, "function: call it", [lambda: [1, 2, 3, 4]]),
        (POLYNOMIAL, "5 numbers", [np.polynomial.Polynomial([1, 2, 1]), s**3 + 1, 1 / s]),
        (POLES, "there are 3", [FOUND[:3]]),
        (POLES, "pole 3: it is not finite", [[0, -18.9, np.nan, 1]]),
        (stability, "'stable', 'marginally stable', 'unstable'", ["perhaps", True]),
        (part("2.16", "comparison"), "a int", [42]),
        (symbolic_B, "row 3, column 1: it contains J, which .*: J_eq, J_l", [[0, 0, J, 1]]),
        (symbolic_B, "row 3, column 1 is still empty", [[0, 0, None, 1 / J_eq]]),
        (SPECTRUM, r"spectrum\(x, dt\) raised ZeroDivisionError: division by zero", [lambda x, dt: 1 / 0]),
        (SPECTRUM, "returned a ndarray", [lambda x, dt: x, lambda x, dt: np.array([x, x, x])]),
        (SPECTRUM, "it is a tuple: give the function", [spectrum(np.ones(8), 0.01)]),
        (SPECTRUM, "f_hz has 5 values and amplitude has 4", [lambda x, dt: (x[:5], x[:4])]),
        (SPECTRUM, "amplitude is complex", [lambda x, dt: (np.fft.rfftfreq(len(x), dt), np.fft.rfft(x))]),
        (SPECTRUM, "10 Hz", [lambda x, dt: (np.arange(100) * 1000 + 50, np.arange(100))]),
        (STATE_SPACE, "A is 3 × 3, not 4 × 4", [lambda *p: (np.eye(3), ones, eye, zeros)]),
        (STATE_SPACE, "D is a single number, not 2 × 1, for theta and alpha", [lambda *p: (np.eye(4), ones, eye, 1)]),
        (STATE_SPACE, "in discrete time", [lambda *p: control.ss(np.eye(4), np.ones((4, 1)), eye, 0, 0.002)]),
        (C, "2 × 4 matrix, for theta and alpha; it is 3 × 4", [np.eye(3, 4)]),
        (SWEEP, "Name the signals", [control.step_response(control.tf([1], [1, 1]))]),
        (FIGURE, "no curve", [Figure(), empty]),
        (FIGURE, "not a figure", [[1, 2, 3]]),
        (FIGURE, "9 diagrams; 8 at most", [plotted(9)]),
        (SWEEP, "a ndarray", [np.zeros((10, 2))]),
        (SWEEP, "lacks alpha; it has theta", [Recording.of(np.arange(5) * 0.1, theta=np.ones(5))]),
        (SWEEP, "metadata is not plain data", [recorded(note=note) for note in (object(), float("nan"))]),
        (SWEEP, "The metadata should have at most", [recorded(note="x" * 10_000)]),
        (part("2.15", "validation"), "lacks theta_model and alpha_model; it has theta, alpha, vm", [recorded()]),
    ]
    for wanted, fragment, values in table:
        for value in values:
            refused(wanted, value, fragment)


def test_what_may_be_a_slip_is_kept_with_a_hint():
    channels = dict.fromkeys(("theta_ref", "theta", "alpha", "vm"), np.ones(5))
    full = Recording.of(np.arange(5) * 0.1, {"experiment": "tracking", "feedback": "full"}, **channels)
    nameless, marked = labelled(), labelled()
    nameless.axes[0].plot([0, 1, 2], [0, 1, 0])
    marked.axes[0].axhline(1)
    for wanted, value, fragments in (
        (FIGURE, marked, []),
        (SWEEP, Recording.of(np.arange(5) * 0.1, alpha=np.ones(5)), []),  # from elsewhere: it says nothing
        (Part("x", "number", 1, "Any."), 1e30, []),
        (part("3.13", "response"), full, []),
        (POLES, [0, -18.9, -8.09 + 27j, -8.09 + 27j], ["conjugate"]),
        (FIGURE, plotted(xlabel="time"), ["x axis has no unit", "y axis has no label"]),
        (FIGURE, nameless, ["more than one curve"]),
        (SWEEP, recorded(experiment="tracking"), ["'tracking', where 'sweep'"]),
        (part("3.15", "response"), full, ["'full', where 'partial'"]),
    ):
        hints = encode(wanted, value, SEED).hints
        assert len(hints) == len(fragments)
        assert all(fragment in hint for fragment, hint in zip(fragments, hints, strict=True))


json_values = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=5)
    | st.sampled_from(["symbol", "add", "K_s"]),
    lambda inner: st.lists(inner, max_size=5) | st.dictionaries(st.sampled_from(["value", "kind", "lhs", "n"]), inner),
    max_leaves=12,
)
every_kind = [OMEGA_N, A, B, POLES, SPECTRUM, STATE_SPACE, FIGURE, SWEEP]
every_kind += [part(*where) for where in (("3.1", "stability"), ("2.16", "comparison"), ("2.1", "V"))]
every_kind += [part("2.4", "equation"), part("2.7", "A")]


@given(st.sampled_from(every_kind), json_values)
@settings(max_examples=100, deadline=None)
def test_reading_an_untrusted_answer_gives_a_value_or_an_answer_error(wanted, garbage):
    for content in (garbage, {"kind": wanted.kind, "value": garbage}, {"kind": wanted.kind, "outputs": [garbage] * 4}):
        try:
            decode(wanted, content)
        except AnswerError as error:
            assert len(str(error)) < 500


@pytest.mark.parametrize("given", ["30", 30, 30.0, np.int64(30)])
def test_a_choice_among_numbers_may_be_given_as_a_number(given):
    lost = part("4.7", "lost_ms")
    assert encode(lost, given, SEED).content["value"] == "30"
    with pytest.raises(FormError):
        encode(lost, 25, SEED)


GOOD = {FIGURE.name: encode(FIGURE, labelled(20), SEED).content, SWEEP.name: encode(SWEEP, recorded(20), SEED).content}


@pytest.mark.parametrize(
    ("wanted", "content"),
    [
        (OMEGA_N, {"kind": "number", "value": True}),
        (OMEGA_N, {"kind": "number", "value": float("nan")}),
        (OMEGA_N, {"kind": "number", "value": 10**400}),
        (OMEGA_N, {"kind": "number", "value": 19.9, "more": 1}),
        (OMEGA_N, {"kind": "matrix", "value": [[19.9]]}),
        (A, {"kind": "matrix", "value": [[0.0] * 4] * 5}),
        (A, {"kind": "matrix", "value": [[0.0] * 4] * 3 + [[0.0] * 3]}),
        (POLES, {"kind": "poles", "value": [[0, 0, 0]] * 4}),
        (part("3.1", "stability"), {"kind": "choice", "value": "perhaps"}),
        (part("2.16", "comparison"), {"kind": "prose", "value": "x" * (LONGEST_PROSE + 1)}),
        (part("2.16", "comparison"), {"kind": "prose", "value": "a\x00b"}),
        (part("2.1", "V"), {"kind": "expression", "value": ["symbol", "J_t"]}),
        (SPECTRUM, {"kind": "function", "outputs": [[[1.0, 2.0], [1.0]]] * 4}),
        (SPECTRUM, {"kind": "function", "outputs": [[[1.0] * 601, [1.0] * 601]] * 4}),
        (SPECTRUM, {"kind": "function", "outputs": [[[1.0, 2.0], [1.0, 2.0]]] * 3}),
        (FIGURE, {"kind": "figure", "axes": GOOD["figure"]["axes"] * 9}),
        (SWEEP, {**GOOD["sweep"], "n": 19}),
        (SWEEP, {**GOOD["sweep"], "sample_time": -1}),
        (SWEEP, {**GOOD["sweep"], "metadata": {"x": "y" * 5000}}),
        (SWEEP, {**GOOD["sweep"], "metadata": {"x": [float("inf")]}}),  # as JSON's 1e999 is read
        (SWEEP, {**GOOD["sweep"], "channels": {**GOOD["sweep"]["channels"], "x": {"unit": "m", "values": []}}}),
        (SWEEP, {**GOOD["sweep"], "channels": {"alpha": {"unit": "deg", "values": [0.0] * 20}}}),
    ],
)
def test_what_could_not_have_been_written_is_not_read(wanted, content):
    with pytest.raises(AnswerError):
        decode(wanted, schema.load(json.dumps(content).encode()))


class Quantity:
    """As pint's: a magnitude and a unit, of those that the test converts to."""

    def __init__(self, **magnitudes):
        self.magnitudes = magnitudes

    def to(self, unit):
        return SimpleNamespace(magnitude=self.magnitudes[unit])

    def to_base_units(self):
        return self.to("SI")


MEASURED = SimpleNamespace(nominal_value=19.9, std_dev=0.2)  # as ufloat(19.9, 0.2) of the package uncertainties


@pytest.mark.parametrize(
    ("wanted", "value", "said"),
    [
        (number("w", "rad/s", None, "", ""), Quantity(**{"rad/s": 19.9}), "w = 19.9 rad/s"),
        (number("J", "kg·m²", None, "", ""), Quantity(**{"kg·m²": 0.0033}), "J = 0.0033 kg·m²"),
        (number("T", "°C", None, "", ""), Quantity(**{"°C": 21.0}), "T = 21 °C"),
        (number("z", "", None, "", ""), Quantity(SI=0.6), "z = 0.6"),
        (number("w", "rad/s", None, "", ""), MEASURED, "w = 19.9 ± 0.2 rad/s"),
        (number("w", "rad/s", None, "", ""), Quantity(**{"rad/s": MEASURED}), "w = 19.9 ± 0.2 rad/s"),
        (matrix("A", (1, 2), "", ""), Quantity(SI=np.array([1.0, 2.0])), "A = [1, 2]"),
        (matrix("A", (1, 2), "", ""), [MEASURED, 3], "A = [19.9, 3]"),
        (poles("p", 2, "", ""), [MEASURED, -3], "p = -3, 19.9"),
        (poles("p", 2, "", ""), [Quantity(**{"1/s": -2.0}), -3], "p = -3, -2"),
    ],
)
def test_a_quantity_is_converted_and_an_uncertainty_is_stored_and_shown(wanted, value, said):
    content = encode(wanted, value, 1).content
    assert show(wanted, content) == said
    assert decode(wanted, content) is not None


@pytest.mark.parametrize("spread", [0.0, np.nan, np.inf, None, "0.2", -1.0])
def test_an_uncertainty_that_is_none_is_left_out(spread):
    value = SimpleNamespace(nominal_value=19.9, std_dev=spread)
    assert encode(number("w", "rad/s", None, "", ""), value, 1).content == {"kind": "number", "value": 19.9}


def test_a_quantity_of_another_kind_is_refused_with_the_unit_that_is_asked_for():
    with pytest.raises(FormError, match="rad/s"):
        encode(number("w", "rad/s", None, "", ""), Quantity(V=1.0), 1)
