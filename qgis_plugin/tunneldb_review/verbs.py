"""The verbs that are offered as algorithms, in the order in which one uses them."""

from __future__ import annotations

from dataclasses import replace
from typing import Tuple

from .description import Command, Parameter

BEGIN, STAGES, FINDINGS, SHAPE, HAND_OVER = "1 Begin", "2 Stages", "3 Leaks and findings", "4 Shape and change", "5 Hand over"

SURVEY = Parameter("SURVEY", "Survey", "", "survey", "Name of the survey.", required=True)
KM = Parameter("KM", "Kilometres", "--km", "text", "Only these, 12 or 12-14; all by default.")
FROM = Parameter("FROM", "From", "--from", "text", "Station, as 12+345.678, or chainage in plain metres.")
TO = Parameter("TO", "To", "--to", "text", "Station or chainage.")
FILES = Parameter(
    "FILES",
    "Scan files",
    "",
    "files",
    "LAS, LAZ, E57, PTX, PTS, PLY or tables of points, at paths that the command sees.",
    required=True,
)
SET = Parameter(
    "SET", "Parameters", "--set", "texts", "NAME=VALUE, with ; between: leak.min_area=0.1; leak.threshold=3.", advanced=True
)
DENSITY = Parameter("DENSITY", "Density", "--density", "text", "Points per m² to keep, 1 or more, or all.", advanced=True)
LAYER = Parameter(
    "LAYER",
    "Layer of the design",
    "--layer",
    "choice",
    "Which design profiles hold.",
    default="lining",
    choices=("lining", "shotcrete", "excavation"),
)
MIN_AREA = Parameter("MIN_AREA", "From this area, m²", "--min-area", "number", "Smaller ones are left out.", minimum=0)
GEOMETRY = Parameter(
    "GEOMETRY",
    "Coordinates",
    "--geometry",
    "choice",
    "Chainage and arc; the strip beside the axis; on the lining in space.",
    default="unrolled",
    choices=("unrolled", "map", "3d"),
)


def _number(name: str, title: str, option: str, text: str, least: float = 0, *, advanced: bool = False) -> Parameter:
    return Parameter(name, title, option, "number", text, minimum=least, advanced=advanced)


def _flag(name: str, title: str, option: str, text: str, *, advanced: bool = False) -> Parameter:
    return Parameter(name, title, option, "flag", text, advanced=advanced)


def _output(filter_: str, title: str = "File", *, required: bool = False) -> Parameter:
    return Parameter("OUTPUT", title, "-o", "output", "File to write.", required=required, filter=filter_)


def _stage(name: str, title: str, option: str, *stages: str) -> Parameter:
    return Parameter(name, title, option, "choice", "Stage.", choices=stages)


_STAGES = ("axis", "segments", "sections", "ground", "detect")
_TABLES = "GeoPackage (*.gpkg);;GeoJSON (*.geojson);;CSV (*.csv);;Excel (*.xlsx)"
_CLOCK = Parameter("CLOCK", "Hours", "--clock", "text", "Only those between, clockwise; 12 is the crown: 10-2.")
_KIND = Parameter(
    "INTENSITY_KIND",
    "What its intensity is",
    "--intensity-kind",
    "choice",
    "amplitude: dB, falls with range. reflectance: dB, range removed by the maker. linear: counts. none: there is none.",
    required=True,
    default="amplitude",
    choices=("amplitude", "reflectance", "linear", "none"),
)
_EVERY = _number("EVERY", "Length of stretches, m", "--every", "Of those that are listed.", advanced=True)
_SIGMA = _number(
    "AXIS_SIGMA", "Axis is good for, m", "--axis-sigma", "Standard deviation; goes into errors of volumes.", advanced=True
)

