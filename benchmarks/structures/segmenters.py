"""Faces of ``tunneldb members`` beside those of other programs on the same points: PCL, Open3D and CGAL.

Each is given the whole cloud. Region growing of PCL is as in ``literal``. Of Open3D planar patches (Araújo and Oliveira, 2020;
``pip install open3d``, no dependency of the project) with its own defaults; a point is on the patch that it lies nearest to, of
those whose box holds it, 6 mm thick each way. Of CGAL efficient RANSAC for planes and cylinders (``libcgal-dev``; under the
GPL, so for the benchmark only), with the same 6 mm, three standard deviations of the usual noise. Time is that of the
segmentation with its normals; that of tunneldb is all of its run, with reading, spots and writing.
"""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.common import print_table, progress, save
from benchmarks.structures import compiled, judge, literal
from benchmarks.structures.detector import Found, attempt
from benchmarks.structures.scenes import Scene, make, parameters
from tunneldb.arrays import Float, Int64

NEIGHBOURS = 30
NEAR = 0.006  # m
CLUSTER = 0.05  # m: as the paper's gap
COSINE, LEAST = 0.9, 100

Labels = tuple[Int64, float]


@dataclass
class Sums:
    """Sums of one program over the scenes."""

    faces: judge.Faces = field(default_factory=judge.Faces)
    seconds: float = 0.0

    def row(self, points: int) -> dict[str, float]:
        """Figures, by name."""
        f = self.faces
        return {
            "purity": f.purity,
            "of points on true faces": f.purity_on_faces,
            "points of true faces held": f.share_on_faces,
            "pieces per true face": f.mean_pieces,
            "true faces missed": f.missed / max(f.missed + len(f.pieces), 1),
            "points a second": points / self.seconds if self.seconds else float("nan"),
        }


@cache
def ransac() -> Path | None:
    """The compiled efficient RANSAC; None where there is no CGAL."""
    if not Path("/usr/include/CGAL").exists():
        return None
    return compiled.build("efficient_ransac", ["-DNDEBUG"], ["-lgmp", "-lmpfr"])


def by_pcl(xyz: Float, folder: Path) -> Labels:
    """Clusters of PCL's region growing."""
    label, _, seconds = literal.grow(xyz, folder)
    return label, seconds


def by_cgal(xyz: Float, folder: Path) -> Labels:
    """Planes and cylinders of CGAL's efficient RANSAC."""
    found = ransac()
    assert found is not None
    label, seconds = compiled.run(found, xyz, [NEIGHBOURS, NEAR, CLUSTER, COSINE, LEAST], np.int32, folder)
    return label.astype(np.int64), seconds


def by_open3d(xyz: Float, folder: Path) -> Labels:
    """Planar patches of Open3D."""
    import open3d

    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(xyz))
    search = open3d.geometry.KDTreeSearchParamKNN(NEIGHBOURS)
    start = time.perf_counter()
    cloud.estimate_normals(search)
    patches = cloud.detect_planar_patches(search_param=search)
    seconds = time.perf_counter() - start
    boxes = [(np.asarray(p.center), np.asarray(p.R), np.asarray(p.extent)) for p in patches]
    return nearest_box(xyz, boxes), seconds


def nearest_box(xyz: Float, boxes: Sequence[tuple[Float, Float, Float]]) -> Int64:
    """Number, from 1, of the box (centre, axes in columns, whole sizes) whose plane each point (n, 3) of it is nearest to."""
    label, least = np.zeros(len(xyz), dtype=np.int64), np.full(len(xyz), np.inf)
    for number, (centre, axes, size) in enumerate(boxes, start=1):
        half = np.maximum(0.5 * size, NEAR)
        thin = int(np.argmin(size))
        reach = np.linalg.norm(half)
        near = np.flatnonzero((np.abs(xyz - centre) <= reach).all(axis=1))
        local = np.abs((xyz[near] - centre) @ axes)
        inside = (local <= half).all(axis=1) & (local[:, thin] < least[near])
        label[near[inside]], least[near[inside]] = number, local[inside, thin]
    return label


def others() -> dict[str, Callable[[Float, Path], Labels]]:
    """Programs that are there; what is not is said."""
    out: dict[str, Callable[[Float, Path], Labels]] = {}
    there = {
        "PCL region growing": (literal.program() is not None, by_pcl, "apt-get install libpcl-dev"),
        "Open3D planar patches": (importlib.util.find_spec("open3d") is not None, by_open3d, "pip install open3d"),
        "CGAL efficient RANSAC": (ransac() is not None, by_cgal, "apt-get install libcgal-dev"),
    }
    for name, (is_there, run, how) in there.items():
        if is_there:
            out[name] = run
        else:
            progress(f"without {name}: {how}")
    return out


def main(seeds: Sequence[int], folder: Path) -> None:
    """Print and keep the figures of all programs."""
    peers = others()
    sums = {name: Sums() for name in ("tunneldb, members", "tunneldb, faces", *peers)}
    points = 0
    for seed in seeds:
        scene = make(parameters(seed, f"seed{seed}"), folder)
        points += len(scene.xyz)
        found, _ = attempt(scene, folder, models=False)
        for name, group in (("tunneldb, members", found.member), ("tunneldb, faces", found.face)):
            _add(sums[name], scene, found.face, group, found.seconds)
        xyz = scene.xyz - scene.xyz.mean(axis=0)
        for name, run in peers.items():
            label, seconds = run(xyz, folder)
            _add(sums[name], scene, label, label, seconds)
        progress(f"seed {seed}: {len(scene.xyz):,} points; {', '.join(f'{n} {s.seconds:.0f} s' for n, s in sums.items())}")
    figures = {name: one.row(points) for name, one in sums.items()}
    names = list(figures)
    rows = [[what, *(figures[name][what] for name in names)] for what in figures[names[0]]]
    print_table(f"faces: {len(seeds)} scenes, {points:,} points", ("", *names), rows)
    print(f"\n{save('structures-segmenters', {'seeds': list(seeds), 'points': points, **figures})}")


def _add(sums: Sums, scene: Scene, face: Int64, group: Int64, seconds: float) -> None:
    judge.faces(scene, Found(face, group, group, {}, 0.0, 0.0, {}), sums.faces)
    sums.seconds += seconds
