"""Tells how much values, tables and images of two captures of results differ; see compare_results.py."""

from __future__ import annotations

import csv
import gzip
import json
import math
import re
import warnings
from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path
from typing import Any

import click
import numpy as np
import rasterio
import shapely
from numpy.typing import NDArray
from rasterio.errors import NotGeoreferencedWarning

TOLERANCE = 1e-9
"""Greatest difference of numbers, of max(1, |x|): at most WIDEST, at least 8 units in the last place."""
WIDEST = 1e-6

TIMES = {
    "at", "backend_start", "created_at", "detected_at", "done_at", "drawn_at", "duration", "edited_at", "failed_at",
    "finished_at", "found_at", "heartbeat", "input_at", "last_change", "left", "loaded_at", "now", "points_per_second", "rate",
    "read_at", "requested_at", "retry_after", "reviewed_at", "seconds", "since", "started_at", "update_time",
}  # fmt: skip
MACHINES = {"backend_pid", "dsn", "host", "job_id", "path", "pid", "versions", "who", "worker", "worker_id"}
VOLATILE = TIMES | MACHINES | {"checksum"}  # a LAZ file holds its day
"""Columns and keys of JSON of which only is compared whether they are NULL."""

IDENTITIES = {
    "id",
    "finding_id",
    "cluster_id",
    "file_id",
    "fid",
    "largest_leak",
    "row_id",
    "run_id",
    "section_id",
    "survey_id",
    "tunnel_id",
}
"""Columns of numbers in order of insertion: said where they differ, an error only where the new ones are not one to one."""

NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


@dataclass
class Gap:
    """How much values differ: the number of rows, the greatest difference of numbers, an example of texts."""

    rows: int = 0
    greatest: float = 0.0
    example: str = ""


@dataclass
class Findings:
    """What is found, printed line by line."""

    scene: str = ""
    count: dict[str, int] = field(default_factory=lambda: {"differs": 0, "renumbered": 0, "within tolerance": 0})

    def say(self, what: str, item: str, column: str, text: str) -> None:
        """Print a line and count it."""
        self.count[what] += 1
        click.echo(f"{what}: {self.scene}  {item}  {column}  {text}")

    def values(self, item: str, gaps: Mapping[str, Gap]) -> None:
        """Print a line for each column that differs."""
        for column, gap in gaps.items():
            if gap.rows or gap.greatest:
                size = "not numbers alone" if math.isinf(gap.greatest) else f"greatest {gap.greatest:.3g}"
                text = f"{gap.rows} rows, {size}{gap.example}" if gap.rows else size
                self.say("differs" if gap.rows else "within tolerance", item, column, text)

    def same(self, item: str, column: str, before: Any, after: Any) -> None:
        """Print a line where two values are not the same."""
        if before != after:
            self.say("differs", item, column, excerpt(before, after))


def excerpt(before: Any, after: Any) -> str:
    """Return where two texts begin to differ, in one line."""
    texts = [" ".join(str(value).split()) for value in (before, after)]
    unlike = (n for n, (first, second) in enumerate(zip(*texts, strict=False)) if first != second)
    begin = max(next(unlike, min(map(len, texts))) - 30, 0)
    return " | ".join(("..." if begin else "") + text[begin : begin + 80] for text in texts)


