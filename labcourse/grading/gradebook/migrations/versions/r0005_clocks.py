"""How the time at which a file was handed in is known."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add a column that is NULL in the rows that are there."""
    op.add_column("deliveries", sa.Column("clock", sa.Text(), nullable=True))
