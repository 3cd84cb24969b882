"""The gradebook's database: processes at a time, kills, waiting, versions, addresses; on a file and on PostgreSQL."""

import multiprocessing
import os
import signal
import stat
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path

import pytest
from gradebook_dump import dump
from made_runs import graded, mark, record, small_class
from sqlalchemy import inspect, text, update

from labcourse.errors import GradebookError
from labcourse.grading.gradebook import Gradebook, persons, store
from labcourse.grading.gradebook import database as database_module
from labcourse.grading.gradebook.database import VERSION, Database
from labcourse.grading.gradebook.records import About, Base

forked = multiprocessing.get_context("fork")


def record_many(url, who, begin):
    begin.wait()
    with Gradebook(url) as book:
        for number in range(15):
            record(book, graded(f"{who}{number:02d}"))


def test_two_processes_make_and_fill_one_gradebook_and_nothing_is_lost(url):
    begin = forked.Barrier(2)
    both = [forked.Process(target=record_many, args=(url, who, begin)) for who in "ab"]
    for process in both:
        process.start()
    for process in both:
        process.join(60)
    assert [process.exitcode for process in both] == [0, 0]
    with Gradebook(url) as book:
        assert list(book.all_current()) == [graded(f"{who}{number:02d}") for who in "ab" for number in range(15)]
        assert len(book.audit()) == 60


def killed_after(module, step, what):
    """Do something in a process that is killed just after a step of it."""

    def and_die(before):
        def step(*arguments, **named):
            before(*arguments, **named)
            os.kill(os.getpid(), signal.SIGKILL)

        return step

    def run():
        setattr(module, step, and_die(getattr(module, step)))
        what()

    process = forked.Process(target=run)
    process.start()
    process.join(60)
    return process.exitcode == -signal.SIGKILL


@pytest.mark.parametrize(
    ("module", "step"), [(persons, "add_student"), (store, "_put_run"), (store, "_put_marks"), (store, "put_audit")]
)
def test_a_kill_amid_recording_leaves_what_was_before(url, undisturbed, module, step):
    with Gradebook(url) as book:
        record(book, small_class()[0])
        before = dump(book)
    second = small_class()[2]
    assert killed_after(module, step, lambda: record(Gradebook(url), second))
    with Gradebook(url) as book:
        assert dump(book) == before
        for one in small_class():
            record(book, one)
        assert dump(book) == undisturbed


def tables(url):
    with closing(Database(url)) as database, database.reading() as session:
        return inspect(session.connection()).get_table_names()


def test_a_kill_while_the_gradebook_is_made_leaves_none(url):
    assert killed_after(Base.metadata, "create_all", lambda: Gradebook(url))
    assert tables(url) == []
    with Gradebook(url) as book:
        assert len(book.secret()) == 32


