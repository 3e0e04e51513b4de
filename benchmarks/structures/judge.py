"""Figures of what was found against the truth; arrays in, numbers out."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

import numpy as np
from scipy import ndimage

from benchmarks.structures.detector import Found, cylinder, incidence
from benchmarks.structures.scenes import Scene
from tunneldb.arrays import Bool, Float, Int64

# What counts for the figure of record.
SMALLEST, FEWEST, STEEPEST = 0.01, 100, 75.0
LEAST_CONTRAST = 1.0  # dB, as seen: rust at a slant can be as bright as paint
HALF = 0.5
FRAGMENT = 100  # points of a fragment of a face
PIECE = 0.02  # share of a true face's points that makes a piece
BEAMS = ("I profile", "U profile", "L profile", "box")
JUDGED_FACE, JUDGED_SIDE = 300, 0.03  # points, m: lesser true faces are not asked for in one piece


@dataclass
class Counts:
    """Sums over scenes from which figures are made."""

    tp: float = 0.0
    fp: float = 0.0
    fn: float = 0.0

    def add(self, truth: Bool, called: Bool, weight: Float) -> None:
        self.tp += float(weight[truth & called].sum())
        self.fp += float(weight[~truth & called].sum())
        self.fn += float(weight[truth & ~called].sum())

    def join(self, other: Counts) -> None:
        """Add another's sums."""
        self.tp, self.fp, self.fn = self.tp + other.tp, self.fp + other.fp, self.fn + other.fn

    @property
    def f1(self) -> float:
        total = 2.0 * self.tp + self.fp + self.fn
        return 2.0 * self.tp / total if total else 1.0

    @property
    def iou(self) -> float:
        total = self.tp + self.fp + self.fn
        return self.tp / total if total else 1.0

    @property
    def errors(self) -> float:
        return self.fp + self.fn


@dataclass
class Points:
    """Point by point: all of them; and those of anomalies that count, where the others are left out on both sides."""

    all: Counts = field(default_factory=Counts)
    counted: Counts = field(default_factory=Counts)
    area: Counts = field(default_factory=Counts)


@dataclass
class Spot:
    """A true anomaly: what it is, and the share of its points that was found."""

    scene: str
    kind: str
    area: float
    points: int
    contrast: float
    incidence: float
    found: float
    width: float

    @property
    def counts(self) -> bool:
        return (
            self.area >= SMALLEST
            and self.points >= FEWEST
            and self.incidence <= STEEPEST
            and abs(self.contrast) >= LEAST_CONTRAST
        )


def spots(scene: Scene, called: Bool) -> list[Spot]:
    """True anomalies of which at least a point was seen."""
    out = []
    for a in scene.truth["anomalies"]:
        mine = scene.anomaly == a["id"]
        if mine.any():
            share = float(called[mine].mean())
            middle = float(np.median(scene.incidence[mine]))
            out.append(
                Spot(
                    scene.cloud.stem,
                    a["kind"],
                    a["area"],
                    int(mine.sum()),
                    a["contrast_seen"],
                    middle,
                    share,
                    a.get("width", 0.0),
                )
            )
    return out


def points(scene: Scene, called: Bool, into: Points) -> None:
    """Add a scene's points."""
    truth = scene.anomaly > 0
    counting = [a["id"] for a, s in zip(_seen(scene), spots(scene, called), strict=True) if s.counts]
    kept = ~truth | np.isin(scene.anomaly, counting)
    one, area = np.ones(len(truth)), scene.weights()
    into.all.add(truth, called, one)
    into.counted.add(truth[kept], called[kept], one[kept])
    into.area.add(truth[kept], called[kept], area[kept])


def _seen(scene: Scene) -> list[dict[str, Any]]:
    there = set(np.unique(scene.anomaly).tolist())
    return [a for a in scene.truth["anomalies"] if a["id"] in there]


def false_regions(scene: Scene, region: Int64) -> list[tuple[int, int, float]]:
    """Regions found of which less than half of the points lie on an anomaly: number, points, m² (of all scans)."""
    weight = scene.weights()
    out = []
    for number in np.unique(region[region > 0]).tolist():
        mine = region == number
        if float((scene.anomaly[mine] > 0).mean()) < HALF:
            out.append((number, int(mine.sum()), float(weight[mine].sum())))
    return out


def cells(scene: Scene, rows: Int64, size: float) -> Int64:
    """Number of the cell of the true surface of each of some points on faces (plane or cylinder), the same in other scans."""
    key = np.zeros((len(rows), 3), dtype=np.int64)
    key[:, 0] = scene.face[rows]
    for number in np.unique(key[:, 0]).tolist():
        mine = key[:, 0] == number
        key[mine, 1:] = np.floor(scene.unroll(number, scene.xyz[rows[mine]]) / size).astype(np.int64)
    return (key[:, 0] << 42) + ((key[:, 1] + (1 << 20)) << 21) + key[:, 2] + (1 << 20)


