"""Claims and marks: what is read, what it is worth, and why. Expected marks follow from solutions/key.py's policy."""

import json
import math
import sys
from dataclasses import replace
from pathlib import Path

import matplotlib.figure
import numpy as np
import pytest
from made_courses import OURS, loaded

import rotflex.course.lab
from labcourse.answers import forms
from labcourse.benches import BenchPolicy
from labcourse.errors import GradingError
from labcourse.grading import course as courses
from labcourse.grading.marking import decoding, marking
from labcourse.grading.marking import marking_processes as marker
from labcourse.grading.marking.checks import ForAPerson, Number, RecordingOf
from labcourse.grading.marks import Status
from labcourse.grading.submission import Submission
from labcourse.grading.verdicts import Case, right
from labcourse.problems import Code, Problem
from rotflex import hil, model
from rotflex.course.questions import CATALOGUE
from rotflex.experiments import sweep
from rotflex.hil.student_benches import student_seed
from solutions.true_bench import TrueBench

SEED = 2024
SUBMISSION = Submission(student="ada", probe_seed=SEED)
SWEEP, SPECTRUM_PLOT = ("2.9", "sweep"), ("2.10", "figure")
RIGHT, WRONG = Status.RIGHT, Status.WRONG


def only(key):
    return replace(OURS, key=key)


@pytest.fixture(scope="module")
def key():
    """The real key, as far as these tests know what to expect of it."""
    return only({number: OURS.key[number] for number in ("0.1", "2.9", "2.10", "2.11", "2.12")})


@pytest.fixture(scope="module")
def bench():
    return TrueBench("ada")  # runs its sweep once, when it is first asked for


def file(contents, **changes):
    """The bytes of an answers.json with plain data for (question, part)."""
    book = {"format": 2, "student": "ada", "bench": {"uri": "virtual"}, "software": "rotflex", "probe_seed": SEED}
    answers = {}
    for (question, part), content in contents.items():
        answers.setdefault(question, {})[part] = content
    return json.dumps({**book, "answers": answers} | changes).encode()


def claims(values, **changes):
    contents = {
        (question, part): forms.encode(CATALOGUE.find(question).part(part), value, SEED).content
        for (question, part), value in values.items()
    }
    return decoding.decode(file(contents, **changes), SEED, CATALOGUE)


@pytest.fixture
def marks(key, bench):
    def mark(values, course=None, **changes):
        found = marking.mark(course or key, claims(values, **changes), bench, SUBMISSION)
        return {(mark.question, mark.part): mark for mark in found}

    return mark


NUMBER = {"kind": "number", "value": 19.9}
OMEGA = ("2.11", "omega_n")


@pytest.mark.parametrize(
    "data",
    [
        b"",
        file({OMEGA: NUMBER}).replace(b"19.9", b"NaN"),
        file({OMEGA: NUMBER}).replace(b"19.9", b"1e999"),
    ],
    ids=["empty", "no number", "beyond all numbers"],
)
def test_a_file_that_no_answer_writes_is_refused_as_a_whole(data):
    read = decoding.decode(data, SEED, CATALOGUE)
    assert read.values == {}
    assert [problem.code for problem in read.problems] == [Code.ANSWERS_UNREAD]


@pytest.mark.parametrize(
    "content",
    [
        {"kind": "number", "value": "19.9"},
        {"kind": "number", "value": True},
        {"kind": "prose", "value": "19.9"},
        {"value": 19.9},
        {"kind": "number", "value": 19.9, "right": True},
    ],
)
def test_an_answer_of_another_form_is_malformed_and_wrong_and_the_others_count(content, key, bench):
    read = decoding.decode(
        file({OMEGA: content, ("2.12", "J_l"): {"kind": "number", "value": bench.J_l}}), SEED, CATALOGUE
    )
    found = {(mark.question, mark.part): mark for mark in marking.mark(key, read, bench, SUBMISSION)}
    assert (found[OMEGA].status, found[OMEGA].points) == (WRONG, 0)
    assert found[OMEGA].reason == Problem.of(Code.MALFORMED, error=read.malformed[OMEGA])
    assert found["2.12", "J_l"].points == 1


