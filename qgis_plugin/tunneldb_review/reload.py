"""Reload image layers whose files were written again, for example by another run of detect."""

from __future__ import annotations

from typing import Iterable, List

from qgis.core import QgsDataProvider, QgsMapLayer, QgsProject, QgsRasterLayer, QgsVectorLayer

from .images import Stamps, image_of


class ImageReloader:
    """Knows since when each image layer of the project shows its file."""

    def __init__(self) -> None:
        self._stamps = Stamps()
        self.note(QgsProject.instance().mapLayers().values())
        QgsProject.instance().layersAdded.connect(self.note)

    def stop(self) -> None:
        """Follow the project no more."""
        QgsProject.instance().layersAdded.disconnect(self.note)

    def note(self, layers: Iterable[QgsMapLayer]) -> None:
        """Note the files of layers that were just read."""
        for layer in layers:
            if isinstance(layer, QgsRasterLayer) and image_of(layer.source()) is not None:
                self._stamps.note(layer.source())

    def reload(self) -> List[str]:
        """Reload images whose files have changed, and layers of the database; return the names of the images."""
        changed = []
        for layer in QgsProject.instance().mapLayers().values():
            if isinstance(layer, QgsRasterLayer):
                if image_of(layer.source()) is not None and (self._stamps.changed(layer.source()) or not layer.isValid()):
                    _read_again(layer)
                    changed.append(layer.name())
                    self._stamps.note(layer.source())
            elif isinstance(layer, QgsVectorLayer) and '"tunnel_api"' in layer.source() and not layer.isEditable():
                layer.reload()
                layer.triggerRepaint()
        return sorted(changed)


def _read_again(layer: QgsRasterLayer) -> None:
    """Open a file anew, and keep how it is drawn: a dataset that is open goes on showing the file that it was opened on."""
    renderer = layer.renderer().clone() if layer.renderer() is not None else None
    layer.setDataSource(layer.source(), layer.name(), "gdal", QgsDataProvider.ProviderOptions())
    if renderer is not None and layer.isValid():
        layer.setRenderer(renderer)
    layer.triggerRepaint()
