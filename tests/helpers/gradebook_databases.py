"""Databases that gradebooks are tried on: files, and a real PostgreSQL server, which is started for them."""

import glob
import itertools
import os
import pwd
import shutil
import time
from pathlib import Path

import psycopg
import pytest

KINDS = ["sqlite", pytest.param("postgres", marks=pytest.mark.postgres)]


def programs() -> Path | None:
    """The folder with PostgreSQL's initdb and postgres."""
    on_path = shutil.which("initdb")
    folders = [os.path.dirname(on_path)] if on_path else []
    folders += sorted(glob.glob("/usr/lib/postgresql/*/bin"), reverse=True)
    return next((Path(folder) for folder in folders if os.path.exists(f"{folder}/initdb")), None)


def unprivileged() -> str | None:
    """Whom to run the server as: it refuses root."""
    if os.getuid():
        return None
    names = {entry.pw_name for entry in pwd.getpwall()}
    return "postgres" if "postgres" in names else "nobody"


def wait_for(process, address):
    for _ in range(300):
        assert process.poll() is None, "the server ended"
        try:
            return psycopg.connect(address).close()
        except psycopg.OperationalError:
            time.sleep(0.1)
    raise AssertionError("the server does not answer")


_numbers = itertools.count()


def new_schema(base):
    """The address of a schema of its own: empty as a new database is, and made in no time."""
    name = f"class_{next(_numbers)}"
    with psycopg.connect(base + "postgres") as connection:
        connection.execute(f"CREATE SCHEMA {name}")
    return f"{base}postgres?options=-csearch_path%3D{name}"


def new_file(folder: Path) -> str:
    """The name of a file that is not there yet."""
    return str(folder / f"class {next(_numbers)}.sqlite")
