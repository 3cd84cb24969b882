"""The course as it was handed out, and what its notebooks say of it."""

import json
from importlib.metadata import EntryPoint

import pytest
from checkout import ROOT
from made_notebooks import code, notebook, text

from labcourse import courses
from labcourse.answers import notebooks
from labcourse.errors import ConfigurationError
from rotflex.course.questions import CATALOGUE


def test_the_notebooks_of_this_checkout_are_found_in_order():
    assert courses.current().notebooks == ROOT / "notebooks"
    found = notebooks.masters()
    assert list(found) == sorted(path.name for path in (ROOT / "notebooks").glob("*.ipynb"))
    assert found["00_start.ipynb"] == json.loads((ROOT / "notebooks" / "00_start.ipynb").read_text("utf-8"))
    assert notebooks.catalogue_of(found) is CATALOGUE
    assert {"numpy", "rotflex", "sympy"} <= set(notebooks.packages_of(found))
    assert notebooks.release() == ""  # a checkout is none


MADE = {
    "01.ipynb": notebook(
        text("words", "import nothing"),
        code("a", "import json\nfrom rotflex import units, lab\nx = 1"),
        code("b", "%matplotlib inline\nimport never"),
        code("c", "import json\nimport rotflex.course.lab as here"),
    )
}


def test_import_statements_are_collected_once():
    assert notebooks.imports_of(MADE) == (
        "import json",
        "from rotflex import units, lab",
        "import rotflex.course.lab as here",
    )
    assert notebooks.packages_of(MADE) == ("json", "labcourse", "rotflex")


def test_the_catalogue_is_that_of_the_imported_laboratory():
    assert notebooks.catalogue_of(MADE) is CATALOGUE
    with pytest.raises(ConfigurationError, match="CATALOGUE"):
        notebooks.catalogue_of({"01.ipynb": notebook(code("a", "import json\nfrom os import path, sep"))})


def test_a_folder_without_notebooks_is_an_error_in_words(tmp_path, monkeypatch):
    (tmp_path / "empty_course").mkdir()
    (tmp_path / "empty_course" / "__init__.py").touch()
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv(courses.COURSE_VARIABLE, "empty_course")
    with pytest.raises(ConfigurationError, match="comes without notebooks"):
        notebooks.masters()


def test_of_two_courses_the_one_that_is_named_counts_or_both_are_listed(monkeypatch):
    both = (EntryPoint("rotflex", "rotflex.course", courses.GROUP), EntryPoint("other", "json", courses.GROUP))
    monkeypatch.setattr(courses, "entry_points", lambda group: both)
    for name in ("rotflex", "rotflex.course"):
        monkeypatch.setenv(courses.COURSE_VARIABLE, name)
        assert courses.current().package == "rotflex.course"
    monkeypatch.setenv(courses.COURSE_VARIABLE, "third")
    with pytest.raises(ConfigurationError, match=r"'third'.*other, rotflex"):
        courses.current()