def on_surface(scene: Scene) -> Int64:
    """Points on true planes and cylinders."""
    flat = [f["id"] for f in scene.truth["faces"] if f["kind"] != "bend"]
    return np.flatnonzero(np.isin(scene.face, flat))


def area_seen(scene: Scene) -> float:
    """Surface seen, m², each place once: of cells of 10 cm the most that a scan saw of it."""
    rows = on_surface(scene)
    key = cells(scene, rows, 0.1)
    both, at = np.unique(np.column_stack([key, scene.scan[rows]]), axis=0, return_inverse=True)
    area = np.minimum(np.bincount(at.ravel(), scene.weights()[rows]), 0.01)
    _, place = np.unique(both[:, 0], return_inverse=True)
    most = np.zeros(place.max(initial=-1) + 1)
    np.maximum.at(most, place.ravel(), area)
    return float(most.sum())


def same_surface(one: Scene, called_one: Bool, other: Scene, called_other: Bool, size: float = 0.02) -> Counts:
    """Anomalies found on the surface that both saw at not more than 75°, cell by cell, half of the points deciding."""
    found = []
    for scene, called in ((one, called_one), (other, called_other)):
        rows = on_surface(scene)
        rows = rows[scene.incidence[rows] <= STEEPEST]
        key, at = np.unique(cells(scene, rows, size), return_inverse=True)
        many = np.bincount(at.ravel())
        found.append((key, np.bincount(at.ravel(), called[rows].astype(float)) >= HALF * many))
    _, first, second = np.intersect1d(found[0][0], found[1][0], return_indices=True)
    counts = Counts()
    counts.add(found[0][1][first], found[1][1][second], np.ones(len(first)))
    return counts


@dataclass
class Faces:
    """Faces: purity, pieces of true faces, joins, pipes, incidence."""

    pure: float = 0.0
    pure_on_faces: float = 0.0
    assigned: float = 0.0
    assigned_on_faces: float = 0.0
    on_faces: float = 0.0
    pieces: list[int] = field(default_factory=list)
    missed: int = 0
    left_out: int = 0
    joins: Counts = field(default_factory=Counts)
    right_joins: int = 0
    made_joins: int = 0
    wanted_joins: int = 0
    kept_joins: int = 0
    right_sides: int = 0
    made_sides: int = 0
    wanted_sides: int = 0
    pipes: list[tuple[float, float, float]] = field(default_factory=list)
    pipes_missed: int = 0
    incidence: list[Float] = field(default_factory=list)

    @property
    def purity(self) -> float:
        """Share of the points on a face that are of the true face with most of them."""
        return self.pure / self.assigned if self.assigned else float("nan")

    @property
    def purity_on_faces(self) -> float:
        """The same of points that are on a true face."""
        return self.pure_on_faces / self.assigned_on_faces if self.assigned_on_faces else float("nan")

    @property
    def share_on_faces(self) -> float:
        """Share of the points of true faces that are on a face."""
        return self.assigned_on_faces / self.on_faces if self.on_faces else float("nan")

    @property
    def mean_pieces(self) -> float:
        """Faces a true face is found in, on average."""
        return float(np.mean(self.pieces)) if self.pieces else float("nan")


def faces(scene: Scene, found: Found, into: Faces) -> None:
    """Add a scene's faces and members."""
    _purity(scene, found.face, into)
    _pieces(scene, found.member, into)
    _joins(scene, found.member, into)
    _sides(scene, found.member, into)
    if found.faces:
        _pipes(scene, found, into)
        error = np.abs(incidence(scene, found) - scene.incidence)
        into.incidence.append(error[np.isfinite(error) & (scene.face > 0)])


def _purity(scene: Scene, face: Int64, into: Faces) -> None:
    rows = np.flatnonzero(face > 0)
    pairs, many = np.unique(np.column_stack([face[rows], scene.face[rows]]), axis=0, return_counts=True)
    real = pairs[:, 1] > 0
    into.assigned += len(rows)
    into.assigned_on_faces += float(many[real].sum())
    into.on_faces += float((scene.face > 0).sum())
    for number in np.unique(pairs[real, 0]):
        most = float(many[real & (pairs[:, 0] == number)].max())
        into.pure += most
        into.pure_on_faces += most


