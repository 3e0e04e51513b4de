"""What each part of the detection of leaks is good for: the benchmark set with one part at a time switched off.

    python -m benchmarks.ablation                        # all tunnels and all parts, an hour on two cores
    python -m benchmarks.ablation --only profiler --part judging --part map

First Table 1 and Fig. 8 of Xu et al. (2018): the standard deviation of dry lining, and the share of the wet area that is
missed, for raw intensity and for that corrected by Lambert's law and by Oren and Nayar's, by one threshold for all of the
lining as there, and by the local one. Then the parts. There are no switches for them in the program: its functions are
replaced here. Points are gathered once for all that takes the same ones.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from click.testing import CliRunner
from shapely.geometry import Polygon

from benchmarks.common import print_table, progress, save, scratch_database
from benchmarks.leak_set import Case, prepare
from benchmarks.leaks import HEADER, Outcome, chosen, plain, row, values
from benchmarks.scene import Scene
from tunneldb.anomalies import detect as detection
from tunneldb.anomalies import regions as region
from tunneldb.anomalies.background import relate as relating
from tunneldb.anomalies.background.level import BackgroundLevel
from tunneldb.anomalies.background.level_map import BackgroundMap, map_background
from tunneldb.anomalies.verdict import Verdict, classify
from tunneldb.arrays import Bool
from tunneldb.cli.main import main as command
from tunneldb.database import connect
from tunneldb.pipeline import detect as stage
from tunneldb.radiometry.robust_statistics import robust_statistics
from tunneldb.raster import pixel_state as lining
from tunneldb.raster import rasterize as gather
from tunneldb.raster.accumulator import Accumulator
from tunneldb.raster.geotiff import STEP
from tunneldb.raster.image import LiningImage
from tunneldb.raster.state import PixelState

Replacement = tuple[Any, str, Any]


@dataclass(frozen=True)
class Part:
    """A part of the detection, and how it is switched off: functions replaced, parameters set, the range curve swapped.

    ``points`` names what is gathered; parts of the same name share it.
    """

    name: str
    replaced: Sequence[Replacement] = ()
    parameters: Sequence[str] = ()
    swap_curve: bool = False
    points: str = "as detection takes them"

    @contextmanager
    def off(self, dsn: str, scene: Scene) -> Iterator[list[str]]:
        """Switch it off; yields the options for ``tunneldb run``."""
        with ExitStack() as stack:
            for module, name, other in self.replaced:
                stack.enter_context(patch.object(module, name, other))
            if self.swap_curve:
                stack.enter_context(_other_curve(dsn, scene))
            yield [option for parameter in self.parameters for option in ("--set", parameter)]


@contextmanager
def _other_curve(dsn: str, scene: Scene) -> Iterator[None]:
    """The curve found on the lining in place of the measured one, or the other way round."""
    measured = np.loadtxt(scene.file("reference.csv"), delimiter=",", skiprows=1)
    swap = "UPDATE tunnel.survey SET reference = CASE reference WHEN 'auto' THEN 'measured' ELSE 'auto' END WHERE name = %s"
    with connect(dsn) as conn:
        for range_m, level in measured.tolist():
            conn.execute(
                "INSERT INTO tunnel.reference (survey_id, range_m, intensity_db) SELECT id, %s, %s FROM tunnel.survey"
                " WHERE name = %s ON CONFLICT DO NOTHING",
                (range_m, level, scene.name),
            )
        conn.execute(swap, (scene.name,))
        conn.commit()
        yield
        conn.execute(swap, (scene.name,))
        conn.commit()


def one_level(picture: LiningImage, dry_regions: Sequence[Polygon] = (), wet: Bool | None = None) -> BackgroundMap:
    """One mean and one standard deviation for all of the lining (eq. 19)."""
    local = map_background(picture)
    dry = robust_statistics(picture.level[picture.state == PixelState.LINING][::7] * STEP["corrected"])
    flat = [np.zeros_like(part) for part in (local.level.rings, local.level.bands, local.level.smooth)]
    level = BackgroundLevel(local.level.tile, dry.mean, *flat)
    return BackgroundMap(local.grid, level, np.full_like(local.sigma, dry.sigma), dry.mean, dry.sigma, local.count)


def all_leaks(*judged: Any) -> Verdict:
    """Whatever is judged is a leak."""
    return replace(classify(*judged), kind="leak", reasons=(), confidence=1.0)


def corrected_by(law: str) -> list[Replacement]:
    """Intensity left raw, or corrected by Lambert's law."""
    calibrate, loss = stage.calibrate, gather.incidence_db

    def raw(*arguments: Any, **options: Any) -> Any:
        known = calibrate(*arguments, **options)
        radiometer = replace(known.observer.radiometer, kind="reflectance", reference=None)
        return replace(known, observer=replace(known.observer, radiometer=radiometer))

    if law == "raw":
        return [(stage, "calibrate", raw), (gather, "incidence_db", lambda cosine, roughness: np.zeros_like(cosine))]
    return [(gather, "incidence_db", lambda cosine, roughness: loss(cosine, 0.0))]