_BEGIN = (
    Command(
        "init",
        "Create or upgrade the schema",
        BEGIN,
        ("init",),
        "Creates or upgrades schema, functions and roles. Data stay. Needs the database's owner.",
        (),
    ),
    Command(
        "check",
        "Check the database",
        BEGIN,
        ("check",),
        "Says what is as it should be, and what mends the rest.",
        (),
        wrong="something is wrong, and stands in the list with what mends it",
    ),
    Command(
        "inspect",
        "Inspect scan files",
        BEGIN,
        ("inspect",),
        "Tells what scan files hold, what is missing, and what to do next; needs no database.",
        (FILES,),
        wrong="a file can't be read; the others were looked at",
        database=False,
    ),
    Command(
        "tunnel_add",
        "Add a tunnel",
        BEGIN,
        ("tunnel", "add"),
        "Adds a tunnel with its given axis: design alignment (LandXML, IFC), drawing or map, table, or found in the scan.",
        (
            Parameter("NAME", "Name", "", "text", "Of the tunnel.", required=True),
            replace(FILES, required=False, help="Needed for an axis that is found, or that has no heights."),
            Parameter(
                "SRID", "Coordinate system", "--srid", "text", "EPSG number, projected, in metres; or local.", required=True
            ),
            Parameter(
                "AXIS", "Given axis", "--axis", "file", "LandXML, IFC, DXF, GeoPackage, Shapefile, GeoJSON or CSV x,y,z."
            ),
            _flag("AXIS_AUTO", "Find the axis in the scan files", "--axis auto", "Instead of a given one."),
            Parameter(
                "START",
                "Chainage of its beginning, m",
                "--start-chainage",
                "number",
                "By default that of the alignment, else 0.",
            ),
            Parameter("AXIS_LAYER", "Layer of the axis", "--axis-layer", "text", "If several hold lines.", advanced=True),
            Parameter("ALIGNMENT", "Alignment", "--alignment", "text", "Of a file that holds several.", advanced=True),
            _flag("REVERSE", "Let chainage grow the other way", "--reverse", "Not of a design alignment.", advanced=True),
            _number("SPACING", "Distance of vertices, m", "--spacing", "Of the axis; 10 by default.", advanced=True),
            Parameter(
                "STATIONING",
                "Stationing",
                "--stationing",
                "file",
                "CSV of the tunnel's own.",
                filter="CSV (*.csv)",
                advanced=True,
            ),
        ),
    ),
    Command(
        "survey_add",
        "Add a survey",
        BEGIN,
        ("survey", "add"),
        "Adds a scanning campaign of a tunnel.",
        (
            Parameter("NAME", "Name", "", "text", "Of the survey, as demo-2024.", required=True),
            Parameter("TUNNEL", "Tunnel", "--tunnel", "text", "That was scanned.", required=True),
            Parameter("DATE", "Date", "--date", "text", "Day of the scan, YYYY-MM-DD.", required=True),
            Parameter("TRAJECTORY", "Trajectory", "--trajectory", "file", "Mobile scanner: CSV with time,x,y,z."),
            Parameter("STATIONS", "Stations", "--stations", "files", "Static scanner: CSV with scan_id,x,y,z, E57 or PTX."),
            _flag("NO_POSES", "Nobody knows where the scanner was", "--no-poses", "Intensity is then taken as it is."),
            _KIND,
            Parameter("INTENSITY", "Dimension of the intensity", "--intensity", "text", "Of the files, such as Amplitude."),
            Parameter(
                "REFERENCE",
                "Intensity over range",
                "--reference",
                "file",
                "CSV with range_m,intensity_db.",
                filter="CSV (*.csv)",
            ),
            _flag(
                "REFERENCE_AUTO", "Find intensity over range on the lining", "--reference auto", "Instead of a measured curve."
            ),
            _flag("BACKWARDS", "Driven towards falling chainage", "--backwards", "The trajectory.", advanced=True),
        ),
    ),
)

