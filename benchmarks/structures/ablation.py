"""What each step of the detector is good for: the same scenes with one step at a time taken out.

There are no switches for them in the program: its functions are replaced here. Faces are grown once a scene, for all that is
taken out comes after them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmarks.common import print_table, progress, save
from benchmarks.structures import judge
from benchmarks.structures.detector import Found
from benchmarks.structures.scenes import Scene, make, parameters
from tunneldb.arrays import Bool, Float, Single
from tunneldb.pipeline import members as stage
from tunneldb.radiometry.robust_statistics import robust_statistics
from tunneldb.structures import contrast, find, level, profiles, significance, spots
from tunneldb.structures.level import CLASS, LevelCurve

SIGMAS = 3.0  # Ono et al., 3.4

Replacement = tuple[Any, str, Any]


@dataclass(frozen=True)
class Step:
    """A step, and what takes its place."""

    name: str
    replaced: Sequence[Replacement]

    @contextmanager
    def out(self) -> Iterator[None]:
        """Take it out."""
        with ExitStack() as stack:
            for module, name, other in self.replaced:
                stack.enter_context(patch.object(module, name, other))
            yield


def _point_by_point(drop: Single, judged: Bool, sigma: Single, pixels: int, scatter: Any) -> tuple[Single, Single]:
    """Each pixel by itself against 3σ, in place of `significance`."""
    single = np.where(judged, drop / (SIGMAS * np.maximum(sigma, 1e-3)), 0.0)
    ratio = np.asarray(single, dtype=np.float32)
    return ratio, SIGMAS * ratio


def _white(scatter: Any, window: int, sigma: float, number: float) -> float:
    """Scatter of a window's mean if pixels knew nothing of each other, in place of `Scatter.blended`."""
    return 1.0 / window


def _one_level(parts: list[list[Any]], model: Float, places: Any = None, *, by_range: bool) -> dict[int, LevelCurve]:
    """One level for the points of all scans, in place of `member_levels`."""
    seen = [one for part in parts for one in part]
    if not seen:
        return {}
    curve = contrast.curve_of(seen, model, by_range=by_range)
    return {one.scan: curve for one in seen}


def _by_histogram(angle: Float, range_m: Float, value: Float, points: Float, *_: Any, **__: Any) -> LevelCurve:
    """A robust mode for each class of incidence by itself (Ono et al., 3.3, with a mode that bears rust), no shape over θ.

    In place of `level_curve`, whose further arguments say nothing to it.
    """
    usable = angle <= np.radians(level.MAX_INCIDENCE)
    which = (angle[usable] / CLASS).astype(np.int64)
    held = [k for k in np.unique(which).tolist() if points[usable][which == k].sum() >= level.MIN_LEVEL_POINTS]
    if not held:
        return level.UNKNOWN
    modes = [robust_statistics(value[usable][which == k], level.SHORTH, two_sided=True) for k in held]
    middles = (np.array(held) + 0.5) * CLASS
    sigma = np.maximum([mode.sigma for mode in modes], level.MIN_SIGMA)
    return LevelCurve(middles, np.array([mode.mean for mode in modes]), sigma, np.array(held), 0.0, 0.0)


STEPS = (
    Step("as it is", ()),
    Step("materials not parted", [(find, "parts_of_plane", lambda *_: None)]),
    Step("gratings and fences kept", [(find, "solid_faces", lambda densities: np.ones(len(densities), bool))]),
    Step("faces not joined", [(find, "join", lambda extents, *_: np.arange(len(extents)))]),
    Step("sides of a beam not put together", [(profiles, "group", lambda surfaces, noise: np.arange(len(surfaces)))]),
    Step("a mode for each class of incidence", [(contrast, "level_curve", _by_histogram)]),
    Step("one level for all scans", [(find, "member_levels", _one_level)]),
    Step("a face takes its member's level as it is", [(find, "face_level", lambda curve, one, **_: curve)]),
    Step("level not found again without spots", [(find, "TURNS", 1)]),
    Step("rims judged", [(contrast, name, 0.0) for name in ("BEAM", "DIVERGENCE", "TOLERANCE")]),
    Step("regions along the rim kept", [(spots, "RIM", np.inf)]),
    Step("each pixel against 3σ", [(spots, "significance", _point_by_point)]),
    Step("windows against 3σ", [(significance, "limit", lambda pixels, window: SIGMAS)]),
    Step("windows as of white noise", [(significance.Scatter, "blended", _white)]),
    Step("no boundary at half of the contrast", [(spots, "refine_boundary", lambda marked, image, size: marked)]),
)


