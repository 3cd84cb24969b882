"""What a mark is known by: another key, tolerance or check is another way of marking; another report is not."""

import shutil
from copy import copy
from dataclasses import replace

import pytest
from checkout import ROOT
from made_courses import OURS

from labcourse.grading import settings
from labcourse.grading.marking import marking_processes
from labcourse.grading.settings import CourseSettings


@pytest.fixture
def tree(tmp_path, monkeypatch):
    """A copy of the packages and of the course's folder, for the digest to look at."""
    ignored = shutil.ignore_patterns("__pycache__", "*.ipynb", "*.json")
    for name in ("labcourse", "rotflex", "solutions"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=ignored)
    package = tmp_path / "labcourse"
    monkeypatch.setattr(marking_processes, "_PACKAGE", package)
    monkeypatch.setattr(marking_processes, "package_folder", lambda name: tmp_path / name)
    unaffected = [path.relative_to(ROOT / "labcourse") for path in marking_processes._NOT_MARKING]
    monkeypatch.setattr(marking_processes, "_NOT_MARKING", tuple(package / path for path in unaffected))
    return tmp_path


def of(tree):
    return marking_processes.marking_digest(replace(OURS, folder=tree / "solutions"))


def test_the_same_is_the_same(tree):
    assert of(tree) == of(tree) == marking_processes.marking_digest(OURS)


#: What a run leaves beside the key, what has no part in marking, and what hides in a folder.
NO_PART = ["02_finding_stiffness.ipynb", "answers.json", "rubric.toml", "outcomes.toml", "sheets.toml"]
NO_PART += [".DS_Store", ".course.py.swp"]
NO_PART += [f"{folder}/HEAD.py" for folder in (".git", "__pycache__", "a/.ipynb_checkpoints")]
NO_PART = [f"solutions/{name}" for name in NO_PART]
MODULES = ("reports/feedback", "isolation/sandbox", "intake/reading", "gradebook/store", "accounts")
NO_PART += [f"labcourse/grading/{name}.py" for name in MODULES]


@pytest.mark.parametrize("name", NO_PART)
def test_what_has_no_part_in_marking_marks_nothing_again(tree, name):
    before, path = of(tree), tree / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(path.read_text(encoding="utf-8") + "# changed" if path.exists() else "{}", encoding="utf-8")
    assert of(tree) == before


#: Modules and folders of ``labcourse/grading`` that have no part in marking; all else has, as far as anybody knows.
APART = {"gradebook", "intake", "isolation", "release", "reports", "running", "scoring"}
APART |= {f"{name}.py" for name in ("accounts", "assignments", "commands", "course_check", "erasure", "executed")}
APART |= {f"{name}.py" for name in ("feedback_zip", "outcomes", "overview", "platforms", "sheets", "todo")}


@pytest.mark.slow
def test_every_module_but_those_that_have_no_part_counts_when_it_alone_changes(tree):
    before = of(tree)
    counting = [*(tree / "solutions").glob("*.py")]
    for path in [path for name in ("labcourse", "rotflex") for path in (tree / name).rglob("*.py")]:
        parts = path.relative_to(tree).parts
        if not (parts[1] == "grading" and parts[2] in APART):
            counting.append(path)
    unseen = []
    for path in counting:
        content = path.read_bytes()
        path.write_bytes(content + b"#")
        if of(tree) == before:
            unseen.append(path.name)
        path.write_bytes(content)
    assert len(counting) > 100 and unseen == [] and of(tree) == before


def test_each_package_that_students_get_counts(tree):
    course = replace(OURS, folder=tree / "solutions", packages=("rotflex", "springlab"))
    plant = tree / "springlab" / "plant.py"
    plant.parent.mkdir()
    seen = [of(tree)]
    for source in ("K = 1\n", "K = 2\n"):
        plant.write_text(source)
        seen.append(marking_processes.marking_digest(course))
    assert len(set(seen)) == 3


#: Each section of course.toml, with something else than usual.
OTHERWISE = {
    "course": 'term = "2026 autumn"',
    "bench": 'which = "same"\nseed = 7',
    "optional": 'notebooks = ["10_control_results"]',
    "feedback": "points = false",
    "reflect": "asks = false",
    "report": "page_limit = 12",
    "releases": 'folder = "old"',
    "marks": 'drop = ["2.3"]\nweights = {"2.11" = 2}',
    "levels": "shares = {3 = 80}\nthresholds = {4 = 95}",
    "assignment": 'title = "Lab 2"\nnotebooks = ["02_finding_stiffness"]\nout_of = 20',
    "deadline": "due = 2026-11-21",
    "extension": 'until = 2026-11-28\nstudents = ["ada"]',
    "late": "per_day = 10",
    "outcomes": "level = 2",
}


def with_settings(tree, *sections):
    """The digest of the course with these sections of course.toml."""
    heading = {name: f"[{name}]" for name in OTHERWISE} | {name: f"[[{name}]]" for name in settings._ROWS}
    lines = [f"{heading[name]}\n{OTHERWISE[name]}\n" for name in sections]
    (tree / "solutions" / "course.toml").write_text("".join(lines), encoding="utf-8")
    catalogue = copy(OURS.catalogue)
    catalogue.optional = (*catalogue.optional, "10_control_results")
    decided = settings.read(tree / "solutions", catalogue=catalogue)
    assert decided != CourseSettings() or not sections
    return marking_processes.marking_digest(replace(OURS, folder=tree / "solutions", settings=decided))


@pytest.mark.parametrize("section", OTHERWISE)
def test_settings_of_what_is_made_of_marks_mark_nothing_again(tree, section):
    """Nor does a word of comment."""
    needs = ["deadline"] if section in ("extension", "late") else []
    same = with_settings(tree) == with_settings(tree, *needs, section)
    assert same == (section not in ("course", "bench", "optional", "reflect", "releases"))


def test_the_settings_that_are_tried_are_all_there_are():
    assert set(OTHERWISE) == set(settings._ENTRIES)


@pytest.mark.parametrize("name", ["tables/limits.csv", "roster.txt", "expected.json", "expected.toml"])
def test_what_lies_in_the_courses_folder_counts_by_its_content(tree, name):
    path = tree / "solutions" / name
    path.parent.mkdir(exist_ok=True)
    seen = [of(tree)]
    for text in ("a = 1\n", "a = 2\n"):
        path.write_text(text)
        seen.append(of(tree))
    assert len(set(seen)) == 3
