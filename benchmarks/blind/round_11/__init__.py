"""Round 11: eight typical tunnels as their owners have them scanned.

Three are driven by shield (two metro lines, one railway), two have a cast inner lining (railway and road), one is of
brick, one is a cut-and-cover box and one a utility tunnel of jacked pipes.

The lining is painted on its unrolled plane (`canvas`, `dirt`, `water`), given a shape (`tunnel`, `furniture`), scanned
ray by ray (`scanner`, `survey`), and the outlines of what is wet are lifted back onto it (`outline`). Amplitude is a
constant, plus effects of range and incidence, plus tone, plus noise, drift and jitter of the instrument.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from benchmarks.blind.scene import Scene

from . import box_and_pipe, cast, masonry, metro, rail_segments
from .survey import Survey


def _make(build: Callable[[], Survey]) -> Callable[[Path], None]:
    """A function that builds a scene and writes its files."""

    def make(folder: Path) -> None:
        build().deliver(Path(folder))

    return make


SCENES = (
    Scene(
        name="metro-staggered-mobile",
        lining="segments",
        phenomenon="wet ring and longitudinal joints",
        description="Metro line of the 2010s, rings of 1.2 m in staggered bond, scanned by a "
        "profiler on a trolley. Water at ring joints, joint crossings, grout holes and "
        "bolt pockets, as papers on leakage in intensity images of shield tunnels show "
        "it.",
        make=_make(metro.staggered),
    ),
    Scene(
        name="railway-segments-static",
        lining="segments",
        phenomenon="a whole wet ring",
        description="Single-track railway, trapezoidal segments of 1.8 m, clean; four stations and "
        "no reference curve. One ring joint is wet all round, others in part.",
        make=_make(rail_segments.railway),
    ),
    Scene(
        name="metro-old-dirty",
        lining="segments",
        phenomenon="dry, brake dust and sealed joints",
        description="Metro line of the 1980s, joints in line and caulked, black with brake dust, "
        "with stains of former leaks. Nothing is wet.",
        make=_make(metro.straight_jointed),
    ),
    Scene(
        name="railway-cast-two-tracks",
        lining="cast",
        phenomenon="block joints, kicker joints, damp feet",
        description="Drill and blast with an inner lining in blocks of 10 m; water at block joints,"
        " kickers and cracks, damp feet of walls, as in inspection guides of railways "
        "(CIRIA C671, DB Ril 853).",
        make=_make(cast.railway_two_tracks),
    ),
    Scene(
        name="road-cast-mobile",
        lining="cast",
        phenomenon="soot, wall paint and splash over few leaks",
        description="Road tunnel of two lanes, scanned from a car: painted walls, soot in the "
        "vault, splash above the kerb, washed stretches; water at block joints and "
        "anchor holes.",
        make=_make(cast.road_two_lanes),
    ),
    Scene(
        name="brick-vault-static",
        lining="brick",
        phenomenon="rising damp and wet vault",
        description="Brick horseshoe of the 1870s: soot, new facing, repointing, calcite; damp "
        "walls, weeping joints, wet patches in the vault.",
        make=_make(masonry.brick),
    ),
    Scene(
        name="cut-and-cover-box",
        lining="cast",
        phenomenon="expansion joints, corners, restraint cracks",
        description="Box of a light railway, four stations: expansion joints, kickers and corners "
        "that leak, wet restraint cracks, tie holes.",
        make=_make(box_and_pipe.cut_and_cover),
    ),
    Scene(
        name="utility-jacked-pipe",
        lining="concrete pipes",
        phenomenon="wet pipe joints behind mains and cables",
        description="Utility tunnel of jacked pipes, five stations: mains and racks in front of the"
        " lining, tide mark of a flood, few leaks.",
        make=_make(box_and_pipe.utility),
    ),
)
