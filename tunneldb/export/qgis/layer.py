"""The layers of a project: which view, which style, in which group and in which map themes."""

from __future__ import annotations

from dataclasses import dataclass

from tunneldb.finding_kind import DETECTED

MAP, UNROLLED, SPACE = "Map", "Unrolled", "3D"
"""Groups of the layer tree, and the map themes of the same names."""

FINDINGS, FINDINGS_MAP = "Findings", "Findings on the map"
"""Map themes for drawing findings, on the unrolled lining and beside the axis; the first also names the layer group."""

LISTS = "Lists"
"""Group of the tables with the choices of forms."""

SHEETS = "Inspection sheets"
"""Print layout, and its map theme."""


STRUCTURES, FACES = "Structures", "Faces"
"""Group of the layers of structures, and its subgroup of unrolled faces, with a map theme of its name."""

UNDERWATER = "Under water"
"""Group of the layers of sonar scans, with the raster of the bed."""

CLEARANCE = "Clearance"
"""Group of the layers of clearance, except those on the unrolled plane."""
DEVIATION = "Deviation"
"""Map theme of deviation from the design, and print layout of its sheets."""

CHANGE, CHANGE_MAP = "Change", "Change on the map"
"""Map themes of changes since an older survey, on the unrolled lining and beside the axis."""

MEMBERS = "Members"
"""Print layout with a page for each member."""


@dataclass(frozen=True)
class VectorLayer:
    """A layer on a view of schema tunnel_api.

    Attributes
    ----------
    id : str
        Unique in the project.
    title : str
        Title in the legend.
    view : str
        View in tunnel_api, whose integer key is the column ``id``.
    column : str
        Its geometry column.
    wkb : str
        Geometry type as QGIS calls it, with Z where the data have it.
    style : str
        Style file, without its ending.
    group : str
        Group of the layer tree.
    themes : tuple of str
        Map themes that show it.
    edited : bool
        True if it is for editing; the others are read-only in QGIS.
    where : str
        Condition on the rows that it shows, beside that on the survey.
    part : str
        Subgroup in its group, if any.
    of_tunnel : bool
        True if it shows the rows of all surveys of the tunnel.
    """

    id: str
    title: str
    view: str
    wkb: str
    style: str
    group: str
    themes: tuple[str, ...]
    edited: bool = False
    column: str = "geom"
    where: str = ""
    part: str = ""
    of_tunnel: bool = False

    @property
    def on_map(self) -> bool:
        """True if its coordinates are in the tunnel's SRID; otherwise they are in an unrolled plane."""
        return self.group not in (UNROLLED, FACES)

    @property
    def path(self) -> tuple[str, ...]:
        """Groups of the layer tree around it, from the outermost."""
        if self.part:
            return (self.group, self.part)
        return (STRUCTURES, FACES) if self.group == FACES else (self.group,)

    @property
    def geometry(self) -> str:
        """Kind of geometry without dimension, as QGIS names it in a project: Point, Line or Polygon."""
        return {"Point": "Point", "LineString": "Line", "Polygon": "Polygon"}[self.wkb.removesuffix("Z").removeprefix("Multi")]

    @property
    def shows_findings(self) -> bool:
        """True if it shows findings of all kinds: style and form depend on the owner's catalogue."""
        return self.style == "finding"

    @property
    def on_sheet(self) -> bool:
        """True if it is drawn only on the inspection sheets."""
        return self.themes == (SHEETS,)


SHEET_FINDING = "sheet_finding"
"""View of the findings of the inspection sheets, and the table that these list."""

_DETECTED = ", ".join(f"'{kind}'" for kind in DETECTED)
DRY_DARK = (
    f'NOT "wet" AND NOT "superseded" AND coalesce("kind_detected", "kind") IN ({_DETECTED})'
    " AND public.geometrytype(\"geom\") = 'POLYGON'"
)
"""Condition that a finding is dark on the image and dry: a joint, or what else was found dark and is no leak."""


def only(wkb: str) -> str:
    """Return the condition for rows of a geometry type: QGIS adds it only if it finds others on opening the layer."""
    return f"public.geometrytype(\"geom\") = '{wkb.upper()}'"


def _findings(suffix: str, group: str, theme: str, z: str = "", where: str = "") -> tuple[VectorLayer, ...]:
    """Return the layers of findings of a view: points above lines above areas, editable on the lining and on the map."""
    on_sheet = suffix == "sheet"
    return tuple(
        VectorLayer(
            f"finding_{shape}_{suffix}", f"Findings: {title}{' (sheets)' if on_sheet else ''}",
            SHEET_FINDING if on_sheet else f"finding_{suffix}", wkb + z, "finding", group, (theme,),
            edited=not (z or on_sheet), where=" AND ".join(filter(None, [where, only(wkb)])),
            part=SHEETS if on_sheet else FINDINGS,
        )
        for shape, title, wkb in (("point", "points", "Point"), ("line", "lines", "LineString"), ("area", "areas", "Polygon"))
    )  # fmt: skip


