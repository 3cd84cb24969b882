"""SQLite or PostgreSQL behind one pair of transactions: ``reading`` sees one moment, ``writing`` is alone.

There is one writer at a time. Others wait for it, up to ``PATIENCE``, so that whoever writes may first read.

SQLite keeps its default rollback journal: between transactions a gradebook is one file, that can be copied, and
that may lie on a network drive. A connection ends with its transaction, so that a forked child inherits none.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import URL, Connection, Engine, NullPool, create_engine, event, make_url
from sqlalchemy.exc import ArgumentError, DBAPIError, NoSuchModuleError

from labcourse.errors import GradebookError
from labcourse.messages import FREE_SPACE

PATIENCE = 30.0  #: s; a transaction takes one at most
_WRITERS = 0x726F74666C6578  # the number of the lock that writers take
_POSTGRES = ("postgresql", "postgres")
_FORMS = "A gradebook is a file, sqlite:///FILE or postgresql://USER@HOST/NAME"
_SCHEME = re.compile(r"[a-z][\w+.-]+:(?=/)|(postgres|postgresql|sqlite)[\w+]*:", re.IGNORECASE)  # C:/ is a folder
_SECRET = re.compile(r"password\s*=|:[^/\\]+@", re.IGNORECASE)  # of an address in a form that is none of ours


class Database:
    """A database, not looked at yet.

    Parameters
    ----------
    url : a file, or the address of a database: ``sqlite:///file`` or ``postgresql://user:password@host/name``

    Attributes
    ----------
    where : what messages call it; never with a password

    Raises
    ------
    GradebookError
        If the address is not understood, or the driver for it is not installed.
    """

    def __init__(self, url: str | Path) -> None:
        address = _address(url)
        self.where: str
        if address.get_backend_name() == "sqlite":
            self.where = str(address.database)
            self._engine = _sqlite(address)
            self._start_reading = ["BEGIN"]
            self._start_writing = ["BEGIN IMMEDIATE"]
        else:
            # What stands behind a question mark may be a password, too.
            self.where = address.set(query={}).render_as_string(hide_password=True)
            self._engine = _postgres(address)
            self._start_reading = ["SET TRANSACTION ISOLATION LEVEL REPEATABLE READ, READ ONLY"]
            self._start_writing = [
                f"SET LOCAL lock_timeout = {round(1000 * PATIENCE)}",
                f"SELECT pg_advisory_xact_lock({_WRITERS})",
            ]

    def close(self) -> None:
        """Let go of it."""
        self._engine.dispose()

    @contextmanager
    def reading(self) -> Iterator[Connection]:
        """A transaction that sees the gradebook as it is at one moment."""
        with self._transaction(self._start_reading) as connection:
            yield connection

    @contextmanager
    def writing(self) -> Iterator[Connection]:
        """A transaction that no other writer disturbs: all of it is written, or, after an error or a kill, nothing."""
        with self._transaction(self._start_writing) as connection:
            yield connection

    def rebuild(self, names: Sequence[str]) -> None:
        """Write the tables of these names anew, so that nothing is left where rows were; with what was known of them.

        What was deleted lies on in free pages until then, and a server keeps common values of each column.
        """
        with self._told_in_words(), self._engine.connect() as connection:
            if connection.dialect.name == "sqlite":
                connection.exec_driver_sql("VACUUM")
            else:
                alone = connection.execution_options(isolation_level="AUTOCOMMIT")
                alone.exec_driver_sql(f"VACUUM (FULL, ANALYZE) {', '.join(names)}")

    @contextmanager
    def _transaction(self, start: list[str]) -> Iterator[Connection]:
        with self._told_in_words(), self._engine.begin() as connection:
            for statement in start:
                connection.exec_driver_sql(statement)
            yield connection

    @contextmanager
    def _told_in_words(self) -> Iterator[None]:
        try:
            yield
        except DBAPIError as error:
            raise GradebookError(f"The gradebook {self.where}: {_message(error)}") from error


def is_address(url: str | Path) -> bool:
    """Return whether a gradebook is named by an address; else it is a file.

    Raises
    ------
    GradebookError
        If it begins like an address, as in ``postgresql:/...``, and is none: it may hold a password, which no message
        and no name of a file should.
    """
    if isinstance(url, Path):
        return False
    begin = _SCHEME.match(url)
    if not begin and not _SECRET.search(url):
        return False
    try:
        make_url(url)
    except (ArgumentError, ValueError):
        said = begin[0] if begin else ""
        raise GradebookError(f"{said}... is neither a file nor an address that can be read: {_FORMS}.") from None
    return True


def _address(url: str | Path) -> URL:
    if not is_address(url):
        return URL.create("sqlite", database=str(url))
    address = make_url(str(url))
    scheme = address.drivername
    if scheme.partition("+")[0] in _POSTGRES:
        driver = "postgresql+psycopg"
    elif scheme.partition("+")[0] == "sqlite":
        driver = "sqlite"
    else:
        raise GradebookError(f"{_FORMS}; {scheme}://... is none of these.")
    return address.set(drivername=driver)


def _sqlite(address: URL) -> Engine:
    path = Path(address.database or "")
    if not address.database or address.database == ":memory:":
        raise GradebookError("A gradebook in SQLite needs a file, as in sqlite:///gradebook.sqlite.")
    try:  # made for its owner only: there are marks in it, and a secret
        os.close(os.open(path, os.O_RDWR | os.O_CREAT, 0o600))
    except PermissionError:
        if not path.is_file():  # one that is there may perhaps be read
            raise GradebookError(f"The gradebook {path} cannot be made: permission denied.") from None
    except OSError as error:
        raise GradebookError(f"The gradebook {path} cannot be opened: {error.strerror}.") from None
    engine = create_engine(address, poolclass=NullPool, connect_args={"timeout": PATIENCE})

    @event.listens_for(engine, "connect")
    def _prepare(connection: Any, _: object) -> None:
        connection.isolation_level = None  # transactions begin where we say so
        connection.execute("PRAGMA foreign_keys = ON")
        connection.execute("PRAGMA secure_delete = ON")  # what is deleted is overwritten, and lies in no free page

    return engine


def _postgres(address: URL) -> Engine:
    try:
        return create_engine(address, pool_pre_ping=True)
    except (ImportError, NoSuchModuleError):
        raise GradebookError("PostgreSQL needs its driver: pip install 'labcourse[postgres]'.") from None


def _message(error: DBAPIError) -> str:
    """The database's message; without the statement and its values, which are untrusted text."""
    message = str(error.orig).strip()
    if "file is not a database" in message:
        return "this file is not a gradebook. It is left as it is; choose another."
    if "database is locked" in message or "lock timeout" in message:
        return f"another process has been writing to it for {PATIENCE:g} s. Try again when that has ended."
    if "disk is full" in message:
        return f"{message}. {FREE_SPACE} What is in the gradebook stays."
    return f"the database says: {message}"