def without_weights() -> list[Replacement]:
    look = gather.Projector.project

    def same(projector: gather.Projector, points: Any) -> Any:
        pixels, tally = look(projector, points)
        pixels.weight[: len(points)] = 1
        return pixels, tally

    return [(gather.Projector, "project", same)]


class Kept:
    """The sums of all points of a tunnel, by what was gathered; of those that were gathered before the files are not read."""

    def __init__(self) -> None:
        self.name = ""
        self._kept: dict[str, tuple[dict[int, np.ndarray], Any]] = {}
        self._gather = stage._gather

    def gather(self, observer: Any, files: Any, image: Accumulator, *others: Any) -> Any:
        if self.name not in self._kept:
            counts = self._gather(observer, files, image, *others)
            self._kept[self.name] = {block: image._fetch(block).copy() for block in image.blocks()}, counts
        blocks, counts = self._kept[self.name]
        for block, sums in blocks.items():
            image._fetch(block)[:] = sums
        return counts


def after(function: Callable[..., Any], change: Callable[[Any], Any]) -> Callable[..., Any]:
    return lambda *arguments, **named: change(function(*arguments, **named))


def recess_is_off(picture: LiningImage) -> LiningImage:
    picture.state[picture.state == PixelState.RECESS] = PixelState.OFF
    return picture


def law(name: str) -> str:
    """Collect the observations for one of LAWS; detection uses the law of Oren and Nayar."""
    given = name.split(",")[0]
    return Part.points if given == "Oren-Nayar" else given


GLOBAL: list[Replacement] = [(relating, "map_background", one_level)]


def nothing_off(distance: np.ndarray, *others: Any) -> np.ndarray:
    return np.zeros(distance.shape, np.bool_)


def no_drips(components: Any, *others: Any) -> tuple[np.ndarray, np.ndarray]:
    return np.arange(len(components.pixels)), np.empty((0, 4), int)