# In drawing order within a group, from the top.
LAYERS = (
    VectorLayer("action_map", "Actions of the tunnel", "action_map", "Point", "action", MAP, (MAP,), True, of_tunnel=True),
    *_findings("map", MAP, FINDINGS_MAP),
    VectorLayer("axis_vertex", "Axis vertices (editable)", "axis_vertex", "PointZ", "axis_vertex", MAP, (MAP,), True),
    VectorLayer("leak_map", "Leaks beside the axis, unrolled (review)", "leak_map", "Polygon", "leak", MAP, (MAP,), True),
    VectorLayer(
        "dark_map", "Dry dark areas, map (review)", "finding_map", "Polygon", "dark", MAP, (), True,
        where=DRY_DARK,
    ),
    VectorLayer("target_sphere", "Target spheres", "target_sphere", "PointZ", "target_sphere", MAP, (MAP, SPACE)),
    VectorLayer("axis", "Axis", "axis", "LineStringZ", "axis", MAP, (MAP, SPACE, FINDINGS_MAP)),
    VectorLayer("segment", "Segments", "segment", "LineStringZ", "segment", MAP, (MAP,)),
    VectorLayer("section", "Sections", "section", "LineStringZ", "section", MAP, (MAP, SPACE)),
    VectorLayer("outline", "Walls, at their widest", "outline", "LineString", "outline", MAP, (MAP, FINDINGS_MAP)),
    VectorLayer("cluster", "Objects, rails, fixtures", "cluster", "Polygon", "cluster", MAP, (MAP,)),
    VectorLayer(
        "detectability_map", "What could be found, beside the axis", "detectability_map", "Polygon", "detectability", MAP, ()
    ),
    VectorLayer(
        "action_unrolled", "Actions of the tunnel, on the lining", "action_unrolled", "Point", "action", UNROLLED, (UNROLLED,),
        True, of_tunnel=True,
    ),
    *_findings("unrolled", UNROLLED, FINDINGS),
    VectorLayer(
        "coverage_gap", "Where leaks could be missed", "coverage_gap", "Polygon", "coverage_gap", UNROLLED, (UNROLLED, SHEETS)
    ),
    VectorLayer("dark_band", "Dark bands, wet or dirty", "dark_band", "Polygon", "dark_band", UNROLLED, (UNROLLED, SHEETS)),
    VectorLayer("detectability", "What could be found", "detectability", "Polygon", "detectability", UNROLLED, ()),
    VectorLayer("leak_unrolled", "Leaks (review)", "leak_unrolled", "Polygon", "leak", UNROLLED, (UNROLLED,), True),
    VectorLayer(
        "dark_unrolled", "Dry dark areas (review)", "finding_unrolled", "Polygon", "dark", UNROLLED, (), True,
        where=DRY_DARK,
    ),
    VectorLayer("region", "Regions drawn by hand", "region", "Polygon", "region", UNROLLED, (UNROLLED, FINDINGS), True),
    VectorLayer(
        "section_unrolled", "Sections, unrolled", "section_unrolled", "LineString", "section_unrolled", UNROLLED,
        (UNROLLED,),
    ),
    VectorLayer("sheet", "Sheets of 50 m", "sheet", "Polygon", "sheet", UNROLLED, (UNROLLED, FINDINGS)),
    *_findings("sheet", UNROLLED, SHEETS, where='"shown"'),
    VectorLayer(
        "leak_sheet", "Leaks, numbered (sheets)", "sheet_leak", "Polygon", "leak_sheet", UNROLLED, (SHEETS,),
        where="\"review\" <> 'rejected' AND \"detected\"",
    ),
    VectorLayer("leak_3d", "Leaks in space (review)", "leak_3d", "PolygonZ", "leak_3d", SPACE, (SPACE,), True),
    *_findings("3d", SPACE, SPACE, "Z", '"manual" AND NOT "wet"'),
    VectorLayer("ground", "Ground", "ground", "LineStringZ", "ground", SPACE, (SPACE,)),
)  # fmt: skip

SCANNER_LAYERS = (
    VectorLayer("scan_station", "Where the scanner stood", "scan_station", "PointZ", "scan_station", MAP, (MAP, SPACE)),
    VectorLayer("trajectory", "The scanner's way", "trajectory", "LineStringZ", "trajectory", MAP, ()),
)
"""Layers of a survey with known scanner positions. The trajectory is off at first: each view of it reads all of it."""

STRUCTURE_LAYERS = (
    VectorLayer("spot_map", "Spots on the map (review)", "spot_map", "Polygon", "spot", STRUCTURES, (MAP,), True),
    VectorLayer("member", "Members", "member", "LineStringZ", "member", STRUCTURES, (MAP,)),
    VectorLayer("spot_3d", "Spots in space (review)", "spot_3d", "PolygonZ", "spot_3d", STRUCTURES, (SPACE,), True),
    VectorLayer("face", "Faces", "face", "MultiPolygonZ", "face", STRUCTURES, (MAP,)),
    VectorLayer("face_3d", "Faces in space", "face_3d", "MultiPolygonZ", "face_3d", STRUCTURES, (SPACE,)),
    VectorLayer("spot_sheet", "Spots on faces (review)", "spot_sheet", "Polygon", "spot", FACES, (FACES,), True),
    VectorLayer("member_sheet", "Pages of members", "member_sheet", "Polygon", "member_sheet", FACES, (FACES,)),
    VectorLayer("face_sheet", "Faces, unrolled", "face_sheet", "MultiPolygon", "face_sheet", FACES, (FACES,)),
)
"""Layers of structures: of a site, and of a survey of a tunnel in which members were found."""