def test_outputs_on_other_inputs_than_those_drawn_do_not_count():
    values = {("2.10", "spectrum"): amplitude_spectrum}
    assert ("2.10", "spectrum") in claims(values).values
    assert ("2.10", "spectrum") in claims(values, probe_seed=SEED + 1).malformed


def test_what_is_not_there_is_missing_and_earns_nothing(marks):
    found = marks({}).values()
    assert {mark.status for mark in found} == {Status.MISSING}
    assert sum(mark.points for mark in found) == 0
    assert sum(mark.out_of for mark in found) == 11


def sweep_of(student, **run):
    with hil.open("virtual", seed=student_seed(student), **run) as opened:
        return sweep(opened, progress=False)


@pytest.fixture(scope="module")
def own_sweep():
    return sweep_of("ada")


@pytest.fixture(scope="module")
def others_sweep():
    return sweep_of("bob")


def drawn(x, y, xlabel="time (s)", ylabel="alpha (deg)"):
    figure = matplotlib.figure.Figure()
    axes = figure.subplots()
    axes.plot(x, y)
    axes.set(xlabel=xlabel, ylabel=ylabel)
    return figure


def test_a_recording_of_ones_own_bench_is_right_and_another_ones_is_not(marks, own_sweep, others_sweep):
    assert marks({SWEEP: own_sweep})[SWEEP].status is RIGHT
    assert marks({SWEEP: others_sweep})[SWEEP].status is WRONG


def test_a_recording_is_held_against_the_run_that_it_says_it_is(bench):
    """A tighter tolerance than the key's, which two runs of one bench may both keep."""
    strict = RecordingOf(lambda bench, run: bench.sweep(run), channel="alpha", rtol=1e-4, runs=True)
    part, case = CATALOGUE.find("2.9").part("sweep"), Case(bench, lambda question, part: {}[question], SEED)
    value = forms.decode(part, forms.encode(part, sweep_of("ada", run=2), SEED).content)
    assert strict.verdict(part, value, case).status is RIGHT
    value["metadata"]["bench"]["run"] = 1
    assert strict.verdict(part, value, case).status is WRONG
    del value["metadata"]["bench"]["run"]  # as of a release that knew no runs
    assert strict.verdict(part, value, case).status is WRONG


@pytest.mark.parametrize("inside", [2, 4])
def test_points_at_the_peaks_frequency_alone_are_no_spectrum(marks, own_sweep, inside):
    """A flat line, and one that stands in the right place and falls off nowhere: nobody has computed these."""
    f, amplitude = amplitude_spectrum(own_sweep.degrees("alpha"), 0.002)
    peak = f[np.argmax(np.where((f > 2) & (f < 4.5), amplitude, 0.0))]
    for x in (np.full(50, peak), np.r_[0.0, np.linspace(peak, peak * (1 + 0.01 * inside), 50)]):
        for y in (np.zeros(x.size), np.ones(x.size), np.r_[0.0, np.ones(x.size - 1)]):
            assert marks({SPECTRUM_PLOT: drawn(x, y, "f (Hz)", "amplitude (deg)")})[SPECTRUM_PLOT].status is WRONG


def amplitude_spectrum(x, dt, padded=None, factor=2.0):
    f = np.fft.rfftfreq(padded or len(x), dt)
    return f, factor * np.abs(np.fft.rfft(x, padded)) / len(x)


