"""The set of simulated tunnels by which the detection of leaks is measured.

Sections, scanners, linings, roughness and seeds are crossed so that each occurs with several of the others; each tunnel holds
what is dark without being wet, or before the lining. None is made to be easy. Water is 1.5 to 8 dB darker than dry lining,
which spans 4 of its standard deviations to more than 12.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pyogrio.raw
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from benchmarks.common import tunneldb
from benchmarks.scene import Scene

STATIC: dict[str, Any] = {"scanner": "static", "station_spacing": 12.0, "angular_step": 0.18}
PROFILER: dict[str, Any] = {"scanner": "profiler", "profile_spacing": 0.016, "profile_points": 1250}
COMMON: dict[str, Any] = {
    "leak_drop": (1.5, 8.0), "leak_area": (0.1, 2.5), "niche_leaks": 1, "drips": True, "clutter": 3,
    "beam": 0.3, "leak_edge": 0.03, "relief": 0.002, "slope": 2.0, "start_chainage": 12_310.0,
}  # fmt: skip
MARKED: dict[str, Any] = {"soot": 2.0, "grime": 2.0, "patches": 5, "paint": 5}
KILOMETRE = 1000.0


@dataclass(frozen=True)
class Case:
    """One tunnel of the set.

    Attributes
    ----------
    name : str
        Section, scanner and what is particular about it.
    options : dict
        Parameters of the simulation.
    reference : str
        ``measured`` on a target, or ``auto``: found on the lining.
    """

    name: str
    options: Mapping[str, Any] = field(default_factory=dict)
    reference: str = "measured"

    def seed(self, seed: int, number: int) -> int:
        """Seed of the simulation, by that of the set and the number in it."""
        return 100 * seed + number

    def arguments(self, seed: int, number: int) -> list[object]:
        """Options of ``tunneldb simulate``; each tunnel has its own kilometre, so that results can be put side by side."""
        values = {**COMMON, **self.options}
        if values["lining"] in ("cast", "segments"):
            values.setdefault("joint_leaks", 3)
        values["seed"] = self.seed(seed, number)
        values["start_chainage"] = KILOMETRE * (12 + number) + 310.0
        out: list[object] = []
        for name, value in values.items():
            flag = "--" + name.replace("_", "-")
            if value is True:
                out.append(flag)
            elif value is not False:
                out += [flag, *(value if isinstance(value, tuple) else (value,))]
        return out


SET = (
    Case(
        "circular static plain",
        {**STATIC, "section": "circular", "length": 60, "lining": "plain", "roughness": 12, "leaks": 8},
    ),
    Case(
        "circular static segments",
        {**STATIC, "section": "circular", "length": 60, "lining": "segments", "ring_step": 0.003, "roughness": 18, **MARKED,
         "leaks": 7},
        "auto",
    ),
    Case(
        "circular profiler segments",
        {**PROFILER, "section": "circular", "length": 80, "lining": "segments", "ring_step": 0.004, "roughness": 14, **MARKED,
         "leaks": 8, "range_curve": "inverse_square", "scanner_height": 2.2},
    ),
    Case(
        "circular profiler tiles",
        {**PROFILER, "section": "circular", "length": 70, "lining": "tiles", "roughness": 5, "leaks": 6, **MARKED,
         "scanner_offset": 0.9},
    ),
    Case(
        "horseshoe static cast",
        {**STATIC, "section": "horseshoe", "length": 60, "lining": "cast", "ring": 8.0, "roughness": 10, **MARKED, "leaks": 6},
        "auto",
    ),
    Case(
        "horseshoe static shotcrete",
        {**STATIC, "section": "horseshoe", "length": 60, "lining": "shotcrete", "relief": 0.006, "roughness": 26, "soot": 1.5,
         "grime": 1.5, "leaks": 6, "range_curve": "inverse_square"},
        "auto",
    ),
    Case(
        "horseshoe profiler cast",
        {**PROFILER, "section": "horseshoe", "length": 80, "lining": "cast", "ring": 10.0, "roughness": 16, **MARKED,
         "radius_step": 0.12, "leaks": 8},
    ),
    Case(
        "horseshoe profiler shotcrete",
        {**PROFILER, "section": "horseshoe", "length": 70, "lining": "shotcrete", "relief": 0.008, "roughness": 30, "soot": 2.5,
         "grime": 1.5, "leaks": 7},
    ),
    Case(
        "box static cast",
        {**STATIC, "section": "box", "length": 60, "lining": "cast", "ring": 12.0, "roughness": 15, **MARKED, "leaks": 6},
        "auto",
    ),
    Case(
        "box static tiles",
        {**STATIC, "section": "box", "length": 60, "lining": "tiles", "roughness": 8, "paint": 8, "grime": 2.5, "leaks": 6},
    ),
    Case(
        "box profiler cast",
        {**PROFILER, "section": "box", "length": 80, "lining": "cast", "ring": 6.0, "roughness": 22, **MARKED, "leaks": 8,
         "range_curve": "inverse_square"},
    ),
    Case(
        "box profiler shotcrete",
        {**PROFILER, "section": "box", "length": 60, "lining": "shotcrete", "relief": 0.005, "roughness": 20, "leaks": 6},
    ),
    Case(
        "circular profiler segments, step",
        {**PROFILER, "section": "circular", "length": 70, "lining": "segments", "ring_step": 0.002, "radius_step": 0.08,
         "roughness": 12, "soot": 3.0, "leaks": 6},
    ),
    Case(
        "circular profiler segments, dry",
        {**PROFILER, "section": "circular", "length": 80, "lining": "segments", "ring_step": 0.004, "roughness": 20, **MARKED,
         "leaks": 0, "joint_leaks": 0, "niche_leaks": 0},
    ),
)  # fmt: skip


@dataclass(frozen=True)
class Truth:
    """What was put into a tunnel: polygons in the unrolled plane, drops in dB.

    Attributes
    ----------
    leaks, drops
        Wet patches, and how much darker than dry lining they are.
    dry, kinds
        What is dark but dry, and what it is.
    """

    leaks: list[BaseGeometry]
    drops: NDArray[np.float64]
    dry: list[BaseGeometry]
    kinds: list[str]

    @classmethod
    def of(cls, scene: Scene) -> Truth:
        path = scene.file("truth.gpkg")
        leaks, drops = _layer(path, "leak", "drop_db")
        dry, kinds = _layer(path, "dry", "kind")
        return cls(leaks, np.asarray(drops, dtype=np.float64), dry, [str(kind) for kind in kinds])

    @cached_property
    def tree(self) -> shapely.STRtree:
        return shapely.STRtree(self.dry)

    def near(self, place: BaseGeometry, within: float = 0.3) -> str:
        """Return the dry dark area that a polygon overlaps or touches; empty if there is none."""
        if not self.dry:
            return ""
        numbers = self.tree.query(place, predicate="dwithin", distance=within)
        if not len(numbers):
            return ""
        shared = shapely.area(shapely.intersection(np.asarray(self.dry, dtype=object)[numbers], place))
        return self.kinds[numbers[int(np.argmax(shared))]] + (f" {100 * shared.max() / place.area:.0f} %")


def _layer(path: Path, layer: str, column: str) -> tuple[list[BaseGeometry], NDArray[Any]]:
    """Polygons of a layer and the values of a column; nothing where there is no such layer."""
    if layer not in pyogrio.list_layers(str(path))[:, 0]:
        return [], np.empty(0)
    meta, _, wkb, columns = pyogrio.raw.read(str(path), layer=layer)
    return list(shapely.from_wkb(wkb)), columns[list(meta["fields"]).index(column)]


def prepare(case: Case, seed: int, folder: Path, dsn: str, among: Sequence[Case] = SET) -> Scene:
    """Simulate a tunnel of a set, unless its files are there, and take it as far as the ground."""
    number = among.index(case)
    name = case.name.replace(",", "").replace("%", "per-cent").replace(" ", "-")
    scene = Scene(folder, name, KILOMETRE * (12 + number) + 310.0)
    arguments = case.arguments(seed, number)
    made_with = folder / f"{name}.options.json"
    if not made_with.exists() or json.loads(made_with.read_text()) != [str(a) for a in arguments]:
        tunneldb("simulate", folder, "--name", name, "--no-truth", *arguments)
        made_with.write_text(json.dumps([str(a) for a in arguments]))
    scene.register(dsn, reference=case.reference)
    scene.load(dsn)
    scene.run(dsn, "axis", "ground")
    return scene
