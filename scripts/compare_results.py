#!/usr/bin/env python
"""Captures all results of the program on eight scenes, and compares two captures: before and after a change of the code.

    .venv/bin/python scripts/compare_results.py capture before --tunneldb .venv/bin/tunneldb --ringo scans
    .venv/bin/python scripts/compare_results.py compare before after

Scenes: demo (as scripts/demo.sh), static (stations, dirt, target spheres, edits by hand, over the end of a kilometre), ringo (a
real scan, where its folder is given), batch (three kilometres by two workers), structure, canal, epochs (two surveys and all
measures) and files (design alignments and real scan files by themselves). VOLATILE, CHANGING and SAID name what differs between
two runs of the same code.
"""

from __future__ import annotations

import base64
import datetime as dt
import json
import re
import shutil
import sqlite3
import sys
import time
import zipfile
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import Any

import click
import laspy
import numpy as np
from capture_results import Scene, batch, canal, demo, dump, epochs, files, ringo, static, structure
from measure_results import (
    IDENTITIES,
    VOLATILE,
    Findings,
    Gap,
    Table,
    clean_json,
    compare_tables,
    distance_of,
    excerpt,
    gaps_of_images,
    measure,
    one_to_one,
    read_table,
)

SCENES = ("demo", "static", "ringo", "batch", "structure", "canal", "epochs", "files")

RUNS = {"demo": demo, "static": static, "batch": batch, "structure": structure, "canal": canal, "epochs": epochs}
"""Scenes that need nothing but the program."""

Rules = tuple[tuple[re.Pattern[str], str | Callable[[re.Match[str]], str]], ...]

CHANGING: Rules = (
    (re.compile(r"(?s)(\n *2\r?\nCLASSES\r?\n).*?(?=\n *0\r?\nENDSEC)"), r"\1"),  # of DXF, in any order
    (re.compile(r"\$(TDU?CREATE|TDU?UPDATE|FINGERPRINTGUID|VERSIONGUID)\r?\n\s*\d+\r?\n.*"), r"$\1"),  # of DXF
    (re.compile(r"\d{4}-\d\d-\d\d[ T]\d\d:\d\d(:\d\d(\.\d+)?)?( ?(Z|UTC|[+-]\d\d(:?\d\d)?))?"), "TIME"),
    (re.compile(r"\{?\b[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}\b\}?", re.IGNORECASE), "UUID"),
    (re.compile(r"\btunneldb \d+(\.\d+)+\S*"), "tunneldb VERSION"),
)
"""What is replaced in all texts."""

SAID: Rules = (
    (re.compile(r"\b[\d.,]+ (s|min|h|points/s|GB free|MB/s)(?!\w)"), "TIME"),
    (re.compile(r"^│ +\d+ (?=│)", re.MULTILINE), "│ id "),  # ids of leaks, which are compared in the tables
    (re.compile(r"\{\d+(,\d+)*\}"), lambda found: f"{found[0].count(',') + 1} ids"),
    (re.compile(r"[ ─━-]{2,}"), " "),  # widths of columns follow from them
)
"""And in what is printed."""

IMAGE = re.compile(r"data:image/(?:png|jpeg|webp);base64,([A-Za-z0-9+/=]+)")


def compare_arrays(findings: Findings, item: str, before: Path, after: Path) -> None:
    """Compare two files of arrays; points of which some are on one side only by those of both."""
    with np.load(before) as old, np.load(after) as new:
        findings.same(item, "arrays", sorted(old.files), sorted(new.files))
        first, second = ({name: file[name] for name in old.files if name in new.files} for file in (old, new))
    names = [name for name in first if len(first[name]) != len(second[name])]
    if names:
        findings.say("differs", item, "rows", f"{len(first[names[0]])} before, {len(second[names[0]])} after")
        if not {"x", "y", "z", "gps_time"} <= first.keys():
            return
        places = [np.stack([side[n] for n in ("gps_time", "x", "y", "z")], 1) for side in (first, second)]
        flat = [np.ascontiguousarray(place).view([("", np.float64)] * 4).ravel() for place in places]
        both, left, right = np.intersect1d(flat[0], flat[1], return_indices=True)
        findings.say("differs", item, "rows", f"{len(both)} in both, by time and place")
        first, second = ({n: side[n][at] for n in side} for side, at in ((first, left), (second, right)))
    gaps = {}
    for name, values in first.items():
        gaps[name] = measure(values, second[name])
        if name in IDENTITIES and gaps[name].rows:
            pairs = {(int(a), int(b)) for a, b in np.unique(np.stack([values, second[name]], 1), axis=0)}
            if one_to_one(pairs):
                findings.say("renumbered", item, name, f"{gaps.pop(name).rows} rows, one to one: the order of insertion")
    findings.values(item, gaps)