def test_an_error_amid_recording_leaves_what_was_before(book, monkeypatch):
    record(book, graded())
    before = dump(book)
    monkeypatch.setattr(store, "put_audit", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        record(book, graded("ada", "second", mark(points=0.0)))
    assert dump(book) == before


def test_a_writer_waits_for_another(book, url):
    held, let_go = threading.Event(), threading.Event()

    def hold():
        with closing(Database(url)) as database, database.writing():
            held.set()
            let_go.wait(30)

    def open_and_record():
        with Gradebook(url) as opened:
            return record(opened, graded())

    with ThreadPoolExecutor(2) as pool:
        holding = pool.submit(hold)
        held.wait(30)
        waiting = pool.submit(open_and_record)
        with pytest.raises(TimeoutError):
            waiting.result(0.3)
        let_go.set()
        assert waiting.result(30) == 2
        holding.result(30)


def test_a_number_that_no_row_can_have_is_an_error_of_the_gradebook(book):
    with pytest.raises(GradebookError, match=r"too large|out of range"):
        book.requests.answer(2**70, "prof", "Yes.")


def test_a_writer_does_not_wait_for_ever(book, url, monkeypatch):
    monkeypatch.setattr(database_module, "PATIENCE", 0.1)
    with Gradebook(url) as other, closing(Database(url)) as database, database.writing():
        assert other.students() == []  # reading goes on
        with pytest.raises(GradebookError, match="another process"):
            record(other, graded())
    assert record(book, graded()) == 2


#: What is in a database → what is said of it.
NOT_OURS = {
    "somebody else's": (["CREATE TABLE students (shoe INTEGER)"], "is not a gradebook"),
    "of the time of alembic": (
        ["CREATE TABLE gradebook_version (version_num TEXT)", "CREATE TABLE students (id INTEGER)"],
        r"earlier labcourse.* Grade the submissions again.* score --write .* score --read",
    ),
}


@pytest.mark.parametrize("what", NOT_OURS)
def test_a_database_that_cannot_be_used_is_left_as_it_is(url, what):
    statements, why = NOT_OURS[what]
    with closing(Database(url)) as database, database.writing() as session:
        for statement in statements:
            session.execute(text(statement))
    there = tables(url)
    with pytest.raises(GradebookError, match=why):
        Gradebook(url)
    assert tables(url) == there


@pytest.mark.parametrize(("difference", "why"), [(-1, "earlier labcourse"), (1, "newer labcourse.* upgrade")])
def test_a_gradebook_of_another_version_is_refused_and_left_as_it_is(url, undisturbed, difference, why):
    def set_version(version):
        with closing(Database(url)) as database, database.writing() as session:
            session.execute(update(About).values(version=version))

    with Gradebook(url) as book:
        for one in small_class():
            record(book, one)
    set_version(VERSION + difference)
    with pytest.raises(GradebookError, match=why):
        Gradebook(url)
    set_version(VERSION)
    with Gradebook(url) as book:
        assert dump(book) == undisturbed


def test_a_file_that_is_no_database_is_left_as_it_is(tmp_path):
    file = tmp_path / "grades.csv"
    file.write_text("student,total\n" * 100)
    with pytest.raises(GradebookError, match=r"grades\.csv: this file is not a gradebook"):
        Gradebook(file)
    assert file.read_text() == "student,total\n" * 100


@pytest.mark.parametrize("form", [str, Path, "sqlite:///{}".format])
def test_a_gradebook_is_a_file_for_its_owner_only(tmp_path, form):
    file = tmp_path / ("100% ü?#.sqlite" if form in (str, Path) else "class.sqlite")
    with Gradebook(form(file)) as book:
        record(book, graded())
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize(
    ("url", "said"),
    [
        ("missing/class.sqlite", "No such file or directory"),
        (".", "directory"),
        ("sqlite://", "needs a file"),
        (":memory:", "needs a file"),
        ("sqlite:///:memory:", "needs a file"),
        ("mysql://root:secret@host/x", "mysql://... is none of these"),
        ("postgresql://teacher:secret@host:port/x", "postgresql:... is neither"),
        ("postgresql:/teacher:secret@host/x", "postgresql:... is neither"),
        ("postgres:teacher:secret@host/x", "postgres:... is neither"),
        ("mysql:/root:secret@host/x", "mysql:... is neither"),
        ("jdbc:postgresql://teacher:secret@host/x", "is neither"),
        (" postgresql://teacher:secret@host/x", "is neither"),
        ("host=127.0.0.1 user=teacher password=secret", "is neither"),
    ],
)
def test_an_address_that_cannot_be_used_is_explained_without_its_password(tmp_path, monkeypatch, url, said):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(GradebookError, match=said) as caught:
        Gradebook(url)
    assert "secret" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_a_server_that_refuses_us_is_explained_without_the_password(server):
    with pytest.raises(GradebookError, match="password authentication failed") as caught:
        Gradebook(server.replace("teacher:", "teacher:wrong") + "postgres")
    assert "wrong" not in str(caught.value)
    with pytest.raises(GradebookError, match="does not exist"):
        Gradebook(server.replace("postgresql:", "postgres:") + "nowhere")


def test_a_server_is_told_how_long_to_wait_and_which_lock_writers_take():
    server = Database("postgresql://prof:secret@host/book")
    begin, lock = server._start_writing
    assert begin == "SET LOCAL lock_timeout = 30000" and lock.startswith("SELECT pg_advisory_xact_lock(")
    assert server._start_reading == ["SET TRANSACTION ISOLATION LEVEL REPEATABLE READ, READ ONLY"]
    assert "secret" not in server.where and "host/book" in server.where
    for hidden in ("?password=secret", "?sslpassword=secret&sslmode=require"):
        assert Database(f"postgresql://prof@host/book{hidden}").where.endswith("prof@host/book")
    server.close()


def test_a_gradebook_that_is_left_lets_go_of_its_database(tmp_path, monkeypatch):
    closed = []
    monkeypatch.setattr(Database, "close", lambda self: closed.append(self.where))
    with Gradebook(tmp_path / "book.sqlite"):
        assert closed == []
    assert closed == [str(tmp_path / "book.sqlite")]
