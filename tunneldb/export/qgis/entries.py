"""Layers of a project as XML elements: on views, tables, images."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path

from tunneldb.export.qgis.catalogue import Catalogue
from tunneldb.export.qgis.crs import no_crs
from tunneldb.export.qgis.finding_actions import finding_actions
from tunneldb.export.qgis.finding_form import KIND_LIST, PHOTOS, SEVERITIES, defaults, demanded, finding_form, photo_form
from tunneldb.export.qgis.finding_style import finding_style
from tunneldb.export.qgis.layer import (
    CHANGE,
    DEVIATION,
    FINDINGS,
    LISTS,
    MAP,
    SHEET_FINDING,
    SHEETS,
    UNDERWATER,
    UNROLLED,
    VectorLayer,
)
from tunneldb.export.qgis.raster import (
    BED,
    FILLED,
    KINDS,
    SUBMERGED,
    image_kind,
    imported_name,
    imported_pipe,
    imported_title,
    pipe,
)
from tunneldb.export.qgis.rating_style import rating_renderer
from tunneldb.export.qgis.source import RECOMPUTED_FROM, Source, recompute
from tunneldb.export.qgis.styles import style_elements
from tunneldb.raster.geotiff import CHANGE as CHANGE_KIND
from tunneldb.raster.geotiff import DEVIATION_KINDS
from tunneldb.store.survey import Survey

NEW_KINDS = {"leak_map": "leak", "leak_unrolled": "leak", "dark_map": "dark", "dark_unrolled": "dark"}
"""Layers of leaks and dry dark areas in which findings may be drawn, and the initial kind of a new finding."""


@dataclass(frozen=True)
class Entry:
    """A layer of the project: its element, its place in the tree, the themes that show it, whether its rows are counted."""

    id: str
    title: str
    group: tuple[str, ...]
    themes: tuple[str, ...]
    element: ET.Element
    counted: bool = False


def layer_id(name: str) -> str:
    """Return a layer's id in a project; QGIS replaces ids of ten letters or fewer by its own."""
    return f"tunneldb_layer_{name}"


def vector_entry(
    layer: VectorLayer,
    source: Source,
    survey: Survey,
    crs: ET.Element,
    catalogue: Catalogue | None,
    *,
    in_space: bool,
    results: Sequence[str] = (),
) -> Entry:
    """Return a layer on a view; a 3D view draws it only if it is in space.

    Parameters
    ----------
    results : sequence of str
        Results of the scheme of a layer of ratings, from the best to the worst.
    """
    element = ET.Element(
        "maplayer", type="vector", geometry=layer.geometry, wkbType=layer.wkb, readOnly=str(int(not layer.edited)),
        autoRefreshEnabled="0", refreshOnNotifyEnabled="0", hasScaleBasedVisibilityFlag="0",
        minScale="0", maxScale="0", styleCategories="AllStyleCategories",
    )  # fmt: skip
    ET.SubElement(element, "id").text = layer_id(layer.id)
    ET.SubElement(element, "datasource").text = source.layer(layer, survey)
    ET.SubElement(element, "layername").text = layer.title
    ET.SubElement(element, "srs").append(deepcopy(crs) if layer.on_map else no_crs())
    ET.SubElement(element, "provider", encoding="UTF-8").text = "postgres"
    if layer.on_sheet and layer.shows_findings and catalogue is not None:
        element.extend(finding_style(catalogue, layer.geometry, in_space=False, on_sheet=True))
    elif layer.shows_findings and catalogue is not None:
        element.extend(_findings(layer, catalogue, survey, in_space=in_space))
    elif layer.style == "rating" and results:
        element.append(rating_renderer(results))
        element.extend(part for part in style_elements(layer.style) if part.tag != "renderer-v2")
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
    elif layer.style == "action":
        element.append(defaults({"survey": survey.name, "urgency": "planned", "state": "open"}))
        if not layer.on_map:  # a point of the unrolled plane states its chainage and arc
            places = {"chainage_from": "x($geometry)", "chainage_to": "x($geometry)", "arc": "y($geometry)"}
            for column, expression in places.items():
                ET.SubElement(
                    element[-1], "default", field=column, expression=f"round({expression}, 3)", applyOnUpdate="0"
                )  # fmt: skip
    elif layer.id in NEW_KINDS:
        element.append(defaults({"survey": survey.name, "kind": NEW_KINDS[layer.id], "review": "confirmed"}))
    return Entry(layer_id(layer.id), layer.title, layer.path, layer.themes, element)


