"""The gradebook's database: several processes, kills, waiting, versions, addresses; in a file and on PostgreSQL."""

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
from made_runs import graded, record, small_class
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
    """Run a function in a process that is killed right after one of its steps."""

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
def test_a_kill_while_a_run_is_recorded_changes_nothing(url, undisturbed, module, step):
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


def test_a_kill_while_the_gradebook_is_made_leaves_an_empty_database(url):
    assert killed_after(Base.metadata, "create_all", lambda: Gradebook(url))
    assert tables(url) == []
    with Gradebook(url) as book:
        assert len(book.secret()) == 32


def test_a_writer_waits_for_another(book, url):
    locked, release = threading.Event(), threading.Event()

    def hold():
        with closing(Database(url)) as database, database.writing():
            locked.set()
            release.wait(30)

    def open_and_record():
        with Gradebook(url) as opened:
            return record(opened, graded())

    with ThreadPoolExecutor(2) as pool:
        holding = pool.submit(hold)
        locked.wait(30)
        waiting = pool.submit(open_and_record)
        with pytest.raises(TimeoutError):
            waiting.result(0.3)
        release.set()
        assert waiting.result(30) == 2
        holding.result(30)


def test_a_number_that_no_row_can_have_is_an_error_of_the_gradebook(book):
    with pytest.raises(GradebookError, match=r"too large|out of range"):
        book.scores.undo(2**70, "prof")


def test_a_writer_does_not_wait_for_ever(book, url, monkeypatch):
    monkeypatch.setattr(database_module, "PATIENCE", 0.1)
    with Gradebook(url) as other, closing(Database(url)) as database, database.writing():
        assert other.students() == []  # reading goes on
        with pytest.raises(GradebookError, match="another process"):
            record(other, graded())
    assert record(book, graded()) == 2


EARLIER, FORMER = r"earlier labcourse.* grade NEW .*once more.* comes along", r"earlier labcourse.* score them again"


@pytest.mark.parametrize(("table", "why"), [("students", "is not a gradebook"), ("gradebook_version", FORMER)])
def test_a_database_with_other_tables_is_refused_and_not_changed(url, table, why):
    with closing(Database(url)) as database, database.writing() as session:
        session.execute(text(f"CREATE TABLE {table} (shoe INTEGER)"))
    with pytest.raises(GradebookError, match=why):
        Gradebook(url)
    assert tables(url) == [table]


@pytest.mark.parametrize(("difference", "why"), [(-1, EARLIER), (1, "newer labcourse.* upgrade")])
def test_a_gradebook_of_another_version_is_refused_and_not_changed(url, undisturbed, difference, why):
    def set_version(version):
        with closing(Database(url)) as database, database.writing() as session:
            session.execute(update(About).values(version=version))

    with Gradebook(url) as book:
        for one in small_class():
            record(book, one)
    set_version(VERSION + difference)
    is_file = "postgres" not in str(url)  # only a file can be taken over
    with pytest.raises(GradebookError, match=why if is_file or difference > 0 else FORMER):
        Gradebook(url)
    set_version(VERSION)
    with Gradebook(url) as book:
        assert dump(book) == undisturbed


def test_a_file_that_is_no_database_is_refused_and_not_changed(tmp_path):
    file = tmp_path / "grades.csv"
    file.write_text("student,total\n" * 100)
    with pytest.raises(GradebookError, match=r"grades\.csv: this file is not a gradebook"):
        Gradebook(file)
    assert file.read_text() == "student,total\n" * 100


@pytest.mark.parametrize("form", [str, Path, "sqlite:///{}".format])
def test_only_its_owner_can_read_a_gradebook_s_file(tmp_path, form):
    file = tmp_path / ("100% ü?#.sqlite" if form in (str, Path) else "class.sqlite")
    with Gradebook(form(file)) as book:
        record(book, graded())
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize(
    ("url", "why"),
    [
        ("missing/class.sqlite", "No such file or directory"),
        (".", "directory"),
        ("sqlite://", "needs a file"),
        (":memory:", "needs a file"),
        ("sqlite:///:memory:", "needs a file"),
        ("mysql://root:secret@host/x", "mysql://... is none of these"),
        ("postgresql://teacher:secret@host:port/x", "postgresql:... is neither"),
        ("postgresql:/teacher:secret@host/x", "postgresql:... is neither"),
        ("jdbc:postgresql://teacher:secret@host/x", "is neither"),
        ("host=127.0.0.1 user=teacher password=secret", "is neither"),
    ],
)
def test_an_address_that_cannot_be_used_is_refused_without_its_password(tmp_path, monkeypatch, url, why):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(GradebookError, match=why) as caught:
        Gradebook(url)
    assert "secret" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_a_server_that_refuses_a_connection_is_reported_without_the_password(server):
    with pytest.raises(GradebookError, match="password authentication failed") as caught:
        Gradebook(server.replace("teacher:", "teacher:wrong") + "postgres")
    assert "wrong" not in str(caught.value)
    with pytest.raises(GradebookError, match="does not exist"):
        Gradebook(server.replace("postgresql:", "postgres:") + "nowhere")


@pytest.mark.parametrize(
    "address", ["prof:secret@host/book", "prof@host/book?password=secret", "prof@host/book?sslpassword=secret&x=y"]
)
def test_the_name_of_a_database_in_messages_has_no_password(address):
    where = Database(f"postgresql://{address}").where
    assert "secret" not in where and where.endswith("@host/book")
