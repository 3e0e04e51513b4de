"""The queue, what is wanted of each kilometre, files by kilometre, and leaks cut by the end of a kilometre.

Revision: 0002, after 0001.
"""

from pathlib import Path

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects import postgresql

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None

# Procrastinate names its tables and functions without a schema: its functions get theirs here once and for all.
QUALIFY = """
DO $$
DECLARE
    f regprocedure;
BEGIN
    FOR f IN SELECT p.oid FROM pg_proc p WHERE p.pronamespace = 'tunnel_queue'::regnamespace LOOP
        EXECUTE format('ALTER FUNCTION %s SET search_path = tunnel_queue, pg_temp', f);
    END LOOP;
END
$$;
COMMENT ON SCHEMA tunnel_queue IS 'Jobs of tunneldb''s batches, kept by procrastinate; read them through tunnel_api.job';
"""

# Points and the fragments of files that wait to be loaded go as their survey goes.
DROP_POINTS = """
CREATE OR REPLACE FUNCTION tunnel.drop_points() RETURNS trigger
LANGUAGE plpgsql
AS $$
DECLARE
    name text;
BEGIN
    EXECUTE format('DROP TABLE IF EXISTS tunnel.%I', 'point_s' || OLD.id);
    FOR name IN SELECT c.relname FROM pg_class c
                 WHERE c.relnamespace = 'tunnel'::regnamespace
                   AND c.relname ~ ('^fragment_s' || OLD.id || '_f[0-9]+_km-?[0-9]+$') LOOP
        EXECUTE format('DROP TABLE tunnel.%I', name);
    END LOOP;
    RETURN NULL;
END
$$;
"""

# Files loaded before were not told apart by kilometre: each counts whole for all that it touches.
MOVE_FILES = """
INSERT INTO tunnel.file_km (file_id, km, rows, points, read_at, loaded_at)
SELECT f.id, k.km, 0, int8multirange(int8range(0, f.points)), f.loaded_at, f.loaded_at
  FROM tunnel.scan_file f
 CROSS JOIN LATERAL generate_series(
     floor((f.chainage_from - 10) / 1000)::int, floor((f.chainage_to + 10) / 1000)::int) AS k (km)
"""


def _survey() -> sa.Column[int]:
    return sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to")


def _of_survey(table: str) -> sa.ForeignKeyConstraint:
    name = op.f(f"{table}_survey_id_fkey")
    return sa.ForeignKeyConstraint(["survey_id"], ["tunnel.survey.id"], name=name, ondelete="CASCADE")


def _km() -> sa.Column[int]:
    return sa.Column("km", sa.Integer(), autoincrement=False, nullable=False, comment="Kilometre: floor(chainage / 1000)")


def _moment(name: str, comment: str, *, now: bool = False, nullable: bool = False) -> sa.Column[object]:
    default = sa.text("clock_timestamp()") if now else None
    return sa.Column(name, sa.DateTime(timezone=True), server_default=default, nullable=nullable, comment=comment)


