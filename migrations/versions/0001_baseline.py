"""Create all tables, their triggers and the queue: the first schema.

Revision: 0001, after nothing.

The SQL is in `migrations/baseline/`. `tables.sql` is written from the models by `scripts/write_tables.py`; the other files are
written by hand.
"""

from pathlib import Path

from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None

# The audit has a schema of its own: operators own schema tunnel, and the owner of a schema may drop any table in it.
SCHEMAS = """
CREATE SCHEMA tunnel_audit;
CREATE SCHEMA tunnel_queue;
COMMENT ON SCHEMA tunnel IS 'Data of tunneldb; read and edit it through schema tunnel_api';
COMMENT ON SCHEMA tunnel_audit IS 'What people changed by hand; read it through tunnel_api.audit';
COMMENT ON SCHEMA tunnel_queue IS 'Jobs of tunneldb''s batches, kept by procrastinate; read them through tunnel_api.job';
"""
FILES = ("functions", "tables", "partitions", "run", "finding", "waterproof", "as_of", "audit")


def upgrade() -> None:
    op.execute(SCHEMAS)
    _create_queue()
    for name in FILES:
        _run(name)


def _create_queue() -> None:
    """Create procrastinate's tables and functions, which its file names without a schema, in tunnel_queue."""
    before = op.get_bind().exec_driver_sql("SHOW search_path").scalar_one()
    op.execute("SET LOCAL search_path = tunnel_queue")
    _run("procrastinate-3.10")
    op.execute(f"SET LOCAL search_path = {before}")
    _run("queue")


def _run(name: str) -> None:
    path = Path(__file__).parents[1] / "baseline" / f"{name}.sql"
    op.get_bind().exec_driver_sql(path.read_text("utf-8").replace("%", "%%"))
