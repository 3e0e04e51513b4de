"""Runs ``tunneldb members`` as its user would, and reads what it wrote."""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import laspy
import numpy as np
import pyogrio.raw
import shapely
from scipy.optimize import least_squares

from benchmarks.common import COMMAND, progress
from benchmarks.structures.scenes import Scene
from tunneldb.arrays import Float, Int64


@dataclass(frozen=True)
class Found:
    """What was found at each point (n), and how long it took.

    ``faces`` has kind, radius and the vertices of the outline of each face; ``memory`` is the peak resident set, bytes.
    """

    face: Int64
    member: Int64
    anomaly: Int64
    faces: dict[int, dict[str, Any]]
    seconds: float
    memory: float
    answer: dict[str, Any]


class CrashedError(Exception):
    """The program ended otherwise than well; the last line that it wrote."""


def run(arguments: list[object]) -> tuple[float, float, str]:
    """Run a command of tunneldb; its seconds, its peak memory (bytes) and what it printed."""
    start = time.perf_counter()
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        process = subprocess.Popen([*COMMAND, *map(str, arguments)], stdout=out, stderr=err)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        seconds = time.perf_counter() - start
        out.seek(0)
        err.seek(0)
        text = out.read()
        if process.returncode:
            raise CrashedError(f"tunneldb {' '.join(map(str, arguments))}: {(err.read().strip() or text).splitlines()[-1]}")
    return seconds, usage.ru_maxrss * 1024.0, text


def command(scene: Scene, output: Path) -> list[object]:
    intensity = ["--intensity", "Amplitude", "--intensity-kind", "amplitude"]
    return ["members", scene.cloud, "--stations", scene.stations_file, *intensity, "-o", output, "--json"]


def detect(scene: Scene, folder: Path, models: bool = True, reference: bool = False) -> Found:
    """Find members, faces and anomalies of a scene; with ``models`` in a second run their outlines, too."""
    output = folder / f"{scene.cloud.stem}.found.laz"
    outline = output.with_suffix(".gpkg")
    for path in (output, outline):
        path.unlink(missing_ok=True)
    with_reference = ["--reference", scene.cloud.with_name(f"{scene.cloud.stem}.reference.csv")] if reference else []
    seconds, memory, text = run([*command(scene, output), *with_reference])
    if models:
        run([*command(scene, outline), *with_reference])
    las = laspy.read(output)
    if not np.array_equal(las.xyz, scene.xyz):
        raise SystemExit(f"{output}: not the input's points in their order")
    return Found(
        *(np.asarray(las[name]).astype(np.int64) for name in ("face", "member", "anomaly")),
        _faces(outline) if models else {},
        seconds,
        memory,
        json.loads(text),
    )


def attempt(scene: Scene, folder: Path, models: bool = True, reference: bool = False) -> tuple[Found, bool]:
    """The same, and whether it ran: what crashed has found nothing."""
    try:
        return detect(scene, folder, models, reference), True
    except CrashedError as error:
        progress(f"counted as nothing found: {error}")
    none = np.zeros(len(scene.xyz), dtype=np.int64)
    return Found(none, none, none, {}, 0.0, 0.0, {}), False


def _faces(path: Path) -> dict[int, dict[str, Any]]:
    meta, _, geometry, columns = pyogrio.raw.read(path, layer="face")
    fields = dict(zip(meta["fields"], columns, strict=True))
    out = {}
    for k, shape in enumerate(shapely.from_wkb(geometry)):
        row = {name: values[k] for name, values in fields.items()}
        out[int(row["face"])] = {**row, "vertices": shapely.get_coordinates(shape, include_z=True)}
    return out


def plane(vertices: Float) -> tuple[Float, Float]:
    """Middle and unit normal of the plane that an outline lies in."""
    middle = vertices.mean(axis=0)
    return middle, np.linalg.svd(vertices - middle, full_matrices=False)[2][2]


def cylinder(vertices: Float, radius: float) -> tuple[Float, Float, float]:
    """Point and unit direction of the axis of the cylinder of a known radius on which an outline lies, and the misfit, m."""
    middle = vertices.mean(axis=0)
    local = vertices - middle
    along = np.linalg.svd(local, full_matrices=False)[2][0]
    first = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
    first /= np.linalg.norm(first)
    second = np.cross(along, first)

    def axis(x: Float) -> tuple[Float, Float]:
        direction = along + x[2] * first + x[3] * second
        return x[0] * first + x[1] * second, direction / np.linalg.norm(direction)

    def misfit(x: Float) -> Float:
        point, direction = axis(x)
        return np.linalg.norm(np.cross(local - point, direction), axis=1) - radius

    starts = [radius * np.array([np.cos(a), np.sin(a), 0.0, 0.0]) for a in np.arange(8) * np.pi / 4]
    best = min((least_squares(misfit, start) for start in starts), key=lambda fit: fit.cost)
    point, direction = axis(best.x)
    return middle + point, direction, float(np.sqrt(np.mean(best.fun**2)))


def incidence(scene: Scene, found: Found) -> Float:
    """Angle of incidence of each point on the face found, degrees; NaN where there is none."""
    out = np.full(len(scene.xyz), np.nan)
    ray = scene.xyz - scene.stations[scene.scan - 1]
    ray /= np.linalg.norm(ray, axis=1)[:, None]
    for number, face in found.faces.items():
        mine = np.flatnonzero(found.face == number)
        if face["radius"] > 0.0:
            point, axis, _ = cylinder(face["vertices"], face["radius"])
            away = scene.xyz[mine] - point
            away -= (away @ axis)[:, None] * axis
            normal = away / np.linalg.norm(away, axis=1)[:, None]
        else:
            normal = np.broadcast_to(plane(face["vertices"])[1], (len(mine), 3))
        cosine = np.abs(np.einsum("ij,ij->i", normal, ray[mine]))
        out[mine] = np.degrees(np.arccos(np.clip(cosine, 0.0, 1.0)))
    return out