def upgrade() -> None:
    schema = Path(__file__).parent.with_name("procrastinate-3.10.sql").read_text("utf-8")
    before = op.get_bind().exec_driver_sql("SHOW search_path").scalar_one()
    op.execute("CREATE SCHEMA tunnel_queue")
    op.execute("SET LOCAL search_path = tunnel_queue")
    op.get_bind().exec_driver_sql(schema.replace("%", "%%"))
    op.execute(f"SET LOCAL search_path = {before}")
    op.execute(QUALIFY)

    op.add_column(
        "run", sa.Column("worker", sa.Text(), nullable=True, comment="Machine and process that it ran on"), schema="tunnel"
    )
    op.add_column(
        "run",
        sa.Column("job_id", sa.BigInteger(), nullable=True, comment="Job of the queue that it was, if it was one"),
        schema="tunnel",
    )
    op.create_index(op.f("run_job_id_idx"), "run", ["job_id"], unique=False, schema="tunnel")
    op.alter_column("run", "stage", comment="read, load, axis, segments, sections, detect", schema="tunnel")
    op.create_table(
        "file_km",
        sa.Column("file_id", sa.Integer(), nullable=False, comment="File (scan_file.id)"),
        _km(),
        sa.Column("rows", sa.BigInteger(), nullable=False, comment="Points of the file that wait or waited to be loaded there"),
        sa.Column(
            "points",
            postgresql.INT8MULTIRANGE(),
            nullable=False,
            comment="Where in the file the points of the kilometre and 10 m to both sides are: ranges of point numbers from 0",
        ),
        _moment("read_at", "When the file was read", now=True),
        _moment("loaded_at", "When they were loaded into the kilometre; none while they wait", nullable=True),
        sa.ForeignKeyConstraint(["file_id"], ["tunnel.scan_file.id"], name=op.f("file_km_file_id_fkey"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("file_id", "km", name=op.f("file_km_pkey")),
        schema="tunnel",
        comment="Which kilometres a file touches. Points read and not loaded yet lie in fragment_s<survey>_f<file>_km<km>",
    )
    op.execute(MOVE_FILES)
    op.create_table(
        "incoming",
        _survey(),
        sa.Column("name", sa.Text(), nullable=False, comment="File name without its folder"),
        sa.Column("path", sa.Text(), nullable=False, comment="Where the file lies"),
        sa.Column("bytes", sa.BigInteger(), nullable=False, comment="Size of the file, bytes"),
        sa.Column("points", sa.BigInteger(), nullable=False, comment="Points that its header announces; 0 if it is unreadable"),
        sa.Column("km_from", sa.Integer(), nullable=True, comment="First kilometre that it may touch, by its header's box"),
        sa.Column("km_to", sa.Integer(), nullable=True, comment="Last kilometre that it may touch, by its header's box"),
        sa.Column(
            "parameters", postgresql.JSONB(), server_default=sa.text("'{}'"), nullable=False, comment="How it is to be read"
        ),
        _moment("requested_at", "When it was asked for", now=True),
        _moment("failed_at", "When reading it failed", nullable=True),
        sa.Column("message", sa.Text(), nullable=True, comment="Why it failed"),
        _of_survey("incoming"),
        sa.PrimaryKeyConstraint("survey_id", "name", name=op.f("incoming_pkey")),
        schema="tunnel",
        comment="Files that a batch is to read, until they are read",
    )
    op.create_table(
        "goal",
        _survey(),
        _km(),
        sa.Column("stage", sa.Text(), nullable=False, comment="Stage up to which the kilometre is to be brought"),
        sa.Column(
            "parameters", postgresql.JSONB(), server_default=sa.text("'{}'"), nullable=False, comment="Parameters of the stages"
        ),
        _moment("requested_at", "When it was asked for", now=True),
        _moment("retry_after", "Stages that failed before this moment are tried again", nullable=True),
        _of_survey("goal"),
        sa.PrimaryKeyConstraint("survey_id", "km", name=op.f("goal_pkey")),
        schema="tunnel",
        comment="What batches want of each kilometre",
    )
    op.create_table(
        "worker",
        sa.Column("id", sa.BigInteger(), autoincrement=False, nullable=False, comment="Key: that of the queue's worker"),
        sa.Column("host", sa.Text(), nullable=False, comment="Machine that it runs on"),
        sa.Column("pid", sa.Integer(), nullable=False, comment="Its process there"),
        _moment("started_at", "When it started", now=True),
        sa.Column(
            "stop",
            sa.Boolean(),
            server_default=sa.text("false"),
            nullable=False,
            comment="Whether it was asked to finish what it is at and leave",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("worker_pkey")),
        schema="tunnel",
        comment="Workers that serve the queue",
    )
    op.create_table(
        "leak_part",
        sa.Column("id", sa.BigInteger(), sa.Identity(always=True), nullable=False, comment="Key"),
        _survey(),
        sa.Column("km", sa.Integer(), nullable=False, comment="Kilometre: floor(chainage / 1000)"),
        sa.Column("pixel", sa.Double(), nullable=False, comment="Edge of a pixel, m"),
        sa.Column(
            "box",
            postgresql.ARRAY(sa.Integer()),
            nullable=False,
            comment="First column (chainage / pixel), first row (arc / pixel), columns and rows of the mask",
        ),
        sa.Column(
            "mask", sa.LargeBinary(), nullable=False, comment="Its wet pixels, a bit each, row by row from the lowest arc"
        ),
        sa.Column("filled", sa.BigInteger(), nullable=False, comment="Its pixels that hold measured data"),
        sa.Column("drop_sum", sa.Double(), nullable=False, comment="Sum over them of the drop below dry lining, dB"),
        sa.Column("drop_max", sa.Double(), nullable=False, comment="Greatest drop below dry lining, dB"),
        sa.Column("leak_id", sa.BigInteger(), nullable=True, comment="Leak that it is a part of, if it is large enough"),
        _of_survey("leak_part"),
        sa.ForeignKeyConstraint(["leak_id"], ["tunnel.leak.id"], name=op.f("leak_part_leak_id_fkey"), ondelete="SET NULL"),
        sa.PrimaryKeyConstraint("id", name=op.f("leak_part_pkey")),
        schema="tunnel",
        comment="Wet regions cut by an end of their kilometre, from which leaks over several kilometres are put together",
    )
    op.create_index(op.f("leak_part_survey_id_km_idx"), "leak_part", ["survey_id", "km"], unique=False, schema="tunnel")
    op.create_index(op.f("leak_part_leak_id_idx"), "leak_part", ["leak_id"], unique=False, schema="tunnel")
    op.execute(DROP_POINTS)