def _findings(layer: VectorLayer, catalogue: Catalogue, survey: Survey, *, in_space: bool) -> list[ET.Element]:
    """Return style and form of a layer of findings."""
    tables = {view: layer_id(view) for view in (KIND_LIST, SEVERITIES, PHOTOS)}
    return [
        *finding_style(catalogue, layer.geometry, in_space=in_space),
        *finding_form(catalogue, layer.geometry, layer_id(layer.id), tables, survey.name),
        *([finding_actions()] if layer.edited else []),
    ]


def list_entries(source: Source, survey: Survey) -> list[Entry]:
    """Return the tables for the forms of findings, and their photos, which are edited there."""
    photos = table_entry(source, survey, PHOTOS, "Photos (table)", group=(LISTS,))
    photos.element.set("readOnly", "0")
    photos.element.extend(photo_form())
    return [
        photos,
        table_entry(source, None, KIND_LIST, "Kinds of findings (table)", group=(LISTS,)),
        table_entry(source, None, SEVERITIES, "Severities (table)", group=(LISTS,)),
        table_entry(source, survey, SHEET_FINDING, "Findings of the sheets (table)", group=(LISTS,)),
    ]


def table_entry(
    source: Source, survey: Survey | None, view: str, title: str, *, counted: bool = False, group: tuple[str, ...] = ()
) -> Entry:
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
    return Entry(layer_id(view), title, group, (), element, counted)


def image_entries(images: Sequence[Path], folder: Path | None, crs: ET.Element) -> list[Entry]:
    """Return the layers of the images, a group for each kind.

    The first kind is visible, and images of sonar scans are. An image lies above the same image with filled gaps. Theme
    Deviation shows the deviation from the innermost layer of the design, theme Change shows the change. Imported images
    follow, a group for each, hidden at first.
    """
    entries = []
    of_kind = {kind: sorted(path for path in images if image_kind(path) == kind) for kind in KINDS}
    shown = {next((kind for kind, paths in of_kind.items() if paths), ""), SUBMERGED}
    design = next((kind for kind in DEVIATION_KINDS.values() if of_kind[kind]), "")
    for kind, title in KINDS.items():
        paths = of_kind[kind]
        drawn = pipe(kind, of_kind[kind.removesuffix(FILLED)])
        for path in paths:
            if kind == BED:
                entries.append(_image_entry(path, folder, (UNDERWATER, title), (MAP,), drawn, crs))
                continue
            themes: tuple[str, ...] = (UNROLLED, SHEETS, FINDINGS) if kind.removesuffix(FILLED) in shown else ()
            themes += (DEVIATION,) if kind.removesuffix(FILLED) == design else ()
            themes += (CHANGE,) if kind == CHANGE_KIND else ()
            entries.append(_image_entry(path, folder, (UNROLLED, title), themes, drawn, None))
    for name in sorted({name for path in images if (name := imported_name(path)) is not None}):
        paths = sorted(path for path in images if imported_name(path) == name)
        drawn, title = imported_pipe(paths), imported_title(paths)
        entries += [_image_entry(path, folder, (UNROLLED, title), (), drawn, None) for path in paths]
    return entries


def _image_entry(
    path: Path, folder: Path | None, group: tuple[str, ...], themes: tuple[str, ...], drawn: ET.Element, crs: ET.Element | None
) -> Entry:
    """Return the layer of an image; without a coordinate system it is in the unrolled plane."""
    element = ET.Element("maplayer", type="raster", styleCategories="AllStyleCategories")
    ET.SubElement(element, "id").text = layer_id(path.stem)
    ET.SubElement(element, "datasource").text = _path(path, folder)
    ET.SubElement(element, "layername").text = path.stem
    ET.SubElement(element, "srs").append(no_crs() if crs is None else deepcopy(crs))
    ET.SubElement(element, "provider").text = "gdal"
    element.append(deepcopy(drawn))
    ET.SubElement(element, "blendMode").text = "0"
    return Entry(layer_id(path.stem), path.stem, group, themes, element)


def _path(path: Path, folder: Path | None) -> str:
    if folder is None:
        return str(path.resolve())
    relative = os.path.relpath(path.resolve(), folder.resolve())
    return relative if relative.startswith("..") else f"./{relative}"
