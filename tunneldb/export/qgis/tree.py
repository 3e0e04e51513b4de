"""The layer tree and the map themes of a project."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from tunneldb.export.qgis.entries import Entry
from tunneldb.export.qgis.layer import (
    CHANGE,
    CHANGE_MAP,
    CLEARANCE,
    DEVIATION,
    FACES,
    FINDINGS,
    FINDINGS_MAP,
    MAP,
    SHEETS,
    SPACE,
    STRUCTURES,
    UNDERWATER,
    UNROLLED,
)


@dataclass
class _Group:
    entries: list[Entry] = field(default_factory=list)
    groups: dict[str, _Group] = field(default_factory=dict)


def tree_element(entries: Iterable[Entry]) -> ET.Element:
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


def themes_element(entries: Sequence[Entry], *, site: bool) -> ET.Element:
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
