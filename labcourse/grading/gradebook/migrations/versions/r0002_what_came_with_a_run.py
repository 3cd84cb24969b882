"""What came with a run and what its cells reported; the files that were handed in; other names of students."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add columns that are NULL in the rows that are there, and a table."""
    for name in ("cells", "claim", "words", "supplied", "files"):
        op.add_column("runs", sa.Column(name, sa.JSON(), nullable=True))
    op.add_column("runs", sa.Column("release", sa.Text(), nullable=True))
    op.add_column("students", sa.Column("aliases", sa.JSON(), nullable=True))
    op.add_column("students", sa.Column("enrolled", sa.Boolean(), nullable=True))
    op.create_table(
        "deliveries",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("student_id", sa.Integer(), nullable=False),
        sa.Column("name", sa.Text(), nullable=False),
        sa.Column("digest", sa.Text(), nullable=False),
        sa.Column("received", sa.DateTime(timezone=True), nullable=False),
        sa.Column("content", sa.LargeBinary(), nullable=False),
        sa.Column("source", sa.Text(), nullable=False),
        sa.ForeignKeyConstraint(["student_id"], ["students.id"], name=op.f("fk_deliveries_student_id")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_deliveries")),
        sa.UniqueConstraint(
            "student_id",
            "name",
            "digest",
            "received",
            name=op.f("uq_deliveries_student_id_name_digest_received"),
        ),
    )
