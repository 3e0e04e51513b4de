"""Classes of a single scan file without a survey: its ground, its lining, and objects in front of the lining."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tunneldb.arrays import Float, Int64
from tunneldb.classification.classes import PointClass
from tunneldb.classification.classify import find_bare_scene
from tunneldb.classification.ground.extraction import GroundSettings, find_ground
from tunneldb.classification.objects.objects import ClusterSettings
from tunneldb.classification.scene import Scene
from tunneldb.errors import UserError
from tunneldb.export.pointcloud.survey import CLASS_NAMES, same_file
from tunneldb.files import replacing
from tunneldb.geometry.centreline import centreline_through
from tunneldb.pointcloud.reader import read_header
from tunneldb.pointcloud.rewrite import read_coordinates, rewrite
from tunneldb.pointcloud.voxels import Voxels
from tunneldb.progress import StartProgress


@dataclass(frozen=True)
class Classified:
    """Classification of a file's points.

    Attributes
    ----------
    counts : (256,) int64 array
        Points by class.
    ground, lining : bool
        True if there is any.
    """

    counts: Int64
    ground: bool
    lining: bool


def classify_file(source: Path, target: Path, values: Mapping[str, float], begin: StartProgress) -> Classified:
    """Write a scan file again with the classes that are found from its points alone.

    It is read twice: into voxels, from which the models are made, and once more to be written. Memory grows with the
    surface that was scanned, not with the points.

    Parameters
    ----------
    source : Path
        Scan file.
    target : Path
        ``.laz`` file to write; it appears when it is complete.
    values : mapping of str to float
        Parameters ``ground.…`` and ``cluster.…``.
    begin : callable
        Called with a text and the number of points before each pass; returns a function that takes the points done.

    Raises
    ------
    UserError
        If the source cannot be read, has neither ground nor lining, or is the target; if the target is no ``.laz``, or cannot
        be written.
    """
    if target.suffix.lower() != ".laz":
        raise UserError(f"{target}: the output is LAZ; use the extension .laz")
    if same_file(source, target):
        raise UserError(f"{target} is the input file; choose another name with -o")
    if not target.parent.is_dir():
        raise UserError(f"{target.parent}: no such folder")
    count = read_header(source).points
    scene, origin = find_scene_of(source, values, begin("points", count))
    lining = any(cluster.klass == PointClass.LINING for cluster in scene.clusters) or scene.relief is not None
    if scene.ground is None and not lining:
        raise UserError(f"{source}: neither ground nor lining was found in its {count} points; pass a tunnel in metres")
    with replacing(target) as temporary:
        counts = rewrite(source, temporary, lambda xyz: scene.classes(xyz - origin), CLASS_NAMES, begin("classes", count))
    return Classified(counts, scene.ground is not None, lining)


def find_scene_of(source: Path, values: Mapping[str, float], progress: Callable[[int], None]) -> tuple[Scene, Float]:
    """Make the models of a file in one pass over its points.

    Returns
    -------
    scene : Scene
    origin : (3,) float64 array
        Whole kilometres near the points, m. The scene is for coordinates less these: cells are numbered from there, however
        far away the file's own origin is.

    Raises
    ------
    UserError
        If the file cannot be read, or its points are too far apart.
    """
    settings = GroundSettings.of(values)
    voxels = Voxels(settings.voxel)
    origin = np.zeros(3)
    for xyz in read_coordinates(source):
        if not len(voxels):
            origin = np.round(xyz[0], -3)
        try:
            voxels.add(xyz - origin)
        except ValueError as error:
            raise UserError(f"{source}: {error}") from error
        progress(len(xyz))
    thinned, spread = voxels.centroids(), voxels.spread()
    del voxels  # room for the models
    try:
        line = centreline_through(thinned)
    except ValueError as error:
        raise UserError(f"{source}: {error}; check the scale in its header") from error
    ground = find_ground(thinned, line, settings, spread=spread)
    return find_bare_scene(thinned, line, ground, ClusterSettings.of(values)), origin
