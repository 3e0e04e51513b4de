"""From a plan of a scene to the files of the contract."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass, field as default
from pathlib import Path

import laspy
import numpy as np
import pyproj

from . import instruments as ins
from .instruments import Ladder, Sonar
from .world import Bar, Canal, Hull


@dataclass
class Station:
    """A laser station: its place and how densely it is kept."""

    s: float
    n: float
    z: float
    reach: float = 18.0
    along: int = 900
    around: int = 900


@dataclass
class Plan:
    """Everything about one scene."""

    canal: Canal
    ladders: list[Ladder]
    stations: list[Station]
    sonars: list[Sonar]
    epsg: int
    east: float
    north: float
    level: float  # height of the water at the laser's time
    azimuth: float  # degrees, of the local x axis, counted from east to north
    scale: float
    seed: int
    water_then: float = 0.0  # water of the sonar's day above that of the laser's
    down: bool = False
    sound: tuple[float, float] | None = None
    paced: float | None = None
    ropes_laser: list[list[Bar]] = default(default_factory=list)
    ropes_sonar: list[list[Bar]] = default(default_factory=list)
    hulls_laser: list[Hull] = default(default_factory=list)
    hulls_sonar: list[Hull] = default(default_factory=list)
    axis_step: float = 5.0
    voxel: float = 0.0


def write(plan: Plan, folder: Path) -> None:
    """Write the files of a scene and its truth."""
    rng = np.random.default_rng(plan.seed)
    canal = plan.canal
    a = np.radians(plan.azimuth)
    turn = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    base = np.array([plan.east, plan.north, plan.level])
    ladders = [x.bars(canal) for x in plan.ladders]

    # The laser.
    clouds, rows = [], []
    for number, st in enumerate(plan.stations, 1):
        place = canal.to_xyz(st.s, st.n, st.z)
        p = ins.laser(canal, place, st.reach, st.along, st.around, ladders + plan.ropes_laser, plan.hulls_laser, rng)
        s, _ = canal.to_sn(p[:, 0], p[:, 1])
        p = p[(s > -0.5) & (s < canal.length + 0.5)]
        r = np.linalg.norm(p - place, axis=1)
        clouds.append(np.column_stack([p @ turn.T + base, r, np.full(len(p), number)]))
        rows.append([number, *np.round(place @ turn.T + base, 4)])
    cloud = np.concatenate(clouds)
    if plan.voxel:
        key = np.floor((cloud[:, :3] - cloud[:, :3].min(0)) / plan.voxel).astype(np.int64)
        _, first = np.unique(key[:, 0] * 4_000_037 + key[:, 1] * 2003 + key[:, 2], return_index=True)
        cloud = cloud[np.sort(first)]
    if len(cloud) > 4_000_000:
        cloud = cloud[np.sort(rng.choice(len(cloud), 3_990_000, replace=False))]
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales = np.full(3, 0.001)
    header.offsets = np.floor(cloud[:, :3].min(0))
    header.add_crs(pyproj.CRS.from_epsg(plan.epsg))
    las = laspy.LasData(header)
    las.x, las.y, las.z = cloud[:, 0], cloud[:, 1], cloud[:, 2]
    las.point_source_id = cloud[:, 4].astype(np.uint16)
    las.intensity = np.clip(rng.normal(22000, 2500, len(cloud)) / (1 + 0.03 * cloud[:, 3]), 0, 65535).astype(np.uint16)
    las.return_number = np.ones(len(cloud), np.uint8)
    las.number_of_returns = np.ones(len(cloud), np.uint8)
    las.write(str(folder / "laser.laz"))

    with open(folder / "stations.csv", "w", newline="") as f:
        csv.writer(f).writerows([["scan_id", "x", "y", "z"], *rows])
    with open(folder / "axis.csv", "w", newline="") as f:
        out = csv.writer(f)
        out.writerow(["x", "y", "z"])
        count = int(np.ceil(canal.length / plan.axis_step)) + 1
        for s in np.linspace(0, canal.length, count):
            p = canal.to_xyz(s, canal.tow_width / 2, canal.springing) @ turn.T + base
            out.writerow([f"{v:.4f}" for v in p])
    with open(folder / "ladders.csv", "w", newline="") as f:
        out = csv.writer(f)
        out.writerow(["ladder", "rung", "height", "stile_gap", "diameter"])
        for i, ladder in enumerate(plan.ladders, 1):
            for j, h in enumerate(ladder.rungs, 1):
                out.writerow([i, j, f"{h - ladder.rungs[0]:.3f}", f"{ladder.gap:.3f}", f"{ladder.diameter:.3f}"])

    # The sonars.
    scans, start = [], []
    for i, head in enumerate(plan.sonars, 1):
        got = ins.sonar(canal, head, plan.water_then, plan.scale, plan.down, ladders + plan.ropes_sonar, plan.hulls_sonar)
        np.savetxt(folder / f"sonar_{i}.xyz", got["points"], fmt="%.4f")
        rot, origin = turn @ got["rotation"], turn @ got["origin"] + base
        entry = {
            "rotation": rot.tolist(),
            "origin": origin.tolist(),
            "scale": plan.scale,
            "check_local": got["check"].tolist(),
            "check_world": (plan.scale * got["check"] @ rot.T + origin).tolist(),
            "determined": head.determined,
        }
        if not head.determined:
            entry["open"] = head.open
        scans.append(entry)
        if plan.paced is not None:
            off = rng.uniform(-1, 1, 2)
            off *= plan.paced * 0.85 * np.sqrt(rng.random()) / np.linalg.norm(off)
            start.append(
                {
                    "file": f"sonar_{i}.xyz",
                    "x": round(float(origin[0] + off[0]), 1),
                    "y": round(float(origin[1] + off[1]), 1),
                    "within": plan.paced,
                }
            )
    scene: dict = {"epsg": plan.epsg, "up": "-z" if plan.down else "+z", "water_level": plan.level}
    if plan.sound is not None:
        scene["sound_speed"] = list(plan.sound)
    if start:
        scene["start"] = start
    (folder / "scene.json").write_text(json.dumps(scene, indent=1))
    (folder / "truth.json").write_text(json.dumps({"scans": scans}))
