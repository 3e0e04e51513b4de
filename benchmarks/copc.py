"""A survey's scan files as COPC: time, memory and size beside plain LAZ, and what independent readers find in them.

    python -m benchmarks.copc SURVEY [SURVEY ...]         # of the database at hand, up to stage ground
    python -m benchmarks.copc SURVEY --node-modules DIR   # also read by copc.js: npm install --prefix … copc

All points must be those of ``export --classified``, each in the cube of its node; with each level of the octree the cells of
that level's spacing that hold a point at all must hold one already. What is not so is printed, and the exit code is 1.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import laspy
import laspy.copc
import numpy as np

from benchmarks.common import print_table, progress
from benchmarks.files import watched

SCRIPT = Path(__file__).with_name("copc_read.js")
ORDER = ["gps_time", "X", "Y", "Z"]


def measured(survey: str, folder: Path) -> tuple[dict[str, float], dict[str, float]]:
    """Export a survey as LAZ and as COPC, by each command's own process."""
    export = ["export", survey, "--classified", "-o"]
    return watched([*export, folder / "laz"]), watched([*export, folder / "copc", "--copc"])


def differences(folder: Path, node_modules: Path | None) -> list[str]:
    """Return the faults of the written files."""
    files = sorted((folder / "copc").glob("*.copc.laz"))
    virtual = json.loads(next((folder / "copc").glob("*.vpc")).read_text())["features"]
    found = []
    arrays = []
    if [Path(item["assets"]["data"]["href"]).name for item in virtual] != [path.name for path in files]:
        found.append("the virtual point cloud names other files")
    for path in files:
        array, faults = by_laspy(path)
        arrays.append(array)
        found += faults
        if node_modules is not None:
            found += by_copc_js(path, array, node_modules)
    before = np.concatenate([laspy.read(path).points.array for path in sorted((folder / "laz").iterdir())])
    after = np.concatenate(arrays)
    if not np.array_equal(np.sort(before, order=ORDER), np.sort(after, order=ORDER)):
        found.append("points differ from those of export --classified")
    return found


def by_laspy(path: Path) -> tuple[np.ndarray, list[str]]:
    """Points of a file, and what is wrong with its levels."""
    found, parts = [], []
    with laspy.copc.CopcReader.open(path) as reader:
        every = reader.query()
        low, spacing = reader.copc_info.center - reader.copc_info.halfsize, reader.copc_info.spacing
        xyz = np.column_stack([every.x, every.y, every.z])
        for level in range(30):
            part = reader.query(level=level)
            if not len(part):
                break
            parts.append(np.column_stack([part.x, part.y, part.z]))
            cell = spacing / 2**level
            all_cells, own = (cells_of(places - low, cell) for places in (xyz, np.concatenate(parts)))
            if len(all_cells) != len(own):
                found.append(
                    f"{path.name}: level {level} leaves {len(all_cells) - len(own)} cells of {cell:g} m without a point"
                )
    if sum(map(len, parts)) != len(every):
        found.append(f"{path.name}: levels have {sum(map(len, parts))} points, the file {len(every)}")
    return every.array, found


def cells_of(places: np.ndarray, cell: float) -> np.ndarray:
    """Numbers of the cells that places (n, 3), m and not negative, lie in."""
    x, y, z = np.floor(places / cell).astype(np.int64).T
    return np.unique((x << 42) | (y << 21) | z)


def by_copc_js(path: Path, array: np.ndarray, node_modules: Path) -> list[str]:
    """Return the differences found by copc.js."""
    done = subprocess.run(
        ["node", str(SCRIPT), str(path)],
        env=dict(os.environ) | {"NODE_PATH": str(node_modules)},
        capture_output=True,
        text=True,
        check=True,
    )
    read: dict[str, Any] = json.loads(done.stdout)
    classes = np.bincount(array["classification"], minlength=256)
    expected = {str(number): int(classes[number]) for number in np.flatnonzero(classes)}
    faults = {
        "points": read["points"] == read["pointCount"] == len(array),
        "places of points in nodes": read["outside"] == 0,
        "classes": read["classes"] == expected,
    }
    return [f"{path.name}: copc.js finds other {name}" for name, right in faults.items() if not right]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("surveys", nargs="+", metavar="SURVEY")
    parser.add_argument("--node-modules", type=Path, help="folder in which copc.js is")
    options = parser.parse_args()
    wrong = []
    for survey in options.surveys:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            progress(f"{survey}: exporting")
            runs = measured(survey, folder)
            rows = []
            for form, run in zip(("laz", "copc"), runs, strict=True):
                size = sum(path.stat().st_size for path in (folder / form).glob("*.laz"))
                rows.append((form.upper(), run["cpu"], run["peak"] / 1e6, size / 1e6))
            print_table(f"Points of {survey} with classes", ["form", "CPU s", "peak MB", "size MB"], rows)
            progress(f"{survey}: reading")
            wrong += differences(folder, options.node_modules)
    print("\n".join(wrong) or "all points, levels and classes as they should be")
    raise SystemExit(1 if wrong else 0)


if __name__ == "__main__":
    main()
