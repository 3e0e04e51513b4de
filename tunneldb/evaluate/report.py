"""Figures of an evaluation as tables, JSON and CSV."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np
import shapely

from tunneldb.arrays import Float
from tunneldb.csvfile import write_csv
from tunneldb.evaluate.measure import MIN_OVERLAP, Comparison, Figures, figures

DISTANCES = (5.0, 10.0)
"""Limits of groups of leaks by distance from the nearest scanner position, m."""

COUNT_HEADER = ("true", "touched", "found", "recall", "called", "right", "false", "precision", "F1", "IoU")
AREA_HEADER = (
    "area", "true m²", "found m²", "recall", "precision", "F1", "IoU", "area error", "p95", "edge mm", "p95",
)  # fmt: skip


@dataclass(frozen=True)
class Subject:
    """Objects that are compared with reference data, with their terms.

    Attributes
    ----------
    name : str
        Name of several objects, plural.
    surface : str
        Name of the surface on which they are detected.
    square_metres : int
        Reference area for the number of false ones, m².
    sizes : tuple of float
        Limits of groups by area, m².
    decimals : int
        Decimals of areas in m².
    place : dict of str to (str, str)
        Heading and format of each column that gives the place.
    """

    name: str
    surface: str
    square_metres: int
    sizes: tuple[float, ...]
    decimals: int
    place: dict[str, tuple[str, str]]

    @property
    def count_header(self) -> tuple[str, ...]:
        """Column headings of `count_rows`."""
        return (self.name, *COUNT_HEADER)

    @property
    def list_header(self) -> tuple[str, ...]:
        """Column headings of `list_rows`."""
        return ("", "id", *(heading for heading, _ in self.place.values()), "area m²", "of it", "distance m")


LEAKS = Subject("leaks", "lining", 1000, (0.3, 1.0), 2, {"chainage": ("chainage", ".2f"), "arc": ("arc m", "+.2f")})
SPOTS = Subject("spots", "faces", 100, (0.03, 0.1), 4, {"member": ("member", "d"), "face": ("face", "d")})


@dataclass(frozen=True)
class Item:
    """Leak or spot that was compared with the others.

    Attributes
    ----------
    id : str
        Identifier in its file or in the database.
    place : dict
        Place: for a leak, chainage and arc of a point inside it, m; for a spot, member and face (None if it is on none), and x,
        y and z of a point inside it, m.
    area : float
        Area, m².
    share : float
        Share that is found, for a true leak; share that is true, for a found one.
    touched : bool
        True if it touches any of the others.
    iou, area_error : float or None
        Values of the true leak's group; None if it has none.
    distance : float or None
        Distance from the nearest scanner position, m.
    """

    id: str
    place: dict[str, Any]
    area: float
    share: float
    touched: bool
    iou: float | None
    area_error: float | None
    distance: float | None


@dataclass(frozen=True)
class Report:
    """Result of an evaluation.

    Attributes
    ----------
    groups : dict of str to Figures
        Figures of all leaks under ``all``, then by size, then by distance.
    true, found : list of Item
        Required true leaks, and found leaks that count.
    seen : float
        Inspected lining, m².
    subject : Subject
    """

    groups: dict[str, Figures]
    true: list[Item]
    found: list[Item]
    seen: float
    subject: Subject

    @property
    def missed(self) -> list[Item]:
        """True leaks that were found by less than half."""
        return [leak for leak in self.true if leak.share < MIN_OVERLAP]

    @property
    def wrong(self) -> list[Item]:
        """Found leaks that are true by less than half; those that touch no true leak are false."""
        return [leak for leak in self.found if leak.share < MIN_OVERLAP]


def make_report(
    comparison: Comparison,
    true_ids: Sequence[str],
    found_ids: Sequence[str],
    distances: tuple[Float, Float],
    min_area: float,
    seen: float,
    subject: Subject = LEAKS,
    places: tuple[Sequence[dict[str, Any]], Sequence[dict[str, Any]]] | None = None,
) -> Report:
    """Return the figures of a comparison, for all leaks and by groups.

    Parameters
    ----------
    comparison : Comparison
        Comparison of n true and m found leaks.
    true_ids, found_ids : sequences of str
        Identifiers of all leaks that were compared.
    distances : two float arrays
        Distances of the n true and the m found leaks from the nearest scanner position, m.
    min_area : float
        Lower limit of the first group by size, m².
    seen : float
        Inspected lining, m².
    subject : Subject
        Kind of the objects; called leaks here.
    places : two sequences of dict, optional
        Places of the n true and the m found leaks; by default chainage and arc of shapes in the unrolled plane.
    """
    c = comparison
    if places is None:
        places = [_unrolled(shape) for shape in c.true_shape], [_unrolled(shape) for shape in c.found_shape]
    groups = {"all": figures(c, seen)}
    for name, low, high in _ranges(min_area, subject.sizes, "m²"):
        groups[name] = figures(c, np.nan, *((low <= area) & (area < high) for area in (c.true_area, c.found_area)))
    for name, low, high in _ranges(0.0, DISTANCES, "m"):
        groups[name] = figures(c, np.nan, *((low <= far) & (far < high) for far in distances))
    true = [
        _item(
            true_ids[k],
            places[0][i],
            c.true_shape[i],
            c.covered[i],
            c.true_group[i],
            distances[0][i],
            c.iou[i],
            c.area_error[i],
        )
        for i, k in enumerate(c.true)
    ]
    found = [
        _item(found_ids[k], places[1][i], c.found_shape[i], c.right[i], c.found_group[i], distances[1][i])
        for i, k in enumerate(c.found)
    ]
    return Report(groups, true, found, seen, subject)


def _ranges(first: float, limits: Sequence[float], unit: str) -> list[tuple[str, float, float]]:
    """Return names and limits of groups from a first value on; the first group includes smaller values."""
    edges = [first, *(limit for limit in limits if limit > first)]
    ends = [*edges[1:], math.inf]
    return [
        (f"{low:g} to {high:g} {unit}" if math.isfinite(high) else f"{low:g} {unit} and more", low if k else 0.0, high)
        for k, (low, high) in enumerate(zip(edges, ends, strict=True))
    ]


def _unrolled(shape: Any) -> dict[str, Any]:
    inside = shapely.point_on_surface(shape)
    return {"chainage": float(inside.x), "arc": float(inside.y)}


def _item(
    key: str, place: dict[str, Any], shape: Any, share: float, group: int, distance: float, iou: float = math.nan,
    area_error: float = math.nan,
) -> Item:  # fmt: skip
    return Item(
        key, place, float(shape.area), float(share), bool(group >= 0), _known(iou), _known(area_error), _known(distance)
    )


def count_rows(report: Report) -> list[list[str]]:
    """Return the numbers of found leaks, group by group."""
    return [
        [name, str(f.true), str(f.touched), str(f.found), _share(f.recall), str(f.called), str(f.right), str(f.false),
         _share(f.precision), _share(f.f1), _share(f.iou)]
        for name, f in report.groups.items()
    ]  # fmt: skip


def area_rows(report: Report) -> list[list[str]]:
    """Return the found area and the accuracy of edges, group by group."""
    size = report.subject.decimals
    return [
        [name, f"{f.true_area:.{size}f}", f"{f.found_area:.{size}f}", _share(f.area_recall), _share(f.area_precision),
         _share(f.area_f1), _share(f.area_iou), _percent(f.area_error), _percent(f.area_error_p95),
         _millimetres(f.edge), _millimetres(f.edge_p95)]
        for name, f in report.groups.items()
    ]  # fmt: skip


def list_rows(report: Report) -> list[list[str]]:
    """Return the true leaks that were missed, and the found ones that are wrong."""
    rows, subject = [], report.subject
    for what, leaks in (("missed", report.missed), ("wrong", report.wrong)):
        for leak in leaks:
            word = what if leak.touched or what == "missed" else "false"
            far = "" if leak.distance is None else f"{leak.distance:.1f}"
            at = ["" if leak.place[key] is None else f"{leak.place[key]:{form}}" for key, (_, form) in subject.place.items()]
            rows.append([word, leak.id, *at, f"{leak.area:.{subject.decimals}f}", _percent(leak.share), far])
    return rows


def false_line(report: Report) -> str:
    """Return the number of false leaks per 1000 m² of lining, or of other objects on another surface."""
    of_all, subject = report.groups["all"], report.subject
    if not math.isfinite(of_all.false_per_1000):
        return f"{of_all.false} false {subject.name}; the inspected area of {subject.surface} is unknown"
    false = of_all.false_per_1000 * subject.square_metres / 1000.0
    return (
        f"{false:.2f} false {subject.name} per {subject.square_metres} m² of the {report.seen:.0f} m² of"
        f" inspected {subject.surface}"
    )


def as_values(report: Report, about: dict[str, Any]) -> dict[str, Any]:
    """Return all figures, and each leak, as plain values; undefined values are None."""
    return {
        **about,
        "seen_m2": _known(report.seen),
        "groups": [{"group": name, **_plain(of)} for name, of in report.groups.items()],
        "true": [_plain_item(leak) for leak in report.true],
        "found": [_plain_item(leak) for leak in report.found],
    }


def as_json(report: Report, about: dict[str, Any]) -> str:
    """Return all figures, and each leak, as JSON; undefined values are null."""
    return json.dumps(as_values(report, about), ensure_ascii=False, allow_nan=False, indent=1) + "\n"


def as_csv(report: Report) -> str:
    """Return the figures as CSV, a row per group; undefined values are empty."""
    names = ["group", *(field.name for field in fields(Figures))]
    return write_csv(names, ([name, *_plain(of).values()] for name, of in report.groups.items()))


def _plain_item(item: Item) -> dict[str, Any]:
    values = asdict(item)
    return {"id": values.pop("id"), **values.pop("place"), **values}


def _plain(of: Figures) -> dict[str, int | float | None]:
    return {name: value if isinstance(value, int) else _known(value) for name, value in asdict(of).items()}


def _known(value: float) -> float | None:
    return round(float(value), 5) if math.isfinite(value) else None


def _share(value: float) -> str:
    return f"{value:.3f}" if math.isfinite(value) else ""


def _percent(value: float) -> str:
    return f"{100.0 * value:.0f} %" if math.isfinite(value) else ""


def _millimetres(value: float) -> str:
    return f"{1000.0 * value:.0f}" if math.isfinite(value) else ""
