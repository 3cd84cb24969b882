"""The gradebook's database: processes at a time, kills, waiting, migrations, addresses; on a file and on PostgreSQL."""

import multiprocessing
import os
import shutil
import signal
import stat
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path

import alembic.autogenerate
import pytest
from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from gradebook_dump import dump
from made_runs import graded, mark, record, small_class
from sqlalchemy import inspect, text

from labcourse.errors import GradebookError
from labcourse.grading.gradebook import (
    Gradebook,
    StudentRecord,
    rows,
    schema,
    tables,
)
from labcourse.grading.gradebook import database as database_module
from labcourse.grading.gradebook.database import Database

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


@pytest.mark.parametrize("step", ["add_student", "put_marks", "put_audit"])
def test_a_kill_amid_recording_leaves_what_was_before(url, undisturbed, step):
    with Gradebook(url) as book:
        record(book, small_class()[0])
        before = dump(book)
    second = small_class()[2]
    assert killed_after(rows, step, lambda: record(Gradebook(url), second))
    with Gradebook(url) as book:
        assert dump(book) == before
        for one in small_class():
            record(book, one)
        assert dump(book) == undisturbed


def test_a_kill_while_the_gradebook_is_made_leaves_none(url):
    assert killed_after(schema.command, "upgrade", lambda: Gradebook(url))
    with closing(Database(url)) as database, database.reading() as connection:
        assert inspect(connection).get_table_names() == []
    with Gradebook(url) as book:
        assert len(book.secret()) == 32


def test_an_error_amid_recording_leaves_what_was_before(book, monkeypatch):
    record(book, graded())
    before = dump(book)
    monkeypatch.setattr(rows, "put_audit", lambda *_: 1 / 0)
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


def test_a_writer_does_not_wait_for_ever(book, url, monkeypatch):
    monkeypatch.setattr(database_module, "PATIENCE", 0.1)
    with Gradebook(url) as other, closing(Database(url)) as database, database.writing():
        assert other.students() == []  # reading goes on
        with pytest.raises(GradebookError, match="another process"):
            record(other, graded())
    assert record(book, graded()) == 2


def test_the_migrations_make_the_tables_that_the_software_knows(book, url):
    with closing(Database(url)) as database, database.reading() as connection:
        options = {"version_table": tables.VERSION_TABLE, "compare_type": True, "compare_server_default": True}
        context = MigrationContext.configure(connection, opts=options)
        assert alembic.autogenerate.compare_metadata(context, tables.metadata) == []


FIRST_ROWS = """
INSERT INTO students (student, folded, name, email, section) VALUES ('Ada', 'ada', 'Ada L.', '', 'A');
INSERT INTO submissions (student_id, digest, first_seen) VALUES (1, 'first', '2025-10-01 12:00:00+00:00');
INSERT INTO runs (student_id, submission_id, key, spelled, master, software, probe_seed, isolation, problems, notes,
  key_digest, current, recorded) VALUES (1, 1, 'ada first', 'Ada', 'm', 'rotflex 0', 7, 'isolated', '["p"]', '[]',
  'key 1', true, '2025-10-01 12:00:00+00:00');
INSERT INTO marks (run_id, question, part, position, status, points, out_of, reason, given)
  VALUES (1, '2.11', 'K_s', 0, 'right', 2.0, 2.0, 'Well.', '1.3')
"""


def test_a_gradebook_of_the_first_revision_reads_as_before(url):
    config = Config()
    config.set_main_option("script_location", "labcourse.grading.gradebook:migrations")
    with closing(Database(url)) as database, database.writing() as connection:
        config.attributes["connection"] = connection
        command.upgrade(config, "0001")
        connection.execute(text("INSERT INTO meta (name, value) VALUES ('secret', :value)"), {"value": b"s" * 32})
        for statement in FIRST_ROWS.split(";"):
            connection.exec_driver_sql(statement)
    one = graded("Ada", "first", mark(), key="ada first", answers=None, problems=("p",))
    with Gradebook(url) as book:
        assert book.secret() == b"s" * 32
        assert book.current("ada") == one
        assert book.students() == [StudentRecord("Ada", "Ada L.", "", "A", enrolled=True)]
        assert book.delivered("ada") == []
        before = dump(book)
        assert record(book, one) == 0
        assert dump(book) == before
        assert record(book, graded("ada", "second", claim={"2.11": {}}, files=("h.py",))) == 1


NEXT_REVISION = """
import sqlalchemy as sa
from alembic import op
revision, down_revision = "9999", {head!r}
def upgrade():
    op.add_column("comments", sa.Column("mood", sa.Text, server_default="mild", nullable=False))
"""


def test_an_older_gradebook_is_migrated_and_a_newer_one_refused(url, tmp_path, monkeypatch, undisturbed):
    with Gradebook(url) as book:
        for one in small_class():
            record(book, one)
        secret = book.secret()
    newer = tmp_path / "newer"
    shutil.copytree(Path(schema.__file__).parent / "migrations", newer)
    with closing(Database(url)) as database, database.reading() as connection:
        head = connection.scalar(text(f"SELECT version_num FROM {tables.VERSION_TABLE}"))
    (newer / "versions" / "next.py").write_text(NEXT_REVISION.format(head=head))
    with monkeypatch.context() as patch:
        patch.setattr(schema, "_SCRIPTS", str(newer))
        with Gradebook(url) as book:
            assert (dump(book), book.secret()) == (undisturbed, secret)
    with closing(Database(url)) as database, database.reading() as connection:
        assert "mood" in {column["name"] for column in inspect(connection).get_columns("comments")}
    with pytest.raises(GradebookError, match=r"newer labcourse .*'9999'.*upgrade"):
        Gradebook(url)


def test_somebody_elses_database_is_left_as_it_is(url):
    with closing(Database(url)) as database:
        with database.writing() as connection:
            connection.execute(text("CREATE TABLE students (shoe INTEGER)"))
        with pytest.raises(GradebookError, match="something else than a gradebook"):
            Gradebook(url)
        with database.reading() as connection:
            assert inspect(connection).get_table_names() == ["students"]


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