def test_a_check_that_fails_on_an_odd_claim_leaves_it_to_a_person_and_the_others_count(bench):
    broken, sound = Number("x", lambda bench: float("?"), 0.1), Number("x", lambda bench: bench.K_s, 0.1)
    key = {"2.12": {"J_l": broken, "K_s": sound}}
    found = marking.mark(only(key), claims({("2.12", "J_l"): 1.0, ("2.12", "K_s"): bench.K_s}), bench, SUBMISSION)
    assert [(mark.status, mark.points) for mark in found] == [(Status.FOR_A_PERSON, 0), (RIGHT, 2)]
    assert found[0].reason.code is Code.NOT_COMPARED and "ValueError" in found[0].reason.parameters["error"]


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("KEY = {'7.7': {}}", "'7.7'"),
        ("KEY = {'2.11': {'explanation': ForAPerson()}}", "checks for explanation\\."),
        ("KEY = {'2.11': {name: ForAPerson() for name in ('omega_n', 'explanation', 'why')}}", "explanation, why"),
        ("KEY = {'2.11': {'omega_n': ForAPerson(), 'explanation': ForAPerson()}}", "2.11, omega_n is a number"),
        ("KEY = {'2.11': nonsense}", "NameError.*nonsense"),
    ],
    ids=["no such question", "a part left out", "a part too many", "check of another kind", "a slip"],
)
def test_a_key_that_does_not_fit_the_catalogue_is_refused(tmp_path, body, words):
    with pytest.raises(GradingError, match=words):
        loaded(tmp_path, key=f"from labcourse.grading.marking.checks import *\n{body}\n")


def test_a_course_that_is_not_there_is_said_to_be_missing_and_how_to_name_one(tmp_path):
    with pytest.raises(GradingError, match=r"no course\.py.*--solutions FOLDER.*LABCOURSE_SOLUTIONS"):
        courses.load(tmp_path)


def test_answers_that_the_key_does_not_mark_are_noted():
    key = {"2.11": {"omega_n": Number("x", lambda bench: 1, 0.1), "explanation": ForAPerson()}}
    read = claims({OMEGA: 1.0, ("2.12", "J_l"): 1.0})
    assert marking.unmarked(key, read) == [Problem.of(Code.NOT_IN_KEY, "2.12")]


def test_feedback_shows_the_students_own_expression_and_equation():
    import sympy

    K_s, alpha = sympy.symbols("K_s alpha")

    def shown(question, part, value):
        read = decoding.Claims(values={(question, part): value}, contents={(question, part): {}})
        return marking._as_text(CATALOGUE.find(question).part(part), read, (question, part))

    assert shown("2.1", "V", K_s * alpha**2 / 2) == "K_s*alpha**2/2"
    assert shown("2.5", "equation", sympy.Eq(K_s * alpha, 0, evaluate=False)) == "K_s*alpha = 0"
    assert len(shown("2.1", "V", sympy.Add(*sympy.symbols("long_name_of_a_symbol_1:60")))) <= 301


class Perhaps:
    """A check that finds it right that there is no answer, or not."""

    kinds = ("number",)

    def __init__(self, finds):
        self.missing = lambda part, case: finds()


def fails():
    raise ArithmeticError("on what there is")


@pytest.mark.parametrize(
    ("finds", "status", "points", "reason"),
    [
        (lambda: right("There is none to give."), Status.RIGHT, 2.0, "There is none to give."),
        (lambda: None, Status.MISSING, 0.0, Problem.of(Code.NOT_IN_THE_RUN)),
        (fails, Status.MISSING, 0.0, Problem.of(Code.NOT_IN_THE_RUN)),
    ],
)
def test_a_check_may_find_it_right_that_there_is_no_answer(bench, finds, status, points, reason):
    question = CATALOGUE.find("2.11")
    key = {"2.11": {part.name: Perhaps(finds) if part.name == "omega_n" else ForAPerson() for part in question.parts}}
    claims = decoding.Claims()
    marks = marking.mark(replace(OURS, key=key), claims, bench, Submission(student="ada", probe_seed=7))
    found = [(one.status, one.points, one.reason) for one in marks if one.part == "omega_n"]
    assert found == [(status, points, reason)]


