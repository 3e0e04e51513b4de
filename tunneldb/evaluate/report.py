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
from tunneldb.evaluate.measure import HALF, Comparison, Figures, figures

DISTANCES = (5.0, 10.0)
"""Limits between groups of leaks by the distance from the nearest scanner position, m."""

COUNT_HEADER = ("true", "touched", "found", "recall", "called", "right", "false", "precision", "F1", "IoU")
AREA_HEADER = (
    "area", "true m²", "found m²", "recall", "precision", "F1", "IoU", "area error", "p95", "edge mm", "p95",
)  # fmt: skip


@dataclass(frozen=True)
class Subject:
    """What is held against a truth, and how it is told.

    Attributes
    ----------
    name : str
        Of several.
    surface : str
        On what they are sought.
    square_metres : int
        Area to which false ones are told.
    sizes : tuple of float
        Limits between groups by area, m².
    decimals : int
        Of areas, m².
    place : dict of str to (str, str)
        Heading and format of what tells the place of one.
    """

    name: str
    surface: str
    square_metres: int
    sizes: tuple[float, ...]
    decimals: int
    place: dict[str, tuple[str, str]]

    @property
    def count_header(self) -> tuple[str, ...]:
        """Headings of `count_rows`."""
        return (self.name, *COUNT_HEADER)

    @property
    def list_header(self) -> tuple[str, ...]:
        """Headings of `list_rows`."""
        return ("", "id", *(heading for heading, _ in self.place.values()), "area m²", "of it", "distance m")


LEAKS = Subject("leaks", "lining", 1000, (0.3, 1.0), 2, {"chainage": ("chainage", ".2f"), "arc": ("arc m", "+.2f")})
SPOTS = Subject("spots", "faces", 100, (0.03, 0.1), 4, {"member": ("member", "d"), "face": ("face", "d")})


@dataclass(frozen=True)
class Item:
    """A leak or spot that was held against the others.

    Attributes
    ----------
    id : str
        What its file or the database calls it.
    place : dict
        Where it is: of a leak chainage and arc of a point inside it, m; of a spot member and face, None where it lies on none,
        and x, y and z of a point inside it, m.
    area : float
        m².
    share : float
        Share of it that is found, of a true leak, or that is true, of a found one.
    touched : bool
        Whether it touches any of the others.
    iou, area_error : float or None
        Of the true leak's group; None where it has none.
    distance : float or None
        From the nearest scanner position, m.
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
    """An evaluation.

    Attributes
    ----------
    groups : dict of str to Figures
        Of all leaks under ``all``, then by size, then by distance.
    true, found : list of Item
        True leaks that are demanded and found leaks that count.
    seen : float
        Lining that was seen, m².
    subject : Subject
    """

    groups: dict[str, Figures]
    true: list[Item]
    found: list[Item]
    seen: float
    subject: Subject

    @property
    def missed(self) -> list[Item]:
        """True leaks of which less than half was found."""
        return [leak for leak in self.true if leak.share < HALF]

    @property
    def wrong(self) -> list[Item]:
        """Found leaks of which less than half is true; those that touch no true leak are false."""
        return [leak for leak in self.found if leak.share < HALF]


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
    """Sum a comparison up, for all leaks and by groups.

    Parameters
    ----------
    comparison : Comparison
        Of n true and m found leaks.
    true_ids, found_ids : sequences of str
        Of all leaks that were given to the comparison.
    distances : two float arrays
        Of the n true and the m found leaks from the nearest scanner position, m.
    min_area : float
        m²; the first group by size begins there.
    seen : float
        Lining that was seen, m².
    subject : Subject
        What they are; here they are called leaks.
    places : two sequences of dict, optional
        Of the n true and the m found leaks; by default chainage and arc, of shapes in the unrolled plane.
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
    """Names and limits of groups from a first value on; the first group takes in what is less."""
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
    """How many leaks were found, group by group."""
    return [
        [name, str(f.true), str(f.touched), str(f.found), _share(f.recall), str(f.called), str(f.right), str(f.false),
         _share(f.precision), _share(f.f1), _share(f.iou)]
        for name, f in report.groups.items()
    ]  # fmt: skip


def area_rows(report: Report) -> list[list[str]]:
    """How much of their area was found, and how near to their edges, group by group."""
    size = report.subject.decimals
    return [
        [name, f"{f.true_area:.{size}f}", f"{f.found_area:.{size}f}", _share(f.area_recall), _share(f.area_precision),
         _share(f.area_f1), _share(f.area_iou), _percent(f.area_error), _percent(f.area_error_p95),
         _millimetres(f.edge), _millimetres(f.edge_p95)]
        for name, f in report.groups.items()
    ]  # fmt: skip


def list_rows(report: Report) -> list[list[str]]:
    """True leaks that were missed, and found ones that are wrong."""
    rows, subject = [], report.subject
    for what, leaks in (("missed", report.missed), ("wrong", report.wrong)):
        for leak in leaks:
            word = what if leak.touched or what == "missed" else "false"
            far = "" if leak.distance is None else f"{leak.distance:.1f}"
            at = ["" if leak.place[key] is None else f"{leak.place[key]:{form}}" for key, (_, form) in subject.place.items()]
            rows.append([word, leak.id, *at, f"{leak.area:.{subject.decimals}f}", _percent(leak.share), far])
    return rows


def false_line(report: Report) -> str:
    """Say how many false leaks there are for each 1000 m² of lining, or what else they are and lie on."""
    of_all, subject = report.groups["all"], report.subject
    if not math.isfinite(of_all.false_per_1000):
        return f"{of_all.false} false {subject.name}; how much {subject.surface} was seen is not known"
    false = of_all.false_per_1000 * subject.square_metres / 1000.0
    return (
        f"{false:.2f} false {subject.name} for each {subject.square_metres} m² of the {report.seen:.0f} m² of"
        f" {subject.surface} that were seen"
    )


def as_values(report: Report, about: dict[str, Any]) -> dict[str, Any]:
    """Return all figures, and each leak, as plain values; what can't be told is None."""
    return {
        **about,
        "seen_m2": _known(report.seen),
        "groups": [{"group": name, **_plain(of)} for name, of in report.groups.items()],
        "true": [_plain_item(leak) for leak in report.true],
        "found": [_plain_item(leak) for leak in report.found],
    }


def as_json(report: Report, about: dict[str, Any]) -> str:
    """Write all figures, and each leak, as JSON; what can't be told is null."""
    return json.dumps(as_values(report, about), ensure_ascii=False, allow_nan=False, indent=1) + "\n"


def as_csv(report: Report) -> str:
    """Write the figures as CSV, a row for each group; what can't be told is empty."""
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
