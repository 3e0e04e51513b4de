"""What ``tunneldb members`` finds on simulated structures, against what was put in; the literal method of Ono et al. beside it.

    python -m benchmarks.structures                       # own seeds
    python -m benchmarks.structures --judge --peer        # the figure of record: seeds nobody tuned on (scenes.py)
    python -m benchmarks.structures --seeds 3 5 --list    # some seeds; what was missed and what is false, one a line
    python -m benchmarks.structures --pairs               # the same surface from two viewpoints, by day and by night
    python -m benchmarks.structures --limits              # detection limits by size, contrast and incidence
    python -m benchmarks.structures --ablation            # the detector without one of its steps at a time
    python -m benchmarks.structures --segmenters          # faces beside those of PCL, Open3D and CGAL
    python -m benchmarks.structures --points 100000000    # time and memory of one scene of so many points

--peer needs apt's libpcl-dev and g++. --folder keeps the scenes, and takes those that it has. Figures of record count true
anomalies of 0.01 m², 100 points, 1 dB and more as seen, at up to 75° of incidence; how many were left out stands beside.
A row "all" counts every point of every anomaly. Points of mixed pixels, wires and cables count as clean.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common import print_table, progress, save
from benchmarks.structures import ablation, judge, limits, segmenters
from benchmarks.structures.detector import Found, attempt
from benchmarks.structures.literal import Literal, literal, program
from benchmarks.structures.scenes import JUDGE, OWN, Scene, make, one_scan, parameters

PAIR_SEEDS = {False: tuple(range(31, 37)), True: tuple(range(2031, 2037))}
LIMIT_SEEDS = {False: tuple(range(51, 55)), True: tuple(range(2051, 2055))}
FEW_SEEDS = (2, 3, 5)
AREAS = (0.0, 0.003, 0.01, 0.03, 0.1, np.inf)
CONTRASTS = (0.0, 1.0, 2.0, 4.0, np.inf)


@dataclass
class Method:
    """Sums of one method over all scenes."""

    name: str
    points: judge.Points = field(default_factory=judge.Points)
    spots: list[judge.Spot] = field(default_factory=list)
    false: int = 0
    false_clean: int = 0
    seconds: float = 0.0
    faces: judge.Faces = field(default_factory=judge.Faces)
    memory: float = 0.0

    def rows(self) -> list[tuple[str, float]]:
        p = self.points
        counted = [s for s in self.spots if s.counts]
        found = [s for s in counted if s.found >= judge.HALF]
        return [
            ("point F1", p.counted.f1),
            ("point IoU", p.counted.iou),
            ("wrong points", p.counted.errors),
            ("point F1, all", p.all.f1),
            ("point IoU, all", p.all.iou),
            ("wrong points, all", p.all.errors),
            ("area F1", p.area.f1),
            ("anomalies that count", len(counted)),
            ("left out", len(self.spots) - len(counted)),
            ("found", len(found) / max(len(counted), 1)),
            ("seconds", self.seconds),
        ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--judge", action="store_true", help="seeds for the figure of record")
    parser.add_argument("--seeds", type=int, nargs="+", help="these seeds")
    parser.add_argument("--peer", action="store_true", help="the literal method on the same points, too")
    parser.add_argument("--pairs", action="store_true", help="two viewpoints, day and night")
    parser.add_argument("--limits", action="store_true", help="detection limits")
    parser.add_argument("--ablation", action="store_true", help="what each step is good for")
    parser.add_argument("--segmenters", action="store_true", help="faces beside those of PCL, Open3D and CGAL")
    parser.add_argument("--points", type=int, help="time and memory of a scene of about so many points")
    parser.add_argument("--reference", action="store_true", help="give the detector the reference curve")
    parser.add_argument("--list", action="store_true", help="list what was missed, and what is false")
    parser.add_argument("--folder", type=Path, help="where scenes are made, or are; default: a temporary one")
    a = parser.parse_args()
    if a.judge and a.list:
        raise SystemExit("--list: not with --judge, whose scenes nobody is to look at one by one")
    if a.peer and program() is None:
        raise SystemExit("--peer: no /usr/include/pcl-*; apt-get install libpcl-dev")
    with nullcontext(a.folder) if a.folder else tempfile.TemporaryDirectory() as folder:
        Path(folder).mkdir(parents=True, exist_ok=True)
        if a.points:
            large(a.points, Path(folder))
        elif a.pairs:
            pairs(PAIR_SEEDS[a.judge], Path(folder))
        elif a.limits:
            limits.main(LIMIT_SEEDS[a.judge], Path(folder), a.reference)
        elif a.ablation:
            ablation.main(a.seeds or FEW_SEEDS, Path(folder))
        elif a.segmenters:
            segmenters.main(a.seeds or FEW_SEEDS, Path(folder))
        else:
            seeds = a.seeds or (JUDGE if a.judge else OWN)
            compare(seeds, Path(folder), a.peer, a.reference, a.list)


def compare(seeds: Sequence[int], folder: Path, peer: bool, reference: bool, listed: bool) -> None:
    """All figures over the scenes of some seeds."""
    ours, fit, moments = Method("tunneldb"), Method("literal, fit"), Method("literal, moments")
    methods = [ours, fit, moments] if peer else [ours]
    area = clean_area = 0.0
    points = clean = 0
    crashed = 0
    pcl = 0.0
    missed: list[list[object]] = []
    for seed in seeds:
        scene = make(parameters(seed, f"seed{seed}"), folder)
        found, ran = attempt(scene, folder, reference=reference)
        crashed += not ran
        seen = judge.area_seen(scene)
        is_clean = not scene.truth["anomalies"]
        area, points = area + seen, points + len(scene.xyz)
        clean, clean_area = clean + is_clean, clean_area + seen * is_clean
        take(ours, scene, found.anomaly > 0, found.seconds)
        ours.memory = max(ours.memory, found.memory)
        judge.faces(scene, found, ours.faces)
        false = judge.false_regions(scene, found.anomaly)
        ours.false += len(false)
        ours.false_clean += len(false) * is_clean
        missed += _listed(scene, found, false)
        text = f"seed {seed}: {len(scene.xyz):,} points, {found.seconds:.1f} s, {_line(scene, found.anomaly > 0)}"
        if peer:
            other = literal(scene, folder)
            pcl += other.seconds_pcl
            take(fit, scene, other.fit, other.seconds)
            take(moments, scene, other.moments, other.seconds)
            _faces_of(scene, other, fit)
            text += f"; literal {other.seconds:.1f} s, {_line(scene, other.fit)}"
        progress(text)
    table = [[name, *(dict(m.rows())[name] for m in methods)] for name, _ in ours.rows()]
    print_table(f"{len(seeds)} scenes, {points:,} points, {area:.0f} m² seen", ("", *(m.name for m in methods)), table)
    figures = face_rows(ours)
    figures += [
        ("false regions", ours.false),
        ("false regions per 100 m²", 100.0 * ours.false / area),
        (f"false regions in {clean} clean scenes of {clean_area:.0f} m²", ours.false_clean),
        ("scenes on which it crashed", crashed),
        ("points a second", points / ours.seconds),
        ("peak memory, MB", ours.memory / 1e6),
    ]
    if peer:
        figures += [("times as fast as PCL's part alone", pcl / ours.seconds), ("as literal", fit.seconds / ours.seconds)]
    print_table("tunneldb members", ("", ""), figures)
    if peer:
        print_table("literal", ("", ""), [row for row in face_rows(fit) if np.isfinite(row[1])])
    print_table("found by size (down, m²) and contrast (across, dB)", *_found_table(ours.spots))
    if listed:
        print_table("missed and false", ("", "scene", "kind", "m²", "points", "dB", "degrees", "of it"), missed)
    result = {m.name: dict(m.rows()) for m in methods} | {"figures": {k: v for k, v in figures if np.isfinite(v)}}
    print(f"\n{save('structures', {'seeds': list(seeds), 'points': points, 'area': area, **result})}")


def take(method: Method, scene: Scene, called: Any, seconds: float) -> None:
    judge.points(scene, called, method.points)
    method.spots += judge.spots(scene, called)
    method.seconds += seconds


def _line(scene: Scene, called: Any) -> str:
    one = judge.Points()
    judge.points(scene, called, one)
    return f"F1 {one.counted.f1:.3f} (all {one.all.f1:.3f})"


def _listed(scene: Scene, found: Found, false: list[tuple[int, int, float]]) -> list[list[object]]:
    name = scene.cloud.stem
    out: list[list[object]] = [
        ["missed", name, s.kind, s.area, s.points, s.contrast, s.incidence, s.found]
        for s in judge.spots(scene, found.anomaly > 0)
        if s.counts and s.found < judge.HALF
    ]
    for number, many, area in false:
        mine = found.anomaly == number
        faces, count = np.unique(scene.face[mine], return_counts=True)
        top = int(faces[count.argmax()])
        kind = "mixed or wire" if not top else f"{scene.truth['faces'][top - 1]['material']} face {top}"
        share = float((scene.anomaly[mine] > 0).mean())
        out.append([f"false {number}", name, kind, area, many, 0.0, float(np.median(scene.incidence[mine])), share])
    return out


def _faces_of(scene: Scene, other: Literal, method: Method) -> None:
    """Purity, pieces and joins of the literal method; groups of a station are told apart from another's, so only of one."""
    if len(scene.stations) == 1:
        judge.faces(scene, Found(other.cluster, other.group, other.group, {}, 0.0, 0.0, {}), method.faces)


