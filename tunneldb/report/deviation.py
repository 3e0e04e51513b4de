"""The chapter on design and deviation: over- and underbreak, the image of deviation, the worst sections."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import psycopg
from PIL import Image
from psycopg import sql
from psycopg.rows import dict_row

from tunneldb.arrays import Single, UInt8
from tunneldb.measures.deviation.rows import layers_held
from tunneldb.raster.gap_fill import MAX_FILL_DISTANCE, fill_gaps
from tunneldb.raster.geotiff import DEVIATION_KINDS
from tunneldb.raster.grid import BLOCK
from tunneldb.raster.overview import shrink
from tunneldb.report.data import label_chainages
from tunneldb.report.drawing import line_path, step_for, ticks
from tunneldb.report.lining import QUALITY, Form
from tunneldb.shape.profile import Stretch, stretches
from tunneldb.store.design import load_profiles
from tunneldb.store.images import load_block
from tunneldb.store.survey import Survey

WORST = 4
"""Number of drawn sections with the greatest overbreak, and of those with the greatest underbreak."""

ROWS = 60
"""Maximum number of stretches in the table, of 100 m or a longer round length."""

MIN_SECTION_DISTANCE = 5.0
"""Minimum distance from a worse section, m."""

WIDTH, HEIGHT = 1000.0, 90.0
"""Size of each half of the plot along the tunnel, in its own unit."""

LIMITS = (0.02, 0.05, 0.1, 0.2, 0.5)
"""Deviation of the full colours, m: the first within which nine tenths of the cells are."""

_COLUMNS = 1000  # of a picture
_STRIP = 100.0  # length of a picture of a short stretch, m; of a long one a tenth of it, in whole blocks
_BLUE, _GREY, _RED, _NONE = (33, 102, 172), (230, 230, 230), (178, 24, 43), (255, 255, 255)
_DRAWN = 0.6  # m to which the greatest deviation of a section is magnified at most
_DOWN = np.array([1.0, -1.0])
_TIMES = (50, 20, 10, 5, 2, 1)


@dataclass(frozen=True)
class Plot:
    """Over- and underbreak along the tunnel: paths, and lines of equal area and ticks, with labels."""

    over: str
    under: str
    areas: list[tuple[float, str]]
    places: list[tuple[float, str]]


@dataclass(frozen=True)
class Strip:
    """Stretch of the image of deviation: label, length and height, m, and picture."""

    title: str
    length: float
    height: float
    picture: str


@dataclass(frozen=True)
class WorstSection:
    """A section with its figures, and the paths of design and lining, deviations magnified so many times."""

    row: dict[str, Any]
    design: str
    lining: str
    box: str
    times: int


class DeviationChapter:
    """Results for a layer.

    Parameters
    ----------
    conn, survey, layer, low, high
        Source; chainages, m.
    form : {'WEBP', 'JPEG'}
        Format of the pictures.

    Attributes
    ----------
    whole : dict
        Columns of ``deviation_volume``.
    stretches : list of dict
        Columns of ``deviation_stretches``, of whole stretches within the report's.
    limit : float
        Deviation at which colours are full, m.
    plot : Plot
    worst : list of list of WorstSection
        Sections with the greatest overbreak, and underbreak.
    stale : list of str
        Reason why the results are out of date.
    evenness, thickness : list of dict
        Results on either for the whole stretch; of thickness by earlier survey.
    """

    def __init__(self, conn: psycopg.Connection[Any], survey: Survey, layer: str, low: float, high: float, form: Form) -> None:
        self._conn, self._survey, self._low, self._high, self._form = conn, survey, low, high, form
        self.layer = layer
        (self.whole,) = self._rows("SELECT * FROM tunnel_api.deviation_volume(%s, %s, %s, %s)", survey.name, layer, low, high)
        self.step = max(step_for(high - low, ROWS), 100.0)
        self.stretches = self._rows(
            "SELECT * FROM tunnel_api.deviation_stretches(%s, %s, %s) WHERE chainage_to > %s AND chainage_from < %s"
            " ORDER BY chainage_from",
            survey.name, layer, self.step, low, high,
        )  # fmt: skip
        self.stale = sorted({row["reason"] for row in self._rows(
            "SELECT reason FROM tunnel_internal.result_state(%s, 'deviation', %s) WHERE reason IS NOT NULL"
            " AND (km + 1) * 1000 > %s AND km * 1000 < %s", survey.id, layer, low, high,
        )})  # fmt: skip
        usual = self._rows(
            "SELECT percentile_cont(0.9) WITHIN GROUP (ORDER BY greatest(deviation_greatest, -deviation_least)) AS usual"
            " FROM tunnel_api.deviation_section"
            " WHERE survey_id = %s AND layer = %s AND chainage_to > %s AND chainage_from < %s",
            survey.id, layer, low, high,
        )[0]["usual"]  # fmt: skip
        self.limit = next((limit for limit in LIMITS if limit >= (usual or 0.0)), LIMITS[-1])
        self.plot = self._plot()
        self.worst = [self._worst(kind) for kind in ("overbreak", "underbreak")]
        self.evenness = self._rows(
            "SELECT min(straightedge) AS straightedge, max(gap_limit) AS gap_limit, sum(lining_area) AS lining,"
            " sum(measured_area) AS measured, sum(over_area) AS over, max(gap_along) AS along, max(gap_around) AS around,"
            " max(waviness) AS waviness FROM tunnel_api.evenness_section"
            " WHERE survey_id = %s AND layer = %s AND chainage_to > %s AND chainage_from < %s HAVING count(*) > 0",
            survey.id, layer, low, high,
        )  # fmt: skip
        self.thickness = self._rows(
            "SELECT before, sum((chainage_to - chainage_from) * compared_length) AS compared,"
            " sum((chainage_to - chainage_from) * area) AS volume, min(thickness_least) AS least,"
            " sum(compared_length * thickness_mean) / nullif(sum(compared_length), 0) AS mean"
            " FROM tunnel_api.thickness_section"
            " WHERE survey_id = %s AND layer = %s AND chainage_to > %s AND chainage_from < %s GROUP BY before ORDER BY 1",
            survey.id, layer, low, high,
        )  # fmt: skip

    def _rows(self, query: Any, *values: Any) -> list[dict[str, Any]]:
        with self._conn.cursor(row_factory=dict_row) as cursor:
            return cursor.execute(query, values).fetchall()

    def _plot(self) -> Plot:
        """Return over- and underbreak by bins of a round length, at most 500."""
        low, high = self._low, self._high
        step = max(step_for(high - low, 500), 1.0)
        rows = self._rows(
            "SELECT floor(chainage_from / %s) * %s AS low, sum(overbreak * (chainage_to - chainage_from)) / %s AS over,"
            " sum(underbreak * (chainage_to - chainage_from)) / %s AS under FROM tunnel_api.deviation_section"
            " WHERE survey_id = %s AND layer = %s AND chainage_to > %s AND chainage_from < %s GROUP BY 1 ORDER BY 1",
            step, step, step, step, self._survey.id, self.layer, low, high,
        )  # fmt: skip
        most = max((max(row["over"], row["under"]) for row in rows), default=0.0) or 1.0
        across, up = WIDTH / (high - low), HEIGHT / most

        def bars(name: str, way: float) -> str:
            return "".join(
                f"M{(row['low'] - low) * across:.1f} {HEIGHT:g}v{way * row[name] * up:.1f}h{step * across:.1f}V{HEIGHT:g}Z"
                for row in rows if row[name] > 0.0
            )  # fmt: skip

        places = ticks(low, high, step_for(high - low, 8))
        labels = label_chainages(self._conn, self._survey, places)
        each = step_for(1e3 * most, 4) / 1e3
        areas = [
            (HEIGHT - way * area * up, f"{area:g}") for area in ticks(0.0, most, each)[1:] for way in (-1.0, 1.0)
        ]  # fmt: skip
        return Plot(
            bars("over", 1.0), bars("under", -1.0), areas,
            [((place - low) * across, label.split(".")[0]) for place, label in zip(places, labels, strict=True)],
        )  # fmt: skip

    def strips(self) -> Iterator[Strip]:
        """Yield pictures of the image of deviation, one after another, with no more than one in memory."""
        kind = DEVIATION_KINDS[self.layer]
        blocks = self._rows(
            "SELECT km, block FROM tunnel.image WHERE survey_id = %s AND kind = %s AND block BETWEEN %s AND %s"
            " ORDER BY block, km",
            self._survey.id, kind, int(self._low // BLOCK), int(np.ceil(self._high / BLOCK)) - 1,
        )  # fmt: skip
        each = round(max(_STRIP, step_for((self._high - self._low) / 10.0, 1)) / BLOCK)
        there = {row["block"]: row["km"] for row in blocks}
        for first in sorted({block // each * each for block in there}):
            numbers = [number for number in range(first, first + each) if number in there]
            yield self._strip(first, each, [(number, there[number]) for number in numbers], kind)

    def _strip(self, first: int, count: int, blocks: list[tuple[int, int]], kind: str) -> Strip:
        parts: list[tuple[int, float, Single]] = []
        side = 0.0
        for number, km in blocks:
            raster = load_block(self._conn, self._survey, km, kind, number)
            factor = max(1, round(count * BLOCK / _COLUMNS / raster.transform.a))
            side = raster.transform.a * factor
            parts.append((number, raster.transform.f, shrink(raster.values, factor)))
        columns = round(BLOCK / side)
        top = max(north for _, north, _ in parts)
        bottom = min(north - len(values) * side for _, north, values in parts)
        canvas = np.full((round((top - bottom) / side) + 1, columns * count), np.nan, np.float32)
        for number, north, values in parts:
            down, along = round((top - north) / side), (number - first) * columns
            canvas[down : down + len(values), along : along + columns] = values[:, :columns]
        held = np.flatnonzero(np.isfinite(canvas).any(axis=1))
        canvas = fill_gaps(canvas[held[0] : held[-1] + 1] if len(held) else canvas[:1], MAX_FILL_DISTANCE / side)
        out = io.BytesIO()
        Image.fromarray(_colours(canvas, self.limit)).save(out, self._form, quality=QUALITY[self._form])
        labels = label_chainages(self._conn, self._survey, [first * BLOCK, (first + count) * BLOCK])
        url = f"data:image/{self._form.lower()};base64,{base64.b64encode(out.getvalue()).decode()}"
        return Strip(" – ".join(label.split(".")[0] for label in labels), count * BLOCK, len(canvas) * side, url)

    def _worst(self, kind: str) -> list[WorstSection]:
        """Return the sections with the greatest over- or underbreak, by chainage, none within 5 m of a worse one."""
        query = sql.SQL(
            "SELECT chainage_from, chainage_to, label, profile, overbreak, underbreak, seen_share, deviation_least,"
            " deviation_greatest, deviation FROM tunnel_api.deviation_section"
            " WHERE survey_id = %s AND layer = %s AND chainage_to > %s AND chainage_from < %s AND {0} > 0"
            " ORDER BY {0} DESC LIMIT %s"
        ).format(sql.Identifier(kind))
        chosen: list[dict[str, Any]] = []
        for row in self._rows(query, self._survey.id, self.layer, self._low, self._high, 20 * WORST):
            if all(abs(row["chainage_from"] - other["chainage_from"]) >= MIN_SECTION_DISTANCE for other in chosen):
                chosen.append(row)
        design = {part.name: part for part in stretches(load_profiles(self._conn, self._survey.tunnel_id, self.layer))}
        worst = sorted(chosen[:WORST], key=lambda row: row["chainage_from"])
        return [_draw(row, design[row["profile"]]) for row in worst if row["profile"] in design]


def read_deviation(
    conn: psycopg.Connection[Any], survey: Survey, low: float, high: float, form: Form
) -> list[DeviationChapter]:
    """Read the results of each layer that a stretch was compared with, from inside."""
    chapters = (DeviationChapter(conn, survey, layer, low, high, form) for layer in layers_held(conn, survey))
    return [chapter for chapter in chapters if chapter.whole["length"] is not None]


def _draw(row: dict[str, Any], design: Stretch) -> WorstSection:
    """Draw a section, looking up-chainage, y downwards, with deviations magnified."""
    outline = design.at((row["chainage_from"] + row["chainage_to"]) / 2.0)
    values = np.array(row["deviation"], np.float64)
    greatest = max(abs(row["deviation_least"]), abs(row["deviation_greatest"]))
    times = next((times for times in _TIMES if times * greatest <= _DRAWN), 1)
    feet, inward = outline.places((np.arange(len(values)) + 0.5) / len(values))
    points = feet + times * values[:, None] * inward
    seen = np.isfinite(values)
    pieces = np.split(np.arange(len(values)), np.flatnonzero(np.diff(seen)) + 1)
    shape = outline.flattened(0.01)
    around = np.vstack([shape, points[seen]])
    (west, south), (east, north) = around.min(axis=0) - 0.2, around.max(axis=0) + 0.2
    return WorstSection(
        row,
        line_path(shape * _DOWN),
        "".join(line_path(points[piece] * _DOWN) for piece in pieces if seen[piece[0]] and len(piece) > 1),
        f"{west:.2f} {-north:.2f} {east - west:.2f} {north - south:.2f}",
        times,
    )


def _colours(values: Single, limit: float) -> UInt8:
    """Return colours (rows, columns, 3): blue outside, grey on the design, red inside."""
    share = np.nan_to_num(np.clip(values / limit, -1.0, 1.0))
    colours = np.stack([np.interp(share, (-1.0, 0.0, 1.0), band) for band in zip(_BLUE, _GREY, _RED, strict=True)], axis=-1)
    colours[np.isnan(values)] = _NONE
    return colours.astype(np.uint8)