def _asked(scene: Scene) -> Iterable[tuple[dict[str, Any], Int64]]:
    """True planes and cylinders that are asked for in one piece, and their points."""
    for truth in scene.truth["faces"]:
        rows = np.flatnonzero(scene.face == truth["id"])
        side = min(truth["size"]) if "size" in truth else 2.0 * truth.get("radius", 0.0)
        if truth["kind"] != "bend" and len(rows) >= JUDGED_FACE and side >= JUDGED_SIDE:
            yield truth, rows


def _pieces(scene: Scene, member: Int64, into: Faces) -> None:
    asked = 0
    for _, rows in _asked(scene):
        asked += 1
        here = member[rows]
        numbers, many = np.unique(here[here > 0], return_counts=True)
        count = int((many >= max(PIECE * len(rows), 30)).sum()) if len(numbers) else 0
        if count:
            into.pieces.append(count)
        else:
            into.missed += 1
    into.left_out += sum(1 for f in scene.truth["faces"] if f["points"] > 0) - asked


def fragments(scene: Scene) -> list[tuple[int, int, Int64]]:
    """Parts of true faces that gaps of more than about three points part: face, member, points."""
    out = []
    weight = scene.weights()
    for truth, rows in _asked(scene):
        spacing = float(np.sqrt(np.median(weight[rows])))
        uv = scene.unroll(truth["id"], scene.xyz[rows])
        # At a slant points lie further apart along the rays.
        size = max(2.5 * spacing, 0.02)
        cell = np.floor((uv - uv.min(axis=0)) / size).astype(np.int64)
        grid = np.zeros(cell.max(axis=0) + 1, dtype=bool)
        grid[cell[:, 0], cell[:, 1]] = True
        label, count = ndimage.label(grid, np.ones((3, 3)))
        of = label[cell[:, 0], cell[:, 1]]
        for number in range(1, count + 1):
            mine = rows[of == number]
            if len(mine) >= FRAGMENT:
                out.append((truth["id"], truth["member"], mine))
    return out


def _joins(scene: Scene, member: Int64, into: Faces) -> None:
    """Joins of fragments with the largest of their true face (recall) and of the member found (precision)."""
    parts = []
    for face, true_member, rows in fragments(scene):
        numbers, many = np.unique(member[rows], return_counts=True)
        top = int(np.argmax(many))
        called = int(numbers[top]) if many[top] > HALF * len(rows) else 0
        parts.append((face, true_member, called, len(rows)))
    parts.sort(key=lambda part: -part[3])
    first_of_face: dict[int, int] = {}
    first_of_member: dict[int, int] = {}
    for face, true_member, called, _ in parts:
        if not called:
            continue
        if face in first_of_face:
            into.wanted_joins += 1
            into.kept_joins += first_of_face[face] == called
        first_of_face.setdefault(face, called)
        if called in first_of_member:
            into.made_joins += 1
            into.right_joins += first_of_member[called] == true_member
        first_of_member.setdefault(called, true_member)


def _sides(scene: Scene, member: Int64, into: Faces) -> None:
    """Pairs of true flat faces found: how many are of one beam (wanted), in one member (made), and both (right)."""
    parts = []
    for truth, rows in _asked(scene):
        numbers, many = np.unique(member[rows], return_counts=True)
        top = int(np.argmax(many))
        if truth["kind"] == "plane" and numbers[top] and many[top] > HALF * len(rows):
            parts.append((truth["member"], int(numbers[top])))
    beams = {m["id"] for m in scene.truth["members"] if m["kind"] in BEAMS}
    for (true_one, one), (true_other, other) in combinations(parts, 2):
        same = true_one == true_other and true_one in beams
        into.wanted_sides += same
        into.made_sides += one == other
        into.right_sides += same and one == other


def _pipes(scene: Scene, found: Found, into: Faces) -> None:
    """Errors of radius (m, and as a share) and axis (degrees) of pipes seen over at least 90°."""
    for truth, rows in _asked(scene):
        if truth["kind"] != "cylinder" or truth["length"] < 2.0 * truth["radius"]:
            continue
        turn = np.sort(scene.unroll(truth["id"], scene.xyz[rows])[:, 1] / truth["radius"])
        gap = np.diff(np.concatenate([turn, turn[:1] + 2.0 * np.pi])).max()
        if np.degrees(2.0 * np.pi - gap) < 90.0:
            continue
        numbers, many = np.unique(found.face[rows][found.face[rows] > 0], return_counts=True)
        face = found.faces[int(numbers[np.argmax(many)])] if len(numbers) else None
        if face is None or not face["radius"] > 0.0:
            into.pipes_missed += 1
            continue
        _, axis, _ = cylinder(face["vertices"], face["radius"])
        slant = np.degrees(np.arccos(min(1.0, abs(float(axis @ np.array(truth["axes"])[2])))))
        into.pipes.append((truth["radius"], face["radius"] - truth["radius"], float(slant)))
