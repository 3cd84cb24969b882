"""SQLite or PostgreSQL in two kinds of transactions: ``reading`` sees one moment, ``writing`` shuts other writers out.

There is one writer at a time; others wait for it, up to ``PATIENCE``. So a writer can read first and then write.

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
from labcourse.grading.gradebook.records import About, Base
from labcourse.messages import FREE_SPACE

PATIENCE = 30.0  #: s; a transaction takes 1 s at most
VERSION = 13  #: of the tables and of the data in them; raise it when they change
TAKEN_OVER = 12  #: the version that :mod:`~labcourse.grading.gradebook.earlier` takes over
_SECRET_BYTES = 32  # 256 bits
_WRITERS = 0x726F74666C6578  # the number of the lock that writers take
_DRIVERS = {"sqlite": "sqlite", **dict.fromkeys(("postgresql", "postgres"), "postgresql+psycopg")}
_FORMS = "A gradebook is a file, sqlite:///FILE or postgresql://USER@HOST/NAME"
#: The scheme of an address (C:/ is a folder), or what may be a password in an address of another form.
_ADDRESS = re.compile(
    r"^(?P<scheme>[a-z][\w+.-]+:(?=/)|(postgres|postgresql|sqlite)[\w+]*:)|password\s*=|:[^/\\]+@", re.IGNORECASE
)


class Database:
    """A database; :meth:`prepare` makes or checks its tables.

    Parameters
    ----------
    url : path of a file, or address of a database: ``sqlite:///file`` or ``postgresql://user:password@host/name``

    Attributes
    ----------
    where : name of the database in messages; never with a password

    Raises
    ------
    GradebookError
        If the address is not understood, the driver for it is not installed, or the file cannot be made or opened.
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
        """Make the tables of a new gradebook, or check those of an existing one.

        Raises
        ------
        GradebookError
            If the database holds something else, or a gradebook of another version. Then it is not changed.
        """
        with self.reading() as session:
            if self._is_ready(session):
                return
        with self.writing() as session:
            if not self._is_ready(session):  # else another process was first
                Base.metadata.create_all(session.connection())
                session.add(About(VERSION, secrets.token_bytes(_SECRET_BYTES)))

    def _is_ready(self, session: Session) -> bool:
        """Return True for a gradebook of this version, False for an empty database; raise GradebookError otherwise."""
        if not (tables := set(inspect(session.connection()).get_table_names())):
            return False
        is_former = "gradebook_version" in tables  # before version 6
        if not is_former and not {About.__tablename__, "students", "audit"} <= tables:
            raise GradebookError(f"{self.where} is not a gradebook. It is not changed; choose another.")
        version = 0 if is_former else session.scalar(select(About.version)) or 0
        name = program.name()
        if version < VERSION:
            again = f"Grade the submissions into a new folder ({name} grade), and score them again ({name} score)."
            if version == TAKEN_OVER and self._engine.dialect.name == "sqlite":
                again = (
                    f"{name} grade NEW {self.where} grades the files that are stored in it once more, into a new "
                    "folder; what persons scored comes along."
                )
            raise GradebookError(
                f"The gradebook {self.where} was made by an earlier labcourse, and this one cannot read it. It is not "
                f"changed. {again}"
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
        """Write all tables and the database's statistics anew, so that nothing of a deleted row is left.

        Copies of deleted rows may stay in free space until then, and a server's statistics hold values of each column.
        """
        with self._explained(), self._engine.connect() as connection:
            if connection.dialect.name == "sqlite":
                connection.exec_driver_sql("VACUUM")
            else:
                alone = connection.execution_options(isolation_level="AUTOCOMMIT")
                alone.exec_driver_sql(f"VACUUM (FULL, ANALYZE) {', '.join(Base.metadata.tables)}")

    @contextmanager
    def _transaction(self, start: list[str]) -> Iterator[Session]:
        """Run a block in a transaction that begins with statements; commit at its end, or undo all after an error."""
        with self._explained(), Session(self._engine, expire_on_commit=False) as session, session.begin():
            for statement in start:
                session.connection().exec_driver_sql(statement)
            yield session

    @contextmanager
    def _explained(self) -> Iterator[None]:
        """Raise errors of the database in a block as GradebookError."""
        try:
            yield
        except (DBAPIError, OverflowError) as error:  # SQLite's driver raises OverflowError itself
            raise GradebookError(f"The gradebook {self.where}: {_message(error)}") from error


def is_address(url: str | Path) -> bool:
    """Return whether a gradebook is named by the address of a database; if not, by the path of a file.

    Raises
    ------
    GradebookError
        If the name looks like an address, as ``postgresql:/...`` does, but cannot be read as one. It may hold a
        password, which must not appear in a message or in the name of a file.
    """
    address = None if isinstance(url, Path) else _ADDRESS.search(url)
    if address is None:
        return False
    try:
        make_url(str(url))
    except (ArgumentError, ValueError):
        begin = address["scheme"] or ""
        raise GradebookError(f"{begin}... is neither a file nor an address that can be read: {_FORMS}.") from None
    return True


def _address(url: str | Path) -> URL:
    """Return the address of a file or of a database, with the driver that is used for it. Raises GradebookError."""
    if not is_address(url):
        return URL.create("sqlite", database=str(url))
    address = make_url(str(url))
    driver = _DRIVERS.get(address.drivername.partition("+")[0])
    if driver is None:
        raise GradebookError(f"{_FORMS}; {address.drivername}://... is none of these.")
    return address.set(drivername=driver)


def _sqlite(address: URL) -> Engine:
    """Return the engine for a file of SQLite, which is made if it does not exist. Raises GradebookError."""
    path = Path(address.database or "")
    if not address.database or address.database == ":memory:":
        raise GradebookError("A gradebook in SQLite needs a file, as in sqlite:///gradebook.sqlite.")
    try:  # readable by its owner only: it holds marks and a secret
        os.close(os.open(path, os.O_RDWR | os.O_CREAT, 0o600))
    except OSError as error:
        if not (isinstance(error, PermissionError) and path.is_file()):  # an existing file can perhaps be read
            raise GradebookError(f"The gradebook {path} cannot be opened: {error.strerror}.") from None
    engine = create_engine(address, poolclass=NullPool, connect_args={"timeout": PATIENCE})

    @event.listens_for(engine, "connect")
    def _prepare(connection: Any, _: object) -> None:
        """Set up a new connection."""
        connection.isolation_level = None  # transactions begin by the statements of Database
        connection.execute("PRAGMA foreign_keys = ON")
        connection.execute("PRAGMA secure_delete = ON")  # overwrite what is deleted

    return engine


def _postgres(address: URL) -> Engine:
    """Return the engine for a server of PostgreSQL. Raises GradebookError if its driver is not installed."""
    try:
        return create_engine(address, pool_pre_ping=True)
    except (ImportError, NoSuchModuleError):
        raise GradebookError("PostgreSQL needs its driver: pip install 'labcourse[postgres]'.") from None


def _message(error: DBAPIError | OverflowError) -> str:
    """Return an error of the database as text: without the statement and its values, which are untrusted."""
    message = str(getattr(error, "orig", error)).strip()
    if "file is not a database" in message:
        return "this file is not a gradebook. It is not changed; choose another."
    if "database is locked" in message or "lock timeout" in message:
        return f"another process has been writing to it for {PATIENCE:g} s. Try again when that has ended."
    if "disk is full" in message:
        return f"{message}. {FREE_SPACE} Nothing in the gradebook is lost."
    return f"the database says: {message}"
