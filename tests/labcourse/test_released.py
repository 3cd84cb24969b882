"""The course as it was handed out, and what its notebooks say of it."""

import json

import pytest
from checkout import ROOT
from made_notebooks import code, notebook, text

from labcourse import released
from labcourse.errors import ConfigurationError
from rotflex.course.questions import CATALOGUE


def test_the_notebooks_of_this_checkout_are_found_in_order():
    assert released.course_folder() == ROOT
    found = released.masters()
    assert list(found) == sorted(path.name for path in (ROOT / "notebooks").glob("*.ipynb"))
    assert found["00_start.ipynb"] == json.loads((ROOT / "notebooks" / "00_start.ipynb").read_text("utf-8"))
    assert released.catalogue_of(found) is CATALOGUE
    assert {"numpy", "rotflex", "sympy"} <= set(released.packages_of(found))
    assert released.release() == ""  # a checkout is none


MADE = {
    "01.ipynb": notebook(
        text("words", "import nothing"),
        code("a", "import json\nfrom rotflex import units, lab\nx = 1"),
        code("b", "%matplotlib inline\nimport never"),
        code("c", "import json\nimport rotflex.course.lab as here"),
    )
}


def test_import_statements_are_collected_once():
    assert released.imports_of(MADE) == (
        "import json",
        "from rotflex import units, lab",
        "import rotflex.course.lab as here",
    )
    assert released.packages_of(MADE) == ("json", "rotflex")


def test_the_catalogue_is_that_of_the_imported_laboratory():
    assert released.catalogue_of(MADE) is CATALOGUE
    with pytest.raises(ConfigurationError, match="None of the modules"):
        released.catalogue_of({"01.ipynb": notebook(code("a", "import json\nfrom os import path, sep"))})


def test_a_folder_without_notebooks_is_an_error_in_words(tmp_path, monkeypatch):
    monkeypatch.setattr("rotflex.__file__", str(tmp_path / "rotflex" / "__init__.py"))
    with pytest.raises(ConfigurationError, match="comes without notebooks"):
        released.course_folder()
