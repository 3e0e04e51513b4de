"""A registration of one sonar scan made by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import psycopg

from tunneldb.registration.underwater import LadderFit, Registration, Residual, SonarPose
from tunneldb.store.sonar import SonarRows, save_bed, save_points, save_registration, stored_scans
from tunneldb.store.survey import get_survey

PLACE = np.array([400010.0, 5700020.0, 98.5])


def save_example_registration(conn: psycopg.Connection, name: str) -> Registration:
    residual = Residual("wall", "left", 120, 0.009, 0.03)
    scan = SonarPose(
        Path(__file__), np.eye(3), PLACE, 1.002, np.diag([1e-6, 1e-6, 1e-6, 4e-6, 9e-6, 1.6e-5, 1e-8]), "determined", (),
        (residual,),
    )  # fmt: skip
    across, up, out = np.eye(3)[[0, 2, 1]]
    ladder = LadderFit("left", PLACE + 1.0, up, across, out, 0.0015, (8, 9), (Path(__file__).name,))
    found = Registration((scan,), (ladder,), 100.0)
    survey = get_survey(conn, name)
    save_registration(conn, survey, found, 1)
    (stored,) = stored_scans(conn, survey).values()
    xyz = PLACE + np.array([[0.0, 0.0, -1.0], [0.01, 0.0, -1.02], [0.0, 0.01, -1.01]])
    # the sections of the example are as good as any to be closed: a metre of water
    conn.execute(
        "INSERT INTO tunnel.section_class (section_id, class, angle, radius, points, state)"
        " SELECT c.id, k, -180 + (k + 0.5) * c.angle_step, 1, 9, 'measured'"
        "   FROM tunnel.section c CROSS JOIN generate_series(0, 71) AS k WHERE c.survey_id = %s",
        [survey.id],
    )
    rows = SonarRows(np.full(3, 12345.5), np.full(3, 0.25), xyz, np.full(3, 40), 4, 0, 0)
    save_bed(conn, survey, save_points(conn, survey, stored, rows, 1))
    conn.execute("UPDATE tunnel.water_level SET height = (SELECT avg(ST_ZMin(geom) + 1) FROM tunnel.section)")
    return found
