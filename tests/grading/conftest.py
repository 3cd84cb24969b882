"""Fixtures for the tests of several rooms."""

from datetime import UTC, datetime

import pytest
from fake_class import FakeClass

from labcourse.grading import assignments
from labcourse.grading.gradebook import Gradebook


@pytest.fixture(autouse=True, scope="session")
def after_the_term():
    """Everything is due, whatever a test's deadlines are, and whenever it runs."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(assignments, "now", lambda: datetime(2100, 1, 1, tzinfo=UTC))
        yield


@pytest.fixture
def book(tmp_path):
    """An empty gradebook in a file."""
    with Gradebook(tmp_path / "book.sqlite") as opened:
        yield opened


@pytest.fixture
def fake_class(tmp_path, monkeypatch):
    return FakeClass(tmp_path, monkeypatch)
