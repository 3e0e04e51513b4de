"""A QGIS project of a survey, written as XML, for a machine that has no QGIS."""

from __future__ import annotations

import io
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from pathlib import Path

import psycopg

from tunneldb import __version__
from tunneldb.export.qgis.canvas import add_canvases, add_extent, bookmarks_element, project_views
from tunneldb.export.qgis.catalogue import Catalogue, read_catalogue
from tunneldb.export.qgis.crs import crs_element
from tunneldb.export.qgis.deviation_sheet import deviation_layout
from tunneldb.export.qgis.entries import image_entries, layer_id, list_entries, table_entry, vector_entry
from tunneldb.export.qgis.extent import first_members, largest_leak, sheet_extent
from tunneldb.export.qgis.finding_form import PHOTOS, relation
from tunneldb.export.qgis.layer import (
    CHANGE_LAYERS,
    CLEARANCE_LAYERS,
    DEVIATION_LAYERS,
    LAYERS,
    RATING_LAYERS,
    RING_LAYERS,
    SCANNER_LAYERS,
    SHEET_FINDING,
    STRUCTURE_LAYERS,
    UNDER_CHANGE,
    UNDERWATER_LAYERS,
    VectorLayer,
)
from tunneldb.export.qgis.member_sheet import member_layout
from tunneldb.export.qgis.raster import shown_limits
from tunneldb.export.qgis.sheet import sheet_layout
from tunneldb.export.qgis.source import Source, literal
from tunneldb.export.qgis.space import docks, filled_layers, has_rows, scene, site_viewpoint, viewpoint
from tunneldb.export.qgis.styles import require_table
from tunneldb.export.qgis.tree import themes_element, tree_element
from tunneldb.files import replacing
from tunneldb.measures.change.rows import older_compared
from tunneldb.measures.deviation.rows import layers_held
from tunneldb.measures.rings.rows import has_rings
from tunneldb.store.coverage import read_coverage
from tunneldb.store.remarks import read_remarks
from tunneldb.store.sonar import has_sonar
from tunneldb.store.spots import read_spots
from tunneldb.store.survey import Survey

QGIS_VERSION = "3.22.0-Białowieża"
"""QGIS version of the written project format; later versions read it."""

_DOCTYPE = "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n"


@dataclass(frozen=True)
class Rating:
    """Rating of a survey that a project shows.

    Attributes
    ----------
    element_set, scheme, version : str
    results : tuple of str
        Results of the scheme, from the best to the worst.
    """

    element_set: str
    scheme: str
    version: str
    results: tuple[str, ...]

    def layers(self) -> list[VectorLayer]:
        """Return the layers of the rating."""
        values = {"element_set": self.element_set, "scheme": self.scheme, "version": self.version}
        where = " AND ".join(f'"{column}" = {literal(value)}' for column, value in values.items())
        name = f"{self.element_set} by {self.scheme} {self.version}"
        return [
            replace(layer, title=layer.title.replace("Rating", f"Rating of {name}", 1), where=where) for layer in RATING_LAYERS
        ]


def write_project(
    conn: psycopg.Connection,
    survey: Survey,
    output: Path,
    images: Sequence[Path] = (),
    service: str | None = None,
    rating: Rating | None = None,
) -> None:
    """Write a project with the layers of a survey into a file.

    Parameters
    ----------
    conn : psycopg.Connection
        The database that the layers will read.
    survey : Survey
        The survey.
    output : Path
        File to write, ``.qgz`` or ``.qgs``; it appears whole or not at all.
    images : sequence of Path
        Unrolled images (GeoTIFF), named by kind as :func:`tunneldb.export.images.image.export_kilometre` does; the project
        holds their paths relative to itself.
    service : str, optional
        Entry of ``pg_service.conf`` by which QGIS connects, instead of this connection's host and database.
    rating : Rating, optional
        Rating of the survey that the project shows.

    Raises
    ------
    UserError
        The survey has no axis, of a site no members, or its SRID is unknown.
    """
    text = _text(_project(conn, survey, images, output.parent, service, rating))
    with replacing(output) as temporary:
        if output.suffix.lower() == ".qgs":
            temporary.write_text(text, encoding="utf-8")
        else:
            temporary.write_bytes(_archive(text, output.stem))


