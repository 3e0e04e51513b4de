"""Running sums of the lining, and the statistics of each kilometre kept until a leak or the lining in it changes.

Revision: 0007, after 0006.
"""

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None


# Whoever asks for a stretch needs the sums at its ends and at those of its leaks: without these, of all steps before each.
_RUNNING_SUMS = """
CREATE FUNCTION tunnel.running_sums(steps real[]) RETURNS double precision[]
LANGUAGE sql IMMUTABLE STRICT PARALLEL SAFE
AS $$
    SELECT 0::double precision || array_agg(t.total ORDER BY t.n)
      FROM (SELECT s.n, sum(s.step::double precision) OVER (ORDER BY s.n ROWS UNBOUNDED PRECEDING) AS total
              FROM unnest(steps) WITH ORDINALITY AS s (step, n)) AS t
$$;
COMMENT ON FUNCTION tunnel.running_sums(real[]) IS 'Sums of the steps of a kilometre before each of them, and of all';
"""


def upgrade() -> None:
    op.execute(_RUNNING_SUMS)
    for name in ("lining", "seen", "wet"):
        op.add_column(
            "coverage",
            sa.Column(
                f"{name}_sums", sa.ARRAY(sa.Double()), sa.Computed(f"tunnel.running_sums({name})", persisted=True),
                comment=f"Sum of {name} before each step, and of all, m²",
            ),
            schema="tunnel",
        )  # fmt: skip
    # the longest leak tells how far before a stretch one that reaches into it may begin
    op.create_index("anomaly_length_idx", "anomaly", ["survey_id", sa.text("(chainage_to - chainage_from)")], schema="tunnel")
    _waterproof()
    for statement in (_NOTE_ANOMALY, _NOTE_COVERAGE, _FORGET):
        op.execute(statement)


def _waterproof() -> None:
    statistics = (
        ("lining_area", sa.Double(), "Lining, seen or not, m²"),
        ("seen_share", sa.Double(), "Share of it that was seen"),
        ("wet_area", sa.Double(), "Area of the leaks within the kilometre, m²"),
        ("wet_ratio", sa.Double(), "wet_area, of the lining seen"),
        ("patches", sa.Integer(), "Leaks in the kilometre or over its ends"),
        ("largest_area", sa.Double(), "Area of the largest of them, whole, m²"),
        ("largest_leak", sa.BigInteger(), "Its id"),
        ("window_patches", sa.Integer(), "Most leaks in any 100 m² of lining"),
        ("window_from", sa.Double(), "Where those 100 m² begin, m"),
        ("window_to", sa.Double(), "Where they end, m"),
        ("window_wet_area", sa.Double(), "Greatest wet area in any 100 m² of lining, m²"),
        ("class", sa.Integer(), "Best class of waterproofing that the lining seen keeps"),
    )
    op.create_table(
        "waterproof",
        sa.Column("id", sa.BigInteger(), sa.Identity(always=True), nullable=False, comment="Key"),
        sa.Column("survey_id", sa.Integer(), nullable=False, comment="Survey that the row belongs to"),
        sa.Column("km", sa.Integer(), nullable=False, comment="Kilometre: floor(chainage / 1000)"),
        sa.Column("chainage_from", sa.Double(), comment="Where its stretch begins, m; NULL in a row that notes a change"),
        sa.Column("chainage_to", sa.Double(), comment="Where it ends, m"),
        *(sa.Column(name, kind, comment=comment) for name, kind, comment in statistics),
        sa.PrimaryKeyConstraint("id", name="waterproof_pkey"),
        sa.ForeignKeyConstraint(
            ["survey_id"], ["tunnel.survey.id"], name="waterproof_survey_id_fkey", ondelete="CASCADE"
        ),
        schema="tunnel",
        comment="Statistics of waterproofing of kilometres, and notes that something changed there: the statistics hold "
        "while their row is the only one of its kilometre. Deleting rows may make others hold that do not: tunneldb init "
        "works all out anew",
    )  # fmt: skip
    op.create_index("waterproof_survey_id_km_idx", "waterproof", ["survey_id", "km"], schema="tunnel")


