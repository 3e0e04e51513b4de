"""Members, faces and spots of a survey: found in its scan files at full density, kept in the database."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, cast

import psycopg

from tunneldb.database import snapshot
from tunneldb.errors import NotReadyError, UserError
from tunneldb.geometry.units import Units
from tunneldb.pipeline.members import AUTO, FileMembers, Inputs
from tunneldb.pipeline.replace_structures import replace_structures
from tunneldb.pipeline.spot_colours import find_coloured_members
from tunneldb.progress import StartProgress
from tunneldb.radiometry.correction import Kind
from tunneldb.stages.ledger import stage_run
from tunneldb.store.images import load_reference
from tunneldb.store.poses import load_poses
from tunneldb.store.sources import unchanged_file
from tunneldb.store.structures import SavedSpots
from tunneldb.store.surface import load_surface
from tunneldb.store.survey import Survey


@dataclass(frozen=True)
class SurveyMembers:
    """Result of a search, and the changes to earlier spots."""

    members: FileMembers
    spots: SavedSpots


def find_survey_members(conn: psycopg.Connection[Any], survey: Survey, begin: StartProgress) -> SurveyMembers:
    """Find the members of a survey in its scan files, and put them in the place of those found before.

    Results are written in one short transaction, after the files have been read; an interruption before changes nothing.

    Parameters
    ----------
    conn : Connection
        Idle.
    survey : Survey
        Survey of a site or of a tunnel; members in a tunnel have a chainage after stage sections.
    begin : callable
        Called with a text and the number of points before each pass; returns a function that takes the points done.

    Raises
    ------
    UserError
        If nothing is loaded, a file is gone or was changed, or there is no intensity, or no station.
    """
    with snapshot(conn):
        inputs = _inputs(conn, survey)
        row = conn.execute("SELECT tunnel_internal.members_inputs(%s)", [survey.id]).fetchone()
        assert row is not None
        made_from = row[0]
        try:
            surface = None if survey.site else load_surface(conn, survey)
        except UserError:  # before stage sections
            surface = None
    found = find_coloured_members(inputs, begin)
    structures = found.found.structures
    with stage_run(conn, survey.id, None, "members", made_from) as run:
        saved = replace_structures(conn, survey, structures, surface)
        run.counts.update(
            points=found.points,
            far=found.far,
            unposed=found.unknown,
            members=len(structures.members),
            faces=len(structures.faces),
            spots=len(structures.spots),
            left_out=asdict(structures.left_out),
            area=sum(face.area for face in structures.faces),
            seen_area=sum(face.area * face.seen_share for face in structures.faces),
        )
        if found.notes:
            run.counts["note"] = "; ".join(found.notes)
    return SurveyMembers(found, saved)


def _inputs(conn: psycopg.Connection[Any], survey: Survey) -> Inputs:
    if survey.intensity_dimension is None:
        raise UserError(
            f"survey {survey.name} has no intensity, which is required to find spots:"
            f" tunneldb survey set {survey.name} --intensity DIMENSION --intensity-kind KIND"
        )
    if survey.platform != "static":
        raise UserError(f"survey {survey.name} is {survey.platform}; members are found only in scans of a static scanner")
    rows = conn.execute(
        "SELECT path, bytes, checksum, unit, height_unit FROM tunnel.scan_file WHERE survey_id = %s ORDER BY name", [survey.id]
    ).fetchall()
    if not rows:
        raise NotReadyError(f"survey {survey.name} has no files yet: tunneldb load {survey.name} FILE...")
    return Inputs(
        tuple(unchanged_file(*row[:3]) for row in rows),
        survey.intensity_dimension,
        cast(Kind, survey.intensity_kind),
        load_poses(conn, survey),
        AUTO if survey.reference == AUTO else load_reference(conn, survey),
        tuple(Units(*row[3:]) for row in rows),
    )