_STAGE_VERBS = (
    Command(
        "load",
        "Load scan files",
        STAGES,
        ("load",),
        "Loads scan files into a survey: noise is dropped, the rest thinned to the survey's density. What is loaded is left"
        " alone.",
        (
            SURVEY,
            FILES,
            DENSITY,
            Parameter(
                "NOISE_POINTS",
                "Noise: fewer points than",
                "--noise-points",
                "integer",
                "1 keeps all.",
                minimum=1,
                advanced=True,
            ),
            _number("NOISE_DIAMETER", "Noise: within, m", "--noise-diameter", "Diameter, at full density.", advanced=True),
            _number(
                "MAX_DISTANCE", "Farthest from the axis, m", "--max-distance", "Points beyond are left out.", advanced=True
            ),
        ),
    ),
    Command(
        "run",
        "Run stages",
        STAGES,
        ("run",),
        "Runs axis, segments, sections, ground and detect. Each stage of each kilometre is one transaction: it may be"
        " cancelled at any"
        " moment and run again. Axis vertices moved by hand and reviews stay.",
        (
            SURVEY,
            KM,
            _stage("FIRST", "Begin with", "--from", *_STAGES),
            _stage("LAST", "End with", "--to", *_STAGES),
            _flag("STALE", "Only what is out of date", "--stale", "With the parameters that each stage had."),
            SET,
        ),
    ),
    Command(
        "batch",
        "Batch: from files to leaks",
        STAGES,
        ("batch",),
        "Brings files to leaks, kilometre by kilometre, on all cores. One that was cancelled goes on where it was, without"
        " files.",
        (
            SURVEY,
            replace(FILES, required=False),
            Parameter(
                "WORKERS", "Workers", "--workers", "integer", "Processes; one a core by default.", minimum=1, maximum=1000
            ),
            KM,
            _stage("LAST", "End with", "--to", "load", *_STAGES),
            DENSITY,
            SET,
            _flag("RETRY", "Try again what has failed", "--retry-failed", "Files and kilometres."),
            _flag("PREVIEW", "Only show what would be done", "--preview", "Files, kilometres, points, disk, time."),
        ),
        wrong="something failed; of a preview: the disk is too small",
    ),
    Command(
        "status",
        "Status",
        STAGES,
        ("status",),
        "Shows how far each kilometre has come; without a survey all in short.",
        (replace(SURVEY, required=False),),
    ),
    Command(
        "members",
        "Find members and spots of structures",
        STAGES,
        ("members",),
        "Finds planes and cylinders in the files of a survey, joins them into members, and what differs from its own"
        " surface there.",
        (
            SURVEY,
            _output("GeoPackage (*.gpkg);;LAZ (*.laz)"),
            Parameter(
                "GEOMETRY",
                "Coordinates of a GeoPackage",
                "--geometry",
                "choice",
                "Each face's own plane; the map; in space.",
                default="3d",
                choices=("face", "map", "3d"),
            ),
        ),
        loads=True,
    ),
    Command(
        "spheres",
        "Find target spheres",
        STAGES,
        ("spheres",),
        "Finds target spheres, and compares them with control points.",
        (
            SURVEY,
            replace(_number("RADIUS", "Radius, m", "--radius", "Of the spheres."), required=True),
            _number(
                "TOLERANCE", "Tolerance, m", "--tolerance", "Of the fitted radius, and of points off the sphere.", advanced=True
            ),
            Parameter("CONTROL", "Control points", "--control", "file", "CSV with id,x,y,z.", filter="CSV (*.csv)"),
            _number("WITHIN", "Within, m", "--within", "Of a control point from its sphere.", advanced=True),
            Parameter("REPORT", "Report", "--report", "output", "As Markdown.", filter="Markdown (*.md)"),
        ),
    ),
)

