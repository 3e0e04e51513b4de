"""Run a scene through the program, and hold what came out against what was written down beforehand."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from benchmarks.any_scan.program import Call, Program
from benchmarks.any_scan.scan import Leak
from benchmarks.any_scan.tube import Tube
from benchmarks.any_scan.ways import WAYS, Step, steps_of

NEAR = 0.10
"""m; so far from a true leak what was found may lie and still be of it."""
LEAST = 0.3
"""Share of a true leak that must be covered for it to count as found."""
AREA = (0.6, 1.5)
"""Bounds of the ratio of found to true area, of the leaks that were found."""


@dataclass
class Plan:
    """What a user has, and types."""

    tube: Tube
    files: list[str]
    tunnel: list[Any]
    survey: list[Any]
    leaks: tuple[Leak, ...]
    load: list[Any] = field(default_factory=list)
    run: list[Any] = field(default_factory=list)
    between: Callable[[Path], None] | None = None
    """Done to the files between ``load`` and ``run``."""
    batch: bool = False
    """Load and run by ``batch``."""
    inspect: bool = False
    unit: float = 1.0
    """m; of the coordinates in the files."""


@dataclass(frozen=True)
class Scene:
    """One scan of the matrix, and what is right for it."""

    name: str
    special: str
    expect: str
    """Of ``result``, ``warning``, ``refusal`` those that are right, with ``|`` between."""
    build: Callable[[Path], Plan]
    word: str = ""
    """Names the right matter, in a warning or a refusal: a regular expression, in small letters."""
    least: int | None = None
    """Leaks that must be found: all, unless said."""
    pieces: bool = True
    """Whether a leak has to be found as one, and its area rightly."""


@dataclass
class Verdict:
    """What was seen of a scene."""

    name: str
    special: str
    expect: str
    seen: str
    right: bool
    faults: list[str]
    found: int
    true: int
    false: int
    said: str
    seconds: float
    typed: str
    steps: list[Step] = field(default_factory=list)
    """Steps of a way of doing it wrong, and what each says of the mistake."""


def judge(scene: Scene, folder: Path, program: Program) -> tuple[Verdict, list[Call]]:
    """Build the scene in `folder`, run it, and judge."""
    folder.mkdir(parents=True, exist_ok=True)
    plan = scene.build(folder)
    plan.inspect = scene.name in WAYS.values()
    calls = _run(scene, plan, folder, program)
    faults = [f"traceback: {call.line}" for call in calls if "Traceback" in call.text or call.code not in (0, 1, 2)]
    spoken = _spoken(scene, calls)
    said = next((line.strip() for line in spoken.splitlines() if scene.word and re.search(scene.word, line.lower())), "")
    refused = next((call for call in calls if call.code == 2), None)
    found = false = 0
    true = len(plan.leaks)
    if refused is not None:
        seen = "refusal"
        said, more = _refusal(scene, refused, folder, program)
        faults += more
        listed = next((call for call in calls if call.words[0] == "leaks"), None)
        if true and listed is not None and listed.code == 0:
            faults.append("a refused run, and then leaks ends with 0")
    else:
        seen = "warning" if said else "result"
        found, false, more = _leaks(scene, plan, folder, calls)
        faults += more
    allowed = scene.expect.split("|")
    if seen not in allowed and not (seen == "warning" and "result" in allowed):
        faults.insert(0, f"{seen} instead of {scene.expect}" + (f": {said}" if said else ""))
    verdict = Verdict(
        scene.name, scene.special, scene.expect, seen, not faults, faults, found, true, false, said[:300],
        round(sum(call.seconds for call in calls), 1), (refused or calls[-1]).line,
        steps_of(scene.name, scene.word, calls) if plan.inspect else [],
    )  # fmt: skip
    return verdict, calls


def _spoken(scene: Scene, calls: list[Call]) -> str:
    """Return what was said on the way, but for what ``inspect`` guesses, names and the heads of tables."""
    lines = "\n".join(call.text for call in calls if call.words[0] != "inspect").replace(scene.name, "NAME").splitlines()
    return "\n".join(line for line in lines if not re.match(r"(file +points|.*┃|\S+: [\d ]+ (stations|poses) of NAME)", line))


def _run(scene: Scene, plan: Plan, folder: Path, program: Program) -> list[Call]:
    name = scene.name
    calls = [_inspect(plan, folder, program)] if plan.inspect else []
    # An inspection that can't read a file ends with 1; that is no refusal of the survey yet.
    steps: list[tuple[Any, ...]] = [
        ("tunnel", "add", name, *plan.tunnel),
        ("survey", "add", name, "--tunnel", name, "--date", "2024-05-04", *plan.survey),
        ("batch" if plan.batch else "load", name, *plan.files, *plan.load),
    ]
    for step in steps:
        calls.append(program(folder, *step))
        if calls[-1].code not in (0, 1):
            return calls
    if plan.between:
        plan.between(folder)
    if not plan.batch:
        calls.append(program(folder, "run", name, *plan.run))
    # After a failed stage a user looks at the leaks all the same.
    calls.append(program(folder, "leaks", name, "--json", "--geometry", "3d"))
    calls.append(program(folder, "report", name, "-o", "report.html", "--json"))
    return calls


def _inspect(plan: Plan, folder: Path, program: Program) -> Call:
    """Inspect the scan, with the tables beside it named as inspect finds them."""
    stem = plan.files[0].split(".", 1)[0]
    named = dict(zip(plan.survey[::2], plan.survey[1::2], strict=False)) | dict(
        zip(plan.tunnel[::2], plan.tunnel[1::2], strict=False)
    )
    copies = []
    for option in ("--trajectory", "--stations", "--axis"):
        if str(named.get(option, "")).endswith(".csv"):
            copies.append(folder / f"{stem}.{option.removeprefix('--')}.csv")
            shutil.copy(folder / named[option], copies[-1])
    call = program(folder, "inspect", *plan.files)
    for path in copies:
        path.unlink()
    return call


def _refusal(scene: Scene, call: Call, folder: Path, program: Program) -> tuple[str, list[str]]:
    faults = []
    text = call.err
    if call.words[-1:] == ("--json",) and call.out.startswith("{"):
        text = "tunneldb: " + str(call.json.get("error"))
    lines = [line for line in text.splitlines() if line.startswith("tunneldb: ")]
    said = lines[-1] if lines else (text.strip().splitlines() or [""])[-1]
    if len(lines) != 1:
        faults.append(f"{len(lines)} lines of refusal instead of one")
    if scene.word and not re.search(scene.word, said.lower()):
        faults.append(f"the refusal names another matter: {said}")
    verb = " ".join(call.words[:2])
    if verb in ("tunnel add", "survey add"):
        rows = program(folder, verb.split()[0], "list").out
        if re.search(rf"\b{re.escape(scene.name)}\b", rows):
            faults.append(f"{verb} was refused, but the {verb.split()[0]} is there")
    if call.words[0] == "load":
        query = f"SELECT count(*) FROM tunnel_api.file WHERE survey = '{scene.name}' AND kept > 0"
        rows = program(folder, "psql", "-tAc", query).out
        if rows.strip() not in ("0", ""):
            faults.append(f"load was refused, but {rows.strip()} files are there")
    return said, faults


def _leaks(scene: Scene, plan: Plan, folder: Path, calls: list[Call]) -> tuple[int, int, list[str]]:
    faults: list[str] = []
    listed, report = calls[-2], calls[-1]
    try:
        leaks = listed.json
    except json.JSONDecodeError:
        return 0, 0, [f"{listed.line} gives no JSON: {listed.err.strip()[-200:]}"]
    polygons = [
        polygon for row in leaks.get("leaks", []) if (polygon := unrolled(plan.tube, row["geometry"], plan.unit)) is not None
    ]
    wet = [leak.polygon() for leak in plan.leaks]
    found = sum(_covered(leak, polygons) >= LEAST for leak in wet)
    around = shapely.union_all([leak.buffer(NEAR) for leak in wet]) if wet else shapely.Polygon()
    strange = [polygon for polygon in polygons if polygon.intersection(around).area < 0.5 * polygon.area]
    false = len(strange)
    least = len(wet) if scene.least is None else scene.least
    if found < least:
        faults.append(f"{found} of {len(wet)} leaks found, at least {least} expected")
    if false:
        places = ", ".join(f"s {p.centroid.x:.1f} a {p.centroid.y:+.1f} {p.area:.2f} m²" for p in strange[:4])
        faults.append(f"{false} false leaks: {places}")
    if scene.pieces and found:
        if len(polygons) - false > found:
            faults.append(f"{found} leaks in {len(polygons) - false} pieces")
        hit = [leak for leak in wet if _covered(leak, polygons) >= LEAST]
        ratio = sum(p.area for p in polygons if p not in strange) / sum(leak.area for leak in hit)
        if not AREA[0] <= ratio <= AREA[1]:
            faults.append(f"area {ratio:.2f} times the true one")
    if wet and not leaks["count"] and listed.code == 0 and not leaks.get("gaps") and not leaks.get("statement"):
        faults.append("a silent all-clear")
    if report.code == 0:
        told = report.json
        count = told.get("leaks", told.get("count"))
        count = len(count) if isinstance(count, list) else count
        if count is not None and count != leaks["count"]:
            faults.append(f"leaks counts {leaks['count']}, report {count}")
        words = re.sub(r"<[^>]+>", " ", (folder / "report.html").read_text())
        summary = re.search(r"(\d+) leaks?\b", words)
        if summary and int(summary.group(1)) != leaks["count"]:
            faults.append(f"leaks counts {leaks['count']}, the report's first words {summary.group(0)}")
    return found, false, faults


def _covered(leak: shapely.Polygon, polygons: list[shapely.Polygon]) -> float:
    return sum(leak.intersection(polygon).area for polygon in polygons) / leak.area


def unrolled(tube: Tube, geometry: dict[str, Any] | None, unit: float) -> shapely.Geometry | None:
    """Bring a polygon in space into the plane (s, a), by the scene's own shape."""
    if geometry is None:
        return None
    parts = geometry["coordinates"] if geometry["type"] == "MultiPolygon" else [geometry["coordinates"]]
    flat = []
    for rings in parts:
        shell = np.asarray(rings[0], float) * unit
        s, u, w = tube.unplace(shell)
        flat.append(shapely.Polygon(np.column_stack([s, tube.section.arc(np.column_stack([u, w]))])).buffer(0))
    return shapely.union_all(flat)