@dataclass
class Sums:
    """Sums of a step over the scenes."""

    points: judge.Points = field(default_factory=judge.Points)
    spots: list[judge.Spot] = field(default_factory=list)
    false: int = 0
    faces: judge.Faces = field(default_factory=judge.Faces)

    def row(self, area: float) -> dict[str, float]:
        """Figures, by name."""
        counted = [s.found >= judge.HALF for s in self.spots if s.counts]
        return {
            "point F1": self.points.counted.f1,
            "IoU": self.points.counted.iou,
            "found": sum(counted) / max(len(counted), 1),
            "false per 100 m²": 100.0 * self.false / area,
            "purity": self.faces.purity,
            "pieces": self.faces.mean_pieces,
        }


def main(seeds: Sequence[int], folder: Path) -> None:
    """Print and keep the figures of all steps."""
    sums = {step.name: Sums() for step in STEPS}
    area, points = 0.0, 0
    for seed in seeds:
        scene = make(parameters(seed, f"seed{seed}"), folder)
        area, points = area + judge.area_seen(scene), points + len(scene.xyz)
        grown = _grow(scene)
        for step in STEPS:
            with step.out():
                _add(sums[step.name], scene, grown.finish())
        progress(f"seed {seed}: {len(scene.xyz):,} points")
    figures = {name: one.row(area) for name, one in sums.items()}
    counted = sum(s.counts for s in sums[STEPS[0].name].spots)
    title = f"{len(seeds)} scenes, {points:,} points, {area:.0f} m² seen, {counted} anomalies that count"
    rows = [[name, *(f"{value:.3f}" for value in row.values())] for name, row in figures.items()]
    print_table(title, ("without a step", *figures[STEPS[0].name]), rows)
    print(f"\n{save('structures-ablation', {'seeds': list(seeds), 'points': points, 'area': area, 'steps': figures})}")


@dataclass(frozen=True)
class _Grown:
    """What `find_structures` is called with, and face and pixel of each point."""

    arguments: tuple[Any, ...]
    by_range: bool
    face: Any
    pixel: Any

    def finish(self) -> Found:
        """Members, faces and spots of the points."""
        found = find.find_structures(*self.arguments, by_range=self.by_range)
        numbers = (np.asarray(n).astype(np.int64) for n in found.of_points(self.face, self.pixel))
        return Found(*numbers, {}, 0.0, 0.0, {})


def _grow(scene: Scene) -> _Grown:
    """The detector up to faces and the sums of their pixels."""
    inputs = stage.Inputs(
        (scene.cloud,), "Amplitude", "amplitude", stage.stations_for(scene.cloud, [scene.stations_file]), None
    )
    with patch.object(stage, "find_structures") as last:
        found = stage.find_members(inputs, lambda *_: lambda done: None)
    face, pixel = zip(
        *(found.segmentation.finder.find(points.xyz, scan) for points, scan, _ in stage.read_all(inputs, lambda count: None)),
        strict=True,
    )
    return _Grown(last.call_args.args, last.call_args.kwargs["by_range"], np.concatenate(face), np.concatenate(pixel))


def _add(sums: Sums, scene: Scene, found: Found) -> None:
    called = found.anomaly > 0
    judge.points(scene, called, sums.points)
    sums.spots += judge.spots(scene, called)
    sums.false += len(judge.false_regions(scene, found.anomaly))
    judge.faces(scene, found, sums.faces)