def store_project(
    conn: psycopg.Connection,
    survey: Survey,
    name: str,
    images: Sequence[Path] = (),
    service: str | None = None,
    rating: Rating | None = None,
) -> None:
    """Store a project in ``public.qgis_projects``, from which QGIS opens it; one with the same name is replaced.

    Parameters
    ----------
    conn : psycopg.Connection
        Connection whose transaction this joins.
    survey, images, service, rating
        As in :func:`write_project`, but the project has absolute paths of the images.
    name : str
        Name of the project there.

    Raises
    ------
    UserError
        As in :func:`write_project`, or if the table is missing.
    """
    require_table(conn, "public.qgis_projects")
    content = _archive(_text(_project(conn, survey, images, None, service, rating)), name)
    conn.execute(
        "INSERT INTO public.qgis_projects (name, metadata, content) VALUES (%s, jsonb_build_object("
        "'last_modified_time', (clock_timestamp() AT TIME ZONE 'UTC')::text, 'last_modified_user', session_user), %s) "
        "ON CONFLICT (name) DO UPDATE SET metadata = excluded.metadata, content = excluded.content",
        (name, content),
    )


def _project(
    conn: psycopg.Connection,
    survey: Survey,
    images: Sequence[Path],
    folder: Path | None,
    service: str | None,
    rating: Rating | None,
) -> ET.Element:
    """Return the project's root, with paths relative to its folder, or absolute without one."""
    crs = crs_element(conn, survey.srid)
    source = Source.of_connection(conn) if service is None else Source.of_service(service)
    cells = first_members(conn, survey.name)
    structures = survey.site or cells is not None
    designed = layers_held(conn, survey)[:1]
    layers = (*_layers(conn, survey, designed, structures=structures), *(rating.layers() if rating else ()))
    filled = filled_layers(conn, survey.name, layers)
    catalogue = None if survey.site else read_catalogue(conn, survey)
    entries = [table_entry(source, survey, "remark", "Notes and limitations (table)", counted=True)]
    if structures:
        entries.append(table_entry(source, survey, "member_statistics", "Members (table)"))
    results = rating.results if rating else ()
    entries += [
        vector_entry(layer, source, survey, crs, catalogue, in_space=layer.id in filled, results=results) for layer in layers
    ]
    entries += image_entries(images, folder, crs)
    if catalogue is not None:
        entries += list_entries(source, survey)
    views = project_views(conn, survey, cells)
    root = _root(survey, crs)
    root.append(tree_element(entries))
    add_canvases(root, views, crs)
    name = survey.name
    view = site_viewpoint(conn, name) if survey.site else viewpoint(conn, name, largest_leak(conn, name))
    shown = [layer_id(layer.id) for layer in layers if layer.id in filled]
    root.append(docks(view, scene(view, views[0].extent, crs, shown)))
    ET.SubElement(root, "projectlayers").extend(entry.element for entry in entries)
    drawn = [layer_id(layer.id) for layer in layers if layer.shows_findings and layer.edited]
    ET.SubElement(root, "relations").extend(relation(layer, layer_id(PHOTOS)) for layer in drawn)
    root.append(themes_element(entries, site=survey.site))
    root.append(bookmarks_element(views, crs))
    root.append(_properties(absolute=folder is None))
    known = {layer.id: (layer_id(layer.id), source.layer(layer, survey)) for layer in layers}
    layouts = _layouts(conn, survey, source, known, catalogue, images, designed=bool(designed))
    if cells is not None:
        layouts.append(member_layout(survey, known["member_sheet"], known["spot_sheet"]))
    if len(layouts):
        root.append(layouts)
    view_settings = ET.SubElement(root, "ProjectViewSettings", UseProjectScales="0")
    # Else the full extent would hold the unrolled plane, too, and new 3D views begin far from the tunnel.
    for tag in ("DefaultViewExtent", "PresetFullExtent"):
        add_extent(view_settings, views[0].extent, tag).append(deepcopy(crs))
    root.append(_metadata(conn, survey, structures=structures))
    return root


def _layers(conn: psycopg.Connection, survey: Survey, designed: Sequence[str], *, structures: bool) -> tuple[VectorLayer, ...]:
    """Return the layers for which the survey has results, from top to bottom."""
    layers = (
        *(layer for layer in SCANNER_LAYERS if has_rows(conn, survey.name, layer)),
        *(() if survey.site else LAYERS),
        *(replace(layer, where=f"\"layer\" = '{held}'") for held in designed for layer in DEVIATION_LAYERS),
        *(STRUCTURE_LAYERS if structures else ()),
        *(UNDERWATER_LAYERS if has_sonar(conn, survey) else ()),
        *(layer for layer in CLEARANCE_LAYERS if has_rows(conn, survey.name, layer)),
        *(RING_LAYERS if has_rings(conn, survey) else ()),
    )
    old = None if survey.site else older_compared(conn, survey)
    return layers if old is None else _with_change(conn, survey, old, layers)


