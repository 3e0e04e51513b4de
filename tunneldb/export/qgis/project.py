"""A QGIS project of a survey, written as XML, for a machine that has no QGIS."""

from __future__ import annotations

import io
import os
import uuid
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Iterable, Sequence
from copy import deepcopy
from dataclasses import dataclass, field, replace
from pathlib import Path

import psycopg

from tunneldb import __version__
from tunneldb.export.qgis.catalogue import Catalogue, read_catalogue
from tunneldb.export.qgis.crs import crs_element, no_crs
from tunneldb.export.qgis.deviation_sheet import deviation_layout
from tunneldb.export.qgis.extent import (
    Extent,
    View,
    first_members,
    first_window,
    largest_leak,
    map_extent,
    sheet_extent,
    unrolled_extents,
)
from tunneldb.export.qgis.finding_actions import finding_actions
from tunneldb.export.qgis.finding_form import (
    KIND_LIST,
    PHOTOS,
    SEVERITIES,
    defaults,
    demanded,
    finding_form,
    photo_form,
    relation,
)
from tunneldb.export.qgis.finding_style import finding_style
from tunneldb.export.qgis.layer import (
    CHANGE,
    CHANGE_LAYERS,
    CHANGE_MAP,
    CLEARANCE,
    CLEARANCE_LAYERS,
    DEVIATION,
    DEVIATION_LAYERS,
    FACES,
    FINDINGS,
    FINDINGS_MAP,
    LAYERS,
    LISTS,
    MAP,
    RING_LAYERS,
    SCANNER_LAYERS,
    SHEET_FINDING,
    SHEETS,
    SPACE,
    STRUCTURE_LAYERS,
    STRUCTURES,
    UNDER_CHANGE,
    UNDERWATER,
    UNDERWATER_LAYERS,
    UNROLLED,
    VectorLayer,
)
from tunneldb.export.qgis.member_sheet import member_layout
from tunneldb.export.qgis.raster import BED, FILLED, KINDS, SUBMERGED, image_kind, pipe, shown_limits
from tunneldb.export.qgis.sheet import sheet_layout
from tunneldb.export.qgis.source import RECOMPUTED_FROM, Source, recompute
from tunneldb.export.qgis.space import docks, filled_layers, has_rows, scene, site_viewpoint, viewpoint
from tunneldb.export.qgis.styles import require_table, style_elements
from tunneldb.files import replacing
from tunneldb.measures.change.rows import older_compared
from tunneldb.measures.deviation.rows import layers_held
from tunneldb.measures.rings.rows import has_rings
from tunneldb.raster.geotiff import CHANGE as CHANGE_KIND
from tunneldb.raster.geotiff import DEVIATION_KINDS
from tunneldb.store.coverage import read_coverage
from tunneldb.store.remarks import read_remarks
from tunneldb.store.sonar import has_sonar
from tunneldb.store.spots import read_spots
from tunneldb.store.survey import Survey

QGIS_VERSION = "3.22.0-Białowieża"
"""QGIS version of the written project format; later versions read it."""

NEW_KINDS = {"leak_map": "leak", "leak_unrolled": "leak", "dark_map": "dark", "dark_unrolled": "dark"}
"""Layers of leaks and dry dark areas in which findings may be drawn, and the initial kind of a new finding."""

_DOCTYPE = "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n"


@dataclass(frozen=True)
class _Entry:
    """A layer of the project: its element, its place in the tree, the themes that show it, whether its rows are counted."""

    id: str
    title: str
    group: tuple[str, ...]
    themes: tuple[str, ...]
    element: ET.Element
    counted: bool = False


@dataclass
class _Group:
    entries: list[_Entry] = field(default_factory=list)
    groups: dict[str, _Group] = field(default_factory=dict)


