"""Files of images of the unrolled lining, by the names that ``tunneldb image`` and ``tunneldb qgis`` give."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from typing import Dict, Iterable, List, Optional, Tuple

KINDS = {"raw": "Intensity, raw", "corrected": "Intensity, corrected", "rgb": "Colour", "offset": "Offset"}
"""Kinds of image shown side by side, with their titles."""

OPTIONAL = ("rgb",)
"""Kinds that are hidden if a survey has no such image."""

_NAME = re.compile(r"^(?P<survey>.+)-km(?P<km>-?\d+)-(?P<kind>[a-z]+)(?P<filled>-filled)?\.tif$", re.IGNORECASE)
_MARGIN, _LEAST = 0.6, 1.6


@dataclass(frozen=True)
class Image:
    """Image of a kilometre; ``filled`` if gaps between points are filled."""

    path: str
    survey: str
    km: int
    kind: str
    filled: bool


def image_of(path: str) -> Optional[Image]:
    """Return what a file shows; None if it is no image of the lining."""
    found = _NAME.match(os.path.basename(path))  # noqa: PTH119 - a source of QGIS is a string
    if found is None:
        return None
    return Image(path, found["survey"], int(found["km"]), found["kind"].lower(), bool(found["filled"]))


def in_folder(folder: str) -> List[Image]:
    """Return the images of a folder; none if there is no such folder."""
    try:
        names = sorted(os.listdir(folder))  # noqa: PTH208
    except OSError:
        return []
    return [image for image in (image_of(os.path.join(folder, name)) for name in names) if image is not None]  # noqa: PTH118


def stacked(images: Iterable[Image], survey: str, kind: str, kilometres: Iterable[int]) -> List[Image]:
    """Return the images of one kind over some kilometres, from the top: as measured, and under these with gaps filled."""
    wanted = set(kilometres)
    chosen = [image for image in images if image.survey == survey and image.kind == kind and image.km in wanted]
    return sorted(chosen, key=lambda image: (image.filled, image.km))


def kilometres(chainage_from: float, chainage_to: float) -> range:
    """Return the kilometres that a stretch reaches into."""
    return range(int(chainage_from // 1000), int(chainage_to // 1000) + 1)


def window(box: Tuple[float, float, float, float], aspect: float, zoom: float = 1.0) -> Tuple[float, float, float, float]:
    """Return the extent shown around a finding.

    Parameters
    ----------
    box : tuple
        The finding's chainage from and to, arc from and to, m.
    aspect : float
        Width of the picture over its height.
    zoom : float
        Above 1 shows less about it, below 1 more.

    Returns
    -------
    tuple
        Chainage from and to, arc from and to, m, with the picture's aspect and the finding in its middle.
    """
    from_, to, low, high = box
    width, height = to - from_, high - low
    margin = _MARGIN * max(width, height, _LEAST) / zoom
    width, height = max(width + margin, _LEAST / zoom), max(height + margin, _LEAST / zoom)
    width, height = max(width, height * aspect), max(height, width / aspect)
    x, y = (from_ + to) / 2, (low + high) / 2
    return x - width / 2, x + width / 2, y - height / 2, y + height / 2


class Stamps:
    """Times of the last writing of files, for finding changed ones."""

    def __init__(self) -> None:
        self._seen: Dict[str, Tuple[int, int]] = {}

    def note(self, path: str) -> None:
        """Note a file as it is now."""
        stamp = _stamp(path)
        if stamp is not None:
            self._seen[path] = stamp

    def changed(self, path: str) -> bool:
        """Return True if a file differs from the noted one; False if it is gone."""
        stamp = _stamp(path)
        return stamp is not None and stamp != self._seen.get(path)


def _stamp(path: str) -> Optional[Tuple[int, int]]:
    try:
        state = os.stat(path)  # noqa: PTH116
    except OSError:
        return None
    return state.st_mtime_ns, state.st_size
