"""Make pictures of the documentation: what each step of leak detection does (``docs/images/leak-steps.png``), and the tutorial.

    python docs/generate_pictures.py steps
    python docs/generate_pictures.py tutorial    # docs/tutorial_pictures.py

For the steps a tunnel of segments with soot, painted numbers, repaired patches, bolt pockets, cables and leaks is simulated,
loaded and run; detection is then gone through once more, its results looked at on the way, and nothing of that is kept.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import shapely
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry
from tutorial_pictures import take

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks.common import scratch_database
from benchmarks.scene import Scene
from tunneldb.anomalies.records import Anomaly
from tunneldb.database import connect
from tunneldb.pipeline import detect as stage
from tunneldb.raster.geotiff import NODATA, STEP
from tunneldb.raster.state import PixelState
from tunneldb.stages.parameters import settings
from tunneldb.store.survey import get_survey

IMAGE = Path(__file__).parent / "images" / "leak-steps.png"
TUNNEL = (
    "--length", 44, "--section", "horseshoe", "--scanner", "static", "--angular-step", 0.1, "--station-spacing", 15,
    "--lining", "segments", "--soot", 3, "--grime", 1.5, "--patches", 6, "--paint", 6, "--joint-leaks", 3, "--leaks", 12,
    "--drips", "--clutter", 2, "--niche-leaks", 1, "--beam", 0.3, "--seed", 4,
)  # fmt: skip
FROM, TO = 14.0, 26.0  # chainage of the stretch, m
KIND = {"leak": "#0072b2", "joint": "#d55e00", "dark": "#cc79a7"}
STATES = {"unseen": "#ffffff", "lining": "#d9d9d9", "recess": "#8da0cb", "appendage": "#fc8d62", "floor": "#a6761d"}


class Steps:
    """What detection had in its hands on the way: arrays of the stretch, rows from the greatest arc."""

    def __init__(self) -> None:
        self.arrays: dict[str, NDArray[Any]] = {}
        self.raw: dict[int, NDArray[Any]] = {}
        self.found: list[Anomaly] = []
        self.extent: tuple[float, float, float, float] = (0, 0, 0, 0)

    def watch(self) -> None:
        """Look at what goes in and comes out of each step."""
        self._after("lining_image", self._picture)
        self._after("relate", self._related)
        self._after("find_anomalies", self._anomalies)

    def _after(self, name: str, look: Callable[..., None]) -> None:
        work = getattr(stage, name)

        def both(*arguments: Any) -> Any:
            if name == "lining_image":
                arguments = (*arguments[:-1], self._raw(arguments[-1]))
            result = work(*arguments)
            look(result, *arguments)
            return result

        setattr(stage, name, both)

    def _raw(self, keep: Callable[[Any], None]) -> Callable[[Any], None]:
        def both(window: Any) -> None:
            self.raw[window.columns.start] = window.raw.copy()
            keep(window)

        return both

    def _keep(self, name: str, values: NDArray[Any]) -> None:
        self.arrays[name] = np.array(values)

    def _picture(self, picture: Any, *_: Any) -> None:
        grid = picture.grid
        self.columns = slice(round((FROM - grid.west) / grid.pixel), round((TO - grid.west) / grid.pixel))
        bottom = grid.bottom * grid.pixel
        self.extent = (FROM, TO, bottom, bottom + grid.rows * grid.pixel)
        whole = np.full((grid.rows, grid.columns), np.nan, np.float32)
        for start, values in self.raw.items():
            whole[:, start : start + values.shape[1]] = values
        self._keep("raw", whole[:, self.columns])
        self._keep("state", picture.state[:, self.columns])
        self._keep("corrected", decibel(picture.level[:, self.columns]))

    def _related(self, related: Any, *_: Any) -> None:
        background, contrast = related
        self._keep("dry", background.level.levels(slice(0, contrast.grid.rows), self.columns))
        self._keep("drop", decibel(contrast.drop[:, self.columns]))
        tile = contrast.tile
        row = np.arange(contrast.state.shape[0]) // tile
        column = np.arange(self.columns.start, self.columns.stop) // tile
        self._keep("sigma", contrast.sigma[row[:, None], column[None, :]])

    def _anomalies(self, detection: Any, *_: Any) -> None:
        self._keep("dark", detection.dark[:, self.columns])
        self.found = detection.anomalies


def decibel(steps: NDArray[np.int16]) -> NDArray[np.float32]:
    """Values of stored whole numbers, NaN for none."""
    return np.where(steps == NODATA, np.nan, steps * STEP["corrected"]).astype(np.float32)


def watch_detection(scene: Scene, dsn: str) -> Steps:
    """Go through detection of the only kilometre once more."""
    steps = Steps()
    steps.watch()
    with connect(dsn) as connection:
        survey = get_survey(connection, scene.name)
        stage.detect(connection, survey, int(scene.start_chainage // 1000), settings(), lambda _: None)
        connection.rollback()
    return steps


def draw(steps: Steps, leaks: list[BaseGeometry], path: Path) -> None:
    """Draw a panel a step."""
    a = steps.arrays
    figure, axes = plt.subplots(4, 2, figsize=(13, 15), sharex=True, sharey=True, layout="constrained")
    panels = iter(axes.ravel())
    middle = float(np.nanmedian(a["corrected"]))
    raw = float(np.nanmedian(a["raw"]))
    show(next(panels), steps, a["raw"], "1  intensity as measured, dB", raw - 8, raw + 5)
    show(
        next(panels),
        steps,
        a["corrected"],
        "2  corrected, stations blended, dB",
        middle - 8,
        middle + 4,
    )
    state = np.where(a["state"] <= PixelState.FLOOR, a["state"], 0)
    colours = ListedColormap(list(STATES.values()))
    image = show(next(panels), steps, state, "3  state of the pixels", 0, 4, colours, BoundaryNorm(np.arange(-0.5, 5), 5))
    image.set_ticks(range(5), labels=list(STATES))
    show(next(panels), steps, a["dry"], "4  level of dry lining, dB", middle - 8, middle + 4)
    contrast = np.where(a["state"] <= PixelState.RECESS, a["drop"] / a["sigma"], np.nan)
    show(next(panels), steps, contrast, "5  drop below it, in its standard deviations", -3, 12, "viridis")
    show(
        next(panels),
        steps,
        a["dark"],
        "6  dark: more than three, filtered, rims at half the contrast",
        0,
        1,
        "Greys",
    )
    judged = next(panels)
    show(judged, steps, np.where(a["dark"], np.nan, np.nan), "7  judged", 0, 1)
    for found in steps.found:
        outline(judged, found.outline, KIND[found.verdict.kind], fill=True)
    handles = [mpl.patches.Patch(color=colour, label=kind) for kind, colour in KIND.items()]
    judged.legend(handles=handles, loc="upper right")
    truth = next(panels)
    show(truth, steps, a["corrected"], "8  leaks found (blue) and put in (yellow)", middle - 8, middle + 4)
    for found in steps.found:
        if found.verdict.kind == "leak":
            outline(truth, found.outline, KIND["leak"])
    for leak in leaks:
        outline(truth, leak, "#f0e442")
    for axis in axes[-1]:
        axis.set_xlabel("chainage, m")
    for axis in axes[:, 0]:
        axis.set_ylabel("arc, m")
    figure.savefig(path, dpi=80)


def show(
    axis: Axes,
    steps: Steps,
    values: NDArray[Any],
    title: str,
    low: float,
    high: float,
    colours: Any = "gray",
    norm: Any = None,
) -> Any:
    """Show an array in the unrolled plane; return its colour bar."""
    limits = {} if norm else {"vmin": low, "vmax": high}
    image = axis.imshow(values, cmap=colours, extent=steps.extent, aspect="auto", interpolation="nearest", norm=norm, **limits)
    axis.set_title(title, loc="left", fontsize=10)
    axis.set_xlim(FROM, TO)
    axis.set_ylim(*steps.extent[2:])
    return axis.figure.colorbar(image, ax=axis, fraction=0.03, pad=0.01)


def outline(axis: Axes, shape: BaseGeometry, colour: str, *, fill: bool = False) -> None:
    """Draw the rings of polygons."""
    for polygon in shapely.get_parts(shape):
        for ring in (polygon.exterior, *polygon.interiors):
            x, y = ring.xy
            if fill and ring is polygon.exterior:
                axis.fill(x, y, color=colour, alpha=0.6)
            axis.plot(x, y, color=colour, linewidth=1.2)


def draw_steps() -> None:
    """Simulate, run, watch and draw."""
    with tempfile.TemporaryDirectory() as folder, scratch_database(None) as dsn:
        scene = Scene.simulate(Path(folder), "steps", *TUNNEL)
        scene.register(dsn)
        scene.load(dsn)
        scene.run(dsn)
        draw(watch_detection(scene, dsn), scene.leaks, IMAGE)
    print(IMAGE)


if __name__ == "__main__":
    {"steps": draw_steps, "tutorial": take}[sys.argv[1]]()
