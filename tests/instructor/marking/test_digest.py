"""What a mark is known by: another key, tolerance or check is another way of marking; another report is not."""

from __future__ import annotations

import shutil
from dataclasses import replace

import pytest
from checkout import ROOT
from made_courses import OURS

from rotflex.instructor.marking import digest


@pytest.fixture
def tree(tmp_path, monkeypatch):
    """A copy of the package and of the course's folder, for the digest to look at."""
    ignored = shutil.ignore_patterns("__pycache__", "*.ipynb", "*.json")
    shutil.copytree(ROOT / "rotflex", tmp_path / "rotflex", ignore=ignored)
    shutil.copytree(ROOT / "solutions", tmp_path / "solutions", ignore=ignored)
    package = tmp_path / "rotflex"
    monkeypatch.setattr(digest, "_PACKAGE", package)
    monkeypatch.setattr(digest, "package_folder", lambda name: tmp_path / name)
    unaffected = [path.relative_to(ROOT / "rotflex") for path in digest._NO_PART]
    monkeypatch.setattr(digest, "_NO_PART", tuple(package / path for path in unaffected))
    return tmp_path


def of(tree):
    return digest.marking_digest(replace(OURS, folder=tree / "solutions"))


def change(path):
    path.write_text(path.read_text(encoding="utf-8") + "\n# changed\n", encoding="utf-8")


def test_the_same_is_the_same(tree):
    assert of(tree) == of(tree) == digest.marking_digest(OURS)


@pytest.mark.parametrize(
    "name",
    [
        "solutions/key.py",
        "solutions/tolerances.py",
        "solutions/design_checks.py",
        "solutions/true_bench.py",
        "rotflex/instructor/marking/checks.py",
        "rotflex/instructor/verdicts.py",
        "rotflex/instructor/model.py",
        "rotflex/courseware/kinds/values.py",
        "rotflex/workbook/catalogue_modeling.py",
        "rotflex/specifications.py",
        "rotflex/plant.py",
    ],
)
def test_a_changed_key_check_or_bench_is_another(tree, name):
    before = of(tree)
    change(tree / name)
    assert of(tree) != before


def test_a_new_module_counts_though_nobody_has_named_it(tree):
    before = of(tree)
    (tree / "rotflex" / "instructor" / "rounding.py").write_text("HALF = 0.5\n")
    assert of(tree) != before


def test_a_table_that_the_key_reads_counts(tree):
    before = of(tree)
    (tree / "solutions" / "expected.csv").write_text("1.4\n")
    with_table = of(tree)
    (tree / "solutions" / "expected.csv").write_text("1.5\n")
    assert len({before, with_table, of(tree)}) == 3


@pytest.mark.parametrize("name", ["02_finding_stiffness.ipynb", "answers.json", "__pycache__/key.pyc"])
def test_what_a_run_leaves_beside_the_key_marks_nothing_again(tree, name):
    before = of(tree)
    (tree / "solutions" / name).parent.mkdir(exist_ok=True)
    (tree / "solutions" / name).write_text("{}")
    assert of(tree) == before


@pytest.mark.parametrize("name", ["reports/feedback.py", "isolation/sandbox.py", "gradebook/store.py"])
def test_what_has_no_part_in_marking_marks_nothing_again(tree, name):
    before = of(tree)
    change(tree / "rotflex" / "instructor" / name)
    assert of(tree) == before
