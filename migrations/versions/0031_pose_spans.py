"""A kilometre and a file cost the poses that they need, however long the survey's trajectory is.

Revision: 0031, after 0030.
"""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects.postgresql import ARRAY, INT8MULTIRANGE

revision = "0031"
down_revision = "0030"
branch_labels = None
depends_on = None

# As longest_interval and PoseModel.gaps have it (tunneldb/pointcloud/poses.py); of a median in the middle of two, their mean.
TRAJECTORIES = """
WITH step AS (
    SELECT survey_id, time AS until, lag(time) OVER w AS since, time - lag(time) OVER w AS apart
      FROM tunnel.pose WINDOW w AS (PARTITION BY survey_id ORDER BY time)
), ranked AS (
    SELECT survey_id, apart, row_number() OVER (PARTITION BY survey_id ORDER BY apart) AS rank,
           count(*) OVER (PARTITION BY survey_id) AS steps
      FROM step WHERE since IS NOT NULL
), longest AS (
    SELECT survey_id, greatest(1, 10 * avg(apart)) AS longest
      FROM ranked WHERE rank IN ((steps + 1) / 2, steps / 2 + 1) GROUP BY survey_id
)
UPDATE tunnel.survey s
   SET longest_interval = coalesce(l.longest, 1),
       trajectory_gaps = ARRAY(SELECT t.time FROM step g CROSS JOIN LATERAL (VALUES (g.since), (g.until)) AS t (time)
                                WHERE g.survey_id = s.id AND g.apart > l.longest ORDER BY g.since, t.time)
  FROM (SELECT DISTINCT survey_id FROM tunnel.pose) p LEFT JOIN longest l USING (survey_id)
 WHERE p.survey_id = s.id
"""


def upgrade() -> None:
    op.add_column(
        "survey",
        sa.Column(
            "longest_interval", sa.Double(), nullable=True,
            comment="Longest interval of its trajectory that is interpolated over, s; NULL without a trajectory",
        ),
        schema="tunnel",
    )  # fmt: skip
    op.add_column(
        "survey",
        sa.Column(
            "trajectory_gaps", ARRAY(sa.Double()), nullable=True,
            comment="Longer intervals of its trajectory: times from and to, one after the other, s; NULL without a trajectory",
        ),
        schema="tunnel",
    )  # fmt: skip
    op.add_column(
        "file_km",
        sa.Column(
            "seconds", INT8MULTIRANGE(), nullable=True,
            comment="When these were measured: whole seconds between which their gps_time lies; NULL where not known",
        ),
        schema="tunnel",
    )  # fmt: skip
    op.execute(TRAJECTORIES)