_FINDING_VERBS = (
    Command(
        "leaks",
        "List or export leaks",
        FINDINGS,
        ("leaks",),
        "Lists leaks, or what else is dark, or writes them to a file. First it says where the list can't be vouched for.",
        (
            SURVEY,
            Parameter(
                "KIND", "Kind", "--kind", "choice", "What to list.", default="leak", choices=("leak", "joint", "dark", "all")
            ),
            KM,
            FROM,
            TO,
            _CLOCK,
            MIN_AREA,
            Parameter(
                "MIN_CONFIDENCE",
                "From this confidence",
                "--min-confidence",
                "number",
                "How sure detection is, 0 to 1.",
                minimum=0,
                maximum=1,
            ),
            _flag("BY_KM", "Summed up by kilometre", "--by-km", "With classes of waterproofing.", advanced=True),
            GEOMETRY,
            _output(_TABLES),
        ),
        wrong="not all that was asked for has been searched for leaks, or nothing of it was seen",
        loads=True,
    ),
    Command(
        "findings_list",
        "List or export findings",
        FINDINGS,
        ("findings", "list"),
        "Lists what was found and drawn, of all kinds, or writes it to a file.",
        (
            SURVEY,
            Parameter("KIND", "Kinds", "--kind", "texts", "Codes with ; between: crack; spall. All by default."),
            Parameter(
                "ORIGIN",
                "Origins",
                "--origin",
                "choices",
                "How outlines came about.",
                choices=("detected", "drawn", "redrawn", "split", "merged"),
            ),
            Parameter(
                "STATE",
                "States",
                "--state",
                "choices",
                "By default open and confirmed, which count.",
                choices=("open", "confirmed", "rejected", "gone", "dry", "same", "merged", "all"),
            ),
            Parameter("MIN_SEVERITY", "From this severity", "--min-severity", "integer", "1 to 4.", minimum=1, maximum=4),
            MIN_AREA,
            FROM,
            TO,
            _CLOCK,
            GEOMETRY,
            _flag("COUNT", "Count them instead", "--count", "By kind, origin and what became of them.", advanced=True),
            _output(_TABLES),
        ),
        loads=True,
    ),
    Command(
        "findings_import",
        "Import findings",
        FINDINGS,
        ("findings", "import"),
        "Imports the findings of another system: all, or, if anything is wrong with a row, none.",
        (
            SURVEY,
            Parameter("FILE", "File", "", "file", "CSV, GeoPackage or GeoJSON.", required=True),
            Parameter("MAP", "Kinds", "--map", "texts", "THEIRS=OURS with ; between: Riss=crack; Abplatzung=spall."),
            Parameter("COLUMN", "Columns", "--column", "texts", "OURS=THEIRS with ; between: kind=Art."),
            Parameter("IMPORT_LAYER", "Layer", "--layer", "text", "Of a GeoPackage that has several."),
        ),
    ),
    Command(
        "spots",
        "List or export spots of structures",
        FINDINGS,
        ("spots",),
        "Lists what on members differs from its own surface.",
        (
            SURVEY,
            Parameter(
                "KIND", "Kind", "--kind", "choice", "Against their surface.", default="all", choices=("dark", "bright", "all")
            ),
            MIN_AREA,
            Parameter("MIN_CONFIDENCE", "From this confidence", "--min-confidence", "number", "0 to 1.", minimum=0, maximum=1),
            Parameter(
                "GEOMETRY",
                "Coordinates",
                "--geometry",
                "choice",
                "The face's own plane; the map; in space.",
                default="face",
                choices=("face", "map", "3d"),
            ),
            _output("GeoPackage (*.gpkg);;GeoJSON (*.geojson);;CSV (*.csv)"),
        ),
        wrong="members were never looked for, or files or settings have changed since",
        loads=True,
    ),
    Command(
        "learn",
        "Learn from reviews",
        FINDINGS,
        ("learn",),
        "Says what detection would learn from what was confirmed, rejected and renamed. It changes nothing unless that is"
        " asked for.",
        (
            Parameter("SURVEYS", "Surveys", "", "surveys", "Names with spaces between.", required=True),
            _flag("APPLY", "Put it in force", "--apply", "For the tunnels of these surveys; then run what is stale."),
            Parameter("NOTE", "Note", "--note", "text", "What to remember of it."),
            _flag("LIST", "List what was learned", "--list", "Instead.", advanced=True),
            _flag("UNDO", "Take the last back", "--undo", "Instead.", advanced=True),
        ),
    ),
    Command(
        "evaluate",
        "Evaluate against a truth",
        FINDINGS,
        ("evaluate",),
        "Holds leaks, or spots, against true ones: recall, precision, errors of areas and edges.",
        (
            SURVEY,
            Parameter("TRUTH", "Truth", "", "file", "GeoPackage or GeoJSON with a polygon for each leak.", required=True),
            Parameter("TRUTH_LAYER", "Layer", "--layer", "text", "That holds the true ones."),
            KM,
            MIN_AREA,
            _flag("SPOTS", "Spots, not leaks", "--spots", "Always so of a site."),
            _output("JSON (*.json);;CSV (*.csv)"),
        ),
    ),
)

