"""Figures of an evaluation as tables, JSON and CSV."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np
import shapely

from tunneldb.arrays import Float
from tunneldb.evaluate.measure import HALF, Comparison, Figures, figures

SIZES = (0.3, 1.0)
"""Limits between groups of leaks by area, m²."""

DISTANCES = (5.0, 10.0)
"""Limits between groups of leaks by the distance from the nearest scanner position, m."""

COUNT_HEADER = ("leaks", "true", "touched", "found", "recall", "called", "right", "false", "precision", "F1", "IoU")
AREA_HEADER = (
    "area", "true m²", "found m²", "recall", "precision", "F1", "IoU", "area error", "p95", "edge mm", "p95",
)  # fmt: skip
LIST_HEADER = ("", "id", "chainage", "arc m", "area m²", "of it", "distance m")


@dataclass(frozen=True)
class Leak:
    """A leak that was held against the others.

    Attributes
    ----------
    id : str
        What its file or the database calls it.
    chainage, arc : float
        Of a point inside it, m.
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
    chainage: float
    arc: float
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
    true, found : list of Leak
        True leaks that are demanded and found leaks that count.
    seen : float
        Lining that was seen, m².
    """

    groups: dict[str, Figures]
    true: list[Leak]
    found: list[Leak]
    seen: float

    @property
    def missed(self) -> list[Leak]:
        """True leaks of which less than half was found."""
        return [leak for leak in self.true if leak.share < HALF]

    @property
    def wrong(self) -> list[Leak]:
        """Found leaks of which less than half is true; those that touch no true leak are false."""
        return [leak for leak in self.found if leak.share < HALF]


def make_report(
    comparison: Comparison,
    true_ids: Sequence[str],
    found_ids: Sequence[str],
    distances: tuple[Float, Float],
    min_area: float,
    seen: float,
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
    """
    c = comparison
    groups = {"all": figures(c, seen)}
    for name, low, high in _ranges(min_area, SIZES, "m²"):
        groups[name] = figures(c, np.nan, *((low <= area) & (area < high) for area in (c.true_area, c.found_area)))
    for name, low, high in _ranges(0.0, DISTANCES, "m"):
        groups[name] = figures(c, np.nan, *((low <= far) & (far < high) for far in distances))
    true = [
        _leak(true_ids[k], c.true_shape[i], c.covered[i], c.true_group[i], distances[0][i], c.iou[i], c.area_error[i])
        for i, k in enumerate(c.true)
    ]
    found = [
        _leak(found_ids[k], c.found_shape[i], c.right[i], c.found_group[i], distances[1][i]) for i, k in enumerate(c.found)
    ]
    return Report(groups, true, found, seen)


def _ranges(first: float, limits: Sequence[float], unit: str) -> list[tuple[str, float, float]]:
    """Names and limits of groups from a first value on; the first group takes in what is less."""
    edges = [first, *(limit for limit in limits if limit > first)]
    ends = [*edges[1:], math.inf]
    return [
        (f"{low:g} to {high:g} {unit}" if math.isfinite(high) else f"{low:g} {unit} and more", low if k else 0.0, high)
        for k, (low, high) in enumerate(zip(edges, ends, strict=True))
    ]


def _leak(
    key: str, shape: Any, share: float, group: int, distance: float, iou: float = math.nan, area_error: float = math.nan
) -> Leak:
    inside = shapely.point_on_surface(shape)
    return Leak(
        key, float(inside.x), float(inside.y), float(shape.area), float(share), bool(group >= 0),
        _known(iou), _known(area_error), _known(distance),
    )  # fmt: skip


def count_rows(report: Report) -> list[list[str]]:
    """How many leaks were found, group by group."""
    return [
        [name, str(f.true), str(f.touched), str(f.found), _share(f.recall), str(f.called), str(f.right), str(f.false),
         _share(f.precision), _share(f.f1), _share(f.iou)]
        for name, f in report.groups.items()
    ]  # fmt: skip


def area_rows(report: Report) -> list[list[str]]:
    """How much of their area was found, and how near to their edges, group by group."""
    return [
        [name, f"{f.true_area:.2f}", f"{f.found_area:.2f}", _share(f.area_recall), _share(f.area_precision),
         _share(f.area_f1), _share(f.area_iou), _percent(f.area_error), _percent(f.area_error_p95),
         _millimetres(f.edge), _millimetres(f.edge_p95)]
        for name, f in report.groups.items()
    ]  # fmt: skip


def list_rows(report: Report) -> list[list[str]]:
    """True leaks that were missed, and found ones that are wrong."""
    rows = []
    for what, leaks in (("missed", report.missed), ("wrong", report.wrong)):
        for leak in leaks:
            word = what if leak.touched or what == "missed" else "false"
            far = "" if leak.distance is None else f"{leak.distance:.1f}"
            at = f"{leak.chainage:.2f}", f"{leak.arc:+.2f}", f"{leak.area:.2f}", _percent(leak.share)
            rows.append([word, leak.id, *at, far])
    return rows


def false_line(report: Report) -> str:
    """Say how many false leaks there are for each 1000 m² of lining."""
    of_all = report.groups["all"]
    if not math.isfinite(of_all.false_per_1000):
        return f"{of_all.false} false leaks; how much lining was seen is not known"
    return f"{of_all.false_per_1000:.2f} false leaks for each 1000 m² of the {report.seen:.0f} m² of lining that were seen"


def as_values(report: Report, about: dict[str, Any]) -> dict[str, Any]:
    """Return all figures, and each leak, as plain values; what can't be told is None."""
    return {
        **about,
        "seen_m2": _known(report.seen),
        "groups": [{"group": name, **_plain(of)} for name, of in report.groups.items()],
        "true": [asdict(leak) for leak in report.true],
        "found": [asdict(leak) for leak in report.found],
    }


def as_json(report: Report, about: dict[str, Any]) -> str:
    """Write all figures, and each leak, as JSON; what can't be told is null."""
    return json.dumps(as_values(report, about), ensure_ascii=False, allow_nan=False, indent=1) + "\n"


def as_csv(report: Report) -> str:
    """Write the figures as CSV, a row for each group; what can't be told is empty."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["group", *(field.name for field in fields(Figures))])
    writer.writerows([name, *_plain(of).values()] for name, of in report.groups.items())
    return out.getvalue()


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
