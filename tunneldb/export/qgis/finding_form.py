"""Forms of findings and their photos in QGIS: choices, read-only fields, defaults."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping

from tunneldb.export.qgis.catalogue import SHAPES, Catalogue
from tunneldb.export.qgis.finding_style import options
from tunneldb.export.qgis.sheet_tables import CLOCK

KIND_LIST, SEVERITIES, PHOTOS = "finding_kind", "severity", "finding_photo"
"""Views with the lists and photos of forms, each a table of the project."""

CLOCK_TEXT = "clock_text"
"""Field of a layer, not of its view: the clock position as text. The styles of leaks and changes have it too."""

_ALIASES = {
    "id": "Number", "survey_id": "Survey key", "survey": "Survey", "km": "Kilometre", "segment": "Segment",
    "chainage_from": "Chainage from (m)", "chainage_to": "Chainage to (m)", "label": "Chainage", "arc_from": "Arc from (m)",
    "arc_to": "Arc to (m)", "clock": "Clock position (h)", "kind": "Kind", "kind_label": "Kind (name)",
    "kind_detected": "Found as",
    "wet": "Wet", "origin": "Origin of the outline", "manual": "Drawn by hand", "severity": "Severity",
    "severity_label": "Severity (name)", "width_mm": "Width of the line (mm)", "length": "Length (m)",
    "orientation": "Angle to the axis (°)", "orientation_class": "Direction", "area": "Area (m²)",
    "measured": "Measured on the image", "darkening_mean": "Mean darkening (dB)", "darkening_max": "Greatest darkening (dB)",
    "image_share": "Share measured", "contrast": "Contrast (sigma)", "confidence": "Confidence (0-1)", "reasons": "Reasons",
    "review": "Review", "reviewed_by": "Reviewed by", "reviewed_at": "Reviewed at", "remark": "Remark", "drawn_by": "Drawn by",
    "drawn_at": "Drawn at", "detected": "Found by the last detection", "created_at": "First found or drawn",
    "detected_at": "Last detected", "also_detected": "Also detected", "detected_as": "Detected as", "parent_id": "Split off",
    "merged_into": "Merged into", "merged": "Merged into this", "same_as": "Same as", "dry_region_id": "In dry region",
    "counted": "Included in totals", "state": "State", "photos": "Photos", "evidence": "Evidence for and against a leak",
    "model": "Classified by model", "other_images": "In other images", "other_contrast": "Contrast there (sigma)",
    "easting": "Easting (m)", "northing": "Northing (m)", "height": "Height (m)",
    "superseded": "Superseded", CLOCK_TEXT: "Clock position",
}  # fmt: skip
_PHOTO_ALIASES = {
    "id": "Photo", "finding_id": "Finding", "survey_id": "Survey key", "survey": "Survey", "path": "File or URL",
    "caption": "Caption", "added_by": "Added by", "added_at": "Added at",
}  # fmt: skip
_DECIMALS = {
    "chainage_from": 3, "chainage_to": 3, "arc_from": 2, "arc_to": 2, "clock": 1, "length": 2, "orientation": 1, "area": 3,
    "darkening_mean": 1, "darkening_max": 1, "image_share": 2, "contrast": 1, "confidence": 2, "other_contrast": 1,
    "easting": 2, "northing": 2,
    "height": 2,
}  # fmt: skip
_MOMENTS = ("reviewed_at", "drawn_at", "created_at", "detected_at", "added_at")
_SAVED = '"label" IS NOT NULL'
"""Condition for saved findings: new ones have no photos and no facts yet."""

_REVIEWS = {"Open": "open", "Confirmed": "confirmed", "Rejected": "rejected"}
_FACTS = (
    "id", "label", CLOCK_TEXT, "state", "area", "length", "orientation", "orientation_class", "origin",
    "drawn_by", "drawn_at", "reviewed_by", "reviewed_at",
    "measured",
    "darkening_mean", "darkening_max", "image_share", "other_images", "other_contrast", "kind_detected", "confidence",
    "reasons", "also_detected", "merged",
    "merged_into",
    "same_as",
    "parent_id", "dry_region_id", "segment", "chainage_from", "chainage_to", "arc_from", "arc_to", "easting", "northing",
    "height", "survey",
)  # fmt: skip


def relation_id(layer: str) -> str:
    """Return the id of the relation between a layer of findings, by its id, and the photos."""
    return f"tunneldb_photos_of_{layer}"


def relation(layer: str, photos: str) -> ET.Element:
    """Return the element ``relation`` through which a form of findings shows photos, given the ids of both layers."""
    element = ET.Element(
        "relation", id=relation_id(layer), name="Photos", referencingLayer=photos, referencedLayer=layer, strength="Association"
    )
    ET.SubElement(element, "fieldRef", referencedField="id", referencingField="finding_id")
    return element


def finding_form(catalogue: Catalogue, geometry: str, layer: str, tables: Mapping[str, str], survey: str) -> list[ET.Element]:
    """Return the form of a layer of findings.

    Parameters
    ----------
    catalogue : Catalogue
        The owner's kinds and severities.
    geometry : str
        Point, Line or Polygon.
    layer : str
        The layer's id in the project.
    tables : mapping of str to str
        Ids of the layers of `KIND_LIST`, `SEVERITIES` and `PHOTOS`.
    survey : str
        Name of the survey that new findings belong to.
    """
    shape = SHAPES[geometry]
    asked = ("kind", "severity", *(["width_mm"] if shape == "line" else []), "review", "remark")
    # Of what is not offered any more, the kind that a finding has. By current_value the list would be made anew while it is
    # being chosen from, at which QGIS 3.22 crashes.
    fits = f'"active" AND array_contains("geometries", \'{shape}\') OR "code" = attribute(@current_feature, \'kind\')'
    widgets: dict[str, tuple[str, dict[str, object]]] = {
        "kind": _listed(tables[KIND_LIST], "code", fits, nothing=False),
        "severity": _listed(tables[SEVERITIES], "id", "", nothing=True),
        "width_mm": ("Range", {
            "AllowNull": True, "Min": 0.01, "Max": 10000.0, "Step": 0.05, "Precision": 2, "Style": "SpinBox", "Suffix": " mm",
        }),
        "review": ("ValueMap", {"map": [{word: code} for word, code in _REVIEWS.items()]}),
    }  # fmt: skip
    form = ET.Element("attributeEditorForm")
    first = _tab(form, "Finding", asked, 1)
    photos = _container(first, "Photos", 1, box=True, condition=_SAVED)
    shown = ET.SubElement(
        photos, "attributeEditorRelation", name=relation_id(layer), relation=relation_id(layer), label="", showLabel="0",
        forceSuppressFormPopup="0", nmRelationId="", relationWidgetTypeId="relation_editor",
    )  # fmt: skip
    offered = {"buttons": "SaveChildEdits|AddChild|DeleteChild|ToggleEditing", "show_first_feature": True}
    shown.append(_renamed(options(offered), "editor_configuration"))
    _tab(form, "Facts, worked out by the database", _FACTS, 2, _SAVED)
    kinds = catalogue.drawn_as(shape)
    begins = {"survey": survey, "review": "confirmed"} | ({"kind": kinds[0].code} if kinds else {})
    return [
        _clock_text(),
        *_fields(_ALIASES, widgets, (*asked, "survey")),
        defaults(begins),
        _constraints(required="kind"),
        _text("editorlayout", "tablayout"),
        form,
        _text("previewExpression", "\"id\" || ' ' || coalesce(\"kind_label\", '') || ' ' || \"label\""),
        _text(
            "mapTip",
            f'<b>[% "id" %] [% {as_html("kind_label")} %]</b>, [% {as_html("label")} %]<br>'
            f"[% coalesce({as_html('severity_label')}, 'no severity') %], [% {as_html('state')} %]"
            f"[% coalesce('<br>' || {as_html('remark')}, '') %]",
        ),
    ]


def as_html(column: str) -> str:
    """Return the expression for a column's text in a map tip, which is HTML, with special characters escaped."""
    return f"replace(\"{column}\", map('&', '&amp;', '<', '&lt;'))"


