"""The last runs of stages are found by an index, whatever has run before and in other surveys.

Revision: 0030, after 0029.
"""

import sqlalchemy as sa
from alembic import op

revision = "0030"
down_revision = "0029"
branch_labels = None
depends_on = None

SUBJECT = """coalesce(CASE stage
    WHEN 'deviation' THEN parameters ->> 'layer'
    WHEN 'evenness' THEN parameters ->> 'layer'
    WHEN 'thickness' THEN (parameters ->> 'before') || ' ' || (parameters ->> 'layer')
    WHEN 'clearance' THEN (parameters ->> 'track') || ' ' || (parameters ->> 'gauge')
    WHEN 'compare' THEN parameters ->> 'old'
END, '')"""


def upgrade() -> None:
    op.add_column(
        "run",
        sa.Column(
            "subject", sa.Text(), sa.Computed(SUBJECT, persisted=True), nullable=False,
            comment="What tells apart results of a stage that are there side by side, by its parameters: layer of profiles, "
            "older survey, track and outline; empty where there is one of a kilometre",
        ),
        schema="tunnel",
    )  # fmt: skip
    op.drop_index(op.f("run_survey_id_stage_km_idx"), "run", schema="tunnel")
    op.create_index(
        op.f("run_survey_id_stage_km_subject_started_at_id_idx"), "run",
        ["survey_id", "stage", "km", "subject", "started_at", "id"], schema="tunnel",
    )  # fmt: skip
    op.execute("ANALYZE tunnel.run")