_SHAPE_VERBS = (
    Command(
        "compare",
        "Compare two surveys",
        SHAPE,
        ("compare",),
        "What became of leaks, and where the lining is another; what is missing or out of date is made first.",
        (
            Parameter("OLD", "Older survey", "", "text", "", required=True),
            Parameter("NEW", "Newer survey", "", "text", "", required=True),
            FROM,
            TO,
            _number("CELL", "Side of cells, m", "--cell", "0.1 by default.", advanced=True),
            _number("LENGTH", "Length of sections, m", "--length", "Of which the rigid motion is taken out.", advanced=True),
            _output("GeoPackage (*.gpkg);;Excel (*.xlsx);;CSV of leaks (*.csv);;GeoTIFF of the change (*.tif)"),
        ),
        loads=True,
    ),
    Command(
        "axis",
        "Axis against the one given",
        SHAPE,
        ("axis",),
        "Shows how far the measured axis lies from the one given.",
        (SURVEY, FROM, TO, _output("PNG (*.png);;PDF (*.pdf);;SVG (*.svg);;CSV (*.csv)")),
    ),
    Command(
        "profile_add",
        "Add a design profile",
        SHAPE,
        ("profile", "add"),
        "Adds a design profile: lines and arcs about the axis, from one place to another.",
        (
            Parameter("TUNNEL", "Tunnel", "", "text", "", required=True),
            Parameter("NAME", "Name", "", "text", "Needed where the tunnel has several.", advanced=True),
            Parameter("FILE", "Profile", "", "file", "CSV right,up[,radius]; DXF; text of two columns.", required=True),
            LAYER,
            FROM,
            TO,
            Parameter("UNIT", "Unit", "--unit", "choice", "Of a file that states none.", choices=("m", "cm", "mm", "ft", "in")),
            Parameter("ORIGIN", "Axis at", "--origin", "text", "RIGHT,UP in the file's unit.", advanced=True),
            Parameter(
                "DRAWING_LAYER", "Layer of the drawing", "--drawing-layer", "text", "If several have lines.", advanced=True
            ),
        ),
    ),
    Command(
        "deviation",
        "Deviation from the design",
        SHAPE,
        ("deviation",),
        "Holds the lining against its design profiles: deviation, over- and underbreak.",
        (
            SURVEY,
            LAYER,
            FROM,
            TO,
            _EVERY,
            _SIGMA,
            _output("CSV of sections (*.csv);;DXF of sections (*.dxf);;GeoTIFF (*.tif)"),
        ),
    ),
    Command(
        "evenness",
        "Evenness",
        SHAPE,
        ("evenness",),
        "Lays a straightedge on the lining, and states the gaps beneath.",
        (
            SURVEY,
            LAYER,
            FROM,
            TO,
            _number("LENGTH", "Straightedge, m", "--length", "2 by default."),
            _number("LIMIT", "Limit of gaps, m", "--limit", "0.02 by default."),
            _EVERY,
            _output("CSV of sections (*.csv)"),
        ),
    ),
    Command(
        "thickness",
        "Thickness between two surveys",
        SHAPE,
        ("thickness",),
        "States what lies between two surveys of one tunnel.",
        (
            Parameter("BEFORE", "Survey before", "", "text", "", required=True),
            Parameter("AFTER", "Survey after", "", "text", "", required=True),
            LAYER,
            FROM,
            TO,
            _number("MINIMUM", "Least thickness, m", "--minimum", "How many m² are thinner."),
            _EVERY,
            _SIGMA,
            _output("CSV of sections (*.csv)"),
        ),
    ),
    Command(
        "rings",
        "Rings",
        SHAPE,
        ("rings",),
        "Measures the rings of a lining: centre, radius, ovality, harmonics, steps.",
        (
            SURVEY,
            _number("LENGTH", "Length of rings, m", "--length", "Whole rings from the beginning on."),
            Parameter("START", "A joint lies at, m", "--start", "number", "Chainage, with a length."),
            Parameter("RINGS", "Rings", "--rings", "file", "CSV with number,chainage_from,chainage_to.", filter="CSV (*.csv)"),
            _flag("FIND", "Find them by their joints", "--find", "In the images."),
            _number("DIAMETER", "Inner diameter, m", "--diameter", "Of the design."),
            Parameter("CHORD", "Chords", "--chord", "texts", "FROM-TO with ; between: 9:00-3:00.", advanced=True),
            FROM,
            TO,
            _output("CSV (*.csv);;Excel (*.xlsx)"),
        ),
    ),
    Command(
        "clearance",
        "Clearance",
        SHAPE,
        ("clearance",),
        "Holds what stands in the tunnel against an outline about a track.",
        (
            SURVEY,
            Parameter("GAUGE", "Outline", "--gauge", "file", "CSV or DXF, about the track's middle.", required=True),
            Parameter("TRACK", "Track", "--track", "text", "left or right, or a number from the left."),
            Parameter("TRACK_AXIS", "Axis of the track", "--track-axis", "file", "Instead of by rails."),
            _number("BOGIE", "Distance of bogies, m", "--bogie-distance", "Of the vehicle.", advanced=True),
            _number("OVERHANG", "Overhang, m", "--overhang", "From a bogie's middle to its end.", advanced=True),
            Parameter(
                "WIDENING",
                "Widening in curves",
                "--curve-widening",
                "numbers",
                "INSIDE OUTSIDE over the radius, m².",
                advanced=True,
            ),
            _number("ALLOWANCE", "Allowance, m", "--allowance", "For all else, to each side.", advanced=True),
            FROM,
            TO,
            _output("GeoPackage (*.gpkg);;CSV (*.csv);;DXF of sections (*.dxf)"),
        ),
        loads=True,
    ),
    Command(
        "intensity",
        "Intensity over range and incidence",
        SHAPE,
        ("intensity",),
        "Shows whether intensity depends on range or incidence, before and after correction.",
        (SURVEY, KM, _output("PNG (*.png);;PDF (*.pdf);;SVG (*.svg)")),
    ),
)

