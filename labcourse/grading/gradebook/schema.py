"""A new, an old or somebody else's database → one with the gradebook's tables, as this software knows them.

The migrations are alembic's, and are run from here. A new one is a module in ``migrations/versions``, whose
``down_revision`` is the newest before; ``tables`` is changed along with it. A released migration is never changed.
"""

from __future__ import annotations

import secrets

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from alembic.util import CommandError
from sqlalchemy import Connection, inspect

from labcourse.errors import GradebookError
from labcourse.grading.gradebook import tables
from labcourse.grading.gradebook.database import Database

_SECRET_BYTES = 32  # 256 bits
_SCRIPTS = "labcourse.grading.gradebook:migrations"


def prepare(database: Database) -> None:
    """Create or migrate the tables, in one transaction.

    Raises
    ------
    GradebookError
        If the database is somebody else's, or newer than this software. It is left as it is.
    """
    config = Config()
    config.set_main_option("script_location", _SCRIPTS)
    scripts = ScriptDirectory.from_config(config)
    with database.reading() as connection:
        if _revision(connection, scripts, database.where) == scripts.get_current_head():
            return
    with database.writing() as connection:
        if _revision(connection, scripts, database.where) == scripts.get_current_head():
            return  # another process was first
        config.attributes["connection"] = connection
        command.upgrade(config, "head")
        if connection.execute(tables.meta.select().where(tables.meta.c.name == "secret")).first() is None:
            secret = {"name": "secret", "value": secrets.token_bytes(_SECRET_BYTES)}
            connection.execute(tables.meta.insert().values(secret))


def _revision(connection: Connection, scripts: ScriptDirectory, where: str) -> str | None:
    """The revision that a database is at; None if it is empty."""
    found = inspect(connection).get_table_names()
    context = MigrationContext.configure(connection, opts={"version_table": tables.VERSION_TABLE})
    revision = context.get_current_revision()
    if revision is None:
        if found:
            raise GradebookError(f"{where} holds something else than a gradebook. It is left as it is; choose another.")
        return None
    try:
        scripts.get_revision(revision)
    except CommandError:
        raise GradebookError(
            f"The gradebook {where} was made by a newer labcourse (its tables are at revision {revision!r}): "
            "upgrade labcourse, or choose another gradebook."
        ) from None
    return revision
