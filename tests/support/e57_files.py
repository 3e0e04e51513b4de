"""E57 files for tests, written field by field."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from pye57 import libe57


@dataclass
class Scan:
    """Fields of the points, in the scan's own frame; pose as quaternion w,x,y,z and translation."""

    fields: Mapping[str, np.ndarray]
    translation: Sequence[float] | None = None
    rotation: Sequence[float] = (1.0, 0.0, 0.0, 0.0)
    guid: str = "{A}"
    start: float | None = None
    bounds: tuple[np.ndarray, np.ndarray] | None = None
    scaled: Mapping[str, float] = field(default_factory=dict)  # scale of the fields stored as scaled integers
    colour_limits: Mapping[str, float] = field(default_factory=dict)  # as colorRedMaximum


def write(path: Path, scans: Sequence[Scan], metadata: str = "") -> Path:
    image = libe57.ImageFile(str(path), "w")
    image.extensionsAdd("", libe57.E57_V1_0_URI)
    for prefix in sorted({name.split(":")[0] for scan in scans for name in scan.fields if ":" in name}):
        image.extensionsAdd(prefix, f"http://example.com/e57/{prefix}")
    for name, text in (("formatName", "ASTM E57 3D Imaging Data File"), ("guid", "{F}"), ("coordinateMetadata", metadata)):
        image.root().set(name, libe57.StringNode(image, text))
    for name, number in (("versionMajor", libe57.E57_FORMAT_MAJOR), ("versionMinor", libe57.E57_FORMAT_MINOR)):
        image.root().set(name, libe57.IntegerNode(image, number))
    nodes = libe57.VectorNode(image, True)
    image.root().set("data3D", nodes)
    for index, scan in enumerate(scans):
        _write_scan(image, nodes, f"Scan {index + 1}", scan)
    image.close()
    return path


def structure(image: libe57.ImageFile, **values: float) -> libe57.StructureNode:
    node = libe57.StructureNode(image)
    for name, value in values.items():
        node.set(name, libe57.FloatNode(image, float(value)))
    return node


def _write_scan(image: libe57.ImageFile, nodes: libe57.VectorNode, name: str, scan: Scan) -> None:
    node = libe57.StructureNode(image)
    node.set("guid", libe57.StringNode(image, scan.guid))
    node.set("name", libe57.StringNode(image, name))
    if scan.translation is not None:
        pose = libe57.StructureNode(image)
        pose.set("rotation", structure(image, **dict(zip("wxyz", scan.rotation, strict=True))))
        pose.set("translation", structure(image, **dict(zip("xyz", scan.translation, strict=True))))
        node.set("pose", pose)
    if scan.start is not None:
        node.set("acquisitionStart", structure(image, dateTimeValue=scan.start))
    if scan.bounds is not None:
        low, high = scan.bounds
        box = {f"{axis}Minimum": value for axis, value in zip("xyz", low, strict=True)}
        box |= {f"{axis}Maximum": value for axis, value in zip("xyz", high, strict=True)}
        node.set("cartesianBounds", structure(image, **box))
    if scan.colour_limits:
        node.set("colorLimits", structure(image, **scan.colour_limits))
    prototype = libe57.StructureNode(image)
    for name, values in scan.fields.items():
        if name in scan.scaled:
            child = libe57.ScaledIntegerNode(image, 0, -(2**31), 2**31 - 1, scan.scaled[name], 0.0)
        elif np.issubdtype(values.dtype, np.integer):
            child = libe57.IntegerNode(image, 0, 0, 2**16)
        else:
            child = libe57.FloatNode(image, 0.0)
        prototype.set(name, child)
    points = libe57.CompressedVectorNode(image, prototype, libe57.VectorNode(image, True))
    node.set("points", points)
    nodes.append(node)
    count = len(next(iter(scan.fields.values())))
    buffers = libe57.VectorSourceDestBuffer()
    kept = []
    for name, values in scan.fields.items():
        kept.append(np.ascontiguousarray(values, "f8"))  # pye57 takes int64 for int32
        buffers.append(libe57.SourceDestBuffer(image, name, kept[-1], max(count, 1), True, True))
    if count:
        writer = points.writer(buffers)
        writer.write(count)
        writer.close()
