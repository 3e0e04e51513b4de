"""The map follows: each canvas goes to a finding in its own coordinates, and a red line goes round it."""

from __future__ import annotations

from typing import Any, Dict, Iterable, List

from qgis.core import QgsGeometry, QgsMapLayer, QgsRasterLayer, QgsRectangle, QgsVectorLayer, QgsWkbTypes
from qgis.gui import QgsMapCanvas, QgsRubberBand
from qgis.PyQt import sip
from qgis.PyQt.QtGui import QColor

from .images import image_of, window

ZOOM = 0.12
"""Ratio of the extent to that of a cut-out: a canvas shows more around a finding."""

_BESIDE = 15.0
"""Distance shown around a finding on the map, m."""

_LINE = QColor(220, 30, 30)


def shows_unrolled(layers: Iterable[QgsMapLayer]) -> bool:
    """Return True if the layers of a canvas are in the unrolled plane, which has no reference system."""
    for layer in layers:
        if isinstance(layer, QgsRasterLayer) and image_of(layer.source()) is not None:
            return True
        if isinstance(layer, QgsVectorLayer) and '_unrolled"' in layer.source():
            return True
    return False


class Followers:
    """Canvases that follow the review, with the mark in each."""

    def __init__(self) -> None:
        self._bands: Dict[QgsMapCanvas, QgsRubberBand] = {}

    def go(self, canvases: Iterable[QgsMapCanvas], facts: Dict[str, Any]) -> None:
        """Show a finding."""
        self.clear()
        for canvas in canvases:
            unrolled = shows_unrolled(canvas.layers())
            extent = _unrolled_extent(canvas, facts) if unrolled else _map_extent(facts)
            if extent is None:
                continue
            canvas.setExtent(extent)
            canvas.refresh()
            if unrolled:
                outline = QgsGeometry.fromWkt(facts["outline"])
                band = QgsRubberBand(canvas, QgsWkbTypes.LineGeometry)
                band.setColor(_LINE)
                band.setWidth(2)
                band.setToGeometry(QgsGeometry.fromMultiPolylineXY(_lines(outline)), None)
                self._bands[canvas] = band

    def repaint(self, canvases: Iterable[QgsMapCanvas]) -> None:
        """Draw the layers anew that show reviews."""
        done: List[QgsMapLayer] = []
        for canvas in canvases:
            for layer in canvas.layers():
                if isinstance(layer, QgsVectorLayer) and '"tunnel_api"' in layer.source() and layer not in done:
                    done.append(layer)
                    layer.triggerRepaint()

    def clear(self) -> None:
        """Remove the marks."""
        for canvas, band in self._bands.items():
            if not sip.isdeleted(canvas) and not sip.isdeleted(band):
                canvas.scene().removeItem(band)
        self._bands.clear()


def _unrolled_extent(canvas: QgsMapCanvas, facts: Dict[str, Any]) -> QgsRectangle:
    aspect = max(canvas.width(), 1) / max(canvas.height(), 1)
    box = facts["chainage_from"], facts["chainage_to"], facts["arc_from"], facts["arc_to"]
    from_, to, low, high = window(box, aspect, ZOOM)
    return QgsRectangle(from_, low, to, high)


def _map_extent(facts: Dict[str, Any]) -> QgsRectangle | None:
    sides = [facts[name] for name in ("map_west", "map_south", "map_east", "map_north")]
    return None if None in sides else QgsRectangle(*sides).buffered(_BESIDE)


def _lines(outline: QgsGeometry) -> List[List[Any]]:
    """Return lines and rings of a geometry, as lines."""
    lines: List[List[Any]] = []
    for part in outline.asGeometryCollection():
        if part.type() == QgsWkbTypes.PolygonGeometry:
            lines += part.asPolygon()
        elif part.type() == QgsWkbTypes.LineGeometry:
            lines.append(part.asPolyline())
    return lines
