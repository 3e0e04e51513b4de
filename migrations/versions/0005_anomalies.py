"""Leaks become one kind of anomaly, beside joints and dark spots; range curves found on the lining; coverage.

Revision: 0005, after 0004.
"""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects import postgresql

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None


def upgrade() -> None:
    _rename("leak", "anomaly", "What is darker than dry lining: leaks, joints and other dark spots, in three geometries")
    _rename(
        "leak_part",
        "anomaly_part",
        "Dark regions cut by an end of their kilometre, from which anomalies over several are put together",
    )
    _anomaly()
    _anomaly_part()
    _survey()
    _per_kilometre(
        "range_curve",
        "Range curve found on the lining of a kilometre, of surveys whose reference is auto",
        [
            ("range_m", postgresql.ARRAY(sa.Double()), "Ranges, growing, m"),
            ("intensity_db", postgresql.ARRAY(sa.Double()), "Intensity of dry lining at right angles there, dB"),
            ("sigma_db", postgresql.ARRAY(sa.Double()), "Standard deviation of its shape, dB; NULL beyond the ranges seen"),
        ],
    )
    _per_kilometre(
        "coverage",
        "Lining of a kilometre, what was seen of it and what is dark, by steps of chainage",
        [
            ("step", sa.Double(), "Length of a step, m; the first begins with the kilometre"),
            ("lining", postgresql.ARRAY(sa.REAL()), "Lining in each step, seen or not, in the unrolled plane, m²"),
            ("seen", postgresql.ARRAY(sa.REAL()), "What of it was seen within the limits of range and incidence, m²"),
            (
                "wet",
                postgresql.ARRAY(sa.REAL()),
                "What of that is wet: pixels below the threshold, after the median filter, m²",
            ),
        ],
    )
    _one_of("image", "kind", "raw", "corrected", "offset", "state")
    op.alter_column(
        "image", "kind", schema="tunnel",
        comment="raw or corrected intensity, dB, offset from the surface, m, or state of the pixel",
    )  # fmt: skip


def _anomaly() -> None:
    add = [
        sa.Column(
            "kind", sa.Text(), server_default=sa.text("'leak'"), nullable=False,
            comment="What detection takes it for: leak, joint or dark (dark but dry)",
        ),
        sa.Column(
            "reasons", postgresql.ARRAY(sa.Text()), server_default=sa.text("'{}'"), nullable=False,
            comment="Why, such as thin, straight, gradual, rectangular, recess",
        ),
        sa.Column("confidence", sa.Double(), comment="Confidence that it is of its kind, 0 to 1; none from before"),
        sa.Column(
            "contrast", sa.Double(), comment="Mean drop in standard deviations of the dry lining about it; none from before"
        ),
        sa.Column("judged", sa.Text(), comment="What an inspector takes it for, where he says so"),
    ]  # fmt: skip
    for column in add:
        op.add_column("anomaly", column, schema="tunnel")
    for name in ("kind", "judged"):
        _one_of("anomaly", name, "leak", "joint", "dark", new=True)


def _anomaly_part() -> None:
    op.alter_column(
        "anomaly_part", "leak_id", new_column_name="anomaly_id", schema="tunnel",
        comment="Anomaly that it is a part of, if it is large enough",
    )  # fmt: skip
    op.execute("ALTER TABLE tunnel.anomaly_part RENAME CONSTRAINT anomaly_part_leak_id_fkey TO anomaly_part_anomaly_id_fkey")
    op.execute("ALTER INDEX tunnel.anomaly_part_leak_id_idx RENAME TO anomaly_part_anomaly_id_idx")
    op.alter_column(
        "anomaly_part", "mask", schema="tunnel", comment="Its dark pixels, a bit each, row by row from the lowest arc"
    )
    op.add_column(
        "anomaly_part",
        sa.Column(
            "traits", postgresql.ARRAY(sa.Double()), server_default=sa.text("'{}'"), nullable=False,
            comment="Sums over its pixels by which it is told what it is, see Region in leak/region.py",
        ),
        schema="tunnel",
    )  # fmt: skip


def _survey() -> None:
    op.add_column(
        "survey",
        sa.Column(
            "reference", sa.Text(), server_default=sa.text("'none'"), nullable=False,
            comment="Range curve: none, measured on a target (rows in reference) or auto, from the lining of each kilometre",
        ),
        schema="tunnel",
    )  # fmt: skip
    _one_of("survey", "reference", "none", "measured", "auto", new=True)
    op.execute(
        "UPDATE tunnel.survey s SET reference = 'measured'"
        " WHERE EXISTS (SELECT FROM tunnel.reference r WHERE r.survey_id = s.id)"
    )


def _per_kilometre(table: str, comment: str, columns: list[tuple[str, sa.types.TypeEngine, str]]) -> None:
    op.create_table(
        table,
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column("km", sa.Integer(), autoincrement=False, nullable=False, comment="Kilometre: floor(chainage / 1000)"),
        *(sa.Column(name, kind, nullable=False, comment=text) for name, kind, text in columns),
        sa.ForeignKeyConstraint(["survey_id"], ["tunnel.survey.id"], name=op.f(f"{table}_survey_id_fkey"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("survey_id", "km", name=op.f(f"{table}_pkey")),
        schema="tunnel",
        comment=comment,
    )


def _one_of(table: str, column: str, *values: str, new: bool = False) -> None:
    """Restrict a column to some values, in place of an earlier restriction or as a new one."""
    name = f"{table}_{column}_check"
    if not new:
        op.drop_constraint(op.f(name), table, schema="tunnel")
    op.create_check_constraint(op.f(name), table, sa.column(column).in_(values), schema="tunnel")


def _rename(table: str, to: str, comment: str) -> None:
    """Rename a table with all that is named after it."""
    # Nothing that the loop runs comes from outside: names are the catalogue's own, quoted by format.
    op.execute(
        f"""
        DO $$
        DECLARE
            c record;
        BEGIN
            ALTER TABLE tunnel.{table} RENAME TO {to};
            FOR c IN SELECT conname AS name FROM pg_constraint
                      WHERE conrelid = 'tunnel.{to}'::regclass AND starts_with(conname, '{table}_') LOOP
                EXECUTE format('ALTER TABLE tunnel.{to} RENAME CONSTRAINT %I TO %I',
                               c.name, '{to}' || substr(c.name, length('{table}') + 1));
            END LOOP;
            FOR c IN SELECT k.relname AS name FROM pg_class k JOIN pg_index i ON i.indexrelid = k.oid
                      WHERE i.indrelid = 'tunnel.{to}'::regclass AND starts_with(k.relname, '{table}_') LOOP
                EXECUTE format('ALTER INDEX tunnel.%I RENAME TO %I',
                               c.name, '{to}' || substr(c.name, length('{table}') + 1));
            END LOOP;
            ALTER SEQUENCE tunnel.{table}_id_seq RENAME TO {to}_id_seq;
        END
        $$
        """
    )
    op.create_table_comment(to, comment, schema="tunnel")
