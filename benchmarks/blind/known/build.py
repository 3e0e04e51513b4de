"""What scenes have in common: a site with a floor, fittings, and the writing of all files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.blind.known.axis import Axis
from benchmarks.blind.known.equipment import boxes, tube
from benchmarks.blind.known.files import write_cloud, write_tables, write_truth
from benchmarks.blind.known.record import Optics, scan
from benchmarks.blind.known.scanner import Profiler, Stations
from benchmarks.blind.known.section import Array, Section
from benchmarks.blind.known.site import Site
from benchmarks.blind.known.surface import Surface

BLACK, GALVANISED, PLASTIC = -11.5, -5.0, -9.5


@dataclass(frozen=True)
class Job:
    """A site, who scans it, and how its echoes come about."""

    site: Site
    scanner: Stations | Profiler
    optics: Optics


def produce(build: Callable[[], Job], seed: int, folder: Path) -> None:
    """Build a site, scan it and write everything."""
    job = build()
    cloud = scan(job.site, job.scanner, job.optics, np.random.default_rng(seed + 10_000))
    write_tables(job.site, job.scanner, cloud, job.optics.instrument, folder)
    write_truth(job.site, cloud, folder)
    write_cloud(job.site, cloud, folder / "scan.laz")


def new_site(
    parts: Sequence[tuple[float, float]],
    length: float,
    seed: int,
    axis: Axis,
    dust: float = 0.7,
    floor: float = -2.0,
    fine: float = 0.15,
) -> Site:
    """A plain lining: smooth variation of 0.3 dB, fine texture, dust (dB) at the foot, a floor of its own tone."""
    rng = np.random.default_rng(seed)
    section = Section(parts)
    surface = Surface(length, section.lining, section.total, rng)
    surface.add_smooth(0.3, 1.4)
    surface.add_fine(fine, 0.02)

    def profile(s: Array) -> Array:
        from_foot = np.clip(np.minimum(s, section.lining - s), 0.0, None)
        value: Array = np.where(s > section.lining, floor, dust * np.exp(-((from_foot / 0.28) ** 2)))
        return value

    surface.add_by_s(profile)
    return Site(section, axis, length, surface, rng)


def rails(site: Site, gauge: float = 1.435) -> None:
    """Two rails on the floor."""
    section = site.section
    for y in (-0.5 * gauge, 0.5 * gauge):
        s = section.lining + float(section.y[0]) + y
        site.items.append(boxes(section, s, 0.035, (0.0, 0.16), -8.0, (0.5 * site.length, 0.5 * site.length + 1.0)))


def kerb(site: Site, left: bool, width: float, height: float) -> None:
    """A walkway along the foot of one wall."""
    section = site.section
    foot = float(section.y[0])
    y = foot - 0.5 * width if left else -foot + 0.5 * width
    s = section.lining + foot + y
    site.items.append(boxes(section, s, 0.5 * width, (0.0, height), -5.5, (0.5 * site.length, 0.5 * site.length + 1.0)))


def conduit(site: Site, s: float, gap: float, radius: float, colour: float, clip: float = 1.5, sag: float = 0.0) -> None:
    """A cable or pipe along the whole tunnel with clips."""
    site.items.append(tube(site.section, s, gap, radius, colour, (-1.0, site.length + 1.0), sag))
    count = int(site.length / clip)
    high = gap + 2.0 * radius + 0.004
    site.items.append(boxes(site.section, s, radius + 0.008, (0.0, high), GALVANISED, (0.5 * clip, 0.015), (clip, count)))


def bundle(site: Site, s: float, count: int, pitch: float = 1.0) -> float:
    """Cables of 2 to 5 cm on brackets, 2 to 12 cm off the wall, sagging; returns the bundle's half height."""
    rng, section = site.rng, site.section
    radii = rng.uniform(0.010, 0.025, count)
    places = np.concatenate([[0.0], np.cumsum(radii[:-1] + radii[1:] + rng.uniform(0.012, 0.035, count - 1))])
    places -= 0.5 * places[-1]
    along = (-1.0, site.length + 1.0)
    number = int(site.length / pitch)
    for radius, place in zip(radii, places, strict=True):
        gap = float(rng.uniform(0.02, 0.115 - 2 * radius + 0.02))
        sag = float(rng.uniform(0.01, 0.02))
        colour = float(rng.choice([BLACK, BLACK + 1.0, PLASTIC + 1.5]))
        site.items.append(tube(section, s + float(place), gap, float(radius), colour, along, sag))
        arm = boxes(section, s + float(place), 0.008, (0.0, gap), GALVANISED, (0.0, 0.012), (pitch, number + 1))
        site.items.append(arm)
    half = float(places[-1]) + 0.05
    site.items.append(boxes(section, s, half, (0.0, 0.018), GALVANISED, (0.0, 0.02), (pitch, number + 1)))
    return half