def test_a_fault_of_a_check_that_looks_at_a_missing_answer_is_a_fault_of_the_key(bench):
    question = CATALOGUE.find("2.11")
    key = {"2.11": {part.name: Perhaps(lambda: 1 + "1") for part in question.parts}}
    claims = decoding.Claims()
    marks = marking.mark(replace(OURS, key=key), claims, bench, Submission(student="ada", probe_seed=7))
    assert {one.status for one in marks} == {Status.NOT_MARKED}
    assert {one.reason for one in marks} == {Problem.of(Code.KEY_HAS_FAULT)}
    failed = [(one.code, one.parameters["question"], one.parameters["part"]) for one in claims.problems]
    assert failed == [(Code.KEY_FAILED, "2.11", part.name) for part in question.parts]
    assert all(one.parameters["error"].startswith("TypeError: ") for one in claims.problems)


def test_a_fault_of_the_key_in_a_library_names_the_courses_line(bench):
    question = CATALOGUE.find("2.11")
    key = {"2.11": {part.name: Perhaps(lambda: np.linalg.det([["a"]])) for part in question.parts}}
    claims = decoding.Claims()
    course = replace(OURS, key=key, folder=Path(__file__).parent)
    marking.mark(course, claims, bench, Submission(student="ada", probe_seed=7))
    assert claims.problems and all("(test_marking.py, line " in one.parameters["error"] for one in claims.problems)


OWN_BENCH = BenchPolicy(draw=OURS.draw)
MATRICES = [("2.14", name) for name in "ABCD"]


@pytest.fixture
def answers_with(tmp_path):
    def of(K_s):
        lab = rotflex.course.lab.start("ada", folder=tmp_path)
        lab.answer("2.12", J_l=lab.joint.J_l, K_s=K_s)
        made = model.state_space(lab.servo, lab.joint, K_s, input="torque", link_damping=0.0)
        lab.answer("2.14", **{name: getattr(made, name) for name in "ABCD"})
        return (tmp_path / "answers.json").read_bytes(), lab.book.probe_seed

    return of


def marks_given(answers_with, asked=None):
    data, seed = answers_with
    marker._courses[:] = [OURS]
    submission = Submission(student="ada", answers=data, probe_seed=seed, asked=asked, policy=OWN_BENCH)
    marks, _problems, _notes = marker._mark_answers(submission)
    return {(one.question, one.part): one.status for one in marks}


def test_what_a_student_claims_in_place_of_what_is_given_counts_for_nothing(answers_with):
    claimed = answers_with(2.6)
    assert marks_given(claimed)["2.14", "A"] == Status.FOLLOW_THROUGH  # who was asked for it: it follows
    given = marks_given(claimed, MATRICES)
    assert set(given) == set(MATRICES) and given["2.14", "A"] == Status.WRONG


@pytest.mark.parametrize(
    ("limit", "K_s", "status"),
    [
        (math.inf, 1e6, Status.FOLLOW_THROUGH),
        (100.0, 1e6, Status.FOR_A_PERSON),
        (100.0, 1e-6, Status.FOR_A_PERSON),
        (100.0, 2.6, Status.FOLLOW_THROUGH),
    ],
)
def test_beyond_the_limit_of_a_course_what_follows_waits_for_a_person(answers_with, monkeypatch, limit, K_s, status):
    monkeypatch.setattr(sys.modules[__name__], "OURS", replace(OURS, follow_limit=limit))
    assert marks_given(answers_with(K_s))["2.14", "A"] is status


@pytest.mark.parametrize(("value", "is_absurd"), [(-1.3, True), (1.3, False), (1e5, True), (1e-3, True)])
def test_a_number_of_the_wrong_sign_is_absurd(value, is_absurd):
    assert marking.is_absurd(replace(OURS, follow_limit=100.0), ("2.12", "K_s"), value) is is_absurd
    assert not marking.is_absurd(OURS, ("2.12", "K_s"), value)


def test_what_follows_from_what_is_given_is_right(answers_with):
    values = OURS.given_values("ada", OWN_BENCH, MATRICES)
    found = marks_given(answers_with(values["2.12", "K_s"]), MATRICES)
    assert set(found.values()) == {Status.RIGHT}
