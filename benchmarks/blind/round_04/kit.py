"""What hangs on walls and lies on the floor: rails, cables on hooks, lamps, plates."""

from __future__ import annotations

from .geometry import Bar, Material, Section, Tube
from .sheet import Stain, rect, runs
from .trace import Box

BLACK = Material(-10.5, 0.2, 0.02)
GREY = Material(-6.5, 0.2, 0.03)
STEEL = Material(-5.5, 0.25, 0.15)
ZINC = Material(-4.5, 0.2, 0.25)
LAMP = Material(-3.5, 0.1, 0.3)
RUST = Material(-8.5, 0.4)
CONCRETE = Material(-5.0, 0.4)
PLATE = Material(-1.5, 0.1, 0.1)
NICHE = Material(-8.0, 0.4)


def rails(*tracks: float) -> list[Tube | Bar]:
    """Rails of tracks, head at level 0."""
    return [Bar(u + side * 0.7525, -0.08, 0.07, 0.16, STEEL) for u in tracks for side in (-1, 1)]


def cables(section: Section, side: int, height: float, radii: list[float], material: Material = BLACK) -> list[Tube | Bar]:
    """Cables above one another on hooks, 3 cm off the wall."""
    out: list[Tube | Bar] = []
    for r in radii:
        out.append(Tube(*section.off_wall(side, height, r + 0.03), r, material))
        height += 2 * r + 0.05
    return out


def hooks(section: Section, side: int, height: float, first: float, length: float, spacing: float, size: float) -> list[Box]:
    """Hooks of cables, flat iron down the wall."""
    l = section.l_at(side, height)  # noqa: E741
    return [Box(first + k * spacing, l, 0.04, size, 0.03, RUST) for k in range(int((length - first) / spacing) + 1)]


def tin(section: Section, s: float, l0: float, l1: float, width: float) -> list[Box]:
    """Sheet metal under the vault from l0 to l1 that leads drips aside, bent to its curve."""
    count = max(int((l1 - l0) / 0.35), 1)
    step = (l1 - l0) / count
    return [Box(s, l0 + (k + 0.5) * step, width, step, 0.02, ZINC, gap=0.07) for k in range(count)]


def lamps(section: Section, side: int, height: float, at: list[float], long: float = 0.65) -> list[Box]:
    """Lamps on a wall."""
    return [Box(s, section.l_at(side, height), long, 0.16, 0.11, LAMP, gap=0.02) for s in at]


def rust_below(section: Section, side: int, height: float, at: list[float], length: float = 0.5) -> list[Stain]:
    """Dry stains of rust under iron."""
    l = section.l_at(side, height)  # noqa: E741
    return [Stain("rust stain", 2.2, runs(s, l, length, 0.05, 0.13), rim=0.04, ragged=0.012, fade=0.4) for s in at]


def number(s: float, l: float) -> list[Stain]:  # noqa: E741
    """A chainage painted in white and black on the wall."""
    return [
        Stain("paint", -3.5, rect(s, s + 0.55, l - 0.18, l + 0.18), rim=0.01, ragged=0.0, mottle=0.06),
        *(
            Stain(
                "paint",
                5.5,
                rect(s + 0.08 + 0.15 * k, s + 0.16 + 0.15 * k, l - 0.12, l + 0.12),
                rim=0.01,
                ragged=0.0,
                mottle=0.04,
            )
            for k in range(3)
        ),
    ]
