"""Scanning a tunnel that is painted and equipped, and writing what a surveyor would hand over."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import laspy
import numpy as np
from pyproj import CRS

from .equipment import Body
from .frames import Array
from .instruments import Instrument
from .scanners import Grid, Tripod
from .trace import Echoes, Wall, merge, scan, thin
from .truth import collection, leaks, others

TARGET = 0.8
FIRST_RANGE, LAST_RANGE = 1.0, 26.0


@dataclass
class Survey:
    """A tunnel and how it is scanned.

    Attributes
    ----------
    wall : Wall
        The painted lining.
    bodies : list of Body
        Equipment.
    grids : sequence of Grid
        Stations, or parts of a ride.
    instrument : Instrument
        The scanner.
    rng : numpy.random.Generator
        For noise.
    track : Array or None
        Time and site coordinates of a ride.
    cap : float
        Points per square metre that one station keeps at most.
    cube : float
        Edge of the cubes by which a static scan is thinned, m.
    reference : bool
        Whether the owner has measured a target.
    off_axis : tuple of float
        Offset and height of the axis that is handed over against the section's middle, m.
    """

    wall: Wall
    bodies: list[Body]
    grids: Sequence[Grid]
    instrument: Instrument
    rng: np.random.Generator
    track: Array | None = None
    cap: float = 5000.0
    cube: float = 0.017
    reference: bool = True
    off_axis: tuple[float, float] = field(default=(0.0, 0.0))

    def deliver(self, folder: Path) -> None:
        """Scan, and write all files."""
        echoes = self._scan()
        self._write_points(folder / "scan.laz", echoes)
        self._write_axis(folder / "axis.csv")
        self._write_positions(folder)
        if self.reference:
            self._write_reference(folder / "reference.csv")
        canvas, tunnel = self.wall.canvas, self.wall.tunnel
        for name, regions in (("truth", leaks(canvas, echoes)), ("other", others(canvas, echoes))):
            text = json.dumps(collection(tunnel, canvas, regions))
            (folder / f"{name}.geojson").write_text(text, encoding="utf-8")

    def _scan(self) -> Echoes:
        """All points on the length asked for, with each station's own offsets of place and amplitude, or a ride's drift."""
        parts = []
        for grid in self.grids:
            part = scan(self.wall, self.bodies, grid, self.instrument, self.rng, self.cap)
            if self.track is None:
                part.amplitude += self.rng.normal(0, self.instrument.drift)
                part.site += self.rng.normal(0, 0.0012, 3)
            else:
                part.amplitude += self.instrument.drift * np.sin((part.time - self.track[0, 0]) / 3.7)
            parts.append(part)
        echoes = merge(parts)
        u = self.wall.tunnel.axis.to_local(echoes.site)[0]
        echoes = echoes.only((u > 0.0) & (u < self.wall.tunnel.axis.length))
        return echoes if self.track is not None else thin(echoes, self.cube)

    def _write_points(self, path: Path, echoes: Echoes) -> None:
        world = self.wall.tunnel.axis.to_world(echoes.site)
        header = laspy.LasHeader(point_format=6, version="1.4")
        header.scales = np.full(3, 0.0005)
        header.offsets = np.floor(world.mean(axis=0))
        header.add_extra_dim(laspy.ExtraBytesParams("Amplitude", np.float32, "echo amplitude, dB"))
        header.add_crs(CRS.from_epsg(25832))
        las = laspy.LasData(header)
        las.x, las.y, las.z = world.T
        low = float(echoes.amplitude.min())
        las.intensity = np.clip((echoes.amplitude - low) * 1000, 0, 65535).astype(np.uint16)
        las.gps_time = echoes.time
        las.point_source_id = echoes.source.astype(np.uint16)
        las.return_number = np.ones(len(world), np.uint8)
        las.number_of_returns = np.ones(len(world), np.uint8)
        las["Amplitude"] = echoes.amplitude.astype(np.float32)
        las.write(path)

    def _write_axis(self, path: Path) -> None:
        axis = self.wall.tunnel.axis
        u = np.linspace(-2.0, axis.length + 2.0, int((axis.length + 4.0) / 2.5) + 1)
        site = axis.to_site(u, np.full_like(u, self.off_axis[0]), np.full_like(u, self.off_axis[1]))
        _write_table(path, "x,y,z", axis.to_world(site), "%.4f,%.4f,%.4f")

    def _write_positions(self, folder: Path) -> None:
        axis = self.wall.tunnel.axis
        if self.track is not None:
            rows = np.column_stack([self.track[:, 0], axis.to_world(self.track[:, 1:])])
            _write_table(folder / "trajectory.csv", "time,x,y,z", rows, "%.5f,%.4f,%.4f,%.4f")
            return
        tripods = [grid for grid in self.grids if isinstance(grid, Tripod)]
        rows = np.array([[grid.source, *axis.to_world(grid.place)] for grid in tripods])
        _write_table(folder / "stations.csv", "scan_id,x,y,z", rows, "%d,%.4f,%.4f,%.4f")

    def _write_reference(self, path: Path) -> None:
        reach = np.concatenate([np.arange(FIRST_RANGE, 6.0, 0.25), np.arange(6.0, LAST_RANGE + 0.1, 0.5)])
        amplitude = self.instrument.curve(reach) + 10 * np.log10(TARGET) + self.rng.normal(0, 0.03, len(reach))
        _write_table(path, "range_m,intensity_db", np.column_stack([reach, amplitude]), "%.3f,%.3f")


def _write_table(path: Path, header: str, rows: Array, form: str) -> None:
    """Write a CSV."""
    np.savetxt(path, rows, fmt=form, header=header, comments="", delimiter=",")


def tripods(wall: Wall, places: Sequence[tuple[float, float, float]], step: float, lowest: float = -62.0) -> list[Tripod]:
    """Stations at (chainage, offset to the left, height above the axis)."""
    stations = []
    for number, (u, y, z) in enumerate(places, start=1):
        place = wall.tunnel.axis.to_site(np.array(u), np.array(y), np.array(z))
        stations.append(Tripod(number, place, step, 400_000.0 + 420.0 * number, lowest, 0.7 * number))
    return stations
