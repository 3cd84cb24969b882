"""SQLite or PostgreSQL behind two kinds of transactions: ``reading`` sees one moment, ``writing`` is alone.

There is one writer at a time. Others wait for it, up to ``PATIENCE``, so that a writer may first read.

SQLite keeps its default rollback journal: between transactions a gradebook is one file, which can be copied, and
which may lie on a network drive. A connection ends with its transaction, so that a forked child inherits none.
"""

from __future__ import annotations

import os
import re
import secrets
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import URL, Engine, NullPool, create_engine, event, inspect, make_url, select
from sqlalchemy.exc import ArgumentError, DBAPIError, NoSuchModuleError
from sqlalchemy.orm import Session

from labcourse import program
from labcourse.errors import GradebookError
from labcourse.grading.gradebook import guards  # noqa: F401 - they are made along with the tables
from labcourse.grading.gradebook.records import About, Base
from labcourse.messages import FREE_SPACE

PATIENCE = 30.0  #: s; a transaction takes one at most
VERSION = 6  #: of the tables and guards; raise it when they change
_SECRET_BYTES = 32  # 256 bits
_FORMER_VERSION = "gradebook_version"  # a table of gradebooks before version 6
_WRITERS = 0x726F74666C6578  # the number of the lock that writers take
_DRIVERS = {"sqlite": "sqlite", **dict.fromkeys(("postgresql", "postgres"), "postgresql+psycopg")}
_FORMS = "A gradebook is a file, sqlite:///FILE or postgresql://USER@HOST/NAME"
_SCHEME = re.compile(r"[a-z][\w+.-]+:(?=/)|(postgres|postgresql|sqlite)[\w+]*:", re.IGNORECASE)  # C:/ is a folder
_SECRET = re.compile(r"password\s*=|:[^/\\]+@", re.IGNORECASE)  # of an address in an unknown form