def write_project(
    conn: psycopg.Connection,
    survey: Survey,
    output: Path,
    images: Sequence[Path] = (),
    service: str | None = None,
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

    Raises
    ------
    UserError
        The survey has no axis, of a site no members, or its SRID is unknown.
    """
    text = _text(_project(conn, survey, images, output.parent, service))
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
) -> None:
    """Store a project in ``public.qgis_projects``, from which QGIS opens it; one with the same name is replaced.

    Parameters
    ----------
    conn : psycopg.Connection
        Connection whose transaction this joins.
    survey, images, service
        As in :func:`write_project`, but the project has absolute paths of the images.
    name : str
        Name of the project there.

    Raises
    ------
    UserError
        As in :func:`write_project`, or if the table is missing.
    """
    require_table(conn, "public.qgis_projects")
    content = _archive(_text(_project(conn, survey, images, None, service)), name)
    conn.execute(
        "INSERT INTO public.qgis_projects (name, metadata, content) VALUES (%s, jsonb_build_object("
        "'last_modified_time', (clock_timestamp() AT TIME ZONE 'UTC')::text, 'last_modified_user', session_user), %s) "
        "ON CONFLICT (name) DO UPDATE SET metadata = excluded.metadata, content = excluded.content",
        (name, content),
    )


def _project(
    conn: psycopg.Connection, survey: Survey, images: Sequence[Path], folder: Path | None, service: str | None
) -> ET.Element:
    """Return the project's root, with paths relative to its folder, or absolute without one."""
    crs = crs_element(conn, survey.srid)
    source = Source.of_connection(conn) if service is None else Source.of_service(service)
    cells = first_members(conn, survey.name)
    structures = survey.site or cells is not None
    designed = layers_held(conn, survey)[:1]
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
    if old is not None:
        layers = _with_change(conn, survey, old, layers)
    filled = filled_layers(conn, survey.name, layers)
    entries = [_table(source, survey, "remark", "Notes and limitations (table)", counted=True)]
    if structures:
        entries.append(_table(source, survey, "member_statistics", "Members (table)"))
    catalogue = None if survey.site else read_catalogue(conn, survey)
    entries += [_vector(layer, source, survey, crs, catalogue, in_space=layer.id in filled) for layer in layers]
    entries += _rasters(images, folder, crs)
    if catalogue is not None:
        entries += _lists(source, survey)
    views = _views(conn, survey, cells)
    root = ET.Element("qgis", version=QGIS_VERSION, projectname=survey.name, saveUser="", saveUserFull="")
    ET.SubElement(root, "homePath", path="")
    ET.SubElement(root, "title").text = survey.name
    ET.SubElement(root, "autotransaction", active="0")
    ET.SubElement(root, "evaluateDefaultValues", active="0")
    ET.SubElement(root, "trust", active="0")
    ET.SubElement(root, "projectCrs").append(deepcopy(crs))
    root.append(_tree(entries))
    _canvases(root, views, crs)
    name = survey.name
    view = site_viewpoint(conn, name) if survey.site else viewpoint(conn, name, largest_leak(conn, name))
    shown = [layer_id(layer.id) for layer in layers if layer.id in filled]
    root.append(docks(view, scene(view, views[0].extent, crs, shown)))
    ET.SubElement(root, "projectlayers").extend(entry.element for entry in entries)
    drawn = [layer_id(layer.id) for layer in layers if layer.shows_findings and layer.edited]
    ET.SubElement(root, "relations").extend(relation(layer, layer_id(PHOTOS)) for layer in drawn)
    root.append(_themes(entries, site=survey.site))
    root.append(_bookmarks(views, crs))
    root.append(_properties(absolute=folder is None))
    known = {layer.id: (layer_id(layer.id), source.layer(layer, survey.name, survey.srid)) for layer in layers}
    layouts = ET.Element("Layouts")
    sheet = sheet_extent(conn, survey.name)
    if sheet is not None and catalogue is not None:
        findings = layer_id(SHEET_FINDING), source.table(SHEET_FINDING, survey.name)
        layouts.append(sheet_layout(survey, sheet, catalogue, known["sheet"], known["leak_sheet"], findings))
    if sheet is not None and designed:
        layouts.append(deviation_layout(survey, sheet, known["sheet"], layer_id("deviation_bar"), shown_limits(images)))
    if cells is not None:
        layouts.append(member_layout(survey, known["member_sheet"], known["spot_sheet"]))
    if len(layouts):
        root.append(layouts)
    view_settings = ET.SubElement(root, "ProjectViewSettings", UseProjectScales="0")
    # Else the full extent would hold the unrolled plane, too, and new 3D views begin far from the tunnel.
    for tag in ("DefaultViewExtent", "PresetFullExtent"):
        _extent(view_settings, views[0].extent, tag).append(deepcopy(crs))
    metadata = ET.SubElement(root, "projectMetadata")
    ET.SubElement(metadata, "title").text = survey.name
    said = [] if survey.site else [read_coverage(conn, survey).statement]
    said += [read_spots(conn, survey).statement] if structures else []
    said += [remark.said for remark in read_remarks(conn, survey)]
    ET.SubElement(metadata, "abstract").text = "\n".join(
        [
            f"{'Site' if survey.site else 'Tunnel'} {survey.tunnel}, written by tunneldb {__version__}; works while the"
            " database runs: tunneldb server start, where it is tunneldb's own",
            *filter(None, said),
        ]
    )
    return root


def _with_change(
    conn: psycopg.Connection, survey: Survey, old: Survey, layers: Sequence[VectorLayer]
) -> tuple[VectorLayer, ...]:
    """Return these layers, and above them the change layers since an older survey that have rows."""
    since = (
        replace(layer, title=f"{layer.title}, since {old.name}", where=f'"old_survey_id" = {old.id}') for layer in CHANGE_LAYERS
    )
    under = (replace(layer, themes=(*layer.themes, *UNDER_CHANGE.get(layer.id, ()))) for layer in layers)
    return (*(layer for layer in since if has_rows(conn, survey.name, layer)), *under)


def layer_id(name: str) -> str:
    """Return a layer's id in a project; QGIS replaces ids of ten letters or fewer by its own."""
    return f"tunneldb_layer_{name}"


def _vector(
    layer: VectorLayer, source: Source, survey: Survey, crs: ET.Element, catalogue: Catalogue | None, *, in_space: bool
) -> _Entry:
    """Return a layer on a view; a 3D view draws it only if it is in space."""
    element = ET.Element(
        "maplayer", type="vector", geometry=layer.geometry, wkbType=layer.wkb, readOnly=str(int(not layer.edited)),
        autoRefreshEnabled="0", refreshOnNotifyEnabled="0", hasScaleBasedVisibilityFlag="0",
        minScale="0", maxScale="0", styleCategories="AllStyleCategories",
    )  # fmt: skip
    ET.SubElement(element, "id").text = layer_id(layer.id)
    ET.SubElement(element, "datasource").text = source.layer(layer, survey.name, survey.srid)
    ET.SubElement(element, "layername").text = layer.title
    ET.SubElement(element, "srs").append(deepcopy(crs) if layer.on_map else no_crs())
    ET.SubElement(element, "provider", encoding="UTF-8").text = "postgres"
    if layer.on_sheet and layer.shows_findings and catalogue is not None:
        element.extend(finding_style(catalogue, layer.geometry, in_space=False, on_sheet=True))
    elif layer.shows_findings and catalogue is not None:
        element.extend(_findings(layer, catalogue, survey, in_space=in_space))
    else:
        element.extend(part for part in style_elements(layer.style) if in_space or part.tag != "renderer-3d")
    if layer.id in RECOMPUTED_FROM:
        element.append(recompute(survey, source))
    # What is drawn belongs to this survey.
    if layer.view == "region" and catalogue is not None:
        limit = catalogue.dry_region_limit
        element.append(defaults({"survey": survey.name, "kind": "dry"}))
        element.extend(
            demanded(
                "reason", f"\"kind\" <> 'dry' OR area($geometry) <= {limit} OR trim(coalesce(\"reason\", '')) <> ''",
                f"A dry region of more than {limit:g} m² must say why; an operator then puts it in force.",
            )
        )  # fmt: skip
    elif layer.id in NEW_KINDS:
        element.append(defaults({"survey": survey.name, "kind": NEW_KINDS[layer.id], "review": "confirmed"}))
    return _Entry(layer_id(layer.id), layer.title, layer.path, layer.themes, element)


def _findings(layer: VectorLayer, catalogue: Catalogue, survey: Survey, *, in_space: bool) -> list[ET.Element]:
    """Return style and form of a layer of findings."""
    tables = {view: layer_id(view) for view in (KIND_LIST, SEVERITIES, PHOTOS)}
    return [
        *finding_style(catalogue, layer.geometry, in_space=in_space),
        *finding_form(catalogue, layer.geometry, layer_id(layer.id), tables, survey.name),
        *([finding_actions()] if layer.edited else []),
    ]


def _lists(source: Source, survey: Survey) -> list[_Entry]:
    """Return the tables for the forms of findings, and their photos, which are edited there."""
    photos = _table(source, survey, PHOTOS, "Photos (table)", group=(LISTS,))
    photos.element.set("readOnly", "0")
    photos.element.extend(photo_form())
    return [
        photos,
        _table(source, None, KIND_LIST, "Kinds of findings (table)", group=(LISTS,)),
        _table(source, None, SEVERITIES, "Severities (table)", group=(LISTS,)),
        _table(source, survey, SHEET_FINDING, "Findings of the sheets (table)", group=(LISTS,)),
    ]


def _table(
    source: Source, survey: Survey | None, view: str, title: str, *, counted: bool = False, group: tuple[str, ...] = ()
) -> _Entry:
    """Return a table; if counted, its number of rows is shown beside its name."""
    element = ET.Element(
        "maplayer", type="vector", geometry="No geometry", wkbType="NoGeometry", readOnly="1", autoRefreshEnabled="0",
        refreshOnNotifyEnabled="0", hasScaleBasedVisibilityFlag="0", minScale="0", maxScale="0",
        styleCategories="AllStyleCategories",
    )  # fmt: skip
    ET.SubElement(element, "id").text = layer_id(view)
    ET.SubElement(element, "datasource").text = source.table(view, survey.name if survey else None)
    ET.SubElement(element, "layername").text = title
    ET.SubElement(element, "srs").append(no_crs())
    ET.SubElement(element, "provider", encoding="UTF-8").text = "postgres"
    return _Entry(layer_id(view), title, group, (), element, counted)


def _rasters(images: Sequence[Path], folder: Path | None, crs: ET.Element) -> list[_Entry]:
    """Return the layers of the images, a group for each kind, with the first one visible, and of sonar scans.

    Theme Deviation shows deviation from the innermost layer of the design that there is, theme Change the change.

    It is above the same image with filled gaps.
    """
    entries = []
    of_kind = {kind: sorted(path for path in images if image_kind(path) == kind) for kind in KINDS}
    shown = {next((kind for kind, paths in of_kind.items() if paths), ""), SUBMERGED}
    design = next((kind for kind in DEVIATION_KINDS.values() if of_kind[kind]), "")
    for kind, title in KINDS.items():
        paths = of_kind[kind]
        drawn = pipe(kind, of_kind[kind.removesuffix(FILLED)])
        for path in paths:
            element = ET.Element("maplayer", type="raster", styleCategories="AllStyleCategories")
            ET.SubElement(element, "id").text = layer_id(path.stem)
            ET.SubElement(element, "datasource").text = _path(path, folder)
            ET.SubElement(element, "layername").text = path.stem
            ET.SubElement(element, "srs").append(deepcopy(crs) if kind == BED else no_crs())
            ET.SubElement(element, "provider").text = "gdal"
            element.append(deepcopy(drawn))
            ET.SubElement(element, "blendMode").text = "0"
            if kind == BED:
                entries.append(_Entry(layer_id(path.stem), path.stem, (UNDERWATER, title), (MAP,), element))
                continue
            themes: tuple[str, ...] = (UNROLLED, SHEETS, FINDINGS) if kind.removesuffix(FILLED) in shown else ()
            themes += (DEVIATION,) if kind.removesuffix(FILLED) == design else ()
            themes += (CHANGE,) if kind == CHANGE_KIND else ()
            entries.append(_Entry(layer_id(path.stem), path.stem, (UNROLLED, title), themes, element))
    return entries


def _path(path: Path, folder: Path | None) -> str:
    if folder is None:
        return str(path.resolve())
    relative = os.path.relpath(path.resolve(), folder.resolve())
    return relative if relative.startswith("..") else f"./{relative}"


def _tree(entries: Iterable[_Entry]) -> ET.Element:
    """Return the layer tree, with the layers of theme Map switched on."""
    top = _Group()
    for entry in entries:
        place = top
        for name in entry.group:
            place = place.groups.setdefault(name, _Group())
        place.entries.append(entry)
    return _group_element(top, "", True)


def _group_element(group: _Group, name: str, checked: bool) -> ET.Element:
    element = ET.Element(
        "layer-tree-group", name=name, expanded=str(int(name in ("", MAP, UNROLLED, STRUCTURES, UNDERWATER, CLEARANCE))),
        checked="Qt::Checked" if checked else "Qt::Unchecked",
    )  # fmt: skip
    for title, part in group.groups.items():
        if title == FINDINGS:
            element.append(_group_element(part, title, False))
    for entry in group.entries:
        leaf = ET.SubElement(
            element, "layer-tree-layer", id=entry.id, name=entry.title, expanded="0",
            checked="Qt::Checked" if MAP in entry.themes else "Qt::Unchecked",
        )  # fmt: skip
        if entry.counted:
            shown = ET.SubElement(ET.SubElement(leaf, "customproperties"), "Option", type="Map")
            ET.SubElement(shown, "Option", type="int", name="showFeatureCount", value="1")
    for title, part in group.groups.items():
        if title != FINDINGS:
            element.append(_group_element(part, title, title in (MAP, STRUCTURES, UNDERWATER, CLEARANCE)))
    return element


def _themes(entries: Sequence[_Entry], *, site: bool) -> ET.Element:
    """Map themes: which layers are visible, and the groups that must be switched on for it; of a tunnel all of its own."""
    presets = ET.Element("visibility-presets")
    used = {theme for entry in entries for theme in entry.themes} | (set() if site else {MAP, UNROLLED, SPACE, SHEETS})
    known = (MAP, UNROLLED, FINDINGS, FINDINGS_MAP, DEVIATION, CHANGE, CHANGE_MAP, SPACE, SHEETS, FACES)
    for theme in (theme for theme in known if theme in used):
        preset = ET.SubElement(presets, "visibility-preset", {"name": theme, "has-expanded-info": "1"})
        shown = [entry for entry in entries if theme in entry.themes]
        for entry in shown:
            ET.SubElement(preset, "layer", id=entry.id, visible="1", style="default", expanded="1")
            rules = list(entry.element.iterfind("renderer-v2//rule"))
            if any(rule.get("checkstate") == "0" for rule in rules):
                ticked = [rule for rule in rules if rule.get("checkstate") != "0"]
                for tag, listing in (("checked", ticked), ("expanded", [rule for rule in rules if len(rule)])):
                    listed = ET.SubElement(preset, f"{tag}-legend-nodes", id=entry.id)
                    for rule in listing:
                        ET.SubElement(listed, f"{tag}-legend-node", id=rule.get("key", ""))
        for tag in ("checked-group-nodes", "expanded-group-nodes"):
            nodes = ET.SubElement(preset, tag)
            for path in sorted({"/".join(e.group[: d + 1]) for e in shown for d in range(len(e.group))}):
                ET.SubElement(nodes, tag.removesuffix("s"), id=path)
    return presets


def _views(conn: psycopg.Connection, survey: Survey, cells: Extent | None) -> list[View]:
    """Return bookmarks: the whole map first, then a window on the unrolled lining, each of its kilometres, unrolled faces."""
    views = [View("Map", MAP, map_extent(conn, survey))]
    kilometres = unrolled_extents(conn, survey.name)
    if kilometres:
        views.append(View("Unrolled", UNROLLED, first_window(conn, survey.name, kilometres)))
        views += [View(f"Unrolled, km {km}", UNROLLED, extent.grown()) for km, extent in kilometres]
    if cells is not None:
        views.append(View(FACES, FACES, cells.grown()))
    return views


def _canvases(root: ET.Element, views: Sequence[View], crs: ET.Element) -> None:
    """Return the main canvas with the map, and below it a second one that follows theme Unrolled, or Faces for a site."""
    _canvas(root, "theMapCanvas", views[0], crs)
    docks = ET.SubElement(root, "mapViewDocks")
    if len(views) > 1:
        # Its layers have no reference system and are drawn as they are; the tunnel's gives the canvas its unit, the metre.
        _canvas(root, views[1].theme, views[1], crs).set("theme", views[1].theme)
        # area 8 is the bottom edge of the window
        ET.SubElement(
            docks, "view", name=views[1].theme, area="8", floating="0", x="0", y="0", width="1200", height="360",
            synced="0", showCursor="0", showExtent="0", scaleSynced="0", scaleFactor="1", showLabels="1",
            zoomSelected="0",
        )  # fmt: skip


def _canvas(root: ET.Element, name: str, view: View, crs: ET.Element) -> ET.Element:
    canvas = ET.SubElement(root, "mapcanvas", name=name, annotationsVisible="1")
    ET.SubElement(canvas, "units").text = "meters"
    _extent(canvas, view.extent, "extent")
    ET.SubElement(canvas, "rotation").text = "0"
    ET.SubElement(canvas, "destinationsrs").append(deepcopy(crs))
    ET.SubElement(canvas, "rendermaptile").text = "0"
    return canvas


def _extent(parent: ET.Element, extent: Extent, tag: str) -> ET.Element:
    element = ET.SubElement(parent, tag)
    sides = {side: repr(getattr(extent, side)) for side in ("xmin", "ymin", "xmax", "ymax")}
    if tag == "extent":
        for side, value in sides.items():
            ET.SubElement(element, side).text = value
    else:
        element.attrib.update(sides)
    return element


def _bookmarks(views: Sequence[View], crs: ET.Element) -> ET.Element:
    bookmarks = ET.Element("Bookmarks")
    for view in views:
        bookmark = ET.SubElement(
            bookmarks, "Bookmark", id=f"{{{uuid.uuid5(uuid.NAMESPACE_OID, view.name)}}}", name=view.name,
            group=view.theme, extent=view.extent.wkt(),
        )  # fmt: skip
        bookmark.append(deepcopy(crs))
    return bookmarks


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
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(f"{name}.qgs", text)
    return held.getvalue()
