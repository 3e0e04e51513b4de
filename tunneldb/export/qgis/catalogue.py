"""An owner's kinds and severities of findings, with the colours and symbols used in QGIS."""

from __future__ import annotations

from dataclasses import dataclass

import psycopg

from tunneldb.finding_kind import SEVERITY_COLOURS, rgb
from tunneldb.store.survey import Survey

SHAPES = {"Polygon": "polygon", "Line": "line", "Point": "point"}
"""Possible symbols of a kind, by the geometry type of a layer."""


@dataclass(frozen=True)
class Look:
    """Symbol of a kind.

    Attributes
    ----------
    colour : str
        Red, green and blue, 0 to 255, as QGIS writes them.
    fill : str
        Brush of polygons.
    pen : str
        Dashes of lines.
    marker : str
        Symbol of points.
    """

    colour: str
    fill: str = "solid"
    pen: str = "solid"
    marker: str = "circle"


# Hues that differ on a grey image, for the colour-blind too by brush, dashes and symbol; red and orange are the severities'.
LOOKS = {
    "leak": Look("0,114,178"),
    "drip": Look("0,183,216", marker="triangle"),
    "crack": Look("179,0,134"),
    "spall": Look("122,75,30", "f_diagonal", marker="diamond"),
    "delamination": Look("123,63,191", "b_diagonal"),
    "efflorescence": Look("127,184,0", "cross", "dot", "star"),
    "damaged_joint": Look("0,121,107", "diagonal_x", "dash", "square"),
    "missing_bolt": Look("20,20,20", marker="cross_fill"),
    "corroded": Look("201,160,0", "horizontal", "dash dot", "pentagon"),
    "obstruction": Look("90,90,138", "vertical", "dash dot dot", "hexagon"),
    "other": Look("230,106,177"),
    "joint": Look("63,174,63", "no"),
    "dark": Look("107,107,107", "dense6"),
}
OWN = (Look("27,158,119"), Look("79,109,0", "f_diagonal", "dash"), Look("140,45,140", "b_diagonal", "dot", "square"))
"""Symbols of an owner's own kinds, in turn."""

HALOS = {severity: ",".join(map(str, rgb(SEVERITY_COLOURS[severity]))) for severity in (4, 3)}
"""Halo colour of severe findings, by severity."""


@dataclass(frozen=True)
class Kind:
    """A kind of findings: see ``tunnel_api.finding_kind``."""

    code: str
    label: str
    shapes: tuple[str, ...]
    look: Look
    wet: bool


@dataclass(frozen=True)
class Catalogue:
    """Choices in a form.

    Attributes
    ----------
    kinds : tuple of Kind
        Offered kinds, in the owner's order.
    severities : dict of int to str
        Word of each degree, 1 to 4.
    dry_region_limit : float
        Area above which a dry region needs a reason and waits for an operator, m².
    """

    kinds: tuple[Kind, ...]
    severities: dict[int, str]
    dry_region_limit: float

    def drawn_as(self, shape: str) -> list[Kind]:
        """Return the kinds that may be drawn as a polygon, a line or a point."""
        return [kind for kind in self.kinds if shape in kind.shapes]


def looks_of(conn: psycopg.Connection) -> dict[str, Look]:
    """Return the symbol of each kind by its code, also of inactive ones."""
    codes = conn.execute("SELECT code FROM tunnel_api.finding_kind ORDER BY position, code").fetchall()
    own = [code for (code,) in codes if code not in LOOKS]
    return LOOKS | {code: OWN[n % len(OWN)] for n, code in enumerate(own)}


def read_catalogue(conn: psycopg.Connection, survey: Survey) -> Catalogue:
    """Read the kinds that are offered, the severities and the limit of a survey's tunnel."""
    rows = conn.execute(
        "SELECT code, label, geometries, wet FROM tunnel_api.finding_kind WHERE active ORDER BY position, code"
    ).fetchall()
    looks = looks_of(conn)
    severities = conn.execute("SELECT id, label FROM tunnel_api.severity ORDER BY id").fetchall()
    limit = conn.execute("SELECT dry_region_limit FROM tunnel_api.tunnel WHERE name = %s", [survey.tunnel]).fetchone()
    assert limit is not None
    return Catalogue(
        tuple(Kind(code, label, tuple(shapes), looks[code], wet) for code, label, shapes, wet in rows),
        dict(severities),
        limit[0],
    )