def face_rows(method: Method) -> list[tuple[str, float]]:
    f = method.faces
    nan = float("nan")
    error = np.concatenate(f.incidence) if f.incidence else np.array([nan])
    pipes = np.array(f.pipes).reshape(-1, 3)
    good = np.abs(pipes[:, 1]) <= np.maximum(0.001, 0.01 * pipes[:, 0])
    many = len(pipes) + f.pipes_missed
    return [
        ("purity", f.purity),
        ("purity of points on true faces", f.purity_on_faces),
        ("share of true faces' points on a face", f.share_on_faces),
        ("pieces per true face", f.mean_pieces),
        ("true faces found", len(f.pieces)),
        ("true faces missed", f.missed),
        ("true faces too small to be asked for", f.left_out),
        ("joins' precision", f.right_joins / f.made_joins if f.made_joins else nan),
        ("joins made", f.made_joins),
        ("joins' recall", f.kept_joins / f.wanted_joins if f.wanted_joins else nan),
        ("joins wanted", f.wanted_joins),
        ("pairs of sides in one member: of one beam", f.right_sides / f.made_sides if f.made_sides else nan),
        ("pairs of sides of one beam: in one member", f.right_sides / f.wanted_sides if f.wanted_sides else nan),
        ("pairs of sides of one beam", f.wanted_sides),
        ("pipes seen over 90°", many),
        ("called no pipe", f.pipes_missed),
        ("radius within 1 mm or 1 %", float(good.sum()) / many if many else nan),
        ("radius error, median, mm", 1000.0 * float(np.median(np.abs(pipes[:, 1]))) if len(pipes) else nan),
        ("axis within 0.2°", float((pipes[:, 2] <= 0.2).sum()) / many if many else nan),
        ("axis error, median, degrees", float(np.median(pipes[:, 2])) if len(pipes) else nan),
        ("incidence error, median, degrees", float(np.median(error))),
        ("incidence error, p95, degrees", float(np.percentile(error, 95))),
    ]


