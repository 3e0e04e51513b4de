"""A picture of the dock: a cut-out with the finding's outline over it, and a bar for its scale."""

from __future__ import annotations

from typing import List

from qgis.core import QgsGeometry, QgsPointXY, QgsWkbTypes
from qgis.PyQt.QtCore import QPointF, QRectF, QSize, Qt, pyqtSignal
from qgis.PyQt.QtGui import QColor, QImage, QPainter, QPaintEvent, QPen, QPolygonF, QResizeEvent
from qgis.PyQt.QtWidgets import QSizePolicy, QWidget

from .cutouts import BACKGROUND, REVIEW_COLOURS, Picture

_COLOURS = {review: QColor(colour) for review, colour in REVIEW_COLOURS.items()}
_BARS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
_NEAR = 6.0  # pixels; smaller outlines get a ring


class CutoutView(QWidget):
    """Shows a picture.

    Parameters
    ----------
    title : str
        What kind of image it is.
    """

    resized = pyqtSignal()

    def __init__(self, title: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.title = title
        self.outlined = True
        self.picture: Picture | None = None
        self.image: QImage | None = None
        self.missing = ""
        self._lines: List[List[QgsPointXY]] = []
        self._colour = _COLOURS["open"]
        self.setMinimumSize(120, 110)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

    def sizeHint(self) -> QSize:
        """Return the size that the view would like."""
        return QSize(300, 220)

    def show_finding(self, picture: Picture | None, outline: str, review: str, missing: str = "") -> None:
        """Set what to show; `set_image` provides the image when it is drawn.

        Parameters
        ----------
        picture : Picture or None
            None where there is nothing to show.
        outline : str
            WKT in the unrolled plane.
        review : str
            Its review, which colours the outline.
        missing : str
            What is said in place of an image.
        """
        if picture != self.picture:
            self.image = None
        self.picture, self.missing = picture, missing
        self._lines = _lines(QgsGeometry.fromWkt(outline)) if outline else []
        self._colour = _COLOURS.get(review, _COLOURS["open"])
        self.update()

    def set_image(self, image: QImage) -> None:
        """Show the image of the picture."""
        self.image = image
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw image, outline, scale and title."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.fillRect(self.rect(), BACKGROUND)
        if self.picture is None or self.missing:
            painter.setPen(QColor("#777777"))
            painter.drawText(
                self.rect().adjusted(8, 24, -8, -8),
                int(Qt.AlignmentFlag.AlignCenter) | int(Qt.TextFlag.TextWordWrap),
                self.missing,
            )
        elif self.image is not None:
            painter.drawImage(QRectF(self.rect()), self.image)
        if self.picture is not None and not self.missing:
            if self.outlined:
                self._draw_outline(painter)
            self._draw_bar(painter)
        self._label(painter, QPointF(6, 16), self.title)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Have pictures drawn in the new size."""
        super().resizeEvent(event)
        self.resized.emit()

    def _draw_outline(self, painter: QPainter) -> None:
        for lines in (QPen(QColor(255, 255, 255, 190), 4.0), QPen(self._colour, 2.0)):
            lines.setJoinStyle(Qt.PenJoinStyle.RoundJoin)
            painter.setPen(lines)
            painter.setBrush(Qt.BrushStyle.NoBrush)
            for line in self._lines:
                shape = QPolygonF([self._pixel(point) for point in line])
                if max(shape.boundingRect().width(), shape.boundingRect().height()) < _NEAR:
                    painter.drawEllipse(shape.boundingRect().center(), 2 * _NEAR, 2 * _NEAR)
                else:
                    painter.drawPolyline(shape)

    def _draw_bar(self, painter: QPainter) -> None:
        assert self.picture is not None
        from_, to, _, _ = self.picture.window
        scale = self.width() / (to - from_)
        length = max((bar for bar in _BARS if bar * scale <= 0.4 * self.width()), default=_BARS[0])
        y, x = self.height() - 8.0, 8.0
        for pen in (QPen(QColor("white"), 5.0), QPen(QColor("black"), 2.0)):
            painter.setPen(pen)
            painter.drawLine(QPointF(x, y), QPointF(x + length * scale, y))
        self._label(painter, QPointF(x, y - 6), f"{length:g} m")

    def _label(self, painter: QPainter, at: QPointF, text: str) -> None:
        painter.setPen(QColor("white"))
        for dx, dy in ((-1, 0), (1, 0), (0, -1), (0, 1)):
            painter.drawText(at + QPointF(dx, dy), text)
        painter.setPen(QColor("black"))
        painter.drawText(at, text)

    def _pixel(self, point: QgsPointXY) -> QPointF:
        assert self.picture is not None
        from_, to, low, high = self.picture.window
        return QPointF((point.x() - from_) / (to - from_) * self.width(), (high - point.y()) / (high - low) * self.height())


def _lines(outline: QgsGeometry) -> List[List[QgsPointXY]]:
    lines: List[List[QgsPointXY]] = []
    for part in outline.asGeometryCollection():
        if part.type() == QgsWkbTypes.PolygonGeometry:
            lines += part.asPolygon()
        elif part.type() == QgsWkbTypes.LineGeometry:
            lines.append(part.asPolyline())
        else:
            lines.append([part.asPoint()] * 2)
    return lines
