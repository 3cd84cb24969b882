"""What alembic runs the migrations in: the transaction that :mod:`labcourse.grading.gradebook.schema` began."""

from __future__ import annotations

from alembic import context

from labcourse.grading.gradebook import tables

context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=tables.metadata,
    version_table=tables.VERSION_TABLE,
)
context.run_migrations()