LAWS = {
    "raw, one threshold": [*GLOBAL, *corrected_by("raw")],
    "Lambert, one threshold": [*GLOBAL, *corrected_by("Lambert")],
    "Oren-Nayar, one threshold": GLOBAL,
    "raw, local": corrected_by("raw"),
    "Lambert, local": corrected_by("Lambert"),
    "Oren-Nayar, local": [],
}
PARTS = (
    Part("local dry map: one mean and sigma for all", GLOBAL),
    Part("weights of points: all alike", without_weights(), points="without weights"),
    Part(
        "limits of incidence and range: none",
        parameters=("intensity.max_incidence=89", "intensity.max_range=1000"),
        points="without limits",
    ),
    Part("removal of appendages: none", [(lining.appendage, "off_plane", nothing_off)]),
    Part("recesses: taken for appendages", [(stage, "lining_image", after(stage.lining_image, recess_is_off))]),
    Part("steps of the radius: left in", [(lining.step, "steps", lambda offset, *others: np.zeros_like(offset))]),
    Part("judging: all that is dark is a leak", [(detection, "classify", all_leaks)]),
    Part("edges: where three sigma lie", [(detection, "refine_boundary", lambda dark, contrast, size: dark)]),
    Part("drips: left alone", [(region, "attach_drips", no_drips)]),
    Part("range curve: auto for measured, and the other way round", swap_curve=True, points="by the other curve"),
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dsn", help="server to use; default: the embedded one")
    parser.add_argument("--only", help="tunnels whose name holds this")
    parser.add_argument("--part", action="append", help="parts whose name holds this; default: all, and the laws")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--folder", type=Path, help="where to make the files, or where they are; default: a temporary one")
    arguments = parser.parse_args()
    wanted = [Part("all of it")]
    wanted += [part for part in PARTS if arguments.part is None or any(text in part.name for text in arguments.part)]
    laws = [] if arguments.part else [Part(name, replaced, points=law(name)) for name, replaced in LAWS.items()]
    outcomes: dict[str, list[Outcome]] = {part.name: [] for part in [*wanted, *laws]}
    table_1 = []
    with nullcontext(arguments.folder) if arguments.folder else tempfile.TemporaryDirectory() as folder:
        for case in chosen(arguments.only):
            progress(case.name)
            for name, outcome, sigmas in measure(arguments.dsn, case, arguments.seed, Path(folder), [*wanted, *laws]):
                outcomes[name].append(outcome)
                if name == wanted[0].name:
                    table_1.append([case.name, *sigmas])
    if laws:
        mean = np.sqrt(np.mean(np.square([line[1:] for line in table_1]), axis=0)).tolist()
        header = ("standard deviation of dry lining, dB", "raw", "Lambert", "Oren-Nayar")
        print_table("Table 1 of Xu et al. (2018)", header, [*table_1, ["root mean square", *mean]])
        rows = [[part.name, *missed(outcomes[part.name])] for part in laws if outcomes[part.name]]
        print_table("Fig. 8 of Xu et al. (2018)", ("intensity", "area missed", "area not wet", "leaks missed", "false"), rows)
    all_of_them = len(outcomes[wanted[0].name])
    rows = []
    for part in wanted:
        if of := outcomes[part.name]:
            rows.append(row(part.name if len(of) == all_of_them else f"{part.name} ({len(of)} tunnels)", of))
    print_table("Parts switched off", ("switched off", *HEADER[1:]), rows)
    found = {name: plain(of) for name, of in outcomes.items() if of}
    print(f"\n{save('ablation', {'seed': arguments.seed, 'table_1': table_1, 'parts': found})}")


def measure(
    dsn: str | None, case: Case, seed: int, folder: Path, parts: Sequence[Part]
) -> Iterator[tuple[str, Outcome, list[float]]]:
    """Run a tunnel once for each part switched off; with each outcome Table 1's three standard deviations, dB."""
    with scratch_database(dsn) as database:
        scene, kept = prepare(case, seed, folder, database), Kept()
        for part in parts:
            progress(f"  {part.name}")
            kept.name = part.points
            with part.off(database, scene) as options, patch.object(stage, "_gather", kept.gather):
                arguments = ["--dsn", database, "run", scene.name, "--from", "detect", *options]
                done = CliRunner().invoke(command, arguments)
            if done.exit_code:  # without a part things may go wrong that can't go wrong with it
                progress(f"    fails: {done.output.strip() or repr(done.exception)}")
                continue
            with connect(database) as conn:
                sigmas = conn.execute(
                    "SELECT sigma_raw, sigma_lambert, sigma_oren_nayar FROM tunnel_api.radiometry WHERE survey = %s",
                    (scene.name,),
                ).fetchone()
                yield part.name, Outcome.read(conn, scene, case.name), list(sigmas or ())


def missed(outcomes: list[Outcome]) -> list[object]:
    """Share of the wet area that is missed, of the found area that is dry, leaks missed of all, and false ones."""
    v = values(outcomes)
    return [1.0 - v["area_recall"], 1.0 - v["area_precision"], f"{v['true'] - v['found']} of {v['true']}", v["false"]]


if __name__ == "__main__":
    main()