class Database:
    """A database; :meth:`prepare` makes or checks its tables.

    Parameters
    ----------
    url : a file, or the address of a database: ``sqlite:///file`` or ``postgresql://user:password@host/name``

    Attributes
    ----------
    where : its name in messages; never with a password

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
        """Release all connections."""
        self._engine.dispose()

    def prepare(self) -> None:
        """Make the tables of a new gradebook, or check those that are there.

        Raises
        ------
        GradebookError
            If the database holds something else, or a gradebook of another version. It is left as it is.
        """
        with self.reading() as session:
            if self._is_ready(session):
                return
        with self.writing() as session:
            if not self._is_ready(session):  # else another process was first
                Base.metadata.create_all(session.connection())
                session.add(About(VERSION, secrets.token_bytes(_SECRET_BYTES)))

    def _is_ready(self, session: Session) -> bool:
        """Return whether a gradebook is there; False if the database is empty."""
        tables = set(inspect(session.connection()).get_table_names())
        if not tables:
            return False
        if _FORMER_VERSION not in tables and not {About.__tablename__, "students", "audit"} <= tables:
            raise GradebookError(f"{self.where} is not a gradebook. It is left as it is; choose another.")
        version = 0 if _FORMER_VERSION in tables else session.scalar(select(About.version)) or 0
        if version < VERSION:
            name = program.name()
            raise GradebookError(
                f"The gradebook {self.where} was made by an earlier labcourse, and this one cannot read it. It is left "
                f"as it is. Grade the submissions again into a new folder ({name} grade). What persons scored can be "
                f"taken over: write it with the earlier version ({name} score --write TABLE), and read it with this "
                f"one ({name} score --read TABLE)."
            )
        if version > VERSION:
            raise GradebookError(
                f"The gradebook {self.where} was made by a newer labcourse (version {version} of the tables; this one "
                f"knows {VERSION}): upgrade labcourse, or choose another gradebook."
            )
        return True

    def reading(self) -> AbstractContextManager[Session]:
        """Begin a transaction that sees the gradebook as it is at one moment."""
        return self._transaction(self._start_reading)

    def writing(self) -> AbstractContextManager[Session]:
        """Begin a transaction that no other writer disturbs: after an error or a kill, nothing of it is written."""
        return self._transaction(self._start_writing)

    def rebuild(self) -> None:
        """Write all tables anew, and what the database counts of their columns, so that no deleted row is left.

        Until then, deleted rows stay in free pages, and a server's statistics hold common values of each column.
        """
        with self._explained(), self._engine.connect() as connection:
            if connection.dialect.name == "sqlite":
                connection.exec_driver_sql("VACUUM")
            else:
                alone = connection.execution_options(isolation_level="AUTOCOMMIT")
                alone.exec_driver_sql(f"VACUUM (FULL, ANALYZE) {', '.join(Base.metadata.tables)}")

    @contextmanager
    def _transaction(self, start: list[str]) -> Iterator[Session]:
        with self._explained(), Session(self._engine, expire_on_commit=False) as session, session.begin():
            for statement in start:
                session.connection().exec_driver_sql(statement)
            yield session

    @contextmanager
    def _explained(self) -> Iterator[None]:
        try:
            yield
        except DBAPIError as error:
            raise GradebookError(f"The gradebook {self.where}: {_message(error)}") from error
        except OverflowError as error:  # SQLite's driver raises it as it is
            raise GradebookError(f"The gradebook {self.where}: {error}.") from error


def is_address(url: str | Path) -> bool:
    """Return whether a gradebook is named by an address; else it is a file.

    Raises
    ------
    GradebookError
        If it begins like an address, as in ``postgresql:/...``, but cannot be read as one: it may hold a password,
        which should stand in no message and in no name of a file.
    """
    if isinstance(url, Path):
        return False
    scheme = _SCHEME.match(url)
    if not scheme and not _SECRET.search(url):
        return False
    try:
        make_url(url)
    except (ArgumentError, ValueError):
        begin = scheme[0] if scheme else ""
        raise GradebookError(f"{begin}... is neither a file nor an address that can be read: {_FORMS}.") from None
    return True


def _address(url: str | Path) -> URL:
    if not is_address(url):
        return URL.create("sqlite", database=str(url))
    address = make_url(str(url))
    driver = _DRIVERS.get(address.drivername.partition("+")[0])
    if driver is None:
        raise GradebookError(f"{_FORMS}; {address.drivername}://... is none of these.")
    return address.set(drivername=driver)


def _sqlite(address: URL) -> Engine:
    path = Path(address.database or "")
    if not address.database or address.database == ":memory:":
        raise GradebookError("A gradebook in SQLite needs a file, as in sqlite:///gradebook.sqlite.")
    try:  # readable by its owner only: there are marks in it, and a secret
        os.close(os.open(path, os.O_RDWR | os.O_CREAT, 0o600))
    except PermissionError:
        if not path.is_file():  # a file that is there can perhaps be read
            raise GradebookError(f"The gradebook {path} cannot be made: permission denied.") from None
    except OSError as error:
        raise GradebookError(f"The gradebook {path} cannot be opened: {error.strerror}.") from None
    engine = create_engine(address, poolclass=NullPool, connect_args={"timeout": PATIENCE})

    @event.listens_for(engine, "connect")
    def _prepare(connection: Any, _: object) -> None:
        connection.isolation_level = None  # transactions begin where the statements above say
        connection.execute("PRAGMA foreign_keys = ON")
        connection.execute("PRAGMA secure_delete = ON")  # what is deleted is overwritten, and lies in no free page

    return engine


def _postgres(address: URL) -> Engine:
    try:
        return create_engine(address, pool_pre_ping=True)
    except (ImportError, NoSuchModuleError):
        raise GradebookError("PostgreSQL needs its driver: pip install 'labcourse[postgres]'.") from None


def _message(error: DBAPIError) -> str:
    """Return the database's message, without the statement and its values, which are untrusted text."""
    message = str(error.orig).strip()
    if "file is not a database" in message:
        return "this file is not a gradebook. It is left as it is; choose another."
    if "database is locked" in message or "lock timeout" in message:
        return f"another process has been writing to it for {PATIENCE:g} s. Try again when that has ended."
    if "disk is full" in message:
        return f"{message}. {FREE_SPACE} What is in the gradebook stays."
    return f"the database says: {message}"