def _with_change(
    conn: psycopg.Connection, survey: Survey, old: Survey, layers: Sequence[VectorLayer]
) -> tuple[VectorLayer, ...]:
    """Return these layers, and above them the change layers since an older survey that have rows."""
    since = (
        replace(layer, title=f"{layer.title}, since {old.name}", where=f'"old_survey_id" = {old.id}') for layer in CHANGE_LAYERS
    )
    under = (replace(layer, themes=(*layer.themes, *UNDER_CHANGE.get(layer.id, ()))) for layer in layers)
    return (*(layer for layer in since if has_rows(conn, survey.name, layer)), *under)


def _root(survey: Survey, crs: ET.Element) -> ET.Element:
    """Return the root element with the project's title and reference system."""
    root = ET.Element("qgis", version=QGIS_VERSION, projectname=survey.name, saveUser="", saveUserFull="")
    ET.SubElement(root, "homePath", path="")
    ET.SubElement(root, "title").text = survey.name
    ET.SubElement(root, "autotransaction", active="0")
    ET.SubElement(root, "evaluateDefaultValues", active="0")
    ET.SubElement(root, "trust", active="0")
    ET.SubElement(root, "projectCrs").append(deepcopy(crs))
    return root


def _layouts(
    conn: psycopg.Connection,
    survey: Survey,
    source: Source,
    known: Mapping[str, tuple[str, str]],
    catalogue: Catalogue | None,
    images: Sequence[Path],
    *,
    designed: bool,
) -> ET.Element:
    """Return the print layouts of the lining: findings, and deviation where there is a design profile."""
    layouts = ET.Element("Layouts")
    sheet = sheet_extent(conn, survey.name)
    if sheet is not None and catalogue is not None:
        findings = layer_id(SHEET_FINDING), source.table(SHEET_FINDING, survey.name)
        layouts.append(sheet_layout(survey, sheet, catalogue, known["sheet"], known["leak_sheet"], findings))
    if sheet is not None and designed:
        layouts.append(deviation_layout(survey, sheet, known["sheet"], layer_id("deviation_bar"), shown_limits(images)))
    return layouts


def _metadata(conn: psycopg.Connection, survey: Survey, *, structures: bool) -> ET.Element:
    """Return the project's metadata; its abstract states what was inspected."""
    metadata = ET.Element("projectMetadata")
    ET.SubElement(metadata, "title").text = survey.name
    statements = [] if survey.site else [read_coverage(conn, survey).statement]
    statements += [read_spots(conn, survey).statement] if structures else []
    statements += [remark.said for remark in read_remarks(conn, survey)]
    ET.SubElement(metadata, "abstract").text = "\n".join(
        [
            f"{'Site' if survey.site else 'Tunnel'} {survey.tunnel}, written by tunneldb {__version__}; works while the"
            " database runs: tunneldb server start, where it is tunneldb's own",
            *filter(None, statements),
        ]
    )
    return metadata


def _properties(*, absolute: bool) -> ET.Element:
    """Return settings of the project: paths, lengths in plane metres."""
    properties = ET.Element("properties")
    paths = ET.SubElement(properties, "Paths")
    ET.SubElement(paths, "Absolute", type="bool").text = str(absolute).lower()
    reference = ET.SubElement(properties, "SpatialRefSys")
    ET.SubElement(reference, "ProjectionsEnabled", type="int").text = "1"
    measure = ET.SubElement(properties, "Measure")
    ET.SubElement(measure, "Ellipsoid", type="QString").text = "NONE"
    measurement = ET.SubElement(properties, "Measurement")
    ET.SubElement(measurement, "DistanceUnits", type="QString").text = "meters"
    ET.SubElement(measurement, "AreaUnits", type="QString").text = "m2"
    return properties


def _text(root: ET.Element) -> str:
    return _DOCTYPE + ET.tostring(root, encoding="unicode")


def _archive(text: str, name: str) -> bytes:
    """Return a project in the form of a .qgz file."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(zipfile.ZipInfo(f"{name}.qgs"), text, zipfile.ZIP_DEFLATED)  # without a time: ZIP has none before 1980
    return content.getvalue()