_HAND_OVER = (
    Command(
        "qgis",
        "Write the QGIS project",
        HAND_OVER,
        ("qgis",),
        "Writes a project with styled layers, and its images beside it. After another run of detect write it again to the"
        " same file,"
        " and press Reload images: the layers that are open show the new ones.",
        (
            SURVEY,
            _output("QGIS project (*.qgz);;QGIS project (*.qgs)", required=True),
            Parameter("IMAGES", "Folder of images", "--images", "folder", "One that all who open the project can reach."),
            Parameter("SERVICE", "Service", "--service", "text", "Let it connect by this entry of pg_service.conf."),
        ),
    ),
    Command(
        "image",
        "Write images",
        HAND_OVER,
        ("image",),
        "Writes the unrolled images: raw and corrected intensity, offset, states, classes; a GeoTIFF and a picture for each"
        " kilometre.",
        (SURVEY, KM, Parameter("OUTPUT", "Folder", "-o", "folder", "Made if it isn't there.", required=True)),
    ),
    Command(
        "report",
        "Write the report",
        HAND_OVER,
        ("report",),
        "Writes the inspection report, to be handed over and signed.",
        (
            SURVEY,
            FROM,
            TO,
            Parameter("TEMPLATE", "Owner's template", "--template", "file", "TOML.", filter="TOML (*.toml)"),
            Parameter("PHOTOS", "Folder of photos", "--photos", "text", "Where relative paths of photos begin.", advanced=True),
            _output("HTML (*.html);;PDF (*.pdf)", required=True),
        ),
    ),
    Command(
        "export",
        "Export as GeoPackage or DXF",
        HAND_OVER,
        ("export",),
        "Writes a survey for programs that don't reach the database.",
        (SURVEY, FROM, TO, _output("GeoPackage (*.gpkg);;DXF (*.dxf)", required=True)),
        loads=True,
    ),
    Command(
        "export_classified",
        "Export classed scan files",
        HAND_OVER,
        ("export", "--classified"),
        "Writes the scan files at full density again, as LAZ, each point with its class.",
        (SURVEY, KM, Parameter("OUTPUT", "Folder", "-o", "folder", "Made if it isn't there.", required=True)),
    ),
)

COMMANDS: Tuple[Command, ...] = (*_BEGIN, *_STAGE_VERBS, *_FINDING_VERBS, *_SHAPE_VERBS, *_HAND_OVER)
