"""Pitch of rings by their joints, from images of linings whose rings are known: joints only, dirty, leaking; and without rings.

python -m benchmarks.ring_joints     # 100 rings each of 1.0 to 2.0 m: some minutes

The level of the lining is the simulator's, at two places anywhere in each pixel of 2 cm; noise of 0.35 dB and 3 mm a pixel is
added. No scan is made: what a scanner's geometry adds is not in it.
"""

from __future__ import annotations

import time

import numpy as np
import shapely

from benchmarks.common import print_table, progress, save
from tunneldb.arrays import Float
from tunneldb.measures.rings.compute.joints import NoRingsError, column_signals, follow, peaks, ring_length, strength
from tunneldb.simulate.generate import Simulation
from tunneldb.simulate.lining.reflectance import level
from tunneldb.simulate.parameters import Parameters

PITCHES, RINGS, PIXEL, HALF = (1.0, 1.5, 2.0), 100, 0.02, 7.0
BLOCK, POINTS = 50.0, 2  # m; in a pixel
KINDS: dict[str, dict[str, object]] = {
    "joints only": {"leaks": 0},
    "dirty": {"leaks": 4, "soot": 4.0, "grime": 3.0, "salts": 3.0, "paint": 4, "patches": 6},
    "leaking": {"leaks": 25, "joint_leaks": 10, "ring_leaks": 2, "drips": True},
    "no rings": {"leaks": 10, "lining": "plain", "soot": 2.0},
}


def joints(kind: str, pitch: float) -> tuple[Float, float, float]:
    """Joints found, true place of the first one, and seconds that the search took."""
    asked: dict[str, object] = {"lining": "segments", **KINDS[kind]}
    if asked["lining"] == "segments":
        asked["ring"] = pitch
    made = Simulation(Parameters(name="joints", length=round(RINGS * pitch), radius=0.0, seed=round(100 * pitch), **asked))  # type: ignore[arg-type]
    assert made.reflectance is not None
    wet = shapely.union_all([leak.polygon for leak in made.leaks])
    random = np.random.default_rng(round(100 * pitch))
    start, end = made.tunnel.line.start, made.tunnel.line.end
    arc, signals, seconds = np.arange(-HALF, HALF, PIXEL), [], 0.0
    for low in np.arange(start, end - 1.0, BLOCK):
        chainage = np.arange(low, min(low + BLOCK, end), PIXEL) + PIXEL / 2
        s, a = (grid.ravel() for grid in np.meshgrid(chainage, arc))
        inside = (random.uniform(-PIXEL / 2, PIXEL / 2, (2, len(s))) for _ in range(POINTS))
        image = sum(level(made.reflectance, s + along, a + across) for along, across in inside) / POINTS
        image = image - 6.0 * shapely.contains_xy(wet, s, a) + random.normal(0.0, 0.35, len(s))
        offset = random.normal(0.0, 0.003, len(s))
        began = time.perf_counter()
        both = [values.reshape(len(arc), -1).astype(np.float32) for values in (image, offset)]
        signals.append(column_signals(both[0], both[1], PIXEL))
        seconds += time.perf_counter() - began
    began = time.perf_counter()
    at, weight = peaks(strength(np.concatenate(signals, axis=1), PIXEL), PIXEL)
    places = start + (at + 0.5) * PIXEL
    found = follow(places, weight, ring_length(places, weight))
    return found.chainage, made.rings.first, seconds + time.perf_counter() - began


def main() -> None:
    rows: list[tuple[object, ...]] = []
    for kind in KINDS:
        for pitch in PITCHES if kind != "no rings" else (1.5,):
            try:
                found, first, seconds = joints(kind, pitch)
            except NoRingsError as refused:
                rows.append((kind, pitch, "refused", str(refused), "", ""))
                progress(str(rows[-1]))
                continue
            mean = (found[-1] - found[0]) / (len(found) - 1)
            off = (found - first) / pitch
            wrong = 1e3 * pitch * np.abs(off - np.rint(off))
            within = float(np.quantile(wrong, 0.95))
            off_true = 1e3 * float(mean - pitch)
            rows.append((kind, pitch, len(found), round(off_true, 2), round(within, 1), round(seconds, 1)))
            progress(str(rows[-1]))
    header = ("lining", "pitch m", "joints", "found less true mm", "95 % of joints within mm", "s")
    print_table("pitch of 100 rings from their joints", header, rows)
    save("ring_joints", {"rows": rows})


if __name__ == "__main__":
    main()
