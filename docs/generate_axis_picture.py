"""Draw a made-up deviation from a published alignment: ``docs/images/axis-deviation.png``.

    python docs/generate_axis_picture.py

The alignment is the Japanese sample in ``tests/data``; see the README there.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tunneldb.alignment.design import Design
from tunneldb.alignment.deviation import Deviation, Part
from tunneldb.alignment.given import read_given
from tunneldb.export.figures.axis_deviation import write_deviation
from tunneldb.geometry.stationing import Equation, Stationing

ROOT = Path(__file__).parents[1]
ROAD = ROOT / "tests" / "data" / "j-landxml.xml"
IMAGE = ROOT / "docs" / "images" / "axis-deviation.png"


def parts(design: Design) -> list[Part]:
    """Return the elements, as in view alignment_element."""
    found = []
    for element, begin in zip(design.plan, design.start + design.distances, strict=False):
        radii = [1 / abs(c) if c else None for c in (element.curvature_from, element.curvature_to)]
        turn = {1.0: "left", -1.0: "right"}.get(float(np.sign(element.curvature_from + element.curvature_to)))
        found.append(Part("horizontal", element.kind, turn, begin, begin + element.length, "", "", *radii, None, None))
    for curve in design.profile:
        begin = design.start + curve.distance
        grades = (100 * curve.grade_from, 100 * curve.grade_to)
        found.append(Part("vertical", curve.kind, None, begin, begin + curve.length, "", "", None, None, *grades))
    return found


def main() -> None:
    """Draw it."""
    design = read_given(ROAD).design
    assert design is not None
    rng = np.random.default_rng(3)
    chainage = np.arange(np.ceil(design.start / 10), design.chainages[1] / 10) * 10
    source = ["interpolated" if n % 23 == 7 else "edited" if n % 31 == 5 else "measured" for n in range(len(chainage))]
    stationing = Stationing([Equation(design.start + p.distance, p.station, p.direction) for p in design.pieces])
    deviation = Deviation(
        survey="demo-2024",
        design=ROAD.name,
        chainage=chainage,
        label=tuple(stationing.label(at) for at in chainage.tolist()),
        source=tuple(source),
        to_right=0.02 * np.sin(chainage / 90) + 0.003 * rng.standard_normal(len(chainage)),
        up=-0.015 + 0.01 * np.cos(chainage / 150) + 0.002 * rng.standard_normal(len(chainage)),
        vertices=design.position(chainage - design.start),
        elements=tuple(parts(design)),
        stationing=stationing,
    )
    write_deviation(deviation, IMAGE)


if __name__ == "__main__":
    main()
