"""Files of points and tables."""

from __future__ import annotations

from pathlib import Path

import laspy
import numpy as np
from pyproj import CRS

from .fields import Array


def write_cloud(path: Path, points: Array, amplitude: Array, time: Array, source: Array) -> None:
    """Write points in the order of time as LAS 1.4, format 6, with the extra dimension ``Amplitude``."""
    order = np.argsort(time, kind="stable")
    header = laspy.LasHeader(version="1.4", point_format=6)
    header.scales = np.full(3, 0.0005)
    header.offsets = np.floor(points.min(0))
    header.add_extra_dim(laspy.ExtraBytesParams(name="Amplitude", type=np.float32, description="dB"))
    header.add_crs(CRS.from_epsg(25832))
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = points[order].T
    cloud["Amplitude"] = amplitude[order]
    cloud.gps_time = time[order]
    cloud.point_source_id = source[order].astype(np.uint16)
    cloud.return_number = np.ones(len(points), np.uint8)
    cloud.number_of_returns = np.ones(len(points), np.uint8)
    low, high = amplitude.min(), amplitude.max()
    cloud.intensity = ((amplitude[order] - low) / (high - low) * 65535).astype(np.uint16)
    cloud.write(path)


def write_table(path: Path, header: str, rows: Array, layout: str) -> None:
    """Write a table with a header line."""
    np.savetxt(path, rows, fmt=layout, delimiter=",", header=header, comments="")
