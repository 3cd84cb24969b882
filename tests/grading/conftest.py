"""Fixtures for the tests of several rooms."""

import pytest
from end_of_term import everything_is_due
from fake_class import FakeClass

from labcourse.grading.gradebook import Gradebook


@pytest.fixture(autouse=True, scope="session")
def end_of_term():
    with everything_is_due():
        yield


@pytest.fixture
def book(tmp_path):
    """An empty gradebook in a file."""
    with Gradebook(tmp_path / "book.sqlite") as opened:
        yield opened


@pytest.fixture
def fake_class(tmp_path, monkeypatch):
    return FakeClass(tmp_path, monkeypatch)
