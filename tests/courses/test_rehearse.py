"""``rehearse`` on spoilt copies of the course of a mass on a spring: what shows on some benches, or elsewhere only."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from labcourse.answers.parts import Predictable, number
from labcourse.grading import course_check, rehearse
from labcourse.grading.marking import marking
from labcourse.grading.marking.checks import Number
from labcourse.grading.marking.decoding import Claims
from labcourse.grading.marks import Status
from labcourse.grading.running import bundle
from labcourse.grading.verdicts import Case, right

MASS = 0.5  # kg
STUDENTS = ("rehearsal-1", "rehearsal-2")


@pytest.fixture(scope="module")
def solved(course):
    """The course, and the answers of its solutions on the benches of two students; of the first, of two runs."""
    released = bundle.build(course)
    return course, [
        course_check.answers_of_solutions(course, released, student) for student in (*STUDENTS, STUDENTS[0])
    ]


def spoilt_key(course, **checks):
    """Return the course with other checks in its key: run, k, formula or omega."""
    key = {
        question: {part: checks.get(part, check) for part, check in parts.items()}
        for question, parts in course.key.items()
    }
    return replace(course, key=key)


def faults(course, runs, student=STUDENTS[0]):
    found = rehearse.check_bench(course, student, runs[STUDENTS.index(student)])
    return [(fault.where.split(" (")[0], fault.what) for fault in found if not fault.is_note]


@pytest.mark.usefixtures("sandbox")
def test_nothing_is_found_in_a_course_that_fits(solved):
    course, runs = solved
    assert [faults(course, runs, student) for student in STUDENTS] == [[], []]
    assert [*rehearse.differences(runs[0][0], runs[2][0])] == []


def omega(**options):
    given = {"rtol": 0.02, "follow": lambda own: math.sqrt(own("1.2", "k") / MASS)}
    return {"omega": Number("the natural frequency", lambda bench: bench.omega, **(given | options))}


K = {"what": "the stiffness", "expected": lambda bench: bench.k, "rtol": 0.05}


class AlwaysRight:
    """A check that gives points for nothing."""

    kinds = ("number",)

    def verdict(self, part, value, case):
        return right("Fine.")

    def missing(self, part, case):
        return right("Never mind.")


@pytest.mark.usefixtures("sandbox")
@pytest.mark.parametrize(
    ("checks", "place", "cause"),
    [
        (omega(follow=lambda own: math.sqrt(own("1.2", "k"))), "1.3 omega", "follow"),
        (omega(follow=lambda own: own("1.2", "k") / 0), "1.3 omega", "ZeroDivisionError"),
        (omega(follow=lambda own: own("1.2", "kay")), "1.3 omega", "kay"),
        (omega(slips=lambda bench: {"in rpm": bench.omega * 1.001}), "1.3 omega", "in rpm"),
        (omega(slips=lambda bench: {"in rpm": bench.rpm}), "1.3 omega", "rpm"),
        (omega(rtol=3.0), "1.3 omega", "wrong answer"),
        ({"k": Number(**K | {"expected": lambda bench: None})}, "1.2 k", "None"),
        ({"k": Number(**K | {"expected": lambda bench: "stiff"})}, "1.2 k", "'stiff'"),
        ({"k": Number(**K | {"expected": lambda bench: [bench.k, 1.0]})}, "1.2 k", "1 finite number"),
        ({"k": Number(**K | {"expected": lambda bench: math.log(bench.k - 1e3)})}, "1.2 k", "ValueError"),
        ({"k": AlwaysRight()}, "1.2 k", "empty hand-in"),
    ],
)
def test_a_fault_of_the_key_is_named_with_its_part_and_cause(solved, checks, place, cause):
    course, runs = solved
    found = faults(spoilt_key(course, **checks), runs)
    assert {where for where, _what in found} == {f"the key, {place}"}
    assert any(cause in what for _where, what in found)


def with_chance(x, bench):
    return x + 1e-9 * np.random.default_rng().normal(size=x.size)


def with_wear(x, bench):
    bench.runs = getattr(bench, "runs", 0) + 1
    return x * (1 + 1e-12 * bench.runs)


@pytest.mark.usefixtures("sandbox")
@pytest.mark.parametrize(("change", "cause"), [(with_chance, "made anew"), (with_wear, "repeated")])
def test_a_plant_that_does_not_repeat_to_the_last_bit_is_found(solved, change, cause):
    course, runs = solved
    check = course.key["1.1"]["run"]

    def recording(bench):
        run = check.recording(bench)
        run.channels["x"] = SimpleNamespace(values=change(run.channels["x"].values, bench), unit="m")
        return run

    ((place, what),) = faults(spoilt_key(course, run=replace(check, recording=recording)), runs)
    assert place == "the key, 1.1 run" and cause in what


@pytest.mark.usefixtures("sandbox")
def test_another_bench_in_the_key_than_in_the_session_is_found(solved):
    course, runs = solved
    other = replace(course, bench=lambda student, policy: course.bench(f"{student}!", policy))
    assert any(place == "the key, 1.1 run" and "same bench" in what for place, what in faults(other, runs))
    broken = replace(course, bench=lambda student, policy: 1 / 0)
    ((place, what),) = [(fault.where, fault.what) for fault in rehearse.check_bench(broken, STUDENTS[0], runs[0])]
    assert place == "course.py, bench" and "ZeroDivisionError" in what and "test_rehearse.py" in what


def prediction(course, seen, found_in=(("1.2", "k"),)):
    item = Predictable(number("soft", "N/m", (0.0, 100.0), "", "How stiff?", points=0), found_in, seen, "Why?")
    course.catalogue.predictions["1.1"] = (item,)
    return course


@pytest.mark.usefixtures("sandbox")
@pytest.mark.parametrize(
    ("seen", "cause"),
    [(lambda k: k / 0, "ZeroDivisionError"), (lambda k: 1e3 * k, "plausible"), (lambda k: "soft", "plausible")],
)
def test_a_prediction_that_nobody_could_make_is_found(solved, seen, cause):
    course, runs = solved
    try:
        ((place, what),) = faults(prediction(course, seen), runs)
    finally:
        course.catalogue.predictions.clear()
    assert "'soft' of 1.1" in place and cause in what


def test_what_texts_and_catalogue_lack_is_found_without_a_run(spoilt):
    course = prediction(spoilt(), lambda k: k, (("1.2", "stiffness"),))
    path = course.folder / "01_spring.ipynb"
    pictures = "# A mass ![of steel](mass.png) <img src='spring.svg'>"
    path.write_text(path.read_text(encoding="utf-8").replace("# A mass on a spring", pictures), encoding="utf-8")
    course.key["1.2"]["k"] = Number(**K | {"rtol": -0.05})
    course.key["1.3"]["omega"] = Number(**K | {"rtol": 5})
    found = [str(fault) for fault in course_check.check(course, run=False)]
    for words in ("no cell asks for it", "stiffness", "mass.png", "spring.svg", "rtol is -0.05", "rtol is 5;"):
        assert any(words in fault for fault in found), (words, found)


@pytest.mark.scheduled
@pytest.mark.usefixtures("sandbox")
def test_a_package_that_the_release_does_not_require_stops_it_in_a_fresh_environment(spoilt):
    course = spoilt()
    plant = course.folder.parent / "springlab" / "plant.py"
    text = plant.read_text(encoding="utf-8").replace("import numpy as np", "import control\nimport numpy as np")
    plant.write_text(text, encoding="utf-8")
    spoilt.forget()
    found = [*rehearse.check_fresh(course, bundle.build(course))]
    if any(fault.is_note for fault in found):
        pytest.skip(f"{found[0]}")
    assert len(found) == 1 and "control" in found[0].what and "requires" in found[0].what


@pytest.mark.scheduled
@pytest.mark.usefixtures("sandbox")
def test_a_fault_on_some_benches_comes_once_with_their_number(spoilt):
    course = spoilt()
    stiff = course.true_bench(course_check.SOLUTIONS_STUDENT).k
    course = spoilt_key(course, k=Number(**K | {"expected": lambda bench: bench.k * (bench.k <= stiff)}))
    done = []
    found = [fault for fault in rehearse.rehearse(course, 6, done.append) if fault.where.startswith("the key, 1.2 k")]
    assert len(found) == 1 and "of 6 benches" in found[0].what
    assert any("bench 6 of 6" in step for step in done)


def test_what_follows_from_an_answer_that_waits_waits_too(course):
    k = Number(**K | {"follow": lambda own: MASS * own("1.3", "omega") ** 2})
    limited = replace(spoilt_key(course, k=k, **omega()), follow_limit=1000.0)
    stiff = 1e9  # N/m, of which the plausible ones end at 1000
    claims = Claims(values={("1.2", "k"): stiff, ("1.3", "omega"): math.sqrt(stiff / MASS)})
    claims.contents.update({where: {"kind": "number", "value": value} for where, value in claims.values.items()})
    case = marking.case_of(limited, claims, limited.true_bench("ada"), 1)

    def status(number, name):
        question = limited.catalogue.find(number)
        return marking.mark_part(limited, question, question.part(name), claims, case).status

    assert not marking.is_absurd(limited, ("1.3", "omega"), claims.values["1.3", "omega"])
    assert [status("1.3", "omega"), status("1.2", "k")] == [Status.FOR_A_PERSON, Status.FOR_A_PERSON]
    claims.waiting.clear()
    assert status("1.2", "k") is Status.FOLLOW_THROUGH


def no_other(question, part):
    raise LookupError


def test_a_number_in_another_unit_is_named_as_such(course):
    limited = spoilt_key(course, **omega())
    bench, part = limited.true_bench("ada"), limited.catalogue.find("1.3").part("omega")
    check = limited.key["1.3"]["omega"]
    verdict = check.verdict(part, bench.omega / (2 * math.pi), Case(bench, no_other, 1))
    assert verdict.status is Status.WRONG and "in hertz" in verdict.reason
