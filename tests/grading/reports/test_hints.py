"""What class-mates have in common: found where somebody copied, hardly ever by chance, never in a group."""

import json
from dataclasses import replace
from datetime import UTC, datetime
from hashlib import sha256
from types import SimpleNamespace

import numpy as np
import pytest
from gradebooks import facts, graded, mark, record
from hypothesis import given as given_of
from hypothesis import strategies as st
from made_courses import OURS

from labcourse.answers.forms import encode_recording
from labcourse.benches import SAME, THEIR_OWN, BenchPolicy
from labcourse.errors import GradingError
from labcourse.grading.gradebook import Delivery
from labcourse.grading.marking.checks import ForAPerson, Number
from labcourse.grading.marks import Mark, Status
from labcourse.grading.reports import hints
from labcourse.grading.reports.grades import Reports
from labcourse.grading.reports.hints import ComparedWork, Hint, Likeness
from labcourse.grading.verdicts import OwnBench
from rotflex import experiments, hil
from rotflex.course.questions import CATALOGUE
from rotflex.hil.student_benches import student_seed

X, Y, Z = ("1.1", "x"), ("1.2", "y"), ("1.2", "z")
PARTS = {
    X: OwnBench(lambda bench: bench.x, 0.035, is_discriminating=False),
    Y: OwnBench(lambda bench: bench.y, 0.002),
    Z: OwnBench(lambda bench: bench.z, 0.07),
}
STEP = 0.38  # of the scale that x is read off


def right(name, random):
    """A student with a bench of their own, who measured on it: x off a scale, z with its square."""
    bench = {X: 18.0 * 1.53 ** random.uniform(), Y: 3e-3 * 1.45 ** random.uniform()}
    bench[Z] = bench[Y] * bench[X] ** 2
    x = STEP * round(bench[X] / STEP)
    given = {X: x, Y: bench[Y], Z: bench[Y] * x**2}
    return ComparedWork(name, bench=bench, given=given, right=frozenset(PARTS))


def answering(one, wrong, **given):
    changed = {**one.given, **{where: given[where[1]] for where in PARTS if where[1] in given}}
    return replace(one, given=changed, right=one.right - set(wrong), wrong=frozenset(wrong))


CLASS = [right(f"s{number:03}", random) for random in [np.random.default_rng(5)] for number in range(300)]


def evidence(*students):
    return [hint.evidence for hint in hints.fitting_numbers(students, PARTS)]


