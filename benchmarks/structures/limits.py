"""Detection limits: flat panels about a station, each turned to its incidence, with spots of known size and contrast on them.

Every scene holds the same number of spots of each size, contrast and incidence; materials, outlines and places are a seed's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import shapely
from shapely.geometry import Polygon, box

from benchmarks.common import print_table, progress, save
from benchmarks.structures import judge
from benchmarks.structures.detector import attempt
from benchmarks.structures.scenes import Scene, read
from tunneldb.arrays import Float
from tunneldb.simulate.structure import StructureParameters, StructureScan, layout, write_structure
from tunneldb.simulate.structure.anomalies import Anomaly, blob
from tunneldb.simulate.structure.materials import MATERIALS
from tunneldb.simulate.structure.shapes import Structure

SIZES = (0.005, 0.01, 0.03, 0.1)  # m²
SHIFTS = (-1.0, -2.0, -3.0, -6.0, 1.0, 2.0, 3.0, 6.0)  # dB; negative: darker
INCIDENCES = (0.0, 30.0, 60.0, 75.0, 80.0)  # degrees
EACH = 5  # spots of a size, contrast and incidence in a scene
PANELS = 6  # of an incidence, in a scene
DISTANCE, STEP = 8.0, 0.06  # m, degrees: 8.4 mm between points at right angles
WIDTH, HEIGHT = 2.2, 4.0  # of a panel, m
GAP = math.radians(1.5)  # between panels
FIRST = math.radians(-150.0)  # azimuth of the first panel
MARGIN, APART = 0.06, 0.10  # of spots from the rim and from each other, m
TRIES = 2000


def main(seeds: Sequence[int], folder: Path, reference: bool) -> None:
    """Print and keep the table."""
    spots: list[dict[str, Any]] = []
    false, area, points, seconds = 0, 0.0, 0, 0.0
    for seed in seeds:
        scene = make(seed, folder)
        found, _ = attempt(scene, folder, models=False, reference=reference)
        spots += rows_of(scene, found.anomaly > 0)
        false += len(judge.false_regions(scene, found.anomaly))
        area, points, seconds = area + judge.area_seen(scene), points + len(scene.xyz), seconds + found.seconds
        progress(f"seed {seed}: {len(scene.xyz):,} points, {found.seconds:.1f} s")
    title = f"share found of how many, by incidence, size and contrast; {len(spots)} spots, {points:,} points, {seconds:.0f} s"
    print_table(title, *table(spots))
    print_table("beside them", ("", ""), [("m² seen", area), ("false regions", false), ("on 100 m²", 100.0 * false / area)])
    figures = {"seeds": list(seeds), "points": points, "area": area, "false": false, "spots": spots}
    print(f"\n{save('structures-limits', figures)}")


def rows_of(scene: Scene, called: Any) -> list[dict[str, Any]]:
    """Size, shift, incidence of its panel, points of each spot put in, and the share of these that was found."""
    out = []
    for a in scene.truth["anomalies"]:
        mine = scene.anomaly == a["id"]
        share = float(called[mine].mean()) if mine.any() else 0.0
        incidence = scene.truth["faces"][a["face"] - 1]["incidence"][1]
        out.append(
            {"area": a["area"], "shift": a["contrast"], "incidence": incidence, "points": int(mine.sum()), "found": share}
        )
    return out


def table(spots: Sequence[dict[str, Any]]) -> tuple[list[str], list[list[object]]]:
    """Header and rows: a row each incidence and size, with the median of points; a column each contrast."""
    header = ["degrees", "m²", "points", *(f"{'dark' if s < 0.0 else 'bright'} {abs(s):g} dB" for s in SHIFTS)]
    rows: list[list[object]] = []
    for (low, high), size in product(pairwise(INCIDENCES), SIZES):
        here = [s for s in spots if low <= s["incidence"] < high and math.isclose(s["area"], size, rel_tol=0.01)]
        row: list[object] = [f"{low:g}–{high:g}", f"{size:g}", f"{np.median([s['points'] for s in here]):.0f}" if here else ""]
        for shift in SHIFTS:
            mine = [s["found"] >= judge.HALF for s in here if s["shift"] == shift]
            row.append(f"{100 * sum(mine) / len(mine):.0f} % of {len(mine)}" if mine else "")
        rows.append(row)
    return header, rows


@dataclass(frozen=True)
class _Panel:
    """A panel: azimuth of its middle and tilt against the ray there, radians; which incidence it is for."""

    azimuth: float
    tilt: float
    incidence: int

    def axes(self) -> Float:
        """Level, upright and towards the station (rows)."""
        turned = self.azimuth + math.pi + self.tilt
        normal = np.array([math.sin(turned), math.cos(turned), 0.0])
        up = np.array([0.0, 0.0, 1.0])
        return np.array([np.cross(up, normal), up, normal])

    def middle(self) -> Float:
        """Middle, m from the station."""
        return DISTANCE * np.array([math.sin(self.azimuth), math.cos(self.azimuth), 0.0])

    def corners(self) -> Float:
        """Places (9, 3) of corners, middles of sides and the middle, m from the station."""
        u, v, _ = self.axes()
        sides = product((-0.5, 0.0, 0.5), repeat=2)
        return np.array([self.middle() + p * WIDTH * u + q * HEIGHT * v for p, q in sides])

    def incidences(self) -> Float:
        """Incidence there (9,), degrees."""
        place = self.corners()
        return np.degrees(np.arccos(np.abs(place @ self.axes()[2]) / np.linalg.norm(place, axis=1)))


def panels(rng: np.random.Generator) -> list[_Panel]:
    """Panels about the station in random order, none before another; all of a panel lies within its incidence."""
    out: list[_Panel] = []
    end = FIRST
    for incidence in rng.permutation(np.repeat(np.arange(len(INCIDENCES) - 1), PANELS)).tolist():
        low, high = INCIDENCES[incidence], INCIDENCES[incidence + 1]
        fits = []
        for tilt in np.radians(np.arange(0.0, 85.0, 0.1)):
            there = _Panel(0.0, tilt, incidence).incidences()
            if low <= there.min() and there.max() <= high:
                fits.append(tilt)
        tilt = float(rng.choice(fits)) * float(rng.choice([-1.0, 1.0]))
        away = _Panel(0.0, tilt, incidence).corners()
        azimuth = np.arctan2(away[:, 0], away[:, 1])
        out.append(_Panel(end - azimuth.min(), tilt, incidence))
        end += float(np.ptp(azimuth)) + GAP
    if end > -FIRST:
        raise SystemExit("the panels do not fit about the station")
    return out


class _PanelScan(StructureScan):
    """A scan of panels with as many spots of each kind as there are to be."""

    def __init__(self, parameters: StructureParameters) -> None:
        self._panels = panels(np.random.default_rng([parameters.seed, 1]))
        with patch.object(layout, "build", self._build), patch.object(layout, "stations", lambda *_: np.zeros((1, 3))):
            super().__init__(parameters)

    def _build(self, parameters: StructureParameters, rng: np.random.Generator) -> Structure:
        structure = Structure()
        for panel in self._panels:
            material = str(rng.choice([name for name in MATERIALS if name != "cable"]))
            layout.plate(structure, "panel", material, panel.middle(), panel.axes(), WIDTH, HEIGHT)
        return structure

    def _place(self, rng: np.random.Generator) -> list[Anomaly]:
        out: list[Anomaly] = []
        for incidence in range(len(INCIDENCES) - 1):
            faces = [f for f, panel in zip(self.structure.faces, self._panels, strict=True) if panel.incidence == incidence]
            taken: dict[int, list[Polygon]] = {face.id: [] for face in faces}
            # The largest first, which need most room.
            for size in sorted(SIZES, reverse=True):
                for k, shift in enumerate(rng.permutation(np.repeat(SHIFTS, EACH)).tolist()):
                    face = faces[k % len(faces)]
                    outline = _room(size, taken[face.id], rng)
                    taken[face.id].append(outline)
                    out.append(Anomaly(len(out) + 1, face, "stain" if shift < 0.0 else "flake", outline, shift))
        return out


def _room(size: float, taken: list[Polygon], rng: np.random.Generator) -> Polygon:
    """Outline of a spot that lies clear of the rim and of the others, on the unrolled panel."""
    half = np.array([0.5 * WIDTH - MARGIN, 0.5 * HEIGHT - MARGIN])
    inside, others = box(*-half, *half), shapely.MultiPolygon(taken)
    for _ in range(TRIES):
        shape = blob(size, float(rng.uniform(1.0, 2.5)), float(rng.uniform(0.0, math.pi)), rng)
        outline = Polygon(np.asarray(shape.exterior.coords) + rng.uniform(-half, half))
        if outline.is_valid and inside.contains(outline) and (not taken or others.distance(outline) >= APART):
            return outline
    raise SystemExit("no room for all spots on the panels")


def make(seed: int, folder: Path) -> Scene:
    """Scan the panels of a seed, or read them if the folder has them."""
    base = folder / f"limits{seed}"
    if not Path(f"{base}.truth.json").exists():
        wanted = StructureParameters(
            name=base.name, seed=seed, stations=1, distance=DISTANCE, angular_step=STEP, anomalies=0, fronts=0
        )
        write_structure(_PanelScan(wanted), folder)
    return read(base)
