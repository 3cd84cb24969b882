"""A course with a sample time of 10 minutes: the template's oven, six thousand times slower, drawn over hours."""

from types import SimpleNamespace

import pytest
from matplotlib.figure import Figure

from labcourse.answers import forms
from labcourse.grading import course as courses
from labcourse.grading import course_check, new
from labcourse.grading.marks import Status
from labcourse.grading.release import student_course
from labcourse.grading.verdicts import Case

pytestmark = pytest.mark.slow
#: File → what it says for the oven, and for the slow plant.
SLOWER = {
    "digester/plant.py": (
        ("SAMPLE_TIME = 0.1", "SAMPLE_TIME = 600.0"),
        ("DURATION = 100.0", "DURATION = 600e3"),
        ("uniform(10.0, 20.0)", "uniform(60e3, 120e3)"),
    ),
    "digester/catalogue.py": (
        ('"s", (1.0, 100.0)', '"s", (1.0, 600e3)'),
        ('"s", (0.0, 100.0)', '"s", (0.0, 600e3)'),
        ('"model(t)", (0.0, 100.0)', '"model(t)", (0.0, 600e3)'),
    ),
    "solutions/key.py": (("KP, KI = 0.2, 0.05", "KP, KI = 0.2, 0.05 / 6000"),),
    "solutions/01_first_lab.py": (
        ("0.05 * k", "0.05 / 6000 * k"),
        ("axes.plot(run.time,", "axes.plot(run.time / 3600,"),
        ("time (s)", "time (h)"),
    ),
}


@pytest.fixture(scope="module")
def digester(tmp_path_factory):
    """Make the course, load it, and return it."""
    folder = new.make("digester", tmp_path_factory.mktemp("slow"))
    for name, changes in SLOWER.items():
        text = (folder / name).read_text(encoding="utf-8")
        for oven, slow in changes:
            assert oven in text
            text = text.replace(oven, slow)
        (folder / name).write_text(text, encoding="utf-8")
    course = courses.load(folder / "solutions")
    student_course.write_notebooks(course)
    return course


@pytest.mark.usefixtures("sandbox")
def test_its_solutions_earn_full_points_and_nothing_else_does(digester):
    assert [*map(str, course_check.check(digester))] == []


@pytest.mark.parametrize(("label", "second"), [("t (h)", 1 / 3600), ("t in days", 1 / 86_400), ("t / min", 1 / 60)])
def test_a_figure_of_another_recording_follows_that(digester, label, second):
    question = digester.catalogue.find("1.1")
    mine, other = (digester.bench(student, SimpleNamespace(seed_for=len)) for student in ("ada", "bobby"))
    run = other.step()
    figure = Figure()
    axes = figure.subplots()
    axes.plot(run.time * second, run["T"])
    axes.set(xlabel=label, ylabel="T (K)")
    recorded, drawn = (
        forms.decode(part, forms.encode(part, value, 1).content)
        for part, value in zip(question.parts, (run, figure), strict=True)
    )
    case = Case(mine, lambda number, part: {("1.1", "run"): recorded}[number, part], 1, bench_word="digester")
    verdict = digester.key["1.1"]["plot"].verdict(question.part("plot"), drawn, case)
    assert verdict.status is Status.FOLLOW_THROUGH
    assert "your digester gives" in verdict.reason
