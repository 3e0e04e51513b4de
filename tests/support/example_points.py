"""Points of the example survey: lining, floor and a cable along the left wall, as the loader stores them."""

from __future__ import annotations

import numpy as np
import psycopg
from psycopg import sql

from support.example_objects import CORNER
from support.example_survey import KM, NAME, SRID, example_surface
from tunneldb.classification.classes import PointClass
from tunneldb.database.copy import Column, PointZ, copy_binary, pack

CABLE = (-6.6, -6.4)
"""Arcs between which a cable is in front of the lining, m."""

CABLE_OFFSET = 0.15
"""Distance of the cable from the lining, m."""


def add_points(conn: psycopg.Connection, number: int = 60_000, low: float = 12_330.0, high: float = 12_430.0) -> None:
    """Add so many points, evenly from one chainage to another, m."""
    (survey,) = conn.execute("SELECT id FROM tunnel.survey WHERE name = %s", [NAME]).fetchone()  # type: ignore[misc]
    surface, _ = example_surface()
    rng = np.random.default_rng(7)
    chainage = low + (high - low) * (np.arange(number) + 0.5) / number
    arc = rng.uniform(surface.arcs[0, 0], surface.arcs[0, -1], number)
    cable = (arc > CABLE[0]) & (arc < CABLE[1])
    offset = rng.normal(0.0, 0.003, number) + CABLE_OFFSET * cable
    classes = np.where(np.abs(arc) > CORNER, PointClass.GROUND, np.where(cable, PointClass.APPENDAGE, PointClass.LINING))
    columns: dict[str, Column] = {
        "survey_id": np.full(number, survey, np.int32),
        "km": np.full(number, KM, np.int32),
        "chainage": chainage,
        "gps_time": np.arange(number) / 1000.0,
        "geom": PointZ(surface.to_space(chainage, arc, offset), SRID),
        "scan_id": np.ones(number, np.int32),
        "file_id": np.ones(number, np.int32),
        "intensity": rng.normal(20.0, 2.0, number).astype(np.float32),
        "classification": np.zeros(number, np.int16),
        "class": classes.astype(np.int16),
    }
    conn.execute("SELECT tunnel_internal.partition_new(%s, %s)", [survey, KM])
    table = sql.Identifier("tunnel", f"point_s{survey}_km{KM}_new")
    copy_binary(conn, table, list(columns), [pack(list(columns.values()))])
    conn.execute("SELECT tunnel_internal.partition_swap(%s, %s)", [survey, KM])
    conn.commit()