# A note a kilometre, by whoever changes something, in the same transaction: new rows only, so that nobody waits for anybody. A
# survey that is being deleted takes its notes along.
_NOTE_ANOMALY = """
CREATE FUNCTION tunnel.note_anomaly() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SET search_path = pg_catalog, pg_temp
AS $$
BEGIN
    INSERT INTO tunnel.waterproof (survey_id, km)
    SELECT DISTINCT c.survey_id, k.km
      FROM changed c
      JOIN tunnel.survey s ON s.id = c.survey_id
     CROSS JOIN generate_series(
            floor((c.chainage_from - 0.01) / 1000)::int, floor((c.chainage_to + 0.01) / 1000)::int) AS k (km);
    RETURN NULL;
END
$$;
COMMENT ON FUNCTION tunnel.note_anomaly() IS
'Trigger on tunnel.anomaly: notes the kilometres that what changed reaches into';
CREATE TRIGGER note_insert AFTER INSERT ON tunnel.anomaly
    REFERENCING NEW TABLE AS changed FOR EACH STATEMENT EXECUTE FUNCTION tunnel.note_anomaly();
CREATE TRIGGER note_update_old AFTER UPDATE ON tunnel.anomaly
    REFERENCING OLD TABLE AS changed FOR EACH STATEMENT EXECUTE FUNCTION tunnel.note_anomaly();
CREATE TRIGGER note_update_new AFTER UPDATE ON tunnel.anomaly
    REFERENCING NEW TABLE AS changed FOR EACH STATEMENT EXECUTE FUNCTION tunnel.note_anomaly();
CREATE TRIGGER note_delete AFTER DELETE ON tunnel.anomaly
    REFERENCING OLD TABLE AS changed FOR EACH STATEMENT EXECUTE FUNCTION tunnel.note_anomaly();
"""

_NOTE_COVERAGE = """
CREATE FUNCTION tunnel.note_coverage() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SET search_path = pg_catalog, pg_temp
AS $$
BEGIN
    INSERT INTO tunnel.waterproof (survey_id, km)
    SELECT c.survey_id, c.km FROM changed c JOIN tunnel.survey s ON s.id = c.survey_id;
    RETURN NULL;
END
$$;
COMMENT ON FUNCTION tunnel.note_coverage() IS 'Trigger on tunnel.coverage: notes the kilometres whose lining changed';
CREATE TRIGGER note_insert AFTER INSERT ON tunnel.coverage
    REFERENCING NEW TABLE AS changed FOR EACH STATEMENT EXECUTE FUNCTION tunnel.note_coverage();
CREATE TRIGGER note_update_old AFTER UPDATE ON tunnel.coverage
    REFERENCING OLD TABLE AS changed FOR EACH STATEMENT EXECUTE FUNCTION tunnel.note_coverage();
CREATE TRIGGER note_update_new AFTER UPDATE ON tunnel.coverage
    REFERENCING NEW TABLE AS changed FOR EACH STATEMENT EXECUTE FUNCTION tunnel.note_coverage();
CREATE TRIGGER note_delete AFTER DELETE ON tunnel.coverage
    REFERENCING OLD TABLE AS changed FOR EACH STATEMENT EXECUTE FUNCTION tunnel.note_coverage();
"""

_FORGET = """
CREATE FUNCTION tunnel.forget_waterproof() RETURNS trigger
LANGUAGE plpgsql VOLATILE PARALLEL UNSAFE SET search_path = pg_catalog, pg_temp
AS $$
BEGIN
    BEGIN
        TRUNCATE tunnel.waterproof;
    EXCEPTION
        WHEN object_in_use THEN  -- it is being emptied with the others, or changes in them are still to be worked out
            DELETE FROM tunnel.waterproof;
    END;
    RETURN NULL;
END
$$;
COMMENT ON FUNCTION tunnel.forget_waterproof() IS
'Trigger on tunnel.anomaly and tunnel.coverage: where they are emptied at once, what is kept of their kilometres goes, too';
CREATE TRIGGER note_truncate AFTER TRUNCATE ON tunnel.anomaly
    FOR EACH STATEMENT EXECUTE FUNCTION tunnel.forget_waterproof();
CREATE TRIGGER note_truncate AFTER TRUNCATE ON tunnel.coverage
    FOR EACH STATEMENT EXECUTE FUNCTION tunnel.forget_waterproof();
"""
