"""E57 files with pictures, written by libE57Format."""

from __future__ import annotations

from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation


@dataclass
class Shot:
    """A picture: its pixels, and the numbers of its representation; without a pose if it has no position."""

    pixels: np.ndarray
    representation: str
    numbers: dict[str, float] = field(default_factory=dict)
    position: tuple[float, float, float] | None = None
    rotation: Rotation = field(default_factory=Rotation.identity)
    name: str = "shot"
    size: tuple[int, int] | None = None


def write_e57(path: Path, shots: list[Shot]) -> Path:
    """Write a file with pictures and a scan of one point."""
    libe57 = pytest.importorskip("pye57").libe57
    image = libe57.ImageFile(str(path), "w")
    root = image.root()
    root.set("formatName", libe57.StringNode(image, "ASTM E57 3D Imaging Data File"))
    root.set("guid", libe57.StringNode(image, "{file}"))
    root.set("versionMajor", libe57.IntegerNode(image, 1))
    root.set("versionMinor", libe57.IntegerNode(image, 0))
    vector = libe57.VectorNode(image, True)
    root.set("images2D", vector)
    blobs = []
    for n, shot in enumerate(shots):
        node = libe57.StructureNode(image)
        vector.append(node)
        node.set("guid", libe57.StringNode(image, f"{{shot {n}}}"))
        node.set("name", libe57.StringNode(image, shot.name))
        if shot.position is not None:
            pose, turn, move = (libe57.StructureNode(image) for _ in range(3))
            for name, value in zip("xyzw", shot.rotation.as_quat(), strict=True):
                turn.set(name, libe57.FloatNode(image, float(value)))
            for name, value in zip("xyz", shot.position, strict=True):
                move.set(name, libe57.FloatNode(image, float(value)))
            node.set("pose", pose)
            pose.set("rotation", turn)
            pose.set("translation", move)
        content = BytesIO()
        Image.fromarray(shot.pixels).save(content, "PNG")
        data = np.frombuffer(content.getvalue(), np.uint8).copy()
        view = libe57.StructureNode(image)
        node.set(shot.representation, view)
        rows, columns = shot.pixels.shape[:2] if shot.size is None else shot.size
        view.set("imageWidth", libe57.IntegerNode(image, columns))
        view.set("imageHeight", libe57.IntegerNode(image, rows))
        for name, value in shot.numbers.items():
            view.set(name, libe57.FloatNode(image, float(value)))
        blob = libe57.BlobNode(image, len(data))
        view.set("pngImage", blob)
        blobs.append((blob, data))
    for blob, data in blobs:
        blob.write(data, 0, len(data))
    image.close()
    return path