def allowed(before: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the greatest difference from numbers that is none."""
    size = np.abs(before)
    limit: NDArray[np.float64] = np.minimum(TOLERANCE * np.maximum(1.0, size), WIDEST)
    least: NDArray[np.float64] = 8 * np.spacing(size)
    return np.where(limit > least, limit, least)


def measure(before: NDArray[Any], after: NDArray[Any]) -> Gap:
    """Return how much two arrays of the same shape differ; the first axis is that of rows."""
    if before.dtype.kind not in "iuf":
        wrong = np.asarray(before != after)
        return Gap(int(np.count_nonzero(wrong)), math.inf if wrong.any() else 0.0)
    first, second = before.astype(np.float64), after.astype(np.float64)
    with np.errstate(invalid="ignore"):
        distance = np.where((first == second) | (np.isnan(first) & np.isnan(second)), 0.0, np.abs(first - second))
        far = ~(distance <= np.where(np.isfinite(first), allowed(first), 0.0))
    wrong = far if before.dtype.kind == "f" else np.asarray(before != after)
    rows = wrong.any(axis=tuple(range(1, wrong.ndim)))
    return Gap(int(np.count_nonzero(rows)), float(np.nanmax(distance, initial=0.0)))


def distance_of(before: str, after: str) -> tuple[bool, float]:
    """Return whether two texts are the same but for tiny differences of their numbers, and the greatest of these."""
    if before == after:
        return True, 0.0
    if NUMBER.sub("#", before) != NUMBER.sub("#", after):
        return False, math.inf
    same, greatest = True, 0.0
    for first, second in zip(NUMBER.findall(before), NUMBER.findall(after), strict=True):
        if first != second:
            gap = measure(np.array([float(first)]), np.array([float(second)]))
            exact = first.lstrip("+-").isdigit() and second.lstrip("+-").isdigit()
            same, greatest = same and not (gap.rows or (exact and gap.greatest)), max(greatest, gap.greatest)
    return same, greatest


def distance_of_shapes(before: bytes, after: bytes) -> tuple[bool, float]:
    """Return the same of two geometries in WKB."""
    first, second = shapely.from_wkb(before), shapely.from_wkb(after)
    rest = [(s.geom_type, s.has_z, shapely.get_srid(s), shapely.get_num_coordinates(s)) for s in (first, second)]
    skeleton = [NUMBER.sub("#", s.wkt) for s in (first, second)]
    if rest[0] != rest[1] or skeleton[0] != skeleton[1]:
        return False, math.inf
    gap = measure(*(shapely.get_coordinates(s, include_z=True) for s in (first, second)))
    return gap.rows == 0, gap.greatest


@dataclass
class Table:
    r"""Rows as text, NULL as \N, with the kind of each column (geometry, image, identity or text) and the key."""

    columns: list[str]
    rows: list[tuple[str, ...]]
    kinds: dict[str, str]
    key: list[str]

    def renamed(self, names: Mapping[str, str]) -> Table:
        """Return the table with new names of its columns, unless it has a column of the new name already."""
        new = {name: names[name] for name in self.columns if name in names and names[name] not in self.columns}
        kinds = {new.get(name, name): kind for name, kind in self.kinds.items()}
        return Table([new.get(n, n) for n in self.columns], self.rows, kinds, [new.get(n, n) for n in self.key])


def clean_json(value: Any) -> Any:
    """Return a value of JSON without what is volatile."""
    if isinstance(value, dict):
        return {name: clean_json(item) for name, item in value.items() if name not in VOLATILE}
    return [clean_json(item) for item in value] if isinstance(value, list) else value


def read_table(path: Path, cleaned: Callable[[str], str]) -> Table:
    """Read a dumped table or an exported CSV file."""
    data = path.read_bytes()
    text = (gzip.decompress(data) if path.suffix == ".gz" else data).decode()
    columns, *rows = csv.reader(StringIO(text, newline=""))
    described: dict[str, Any] = {"types": {}, "key": []}
    if path.suffix == ".gz":
        described = json.loads((path.parent / "types.txt").read_text())[path.name.removesuffix(".csv.gz")]
    kinds = {name: {"geometry": "geometry", "bytea": "image"}.get(described["types"].get(name, ""), "text") for name in columns}

    def clean(name: str, cell: str) -> str:
        if cell == "\\N" or (name in VOLATILE and cell):
            return cell if cell == "\\N" else "set"
        if described["types"].get(name) == "jsonb":
            return json.dumps(clean_json(json.loads(cell)), sort_keys=True, ensure_ascii=False)
        return cell if kinds[name] != "text" else cleaned(cell)

    cells = [tuple(clean(name, cell) for name, cell in zip(columns, row, strict=True)) for row in rows]
    return Table(columns, cells, kinds, described["key"])


def pair_rows(before: Table, after: Table) -> tuple[list[tuple[tuple[str, ...], tuple[str, ...]]], int, int]:
    """Return rows that belong together, and how many are only on one side.

    First those that are the same, then those that are about the same but for identities, then those of the same key, then
    the others in their order.
    """
    numbers = [n for n, name in enumerate(before.columns) if name not in IDENTITIES and before.kinds[name] == "text"]
    keys = [before.columns.index(name) for name in before.key]

    def rough(row: tuple[str, ...]) -> object:
        return tuple(NUMBER.sub(lambda found: f"{float(found[0]):.6g}", row[n]) for n in numbers)

    pairs: list[tuple[tuple[str, ...], tuple[str, ...]]] = []
    left, right = before.rows, after.rows
    ways: tuple[Callable[[tuple[str, ...]], object], ...] = (lambda row: row, rough, lambda row: tuple(row[n] for n in keys))
    for way in ways if keys else ways[:2]:
        waiting: dict[object, list[tuple[str, ...]]] = defaultdict(list)
        for row in reversed(right):
            waiting[way(row)].append(row)
        unpaired = []
        for row in left:
            found = waiting[way(row)]
            if found:
                pairs.append((row, found.pop()))
            else:
                unpaired.append(row)
        left, right = unpaired, [row for rows in waiting.values() for row in reversed(rows)]
    both = min(len(left), len(right))
    pairs += zip(left, right, strict=False)
    return pairs, len(left) - both, len(right) - both


def compare_tables(findings: Findings, item: str, before: Table, after: Table) -> None:
    """Compare two tables, column by column."""
    findings.same(item, "columns", before.columns, after.columns)
    names = [name for name in before.columns if name in after.columns]
    tables = []
    for table in (before, after):
        places = [table.columns.index(name) for name in names]
        rows = [tuple(row[n] for n in places) for row in table.rows]
        tables.append(Table(names, rows, table.kinds, [name for name in table.key if name in names]))
    pairs, removed, added = pair_rows(*tables)
    if removed or added:
        findings.say("differs", item, "rows", f"{removed} only before, {added} only after, {len(pairs)} in both")
    gaps: dict[str, Gap] = {name: Gap() for name in names}
    for n, name in enumerate(names):
        cells = [(first[n], second[n]) for first, second in pairs if first[n] != second[n]]
        every = {(first[n], second[n]) for first, second in pairs}
        if cells and name in IDENTITIES and one_to_one(every):
            findings.say("renumbered", item, name, f"{len(cells)} rows, one to one: the order of insertion")
            continue
        for first, second in cells:
            same, greatest = compare_cells(before.kinds[name], first, second)
            gap = gaps[name]
            if not same and not gap.rows:
                gap.example = f", as {example_of(before.kinds[name], first, second)}"
            gap.rows, gap.greatest = gap.rows + (not same), max(gap.greatest, greatest)
    findings.values(item, gaps)


def one_to_one(pairs: set[tuple[Any, Any]]) -> bool:
    """Return whether each number before has one after, and the other way round."""
    return len({first for first, _ in pairs}) == len(pairs) == len({second for _, second in pairs})


def example_of(kind: str, before: str, after: str) -> str:
    """Return two cells that differ as one line."""
    if kind == "image":
        return f"{len(before)} | {len(after)} hexadecimal digits"
    if kind == "geometry" and "\\N" not in (before, after):
        return excerpt(*(shapely.to_wkt(shapely.from_wkb(cell), rounding_precision=-1) for cell in (before, after)))
    return excerpt(before, after)


def compare_cells(kind: str, before: str, after: str) -> tuple[bool, float]:
    """Return whether two cells are the same within the tolerance, and the greatest difference of numbers."""
    if "\\N" in (before, after) or kind == "text":
        return distance_of(before, after)
    first, second = (bytes.fromhex(cell.removeprefix("\\x")) for cell in (before, after))
    if kind == "geometry":
        return distance_of_shapes(first, second)
    if first[:2] in (b"II", b"MM"):
        gaps = gaps_of_images(first, second).values()
        return not any(gap.rows for gap in gaps), max(gap.greatest for gap in gaps)
    return first == second, 0.0 if first == second else math.inf


def raster_gaps(before: rasterio.DatasetReader, after: rasterio.DatasetReader) -> dict[str, Gap]:
    """Return how two images differ: what is said of them, and pixel by pixel."""
    gaps: dict[str, Gap] = {}
    said = []
    for image in (before, after):
        bands = range(1, image.count + 1)
        said.append(
            {name: str(value) for name, value in image.profile.items()}
            | {"tags": image.tags(), "names": image.descriptions, "units": image.units, "colours": image.colorinterp}
            | {f"band {n}": (image.tags(n), image.overviews(n), _palette(image, n)) for n in bands}
        )
    for name in said[0].keys() | said[1].keys():
        if (old := said[0].get(name)) != (new := said[1].get(name)):
            gaps[name] = Gap(1, math.inf, f", {excerpt(old, new)}")
    if (before.count, before.shape) == (after.count, after.shape):
        for n in range(1, before.count + 1):
            gaps[f"pixels of band {n}"] = measure(before.read(n).ravel(), after.read(n).ravel())
    return gaps


def _palette(image: rasterio.DatasetReader, band: int) -> Any:
    try:
        return image.colormap(band)
    except ValueError:  # it has none
        return None


def gaps_of_images(before: bytes, after: bytes) -> dict[str, Gap]:
    """Return the same of two files."""
    with warnings.catch_warnings(), rasterio.MemoryFile(before) as first, rasterio.MemoryFile(after) as second:
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        with first.open() as old, second.open() as new:
            return raster_gaps(old, new)
