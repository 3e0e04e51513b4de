"""The chapter on structures: members, spots, and each member's faces unrolled with its spots."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import psycopg
import shapely
from psycopg.rows import dict_row

from tunneldb.report.drawing import outline_path, step_for
from tunneldb.store.spots import ListedSpot, SpotList, SpotSelection, read_spots
from tunneldb.store.survey import Survey

WIDTH = 1000.0
"""Width of a picture, in its own unit."""

HIDDEN = 0.5
"""Inspected share below which a face or member is marked."""

MAX_LISTED_MEMBERS = 25
"""Number of the largest members listed, with spots or not."""

_BARS = 4  # the bar of a picture is at least a fourth of its width


@dataclass(frozen=True)
class Drawn:
    """Drawn shape: its path, its CSS class, and the place of its number.

    Attributes
    ----------
    path, style : str
    number : int
    x, y : float
        In units of the picture.
    """

    path: str
    style: str
    number: int
    x: float
    y: float


@dataclass(frozen=True)
class Picture:
    """A member's faces, unrolled, with its spots.

    Attributes
    ----------
    number : int
        Number of the member.
    height : float
        Height of the picture, whose width is WIDTH.
    faces, spots : list of Drawn
    bar, metres : float
        Length of the scale bar, in the picture and in truth, m.
    """

    number: int
    height: float
    faces: list[Drawn]
    spots: list[Drawn]
    bar: float
    metres: float


@dataclass(frozen=True)
class StructuresChapter:
    """Content of the chapter.

    Attributes
    ----------
    spots : SpotList
        As listed by `tunneldb spots`.
    members : list of dict
        The largest, those with spots, and those that are bimodal; columns of view ``member_statistics``.
    others, others_area, others_seen : int, float, float
        The rest: number, area, and inspected area, m².
    pictures : list of Picture
        Pictures of the members with spots, and of bimodal ones.
    by_review : dict of str to int
    """

    spots: SpotList
    members: list[dict[str, Any]]
    others: int
    others_area: float
    others_seen: float
    pictures: list[Picture]
    by_review: dict[str, int]

    @property
    def coloured(self) -> bool:
        """True if any of the spots has a colour."""
        return any(spot.rgb for spot in self.spots.rows)

    @property
    def lost(self) -> list[ListedSpot]:
        """Spots that an inspector confirmed and the last run did not find again."""
        return [spot for spot in self.spots.rows if not spot.detected]


def read_structures(
    conn: psycopg.Connection[Any], survey: Survey, stretch: tuple[float, float] | None = None
) -> StructuresChapter | None:
    """Read the structures of a survey; None if members were never searched for.

    Parameters
    ----------
    conn, survey
        Source.
    stretch : (float, float), optional
        Only spots, faces and members with their middle between these chainages, m, and members of these spots.
    """
    spots = read_spots(conn, survey, selection=SpotSelection(stretch=stretch))
    with conn.cursor(row_factory=dict_row) as cursor:
        rows = cursor.execute(
            "SELECT number, kind, length, chainage, label, faces, area, coalesce(seen_share, 0) AS seen_share, bimodal, spots,"
            " dark_area, bright_area, spot_share FROM tunnel_api.member_sheet WHERE survey = %s ORDER BY number",
            [survey.name],
        ).fetchall()
    if not rows and not spots.searched:
        return None
    shown = {spot.member for spot in spots.rows if spot.member is not None}
    if stretch is not None:
        rows = [row for row in rows if row["number"] in shown or _between(row["chainage"], stretch)]
    shown |= {row["number"] for row in rows if row["bimodal"]}
    named = shown | {row["number"] for row in sorted(rows, key=lambda row: -row["area"])[:MAX_LISTED_MEMBERS]}
    listed = [row for row in rows if row["number"] in named]
    others = [row for row in rows if row["number"] not in named]
    return StructuresChapter(
        spots, listed, len(others), sum(row["area"] for row in others), sum(row["area"] * row["seen_share"] for row in others),
        _pictures(conn, survey, sorted(shown), {spot.number for spot in spots.rows}),
        {review: sum(spot.review == review for spot in spots.rows) for review in ("open", "confirmed", "rejected")},
    )  # fmt: skip


def _between(chainage: float | None, stretch: tuple[float, float]) -> bool:
    return chainage is not None and stretch[0] <= chainage <= stretch[1]


def _pictures(conn: psycopg.Connection[Any], survey: Survey, members: list[int], listed: set[int]) -> list[Picture]:
    """Draw members as the atlas of members in QGIS has them."""
    asked = {"survey": survey.name, "members": members}
    faces = conn.execute(
        "SELECT member, number, seen_share, bimodal, public.ST_AsBinary(geom) FROM tunnel_api.face_sheet"
        " WHERE survey = %(survey)s AND member = ANY (%(members)s) ORDER BY number",
        asked,
    ).fetchall()
    spots = conn.execute(
        "SELECT member, number, kind, review, public.ST_AsBinary(geom) FROM tunnel_api.spot_sheet"
        " WHERE survey = %(survey)s AND member = ANY (%(members)s) ORDER BY number",
        asked,
    ).fetchall()
    pictures = []
    for member in members:
        of_face = [
            (
                row[1],
                f"face{' hatched' if row[2] < HIDDEN else ''}{' bimodal' if row[3] else ''}",
                shapely.from_wkb(bytes(row[4])),
            )
            for row in faces
            if row[0] == member
        ]
        of_spot = [
            (row[1], f"spot {row[2]} {row[3]}", shapely.from_wkb(bytes(row[4])))
            for row in spots
            if row[0] == member and row[1] in listed
        ]
        pictures.append(draw_member(member, of_face, of_spot))
    return pictures


def draw_member(
    number: int, faces: list[tuple[int, str, shapely.Geometry]], spots: list[tuple[int, str, shapely.Geometry]]
) -> Picture:
    """Draw a member.

    Parameters
    ----------
    number : int
        The member's.
    faces, spots : list of (int, str, Geometry)
        Number, style and outline on the plane on which they are drawn, m.
    """
    west, south, east, north = shapely.total_bounds([shape for _, _, shape in [*faces, *spots]])
    scale = WIDTH / max(east - west, (north - south) * 2.0)  # what stands upright is not to fill the page

    def drawn(one: tuple[int, str, shapely.Geometry]) -> Drawn:
        which, style, shape = one
        moved = shapely.transform(shape, lambda at: (at - [west, south]) * scale)
        parts = shapely.get_parts(moved)
        path = "".join(outline_path(part, 0.0, (north - south) * scale, 0.5) for part in parts if part.area > 0.0)
        x0, y0, x1, _ = moved.bounds
        return Drawn(path, style, which, (x0 + x1) / 2.0, (north - south) * scale - y0)

    metres = step_for(WIDTH / scale * 100.0, _BARS) / 100.0
    return Picture(number, (north - south) * scale, [*map(drawn, faces)], [*map(drawn, spots)], metres * scale, metres)