def compare_scans(findings: Findings, item: str, before: Path, after: Path) -> None:
    """Compare two LAZ files: headers, and points dimension by dimension."""
    with laspy.open(before) as old, laspy.open(after) as new:
        for name in ("version", "point_format", "point_count", "scales", "offsets", "mins", "maxs", "system_identifier"):
            findings.same(item, name, *(str(getattr(file.header, name)) for file in (old, new)))
        records = [[(v.user_id, v.record_id, v.record_data_bytes()) for v in file.header.vlrs] for file in (old, new)]
        findings.same(item, "records", *records)
        names = [list(file.header.point_format.dimension_names) for file in (old, new)]
        findings.same(item, "dimensions", *names)
        if old.header.point_count != new.header.point_count:
            return
        gaps: dict[str, Gap] = {name: Gap() for name in names[0] if name in names[1]}
        for first, second in zip(old.chunk_iterator(1_000_000), new.chunk_iterator(1_000_000), strict=True):
            for name, gap in gaps.items():
                more = measure(np.asarray(first[name]), np.asarray(second[name]))
                gap.rows, gap.greatest = gap.rows + more.rows, max(gap.greatest, more.greatest)
    findings.values(item, gaps)


def read_geopackage(path: Path, cleaned: Callable[[str], str]) -> Iterator[tuple[str, Table]]:
    """Return the tables of a GeoPackage, geometries as WKB in hexadecimal digits."""
    with sqlite3.connect(path) as connection:
        master = connection.execute("SELECT type, name, tbl_name, sql FROM sqlite_master ORDER BY 1, 2").fetchall()
        rows = [tuple(str(cell) for cell in row) for row in master]
        columns = ["type", "name", "table", "sql"]
        yield "schema", Table(columns, rows, dict.fromkeys(columns, "text"), [])
        for kind, name, *_ in master:
            if kind != "table" or name.startswith(("rtree_", "sqlite_")):
                continue
            cursor = connection.execute(f'SELECT * FROM "{name}"')
            columns = [column[0] for column in cursor.description]
            kinds = dict.fromkeys(columns, "text")
            rows = []
            for row in cursor:
                cells = []
                for column, cell in zip(columns, row, strict=True):
                    if isinstance(cell, bytes):
                        wkb = cell[:2] == b"GP"
                        kinds[column] = "geometry" if wkb else "image"
                        start = 8 + (0, 32, 48, 48, 64)[cell[3] >> 1 & 7] if wkb else 0
                        cells.append(cell[start:].hex())
                    else:
                        cells.append("\\N" if cell is None else "set" if column in VOLATILE else cleaned(str(cell)))
                rows.append(tuple(cells))
            yield name, Table(columns, rows, kinds, [])


def compare_texts(findings: Findings, item: str, before: str, after: str) -> None:
    """Compare two texts line by line; images in them pixel by pixel."""
    images = [IMAGE.findall(text) for text in (before, after)]
    for n, (first, second) in enumerate(zip(*images, strict=False)):
        if first != second:
            gaps = gaps_of_images(base64.b64decode(first), base64.b64decode(second))
            findings.values(item, {f"image {n}: {name}": gap for name, gap in gaps.items()})
    lines = [re.sub(r"(?<=>)(?=<)|(?<=\}),", "\n", IMAGE.sub("IMAGE", text)).splitlines() for text in (before, after)]
    gap = Gap()
    if len(lines[0]) != len(lines[1]):
        findings.say("differs", item, "lines", f"{len(lines[0])} before, {len(lines[1])} after")
    for first, second in zip_longest(*lines, fillvalue=""):
        same, greatest = distance_of(first, second)
        if not same and not gap.rows:
            gap.example = f", as {excerpt(first, second)}"
        gap.rows, gap.greatest = gap.rows + (not same), max(gap.greatest, greatest)
    findings.values(item, {"text": gap})