def photo_form() -> list[ET.Element]:
    """Return the form of photos: each is shown in thumbnail size."""
    viewer = {
        "DocumentViewer": 1, "DocumentViewerHeight": 150, "DocumentViewerWidth": 220, "FileWidget": True,
        "FileWidgetButton": True, "FileWidgetFilter": "Photos (*.jpg *.jpeg *.png *.webp *.tif *.tiff)", "FullUrl": False,
        "RelativeStorage": 0, "StorageMode": 0, "UseLink": False,
    }  # fmt: skip
    form = ET.Element("attributeEditorForm")
    _tab(form, "Photo", ("caption", "path"), 1)
    above = ET.Element("labelOnTop")  # there is little room beside the list of a finding's photos
    for column in ("path", "caption"):
        ET.SubElement(above, "field", name=column, labelOnTop="1")
    widgets: dict[str, tuple[str, dict[str, object]]] = {"path": ("ExternalResource", viewer)}
    return [
        *_fields(_PHOTO_ALIASES, widgets, ("path", "caption", "finding_id")),
        defaults({"path": ""}),  # else NULL stands there, and stays before what is typed
        *demanded("path", "coalesce(\"path\", '') <> ''", "A photo needs a file or a URL."),
        above,
        _text("editorlayout", "tablayout"),
        form,
        _text("previewExpression", 'coalesce("caption", file_name("path"))'),
    ]


