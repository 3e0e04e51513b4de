"""Range curves found on the lining (``--reference auto``) against those that the simulation was made with.

    python -m benchmarks.reference [--seeds 3] [--length 60]

Static stations in circular, horseshoe and box sections, linings and roughness changing from seed to seed, with both courses
of the range term. Points of survey density on the lining, with true range and incidence: what is measured is the estimator, not
the surface. A curve is known but for a constant, so the mean difference over the ranges present is taken off. Then a profiler
in the middle of a circular section, whose ranges and incidences say nothing: it must be refused.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from benchmarks.common import print_table, progress, save
from tunneldb.errors import UserError
from tunneldb.pointcloud.thinning import thin, voxel_edge
from tunneldb.radiometry.cells import IntensitySamples
from tunneldb.radiometry.range_curve import estimate_range_curve
from tunneldb.simulate.generate import Cloud, simulate
from tunneldb.simulate.parameters import Parameters
from tunneldb.simulate.radiometry import range_term

LINING, NEAR = 0, 0.05  # class of the truth; farther off the surface points say nothing, m
LININGS = ("plain", "cast", "segments", "shotcrete", "tiles")
ROUGHNESS = (5.0, 10.0, 16.0, 22.0, 30.0)
HEADER = (
    "tunnel", "seed", "roughness", "found", "m", "to m", "rms dB", "max dB", "at m", "said dB", "refused",
)  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--length", type=float, default=60.0, help="of each tunnel, m")
    arguments = parser.parse_args()
    rows = []
    for k, section in enumerate(("circular", "horseshoe", "box")):
        for course in ("near_loss", "inverse_square"):
            for seed in range(1, arguments.seeds + 1):
                number = (k + 3 * seed + 2 * (course == "near_loss")) % len(LININGS)
                parameters = Parameters(
                    length=arguments.length, section=section, scanner="static", station_spacing=12.0, angular_step=0.25,
                    seed=seed, range_curve=course, lining=LININGS[number], soot=1.5,
                    roughness=ROUGHNESS[(number + seed) % len(ROUGHNESS)], leak_drop=(1.5, 8.0),
                )  # fmt: skip
                progress(f"{section} {LININGS[number]} {course}, seed {seed}")
                rows.append(measured(parameters, f"{section} {LININGS[number]} {course}"))
    for seed in range(1, arguments.seeds + 1):
        centred = Parameters(
            length=min(arguments.length, 30.0), section="circular", scanner="profiler", profile_spacing=0.05,
            profile_points=600, scanner_height=2.8, scanner_offset=0.0, seed=seed,
        )  # fmt: skip
        rows.append(measured(centred, "centred profiler"))
    print_table("Range curves found on the lining", HEADER, [list(row.values()) for row in rows])
    print(f"\n{save('reference', {'curves': rows})}")


def measured(parameters: Parameters, name: str) -> dict[str, Any]:
    """Difference of the curve found from the true one over the ranges present, dB, and whether it was refused."""
    cloud = simulate(parameters)
    near = (cloud.klass == LINING) & (np.abs(cloud.offset) <= NEAR)
    chosen = np.flatnonzero(near & thin(cloud.xyz, voxel_edge(100.0)))
    out: dict[str, Any] = {"tunnel": name, "seed": parameters.seed, "roughness": parameters.roughness}
    try:
        found = estimate_range_curve(_seen(cloud, chosen))
    except UserError as error:
        return out | dict.fromkeys(("found", "m", "to", "rms", "max", "at", "said"), "") | {"refused": str(error)[:60]}
    at = np.linspace(found.nearest, found.farthest, 200)
    ranges = cloud.range[chosen].astype(np.float64)
    weight = np.histogram(ranges, bins=200, range=(found.nearest, found.farthest))[0]
    difference = found.curve(at) - range_term(at, near_loss=parameters.range_curve == "near_loss")
    difference -= np.average(difference, weights=weight)
    refused = ""
    try:
        found.require()
    except UserError as error:
        refused = str(error)[:60]
    worst = int(np.argmax(np.abs(difference)))
    return out | {
        "found": found.roughness,
        "m": found.nearest,
        "to": found.farthest,
        "rms": float(np.sqrt(np.average(difference**2, weights=weight))),
        "max": float(np.abs(difference[worst])),
        "at": float(at[worst]),
        "said": found.worst[0],
        "refused": refused,
    }


def _seen(cloud: Cloud, chosen: np.ndarray) -> IntensitySamples:
    """Some points as they were seen."""
    place = np.column_stack([cloud.chainage[chosen], cloud.arc[chosen].astype(np.float64)])
    columns = cloud.range[chosen], np.cos(cloud.incidence[chosen]), cloud.amplitude[chosen]
    return IntensitySamples(place, cloud.scan_id[chosen], *(column.astype(np.float64) for column in columns))


if __name__ == "__main__":
    main()