UNDERWATER_LAYERS = (
    VectorLayer("sonar_scan", "Sonar stations", "sonar_scan", "PointZ", "sonar_scan", UNDERWATER, (MAP, SPACE)),
    VectorLayer(
        "sonar_ellipse", "Error ellipses, 95 %, 100 times as large", "sonar_ellipse", "Polygon", "sonar_ellipse", UNDERWATER,
        (MAP,),
    ),
    VectorLayer("ladder", "Ladders", "ladder", "PointZ", "ladder", UNDERWATER, (MAP,)),
    VectorLayer("waterline", "Waterlines", "waterline", "LineStringZ", "waterline", UNDERWATER, (MAP, SPACE)),
    VectorLayer(
        "section_part", "Sections below the water", "section_part", "LineStringZ", "section_part", UNDERWATER, (MAP, SPACE),
        where="\"part\" <> 'lining'",
    ),
)  # fmt: skip
"""Layers of a survey of a canal tunnel with registered sonar scans."""

CLEARANCE_LAYERS = (
    VectorLayer(
        "clearance_infringement_3d", "Infringements of the clearance", "clearance_infringement_3d", "MultiPointZ",
        "clearance_infringement_3d", CLEARANCE, (MAP, SPACE),
    ),
    VectorLayer("clearance_map", "Margins along the track", "clearance_map", "LineString", "clearance_map", CLEARANCE, (MAP,)),
    VectorLayer(
        "clearance_infringement_unrolled", "Infringements of the clearance, on the lining", "clearance_infringement_unrolled",
        "MultiPolygon", "clearance_infringement_unrolled", UNROLLED, (UNROLLED,),
    ),
    VectorLayer(
        "clearance_unrolled", "Margins along the track, by outline and track", "clearance_unrolled", "Polygon",
        "clearance_unrolled", UNROLLED, (UNROLLED,),
    ),
)  # fmt: skip
"""Layers of a survey with measured clearance; each only if it has rows."""
RING_LAYERS = (
    VectorLayer("ring_map", "Rings beside the axis, by ovality", "ring_map", "Polygon", "ring", MAP, ()),
    VectorLayer("ring_unrolled", "Rings, by ovality", "ring_unrolled", "Polygon", "ring", UNROLLED, ()),
)
"""Layers of a survey whose lining has rings."""
RATING_LAYERS = (
    VectorLayer("rating_map", "Rating, beside the axis", "rating_map", "MultiPolygon", "rating", MAP, (MAP,)),
    VectorLayer("rating_unrolled", "Rating", "rating_unrolled", "MultiPolygon", "rating", UNROLLED, (UNROLLED,)),
)
"""Layers of a rating by one scheme, which who writes the project names."""
DEVIATION_LAYERS = (
    VectorLayer("deviation_map", "Over- and underbreak", "deviation_map", "LineString", "deviation_map", MAP, ()),
    VectorLayer(
        "evenness_area", "Uneven: gap over the limit", "evenness_area", "Polygon", "evenness_area", UNROLLED, (DEVIATION,)
    ),
    VectorLayer(
        "deviation_bar", "Over- and underbreak by metre", "deviation_bar", "Polygon", "deviation_bar", UNROLLED, (DEVIATION,)
    ),
)
"""Layers of a survey that was compared with a design."""

CHANGE_LAYERS = (
    VectorLayer(
        "leak_change_map", "What became of leaks, beside the axis", "leak_change_map", "MultiPolygon", "leak_change", MAP,
        (CHANGE_MAP,),
    ),
    VectorLayer(
        "change_region_map", "Changed lining, beside the axis", "change_region_map", "Polygon", "change_region", MAP,
        (CHANGE_MAP,),
    ),
    VectorLayer(
        "leak_change_unrolled", "What became of leaks", "leak_change_unrolled", "MultiPolygon", "leak_change", UNROLLED,
        (CHANGE,),
    ),
    VectorLayer(
        "change_region_unrolled", "Changed lining", "change_region_unrolled", "Polygon", "change_region", UNROLLED, (CHANGE,)
    ),
    VectorLayer(
        "change_region_3d", "Changed lining, in space", "change_region_3d", "PolygonZ", "change_region_3d", SPACE, (SPACE,)
    ),
)  # fmt: skip
"""Layers of a survey that was compared with an older one; each only if it has rows."""

UNDER_CHANGE = {"axis": (CHANGE_MAP,), "outline": (CHANGE_MAP,), "sheet": (CHANGE,)}
"""Other layers in the themes of change."""
