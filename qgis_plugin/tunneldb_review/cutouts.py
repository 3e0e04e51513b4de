"""Cut-outs of the images around a finding, drawn by QGIS in the background, with the next ones in advance."""

from __future__ import annotations

from collections import OrderedDict
from typing import Dict, Iterable, List, NamedTuple, Tuple

from qgis.core import (
    QgsColorRampShader,
    QgsContrastEnhancement,
    QgsMapRendererParallelJob,
    QgsMapSettings,
    QgsMultiBandColorRenderer,
    QgsProject,
    QgsRasterLayer,
    QgsRasterShader,
    QgsRectangle,
    QgsSingleBandGrayRenderer,
    QgsSingleBandPseudoColorRenderer,
)
from qgis.PyQt.QtCore import QObject, QSize, pyqtSignal
from qgis.PyQt.QtGui import QColor, QImage

from .images import Image, image_of, in_folder, kilometres, stacked

KEPT = 60
"""Number of pictures in memory."""

BACKGROUND = QColor("#f7f7f7")
REVIEW_COLOURS = {"open": "#e67e00", "confirmed": "#005caf", "rejected": "#6e6e6e"}
"""Colours of leaks by their review, those of all outputs of tunneldb."""

_SAMPLE = 250_000
_LEAST_DARK, _LEAST_BRIGHT = 4.0, 1.6  # dB about the median, as in the images of tunneldb
_OFFSET = 0.1  # m, where colours are full
_OFFSET_COLOURS = ((-1.0, "#2166ac"), (-0.4, "#92c5de"), (0.0, "#e6e6e6"), (0.4, "#f4a582"), (1.0, "#b2182b"))


class Picture(NamedTuple):
    """Key of a picture: finding, kind of image, size, and extent."""

    finding: int
    kind: str
    width: int
    height: int
    window: Tuple[float, float, float, float]


class ImageSource:
    """Images of the open project in its style; missing kinds come from a folder."""

    def __init__(self) -> None:
        self.folder = ""
        self._own: Dict[str, QgsRasterLayer] = {}

    def layers(self, survey: str, kind: str, chainage_from: float, chainage_to: float) -> List[QgsRasterLayer]:
        """Return the layers of one kind over a stretch, from the top."""
        touched = kilometres(chainage_from, chainage_to)
        shown = {layer.source(): layer for layer in QgsProject.instance().mapLayers().values() if _is_image(layer)}
        found = stacked(_images(shown), survey, kind, touched)
        if found:
            return [shown[image.path] for image in found]
        return [self._layer(image) for image in stacked(in_folder(self.folder), survey, kind, touched)] if self.folder else []

    def forget(self) -> None:
        """Open the files of the folder anew."""
        self._own.clear()

    def _layer(self, image: Image) -> QgsRasterLayer:
        if image.path not in self._own:
            layer = QgsRasterLayer(image.path, image.kind, "gdal")
            if layer.isValid():
                _style(layer, image.kind)
            self._own[image.path] = layer
        return self._own[image.path]


class CutoutMaker(QObject):
    """Draws pictures, and keeps those last drawn."""

    made = pyqtSignal(object)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._images: OrderedDict[Picture, QImage] = OrderedDict()
        self._jobs: Dict[Picture, QgsMapRendererParallelJob] = {}
        self._leaving: List[QgsMapRendererParallelJob] = []

    def get(self, picture: Picture) -> QImage | None:
        """Return a picture if it is there."""
        image = self._images.get(picture)
        if image is not None:
            self._images.move_to_end(picture)
        return image

    def want(self, picture: Picture, layers: Iterable[QgsRasterLayer]) -> None:
        """Start to draw a picture, unless it exists or is in progress; `made` reports it when ready."""
        if picture in self._images or picture in self._jobs:
            return
        settings = QgsMapSettings()
        settings.setLayers([layer for layer in layers if layer.isValid()])
        from_, to, low, high = picture.window
        settings.setExtent(QgsRectangle(from_, low, to, high))
        settings.setOutputSize(QSize(picture.width, picture.height))
        settings.setBackgroundColor(BACKGROUND)
        job = QgsMapRendererParallelJob(settings)
        self._jobs[picture] = job
        job.finished.connect(lambda: self._finish(picture, job))
        job.start()

    def drop_others(self, wanted: Iterable[Picture]) -> None:
        """Stop drawing pictures that are no longer needed."""
        kept = set(wanted)
        for picture in [picture for picture in self._jobs if picture not in kept]:
            job = self._jobs.pop(picture)
            self._leaving.append(job)  # to delete it would wait for its end
            job.cancelWithoutBlocking()

    def clear(self) -> None:
        """Forget all pictures, as their images have changed."""
        self.drop_others(())
        self._images.clear()

    def stop(self) -> None:
        """Forget all, and wait until nothing is being drawn."""
        self.clear()
        for job in self._leaving:
            job.finished.disconnect()  # a late signal would reach objects that Python is deleting
            job.waitForFinished()
        self._leaving.clear()

    def _finish(self, picture: Picture, job: QgsMapRendererParallelJob) -> None:
        if job in self._leaving:
            self._leaving.remove(job)
            return
        if self._jobs.pop(picture, None) is None:
            return  # stopped
        self._images[picture] = job.renderedImage()
        while len(self._images) > KEPT:
            self._images.popitem(last=False)
        self.made.emit(picture)


def _images(sources: Iterable[str]) -> List[Image]:
    return [image for image in map(image_of, sources) if image is not None]


def _is_image(layer: object) -> bool:
    return isinstance(layer, QgsRasterLayer) and layer.providerType() == "gdal" and image_of(layer.source()) is not None


def _style(layer: QgsRasterLayer, kind: str) -> None:
    """Draw an image as projects of tunneldb do: intensity in grey, offset blue outside and red inside, colour as it is."""
    provider = layer.dataProvider()
    if kind == "rgb":
        colours = QgsMultiBandColorRenderer(provider, 1, 2, 3)
        colours.setAlphaBand(4)
        layer.setRenderer(colours)
        return
    if kind == "offset":
        ramp = QgsColorRampShader(-_OFFSET, _OFFSET)
        ramp.setColorRampType(QgsColorRampShader.Interpolated)
        ramp.setColorRampItemList(
            [QgsColorRampShader.ColorRampItem(share * _OFFSET, QColor(colour)) for share, colour in _OFFSET_COLOURS]
        )
        shader = QgsRasterShader()
        shader.setRasterShaderFunction(ramp)
        layer.setRenderer(QgsSingleBandPseudoColorRenderer(provider, 1, shader))
        return
    low, middle = provider.cumulativeCut(1, 0.02, 0.5, provider.extent(), _SAMPLE)
    _, high = provider.cumulativeCut(1, 0.5, 0.98, provider.extent(), _SAMPLE)
    stretch = QgsContrastEnhancement(provider.dataType(1))
    stretch.setContrastEnhancementAlgorithm(QgsContrastEnhancement.StretchToMinimumMaximum)
    stretch.setMinimumValue(min(low, middle - _LEAST_DARK))
    stretch.setMaximumValue(max(high, middle + _LEAST_BRIGHT))
    renderer = QgsSingleBandGrayRenderer(provider, 1)
    renderer.setContrastEnhancement(stretch)
    layer.setRenderer(renderer)
