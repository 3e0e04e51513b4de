"""Take a scene through the program, and read what it found beside what is true."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import psycopg
import shapely
from shapely.geometry.base import BaseGeometry

from benchmarks.blind.scene import Scene
from benchmarks.blind.waterproof import classes, read_coverage
from benchmarks.common import tunneldb
from tunneldb.anomalies.coverage import Coverage
from tunneldb.evaluate.survey import read_findings
from tunneldb.store.survey import Survey, get_survey

SRID = 25832


@dataclass
class Outcome:
    """What was seen of a scene; shapes in the unrolled plane, m.

    Attributes
    ----------
    scene, lining, phenomenon : str
        Of the scene.
    true : list
        True leaks.
    drops : list of float
        How much darker than dry lining each is, dB.
    phenomena : list of str
        What each is.
    limits : list of str
        Why it can't be told from the intensity; empty where it can.
    found : list
        What detection found, of any kind.
    kinds : list of str
        What it takes each for.
    probabilities : list of float
        That it is a leak, 0 to 1.
    reasons : list of list of str
    seen : float
        Lining that was seen, m².
    seconds : float
        What ``run`` took.
    other : list
        What is dark but dry, or bright.
    other_kinds : list of str
        What each is.
    true_classes, told_classes, found_classes : sequences of int or None
        Classes of waterproofing, of the scene and then of each stretch of it, by all true leaks, by those that can be told, and
        by what was taken for leaks; see :func:`benchmarks.blind.waterproof.classes`. Empty where the scene was refused.
    """

    scene: str
    lining: str
    phenomenon: str
    true: list[BaseGeometry]
    drops: list[float]
    phenomena: list[str]
    limits: list[str]
    found: list[BaseGeometry]
    kinds: list[str]
    probabilities: list[float]
    reasons: list[list[str]]
    seen: float
    seconds: float
    other: list[BaseGeometry] = field(default_factory=list)
    other_kinds: list[str] = field(default_factory=list)
    true_classes: Sequence[int | None] = ()
    told_classes: Sequence[int | None] = ()
    found_classes: Sequence[int | None] = ()

    @property
    def leaks(self) -> list[int]:
        """Numbers of what was taken for leaks."""
        return [k for k, kind in enumerate(self.kinds) if kind == "leak"]

    def classed(self, conn: psycopg.Connection[Any], coverage: Mapping[int, Coverage]) -> Outcome:
        """Work out the classes of waterproofing on the lining seen."""
        told = [shape for shape, limit in zip(self.true, self.limits, strict=True) if not limit]
        found = [self.found[k] for k in self.leaks]
        true_classes, told_classes, found_classes = (classes(conn, coverage, leaks) for leaks in (self.true, told, found))
        return replace(self, true_classes=true_classes, told_classes=told_classes, found_classes=found_classes)

    def to_json(self) -> dict[str, Any]:
        out = asdict(self)
        for name in ("true", "found", "other"):
            out[name] = [shapely.to_wkt(shape, rounding_precision=4) for shape in getattr(self, name)]
        return out

    @classmethod
    def from_json(cls, values: dict[str, Any]) -> Outcome:
        shapes = {name: [shapely.from_wkt(text) for text in values[name]] for name in ("true", "found", "other")}
        return cls(**{**values, **shapes})


def make(scene: Scene, folder: Path) -> None:
    """Write the files of a scene, unless they are there."""
    if not (folder / "truth.geojson").is_file():
        folder.mkdir(parents=True, exist_ok=True)
        scene.make(folder)


def run(scene: Scene, folder: Path, dsn: str) -> float:
    """Add, load and run a scene by the command line; return the seconds of ``run``."""
    name = scene.name
    poses = ("--stations", "stations.csv") if (folder / "stations.csv").is_file() else ("--trajectory", "trajectory.csv")
    reference = folder / "reference.csv"
    tunneldb("tunnel", "add", name, "--srid", SRID, "--axis", folder / "axis.csv", dsn=dsn)
    tunneldb(
        "survey", "add", name, "--tunnel", name, "--date", "2024-05-04", poses[0], folder / poses[1],
        "--reference", reference if reference.is_file() else "auto",
        "--intensity", "Amplitude", "--intensity-kind", "amplitude", dsn=dsn,
    )  # fmt: skip
    tunneldb("load", name, folder / "scan.laz", dsn=dsn)
    return tunneldb("run", name, dsn=dsn)


def outcome(conn: psycopg.Connection[Any], scene: Scene, folder: Path, seconds: float) -> Outcome:
    """Read what was found, and carry the truth over to the unrolled plane; where the scene was refused nothing was found."""
    survey = get_survey(conn, scene.name)
    true, properties = layer(conn, survey, folder / "truth.geojson")
    other, marks = layer(conn, survey, folder / "other.geojson")
    rows = conn.execute(
        "SELECT public.ST_AsBinary(unrolled), coalesce(kind_override, kind), coalesce(confidence, 0.0), reasons"
        " FROM tunnel.finding WHERE survey_id = %s AND detected ORDER BY id",
        (survey.id,),
    ).fetchall()
    kinds = [str(row[1]) for row in rows]
    seen = read_findings(conn, survey).seen if np.isfinite(seconds) else 0.0
    made = Outcome(
        scene.name, scene.lining, scene.phenomenon, true,
        [float(p.get("drop_db", "nan")) for p in properties],
        [str(p.get("phenomenon", "")) for p in properties],
        [str(p.get("limit") or "") for p in properties],
        [shapely.from_wkb(bytes(row[0])) for row in rows], kinds,
        [float(row[2]) if kind == "leak" else 1.0 - float(row[2]) for row, kind in zip(rows, kinds, strict=True)],
        [list(row[3]) for row in rows], seen, seconds, other, [str(p.get("kind", "")) for p in marks],
    )  # fmt: skip
    return made.classed(conn, read_coverage(conn, survey.id))


LEAST_HOLE = 0.05
"""Length around the smallest hole of an outline that counts, m; authors' outlines have holes without an area."""


def layer(conn: psycopg.Connection[Any], survey: Survey, path: Path) -> tuple[list[BaseGeometry], list[dict[str, Any]]]:
    """Polygons of a file, in the unrolled plane, and their properties; none where there is no file.

    Outlines that cross themselves are mended: what is drawn on a curved lining may.
    """
    features = json.loads(path.read_text())["features"] if path.is_file() else []
    shapes = []
    for feature in features:
        parts = []
        for whole in shapely.get_parts(shapely.from_geojson(json.dumps(feature["geometry"]))):
            part = shapely.Polygon(whole.exterior, [hole for hole in whole.interiors if hole.length > LEAST_HOLE])
            (flat,) = conn.execute(
                "SELECT public.ST_AsBinary(tunnel_api.unroll_shape(%s, public.ST_GeomFromWKB(%s, %s)))",
                (survey.id, shapely.to_wkb(part), survey.srid),
            ).fetchone() or (None,)
            if flat is not None:
                parts.append(shapely.make_valid(shapely.from_wkb(bytes(flat))))
        shapes.append(_areas(shapely.union_all(parts)))
    return shapes, [feature["properties"] for feature in features]


def _areas(shape: BaseGeometry) -> BaseGeometry:
    """What of a shape has an area."""
    parts = shapely.get_parts(shapely.get_parts(shape))
    return shapely.union_all([part for part in parts if isinstance(part, shapely.Polygon)])