def defaults(values: Mapping[str, str]) -> ET.Element:
    """Return the element ``defaults`` with the defaults of a new feature."""
    element = ET.Element("defaults")
    for column, value in values.items():
        quoted = value.replace("'", "''")
        ET.SubElement(element, "default", field=column, expression=f"'{quoted}'", applyOnUpdate="0")
    return element


def demanded(column: str, expression: str, why: str) -> list[ET.Element]:
    """Return the elements that accept a form only if an expression is true, with the message otherwise."""
    constraints, said = ET.Element("constraints"), ET.Element("constraintExpressions")
    ET.SubElement(
        constraints, "constraint", field=column, constraints="4", notnull_strength="0", unique_strength="0", exp_strength="1"
    )
    ET.SubElement(said, "constraint", field=column, exp=expression, desc=why)
    return [constraints, said]


def _clock_text() -> ET.Element:
    """Return the element ``expressionfields`` with the clock position as text."""
    fields = ET.Element("expressionfields")
    ET.SubElement(
        fields, "field", name=CLOCK_TEXT, expression=CLOCK, type="10", typeName="string", subType="0", length="0",
        precision="0", comment="",
    )  # fmt: skip
    return fields


def _constraints(required: str) -> ET.Element:
    """Return the constraint that a column must be filled; the key, which the database sets, may be empty."""
    constraints = ET.Element("constraints")
    for column, kinds, hard, unique in ((required, "1", "1", "0"), ("id", "3", "2", "2")):
        ET.SubElement(
            constraints, "constraint", field=column, constraints=kinds, notnull_strength=hard, unique_strength=unique,
            exp_strength="0",
        )  # fmt: skip
    return constraints


def _listed(layer: str, key: str, condition: str, *, nothing: bool) -> tuple[str, dict[str, object]]:
    """Return a drop-down of a table's rows by their labels."""
    return "ValueRelation", {
        "Layer": layer, "LayerProviderName": "postgres", "Key": key, "Value": "label", "FilterExpression": condition,
        "AllowNull": nothing, "AllowMulti": False, "OrderByValue": False, "NofColumns": 1, "UseCompleter": False,
    }  # fmt: skip


def _fields(
    aliases: Mapping[str, str], widgets: Mapping[str, tuple[str, dict[str, object]]], edited: tuple[str, ...]
) -> list[ET.Element]:
    """Return widgets, names and rights of all columns."""
    fields, names, rights = (ET.Element(tag) for tag in ("fieldConfiguration", "aliases", "editable"))
    for index, (column, alias) in enumerate(aliases.items()):
        kind, config = widgets.get(column) or _plain(column)
        field = ET.SubElement(fields, "field", name=column, configurationFlags="None")
        ET.SubElement(ET.SubElement(field, "editWidget", type=kind), "config").append(options(config))
        ET.SubElement(names, "alias", index=str(index), field=column, name=alias)
        ET.SubElement(rights, "field", name=column, editable=str(int(column in edited)))
    return [fields, names, rights]


def _plain(column: str) -> tuple[str, dict[str, object]]:
    if column in _DECIMALS:
        return "Range", {"AllowNull": True, "Precision": _DECIMALS[column], "Style": "SpinBox"}
    if column in _MOMENTS:
        return "DateTime", {
            "allow_null": True, "calendar_popup": True, "display_format": "yyyy-MM-dd HH:mm", "field_iso_format": False
        }  # fmt: skip
    return "TextEdit", {"IsMultiline": False, "UseHtml": False}


def _container(form: ET.Element, name: str, columns: int, condition: str = "", *, box: bool = False) -> ET.Element:
    """Return a tab, or a box in one; shown if a condition is true."""
    return ET.SubElement(
        form, "attributeEditorContainer", name=name, columnCount=str(columns), groupBox=str(int(box)), showLabel="1",
        visibilityExpressionEnabled=str(int(bool(condition))), visibilityExpression=condition,
    )  # fmt: skip


def _tab(form: ET.Element, name: str, columns: tuple[str, ...], wide: int, condition: str = "") -> ET.Element:
    tab = _container(form, name, wide, condition)
    names = list(_ALIASES if set(columns) <= set(_ALIASES) else _PHOTO_ALIASES)
    for column in columns:
        ET.SubElement(tab, "attributeEditorField", name=column, index=str(names.index(column)), showLabel="1")
    return tab


def _text(tag: str, value: str) -> ET.Element:
    element = ET.Element(tag)
    element.text = value
    return element


def _renamed(element: ET.Element, tag: str) -> ET.Element:
    element.tag = tag
    return element
