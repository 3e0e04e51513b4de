"""Options of a stretch of tunnel, --from and --to, in the tunnel's own stationing."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

import click
import psycopg

from tunneldb.errors import UserError
from tunneldb.numerals import MAX_MEASUREMENT

_METRES = re.compile(r"-?[0-9]+(\.[0-9]*)?")

Command = TypeVar("Command", bound=Callable[..., Any])


class OfTunnel(Protocol):
    """Object with chainages: a survey, or a tunnel by itself."""

    @property
    def tunnel_id(self) -> int:
        """Key of the tunnel."""

    @property
    def tunnel(self) -> str:
        """Its name."""


@dataclass(frozen=True)
class Stretch:
    """A part of a tunnel between two chainages.

    Attributes
    ----------
    low, high : float
        Chainage, m; infinite where it isn't bounded.
    """

    low: float = -math.inf
    high: float = math.inf


def stretch_options(command: Command) -> Command:
    """Add the options --from and --to, which the command gets as ``start`` and ``end``."""
    help_from = "Start: a station of the tunnel, as 12+345.678, or a chainage in metres, as 345.678."
    end = click.option("--to", "end", metavar="PLACE", help="End, likewise.")
    return click.option("--from", "start", metavar="PLACE", help=help_from)(end(command))


def parse_stretch(conn: psycopg.Connection[Any], survey: OfTunnel, start: str | None, end: str | None) -> Stretch:
    """Return the stretch of a survey's tunnel between two places, the one with the smaller chainage first.

    Where stations run backwards, two stations may be given in either order.

    Raises
    ------
    UserError
        For a place that can't be read, that the tunnel hasn't, or that it has more than once; for two places in the wrong
        order, or at the same chainage.
    """
    low = -math.inf if start is None else _chainage(conn, survey, "--from", start)
    high = math.inf if end is None else _chainage(conn, survey, "--to", end)
    if start is not None and end is not None:
        if low > high and _stations_rise(start, end):  # against the chainage: they run backwards there
            low, high = high, low
        if low > high:
            raise UserError(f"--from {start} --to {end} runs backwards: give the smaller one first")
        if low == high:
            raise UserError(f"--from {start} --to {end}: between them lies no tunnel")
    return Stretch(low, high)


def _stations_rise(start: str, end: str) -> bool:
    """Return True if both places are stations, not chainages, and the first is the smaller one."""
    stations = [place for place in (start, end) if not _METRES.fullmatch(place.strip())]
    first, last = (float(place.replace("+", "")) for place in stations) if len(stations) == 2 else (0.0, 0.0)
    return first < last


def _chainage(conn: psycopg.Connection[Any], survey: OfTunnel, option: str, place: str) -> float:
    """Return the chainage of a station, which must exist exactly once, or a chainage, which may be beyond the tunnel."""
    if _METRES.fullmatch(place.strip()):
        if abs(float(place)) > MAX_MEASUREMENT:
            raise UserError(f"{option} {place[:20]}…: no tunnel is so long")
        return float(place)
    from tunneldb.store.alignment import station_chainages

    try:
        chainages = station_chainages(conn, survey.tunnel_id, place)
    except ValueError:
        raise UserError(
            f"{option} takes a station as 12+345.678 (three digits after the +, 0+010, and a decimal point), or a chainage in"
            f" metres, as 345.678, not {place!r}"
        ) from None
    if not chainages:
        raise UserError(
            f"{option} {place}: tunnel {survey.tunnel} has no such station: tunneldb tunnel stationing {survey.tunnel} --show"
        )
    if len(chainages) > 1:
        where = " and ".join(f"{chainage:.3f}" for chainage in chainages)
        raise UserError(
            f"{option} {place}: tunnel {survey.tunnel} has that station {len(chainages)} times, at chainages {where} m; "
            f"give one of these, as {option} {chainages[0]:.3f}"
        )
    return chainages[0]
