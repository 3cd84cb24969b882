"""Fixtures for the tests of several rooms."""

import pytest
from fake_class import FakeClass
from set_clock import END_OF_TERM, set_clock

from labcourse.grading.gradebook import Gradebook


@pytest.fixture(autouse=True, scope="module")
def end_of_term():
    with pytest.MonkeyPatch.context() as patch:
        set_clock(patch, END_OF_TERM)
        yield


@pytest.fixture
def book(tmp_path):
    """An empty gradebook in a file."""
    with Gradebook(tmp_path / "book.sqlite") as opened:
        yield opened


@pytest.fixture
def fake_class(tmp_path, monkeypatch):
    return FakeClass(tmp_path, monkeypatch)
