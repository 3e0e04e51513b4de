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
    rows = SonarRows(np.full(3, 12345.5), np.full(3, 0.25), xyz, np.full(3, 40), 4, 0, 0)
    save_bed(conn, survey, save_points(conn, survey, stored, rows, 1))
    return found