def flatten(value: Any, name: str = "") -> Iterator[tuple[str, str]]:
    """Return what a JSON value holds, each with its name; items of a list have the same."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from flatten(item, f"{name}.{key}" if name else key)
    elif isinstance(value, list) and any(isinstance(item, (dict, list)) for item in value):
        for item in value:
            yield from flatten(item, f"{name}[]")
    else:
        yield name, json.dumps(value, ensure_ascii=False)


def compare_json(findings: Findings, item: str, before: str, after: str) -> None:
    """Compare two JSON texts, name by name."""
    sides: list[dict[str, list[str]]] = [defaultdict(list), defaultdict(list)]
    for text, side in zip((before, after), sides, strict=True):
        for name, value in flatten(clean_json(json.loads(text))):
            side[name].append(value)
    for name in sorted(sides[0].keys() | sides[1].keys()):
        first, second = sides[0][name], sides[1][name]
        if (
            name.rpartition(".")[2] in IDENTITIES
            and len(first) == len(second)
            and one_to_one({*zip(first, second, strict=True)})
        ):
            if first != second:
                findings.say("renumbered", item, name, "one to one: the order of insertion")
            continue
        compare_texts(findings, f"{item}: {name}", "\n".join(first), "\n".join(second))


class Capture:
    """A captured folder.

    Parameters
    ----------
    folder : Path
        As written by ``capture``.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.about = json.loads((folder / "capture.txt").read_text())

    def files(self, scene: str) -> dict[str, Path]:
        """Return what was captured of a scene, by the path within it."""
        paths = (path for path in (self.folder / scene).rglob("*") if path.is_file() and path.name != "types.txt")
        return {path.relative_to(self.folder / scene).as_posix(): path for path in paths}

    def cleaner(self, path: Path, scene: str) -> Callable[[str], str]:
        """Return what takes from a text of a file what changes by itself."""
        rules = CHANGING + (SAID if path.parent.name == "said" else ())

        def clean(text: str) -> str:
            text = text.replace(self.about["folder"], "FOLDER")
            for pattern, word in rules:
                text = pattern.sub(word, text)
            return text.replace(self.about["day"][scene], "DAY")

        return clean


def compare_files(
    findings: Findings, item: str, sides: Sequence[Capture], paths: Sequence[Path], columns: Mapping[str, str]
) -> None:
    """Compare two files by their kind; columns of tables in the first have their new names."""
    clean = [side.cleaner(path, findings.scene) for side, path in zip(sides, paths, strict=True)]
    ending = paths[0].suffix.lower()
    if ending == ".npz":
        compare_arrays(findings, item, *paths)
    elif ending == ".laz":
        compare_scans(findings, item, *paths)
    elif ending in (".gz", ".csv"):
        old, new = (read_table(path, rule) for path, rule in zip(paths, clean, strict=True))
        compare_tables(findings, item, old.renamed(columns), new)
    elif ending == ".gpkg":
        before, after = (dict(read_geopackage(path, rule)) for path, rule in zip(paths, clean, strict=True))
        findings.same(item, "tables", sorted(before), sorted(after))
        for name in before.keys() & after.keys():
            compare_tables(findings, f"{item}: {name}", before[name].renamed(columns), after[name])
    elif ending in (".tif", ".png", ".webp"):
        findings.values(item, gaps_of_images(*(path.read_bytes() for path in paths)))
    elif ending == ".qgz":
        with zipfile.ZipFile(paths[0]) as first, zipfile.ZipFile(paths[1]) as second:
            members = [{Path(name).suffix: file.read(name).decode() for name in file.namelist()} for file in (first, second)]
        findings.same(item, "members", sorted(members[0]), sorted(members[1]))
        for name in members[0].keys() & members[1].keys():
            compare_texts(findings, f"{item}: {name}", clean[0](members[0][name]), clean[1](members[1][name]))
    else:
        texts = [rule(path.read_text(encoding="utf-8")) for path, rule in zip(paths, clean, strict=True)]
        (compare_json if ending in (".json", ".geojson") else compare_texts)(findings, item, *texts)


