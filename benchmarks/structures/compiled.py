"""Programs in C++ that peers are made of: compiled once, given points, their results read."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
from numpy.typing import DTypeLike

from tunneldb.arrays import Float

RESULTS = Path(__file__).parent.parent / "results"


def build(name: str, flags: list[str], libraries: list[str]) -> Path:
    """Compile ``name.cpp``, unless that was done since it was changed; the program."""
    source, program = Path(__file__).with_name(f"{name}.cpp"), RESULTS / name
    if not (program.exists() and program.stat().st_mtime > source.stat().st_mtime):
        RESULTS.mkdir(exist_ok=True)
        subprocess.run(["g++", "-O2", "-w", *flags, str(source), "-o", str(program), *libraries], check=True)
    return program


def run(program: Path, xyz: Float, arguments: list[float], dtype: DTypeLike, folder: Path) -> tuple[np.ndarray, float]:
    """Give a program points (n, 3) and arguments: what it says of each point, (n,) of that type, and seconds."""
    points, result = folder / f"{program.name}.points", folder / f"{program.name}.result"
    xyz.astype(np.float32).tofile(points)
    command = [str(argument) for argument in (program, points, *arguments, result)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    rows = np.fromfile(result, dtype=dtype)
    points.unlink()
    result.unlink()
    return rows, sum(map(float, done.stdout.split()))