def _found_table(spots: list[judge.Spot]) -> tuple[list[str], list[list[object]]]:
    """Found of how many, by size and contrast."""
    header = ["", *(_bin(CONTRASTS, k) for k in range(len(CONTRASTS) - 1))]
    rows: list[list[object]] = []
    for i in range(len(AREAS) - 1):
        row: list[object] = [_bin(AREAS, i)]
        for k in range(len(CONTRASTS) - 1):
            mine = [
                s.found >= judge.HALF
                for s in spots
                if AREAS[i] <= s.area < AREAS[i + 1] and CONTRASTS[k] <= abs(s.contrast) < CONTRASTS[k + 1]
            ]
            row.append(f"{sum(mine)} of {len(mine)}" if mine else "")
        rows.append(row)
    return header, rows


def _bin(edges: Sequence[float], k: int) -> str:
    return f"≥ {edges[k]:g}" if np.isinf(edges[k + 1]) else f"{edges[k]:g}–{edges[k + 1]:g}"


def pairs(seeds: Sequence[int], folder: Path) -> None:
    """The same surface from two viewpoints, each scan by itself; and by day and by night."""
    names = ("two viewpoints", "day and night")
    found, bound = [judge.Counts() for _ in names], [judge.Counts() for _ in names]
    rows: list[list[object]] = []
    for seed in seeds:
        base = parameters(seed, f"pair{seed}", stations=2, anomalies=15, night=False)
        day = make(base, folder)
        night = make(replace(base, name=f"pair{seed}-night", night=True), folder)
        single = [one_scan(day, number, folder) for number in (1, 2)]
        called = [attempt(scene, folder, models=False)[0].anomaly > 0 for scene in (*single, day, night)]
        row: list[object] = [str(seed), len(day.xyz) + len(night.xyz)]
        for k, (one, other) in enumerate((single, (day, night))):
            part = judge.same_surface(one, called[2 * k], other, called[2 * k + 1])
            found[k].join(part)
            bound[k].join(judge.same_surface(one, one.anomaly > 0, other, other.anomaly > 0))
            row.append(part.iou)
        rows.append(row)
        progress(f"seed {seed}: viewpoints {row[2]:.3f}, day and night {row[3]:.3f}")
    rows.append(["all", "", *(counts.iou for counts in found)])
    rows.append(["truth in place of what was found", "", *(counts.iou for counts in bound)])
    print_table("IoU on the same surface, in cells of 2 cm that both saw at up to 75°", ("seed", "points", *names), rows)
    figures = {name: {"found": f.iou, "truth": b.iou} for name, f, b in zip(names, found, bound, strict=True)}
    print(f"\n{save('structures-pairs', {'seeds': list(seeds), 'rows': rows, **figures})}")


def large(points: int, folder: Path) -> None:
    """Time and memory of a large scene; its points stay on disk, so that this needs no more memory than the detector."""
    from benchmarks.structures.detector import run
    from tunneldb.simulate.structure import StructureScan, write_structure

    base = parameters(1, f"large{points}", stations=4, distance=8.0, width=9.0, anomalies=15, angular_step=0.1)
    few = write_structure(StructureScan(base), folder).points
    files = write_structure(StructureScan(replace(base, angular_step=0.1 * (few / points) ** 0.5)), folder)
    output = folder / "large.found.laz"
    intensity = ["--intensity", "Amplitude", "--intensity-kind", "amplitude"]
    seconds, memory, _ = run(["members", files.cloud, "--stations", files.stations, *intensity, "-o", output, "--json"])
    size = files.cloud.stat().st_size / 1e6
    rows = [
        ("points", files.points),
        ("MB of LAZ", size),
        ("seconds", seconds),
        ("points a second", files.points / seconds),
        ("peak memory, MB", memory / 1e6),
    ]
    print_table("a large scene", ("", ""), rows)
    print(f"\n{save('structures-large', dict(rows))}")


if __name__ == "__main__":
    main()
