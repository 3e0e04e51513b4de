"""Style of rated elements: green to red by result, hatched for a lower bound, grey where nothing was rated."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence

from tunneldb.export.qgis.finding_style import Layer, options

STOPS = ((47, 125, 66), (163, 185, 30), (240, 196, 25), (232, 121, 28), (179, 23, 29))
"""Colours from the best to the worst result, as in the desk."""

DOUBTFUL = (214, 208, 178)
"""Colour of a best result that is only a lower bound: it is never green."""

_GREY = "90,90,90,255"


def colour(level: int, levels: int) -> tuple[int, int, int]:
    """Return the colour of a level, from 1, the best, to the number of levels."""
    place = (level - 1) / max(levels - 1, 1) * (len(STOPS) - 1)
    low = min(int(place), len(STOPS) - 2)
    red, green, blue = (round(a + (b - a) * (place - low)) for a, b in zip(STOPS[low], STOPS[low + 1], strict=True))
    return red, green, blue


def _fill(brush: str, style: str, edge: str = "70,70,70,255") -> Layer:
    return "SimpleFill", {
        "color": brush, "style": style, "outline_color": edge, "outline_style": "solid", "outline_width": "0.3",
        "outline_width_unit": "MM", "joinstyle": "miter",
    }  # fmt: skip


def plain(rgb: Sequence[int]) -> list[Layer]:
    """Return the symbol of a result of an element that was inspected in full."""
    return [_fill(f"{','.join(map(str, rgb))},90", "solid")]


def bound(rgb: Sequence[int]) -> list[Layer]:
    """Return the symbol of a result that is a lower bound: hatched."""
    return [_fill(f"{','.join(map(str, rgb))},60", "solid"), _fill(f"{','.join(map(str, rgb))},255", "b_diagonal")]


def not_rated() -> list[Layer]:
    """Return the symbol of an element without a result."""
    return [_fill("150,150,150,70", "dense6", edge=_GREY)]


def rating_renderer(results: Sequence[str]) -> ET.Element:
    """Return the element ``renderer-v2`` of a layer of ratings by a scheme with these results, from the best to the worst."""
    root = ET.Element("renderer-v2", type="RuleRenderer", forceraster="0", enableorderby="0", symbollevels="0")
    rules, symbols = ET.SubElement(root, "rules", key="rating"), ET.SubElement(root, "symbols")
    entries = [("Not rated", '"level" IS NULL', not_rated())]
    for level, result in reversed(list(enumerate(results, start=1))):
        rgb = colour(level, len(results))
        entries.append((result, f'"level" = {level} AND "complete"', plain(rgb)))
        entries.append((f"At least {result}", f'"level" = {level} AND NOT "complete"', bound(DOUBTFUL if level == 1 else rgb)))
    for number, (label, condition, layers) in enumerate(entries):
        ET.SubElement(rules, "rule", key=f"rating{number}", symbol=str(number), label=label, filter=condition)
        symbol = ET.SubElement(
            symbols, "symbol", name=str(number), type="fill", alpha="1", clip_to_extent="1", force_rhr="0"
        )  # fmt: skip
        for kind, properties in layers:
            layer = ET.SubElement(symbol, "layer", {"class": kind, "enabled": "1", "locked": "0", "pass": "0"})
            layer.append(options(dict(properties)))
    return root