def test_a_class_of_300_gets_no_hint_where_all_are_right_and_few_by_chance():
    """Every fourth student is wrong somewhere by a slip of their own; of 75, three at most look like a copy."""
    assert evidence(*CLASS) == []
    random = np.random.default_rng(6)
    slips = [
        lambda one: answering(one, {X, Z}, x=one.given[X] * random.uniform(0.7, 1.3), z=one.given[Z] * 1.3),
        lambda one: answering(one, {Y, Z}, y=one.given[Y] * random.uniform(0.8, 1.2), z=one.given[Z] * 1.2),
        lambda one: answering(one, {Z}, z=one.given[Z] / 39.478),
        lambda one: answering(one, {Y}, y=float(f"{one.given[Y] * random.uniform(0.9, 1.1):.3g}")),
    ]
    those = [slips[number % 4](one) if number % 4 == number // 4 % 4 else one for number, one in enumerate(CLASS)]
    assert sum(bool(one.wrong) for one in those) == 75
    assert len({hint.students[0] for hint in hints.fitting_numbers(those, PARTS)}) <= 3


@given_of(friend=st.sampled_from(CLASS), one=st.sampled_from(CLASS))
def test_whoever_copies_all_numbers_is_named_with_each_that_says_something_but_not_for_a_shared_bench(friend, one):
    copier = answering(one, PARTS, **{where[1]: friend.given[where] for where in PARTS})
    everybody = [other for other in CLASS if other.student not in (friend.student, one.student)]
    found = hints.fitting_numbers([*everybody, friend, copier], PARTS)
    alone = [hint.students for hint in found if "and the right answer of" in hint.evidence]
    assert alone == ([] if friend is one else 2 * [(one.student, friend.student)])
    assert {hint.students[0] for hint in found} <= {one.student}


def test_a_number_in_two_digits_is_no_hint_but_several_may_fit_a_bench_together():
    friend, one, *_ = CLASS
    x, z = (float(f"{friend.given[where]:.2g}") for where in (X, Z))
    assert evidence(answering(friend, set(), z=z), answering(one, {Z}, z=z)) == []
    both = replace(one, given={X: x, Z: z}, right=frozenset(), wrong=frozenset({X, Z}))
    (line,) = evidence(friend, both)
    assert line.startswith(f"s001: 1.1 x = {x:g}, 1.2 z = {z:g} ") and "s000" in line
    assert evidence(friend, replace(both, given={X: x}, wrong=frozenset({X}))) == []
    near = replace(friend, student="near", bench={where: 1.0001 * value for where, value in friend.bench.items()})
    assert evidence(replace(near, right=frozenset()), answering(friend, {X, Z})) == []


def test_a_number_that_three_have_says_nothing_and_neither_does_one_that_is_wrong_for_both_or_right_for_both():
    first, second, third, one, *_ = CLASS
    alike = [answering(other, set(), z=1.2345) for other in (first, second, third)]
    copier = answering(one, {Z}, z=1.2345)
    assert evidence(*alike, copier) == [] and len(evidence(*alike[:2], copier)) == 2
    assert evidence(answering(first, {Z}, z=1.2345), copier) == []
    assert evidence(first, answering(one, set(), z=first.given[Z])) == []


def test_in_this_course_what_is_measured_on_the_own_bench_is_compared():
    parts = hints.measured_parts(OURS.key)
    assert {where: own.is_discriminating for where, own in parts.items()} == {
        ("2.11", "omega_n"): False,
        ("2.12", "J_l"): True,
        ("2.12", "K_s"): True,
    }
    bench = OURS.true_bench("ada")
    assert [parts[where].expected(bench) for where in parts] == [bench.omega_n, bench.J_l, bench.K_s]


(SWEEP,) = (part for part in CATALOGUE.find("2.9").parts if part.kind == "recording")


def sweep_of(name, run=1):
    with hil.open("virtual", seed=student_seed(name), run=run) as bench:
        recording = experiments.sweep(bench, f_start=1.0, f_stop=5.0, duration=3.0, progress=False)
    return {"kind": "recording", **encode_recording(SWEEP, recording)[0]}


def book_with(student, answers):
    about = {"format": 2, "student": student, "bench": {}, "software": "rotflex 0", "probe_seed": 7}
    return json.dumps({**about, "answers": answers}).encode()


def recorded(student, recording, group="", policy=THEIR_OWN, at_home=None):
    here, there = (one and book_with(student, {"2.9": {"sweep": one}}) for one in (recording, at_home))
    run = graded(student, answers=here, cells=facts(bench_of=group or student, policy=policy))
    return hints.handed_in(run, {"answers.json": there} if there else {})


def pairs(*everybody):
    return [hint.students for hint in hints.equal_recordings(everybody)]


@pytest.fixture(scope="module")
def sweeps():
    return {f"s{number:02}": sweep_of(f"s{number:02}") for number in range(20)}


def test_the_recordings_of_twenty_benches_are_all_different_and_each_copy_is_found(sweeps):
    everybody = [recorded(name, recording) for name, recording in sweeps.items()]
    assert pairs(*everybody) == []
    names = list(sweeps)
    copies = {names[2 * number + 1]: names[2 * number] for number in range(10)}
    taken = {**sweeps, **{copier: sweeps[mate] for copier, mate in copies.items()}}
    found = pairs(*(recorded(name, recording) for name, recording in taken.items()))
    assert {frozenset(pair) for pair in found} == {frozenset(pair) for pair in copies.items()}


def test_a_copy_is_found_with_other_metadata_and_recorded_at_home(sweeps):
    recording = sweeps["s00"]
    copy = {**recording, "metadata": {**recording["metadata"], "bench": {"uri": "mine"}}}
    (hint,) = hints.equal_recordings([recorded("ada", recording), recorded("bob", sweeps["s01"], at_home=copy)])
    assert hint.students == ("ada", "bob") and "2.9 sweep" in hint.evidence


def test_a_group_one_bench_for_all_another_run_and_a_simulation_are_no_hint(sweeps):
    one = sweeps["s00"]
    assert pairs(recorded("ada", one, "Ada"), recorded("bob", one, "ada")) == []
    everybody = BenchPolicy(which=SAME, seed=7)
    assert pairs(recorded("ada", one, policy=everybody), recorded("bob", one, policy=everybody)) == []
    assert pairs(recorded("ada", one), recorded("bob", sweep_of("s00", run=2))) == []
    simulated = {**one, "metadata": {"source": "a model"}}
    assert pairs(recorded("ada", simulated), recorded("bob", simulated)) == []
    still = {**one, "channels": {name: {**old, "values": [0.0] * 400} for name, old in one["channels"].items()}}
    assert pairs(recorded("ada", still), recorded("bob", still)) == []


@pytest.mark.parametrize(
    "change",
    [
        {"metadata": 7},
        {"channels": 7},
        {"channels": {}},
        *({"channels": {"alpha": one}} for one in (7, {"values": 7}, {"values": [[1, 2], [3]]}, {"values": []})),
    ],
)
def test_what_has_not_the_form_of_a_recording_is_passed_over(sweeps, change):
    odd = {**sweeps["s00"], **change}
    assert pairs(recorded("ada", odd), recorded("bob", odd), recorded("eve", None)) == []


def of_bench(student, bench_of="", **files):
    kept = {f"recordings/{name}.mat": content for name, content in files.items()}
    return hints.handed_in(graded(student, cells=facts(student, bench_of=bench_of)), kept)


def having(student, handed_out=(), **files):
    return hints.handed_in(graded(student), {name.replace("_", "."): data for name, data in files.items()}, handed_out)


def lines(*everybody):
    return [hint.evidence for hint in hints.equal_files(everybody)]


def test_equal_files_are_named_once_for_all_who_have_them_whatever_their_names():
    everybody = [
        of_bench("ada", a=b"1", b=b"2", c=b"4"),
        of_bench("bob", x=b"1", y=b"2"),
        of_bench("eve", c=b"3"),
        of_bench("dan", d=b"4"),
    ]
    first, second = hints.equal_files(everybody)
    assert (first.students, second.students) == (("ada", "bob"), ("ada", "dan"))
    assert "2 files: recordings/a.mat" in first.evidence and "1 file: recordings/c.mat" in second.evidence


def test_a_group_is_no_hint_but_a_third_with_their_file_is():
    pair = [of_bench("ada", "Ada", a=b"1"), of_bench("bob", "ada", a=b"1")]
    assert lines(*pair) == []
    (line,) = lines(*pair, of_bench("eve", a=b"1"))
    assert line.startswith("ada, bob, eve ")
    assert [len(lines(*(having(f"s{n}", a_py=b"x") for n in range(size)))) for size in (5, 6)] == [1, 0]


def test_files_of_the_course_empty_ones_and_what_was_handed_out_are_no_hint():
    files = {"answers_json": b"{}", "course_json": b"{}", "empty_txt": b"", "data_csv": b"1, 2"}
    given = {hints.digest(b"1, 2")}
    assert lines(having("ada", given, **files), having("bob", given, **files)) == []
    (line,) = lines(having("ada", **files), having("bob", **files))
    assert "1 file: data.csv" in line


BENCHES = {"ada": 1.0, "bob": 2.0, "cleo": 3.0, "dan": 4.0}
WHEN = datetime(2026, 3, 2, 12, tzinfo=UTC)


@pytest.fixture
def course():
    """A course with one measured number; a student's name decides the bench, and some have none."""
    known = Number("it", lambda bench: bench.size, 0.01, own_bench=OwnBench(lambda bench: bench.size, 0.01))
    key = {"2.11": {"omega_n": known, "explanation": ForAPerson()}}
    return replace(OURS, key=key, bench=lambda student, policy: SimpleNamespace(size=BENCHES[student]))


def answered(student, value, status, bench_of=""):
    content = book_with(student, {"2.11": {"omega_n": {"kind": "number", "value": value}}})
    marks = Mark("2.11", "omega_n", status, 0.0, 2.0, "Well.", "")
    return graded(student, marks, answers=content, cells=facts(student, bench_of=bench_of, policy=BenchPolicy()))


def deliver(book, student, content, name="own.py"):
    book.deliver(student, [Delivery(name, sha256(content).hexdigest(), content, WHEN, "a zip")])


def test_hints_are_a_page_with_an_entry_for_each_pair_and_data_and_go_when_there_is_nothing(book, course, tmp_path):
    record(book, answered("ada", 1.003, Status.RIGHT), answered("bob", 1.003, Status.WRONG))
    for student in ("ada", "bob"):
        deliver(book, student, b"x = 1")
    reports, file = Reports(tmp_path / "out", course, book), tmp_path / "out" / "hints.md"
    reports.write_all()
    assert [str(file) in line for line in reports.notices()] == [True, True]
    said = file.read_text(encoding="utf-8")
    assert "hint, never a verdict" in said and said.count("## ada, bob\n") == said.count("## ") == 1
    assert "bob: 2.11 omega_n = 1.003 is wrong" in said and "the right answer of ada." in said and "own.py" in said
    file.write_text("## eve, dan\n* Nobody reads this.\n", encoding="utf-8")
    number = Hint(Likeness.RIGHT_ELSEWHERE, ("bob", "ada"), ("2.11 omega_n",), (1.003,))
    assert hints.read(file.parent) == [number, Hint(Likeness.FILES, ("ada", "bob"), ("own.py",))]
    file.with_suffix(".json").write_text("[{}]", encoding="utf-8")
    with pytest.raises(GradingError, match=r"hints\.json cannot be read"):
        hints.read(file.parent)
    record(book, answered("bob", 2.0, Status.RIGHT))
    deliver(book, "bob", b"y = 2")
    reports.write_all()
    assert not file.exists() and hints.read(file.parent) == list(reports.notices()) == []


def test_a_pair_that_hands_in_together_is_no_hint_and_neither_are_answers_that_cannot_be_read(book, course):
    record(book, answered("cleo", 3.012, Status.RIGHT), answered("dan", 3.012, Status.WRONG, bench_of="cleo"))
    record(book, graded("bob", mark(), answers=b"not json"), answered("eve", 3.012, Status.WRONG))  # eve has no bench
    for student, content, name in (("cleo", b"x", "a.py"), ("dan", b"x", "a.py"), ("bob", b"{}", "01.ipynb")):
        deliver(book, student, content, name)
    deliver(book, "eve", b"{}", "01.ipynb")  # and equal notebooks say nothing
    work = hints.works(book, course)
    assert hints.compared([work(one) for one in book.all_current()], course) == []