@click.group()
def main() -> None:
    """Capture all results of the program, and compare them before and after a change of the code."""


@main.command()
@click.argument("folder", type=click.Path(path_type=Path, file_okay=False))
@click.option("--tunneldb", required=True, type=click.Path(path_type=Path, exists=True), help="The program to run.")
@click.option("--ringo", "real", envvar="RINGO", type=click.Path(path_type=Path), help="Folder of real scans. [env: RINGO]")
@click.option("--only", multiple=True, type=click.Choice(SCENES), help="Only this scene.")
@click.option("--scans", type=click.Path(path_type=Path, exists=True), help="Capture of which the simulated scans are taken.")
@click.option("--keep", is_flag=True, help="Keep the databases.")
def capture(folder: Path, tunneldb: Path, real: Path | None, only: Sequence[str], scans: Path | None, keep: bool) -> None:
    """Run the scenes, and keep all their results in FOLDER; scenes that are there are done anew."""
    folder.mkdir(parents=True, exist_ok=True)
    folder, note = folder.resolve(), folder / "capture.txt"
    for name in SCENES:
        if only and name not in only:
            continue
        if name == "ringo" and (real is None or not (real / "ringo.laz").exists()):
            click.echo("ringo: left out, no folder with ringo.laz is given (--ringo)")
            continue
        scene, start = Scene(folder / name, tunneldb.absolute(), scans), time.monotonic()
        try:
            if name == "files":
                files(scene, real)
            elif name == "ringo" and real is not None:
                ringo(scene, real)
            else:
                RUNS[name](scene)
            took = time.monotonic() - start
            dump(scene)
        finally:
            scene.run("server", "stop")
        if not keep:
            shutil.rmtree(scene.folder / "home")
        about = {"folder": str(folder), "seconds": {}, "day": {}} | (json.loads(note.read_text()) if note.exists() else {})
        about["seconds"][name], about["day"][name] = round(took, 1), dt.datetime.now(dt.UTC).date().isoformat()
        note.write_text(json.dumps(about, indent=1))
        click.echo(f"{name}: {took:.0f} s, and {time.monotonic() - start - took:.0f} s to write its tables")


@main.command()
@click.argument("before", type=click.Path(path_type=Path, exists=True))
@click.argument("after", type=click.Path(path_type=Path, exists=True))
@click.option("--only", multiple=True, help="Only this scene.")
@click.option("--renamed", type=click.Path(path_type=Path, exists=True), help="JSON file of renamed files and columns.")
def compare(before: Path, after: Path, only: Sequence[str], renamed: Path | None) -> None:
    """Compare two captures; exit code 1 where anything differs.

    The file of --renamed has two objects: ``files`` (old name of a table or file to new name, "" if it was removed) and
    ``columns`` (old name of a column to new name, in all tables).
    """
    names = {"files": {}, "columns": {}} | (json.loads(renamed.read_text()) if renamed else {})
    findings, sides = Findings(), (Capture(before), Capture(after))
    for scene in sorted(set().union(*(side.about["seconds"] for side in sides))):
        if only and scene not in only:
            continue
        findings.scene = scene
        if any(scene not in side.about["seconds"] for side in sides):
            findings.say("differs", "all", "files", "the scene is in one capture only")
            continue
        captured = [side.files(scene) for side in sides]
        captured[0] = {names["files"].get(item, item): path for item, path in captured[0].items()}
        captured[0].pop("", None)
        for item in sorted(captured[0].keys() | captured[1].keys()):
            paths = [side[item] for side in captured if item in side]
            if len(paths) == 1:
                findings.say("differs", item, "file", "only before" if item in captured[0] else "only after")
            elif paths[0].read_bytes() != paths[1].read_bytes():
                compare_files(findings, item, sides, paths, names["columns"])
        click.echo(f"{scene}: {len(captured[0])} files before, {len(captured[1])} after")
    click.echo(", ".join(f"{count} {what}" for what, count in findings.count.items()))
    sys.exit(findings.count["differs"] > 0)


if __name__ == "__main__":
    main()
