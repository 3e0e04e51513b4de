"""What the stage ``detect`` states about a kilometre in the ledger: roughness, and notes on what limits the search."""

from __future__ import annotations

import numpy as np

from tunneldb.radiometry.roughness import Roughness
from tunneldb.raster.pixel_size import SMALLEST
from tunneldb.raster.rasterize import Counts


def describe(counts: Counts, roughness: Roughness, known_before: list[str | None], other_pixels: list[int]) -> Counts:
    """Return the ledger's values on the roughness, and the notes.

    Parameters
    ----------
    counts : dict
        Points that were read and seen.
    roughness : Roughness
        Of the lining.
    known_before : list of str or None
        Notes on the survey, its calibration, its evidence model and its detectability.
    other_pixels : list of int
        Adjacent kilometres whose pixels have another size.
    """

    def known(value: float, digits: int) -> float | None:
        return round(value, digits) if np.isfinite(value) else None

    report: Counts = {
        "roughness": known(roughness.sigma, 2),
        "roughness_determined": roughness.determined,
        "roughness_contrast_db": known(roughness.contrast, 3),
        "regions": roughness.regions,
        "incidence_from": known(roughness.incidence_from, 1),
        "incidence_to": known(roughness.incidence_to, 1),
    }
    notes = [note for note in (*known_before, roughness.note) if note]
    if other_pixels:
        notes.append(
            f"leaks across the boundary to kilometre {' and '.join(map(str, other_pixels))} are in two pieces: its pixels have"
            f" another size; run detect on both with --set image.pixel={counts['pixel']:g}"
        )
    if (sparse := counts.get("sparse")) is not None:
        notes.append(
            f"{100.0 * sparse:.3g} % of the lining has fewer than {counts['least_density']:g} points/m², too few to"
            " distinguish wet from dry: it was not searched for leaks and counts as not inspected (image.min_density)"
        )
    if (spacing := counts.get("profile_spacing")) is not None:
        notes.append(
            f"profiles {spacing:g} m apart: between them the images show the nearest one; the ends of leaks along the"
            f" tunnel are uncertain by {0.5 * spacing:.2g} m, and those shorter than {spacing:g} m may be missed"
        )
    if counts.get("bands_area"):
        notes.append(
            f"dark bands along the tunnel, {counts['bands_area']:.1f} m²: wet or dirty is not decided (tunnel_api.dark_band);"
            " draw a leak over them, or a dry region and run detect again"
        )
    notes += pixel_note(counts)
    if notes:
        report["note"] = "; ".join(notes)
    return report


def pixel_note(counts: Counts) -> list[str]:
    """Return the note on pixels that were enlarged."""
    if (density := counts.get("density")) is None:
        return []
    return [
        f"half of the lining has fewer than {density} points/m²: pixels of {counts['pixel']:g} m instead of {SMALLEST:g} m;"
        " small leaks may be missed"
    ]
