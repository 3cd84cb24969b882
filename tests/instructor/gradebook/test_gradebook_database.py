"""What a gradebook's database is told before anything is read or written, and with which values."""

from __future__ import annotations

import stat

import pytest
from gradebooks import graded, record

from rotflex.errors import GradebookError
from rotflex.instructor.gradebook import Gradebook
from rotflex.instructor.gradebook.database import Database
from rotflex.instructor.gradebook.schema import _SECRET_BYTES


@pytest.fixture
def database(tmp_path):
    made = Database(tmp_path / "book.sqlite")
    yield made
    made.close()


def test_a_server_is_told_how_long_to_wait_and_which_lock_writers_take():
    server = Database("postgresql://prof:secret@host/book")
    begin, lock = server._start_writing
    assert begin == "SET LOCAL lock_timeout = 30000" and lock.startswith("SELECT pg_advisory_xact_lock(")
    assert server._start_reading == ["SET TRANSACTION ISOLATION LEVEL REPEATABLE READ, READ ONLY"]
    assert "secret" not in server.where and "host/book" in server.where
    server.close()


def test_a_gradebook_is_for_its_owner_only_and_has_a_secret_of_256_bits(tmp_path):
    path = tmp_path / "book.sqlite"
    with Gradebook(path) as book:
        record(book, graded("ada"))
        secret = book.secret()
        assert len(secret) == _SECRET_BYTES == 32 and book.secret() == secret
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    with Gradebook(tmp_path / "other.sqlite") as other:
        assert other.secret() != secret


@pytest.mark.parametrize("url", ["sqlite://", "sqlite:///:memory:", "mysql://root@host/x", "postgresql://host:port/x"])
def test_an_address_that_is_no_gradebooks_is_refused(url):
    with pytest.raises(GradebookError, match=r"file|none of|read"):
        Database(url)


def test_a_gradebook_that_is_left_lets_go_of_its_database(tmp_path, monkeypatch):
    closed = []
    monkeypatch.setattr(Database, "close", lambda self: closed.append(self.where))
    with Gradebook(tmp_path / "book.sqlite"):
        assert closed == []
    assert closed == [str(tmp_path / "book.sqlite")]
