"""Probability of water by a segmentation network, run by ONNX Runtime in strips along the tunnel."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np

from tunneldb.arrays import Int16, Single, UInt8
from tunneldb.errors import UserError
from tunneldb.raster.geotiff import NODATA
from tunneldb.raster.image import LiningImage
from tunneldb.raster.state import PixelState
from tunneldb.segmentation.channels import NAMES, REACH, STRIDE, Scale, channels
from tunneldb.segmentation.smoothing import enlarged
from tunneldb.threads import in_blocks

if TYPE_CHECKING:
    from onnxruntime import InferenceSession

INPUT, OUTPUT = "images", "probabilities"
"""Names of the network's input (1, channels, rows, columns) and output (1, classes, rows, columns)."""

CLASSES = ("dry", "water", "dry dark area")
"""Classes of the output."""

WATER = CLASSES.index("water")

FIELD = 9 * STRIDE
"""Maximum distance of pixels that a pixel's probability may depend on, pixels."""

BEYOND = 2 * STRIDE
"""Distance from the ends of a kilometre to which water is computed, pixels: so far the boundaries of regions depend on it."""

STRIP = 150 * STRIDE
"""Length of the strips that are computed one by one, pixels: 96 m."""

HALF = 128
"""Stored probability from which lining is more likely wet than not."""

CERTAIN = 255
"""Stored probability of 1."""


@cache
def standard_network() -> Network:
    """Return the network that comes with the program; ``python -m benchmarks.network.train`` trains it."""
    return Network.load(files("tunneldb.segmentation").joinpath("water.onnx").read_bytes(), "water")


def runtime() -> Any:
    """Import ONNX Runtime without its telemetry: version 1.32 sends usage data, and keeps it in the user's folders."""
    os.environ["ORT_DISABLE_TELEMETRY"] = "1"
    import onnxruntime

    return onnxruntime


@dataclass(frozen=True)
class Network:
    """A segmentation network.

    Attributes
    ----------
    version : str
        Name of the network.
    session : InferenceSession
        Its graph, which computes with one thread, so that results do not depend on the number of threads.
    """

    version: str
    session: InferenceSession

    @classmethod
    def load(cls, content: bytes, name: str) -> Network:
        """Load a network from the content of an ONNX file.

        Parameters
        ----------
        content : bytes
            The file.
        name : str
            Its version, unless its metadata have one.

        Raises
        ------
        ValueError
            If it cannot be read, or its input or output is not that of a segmentation network.
        """
        onnxruntime = runtime()
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        options.enable_cpu_mem_arena = False  # memory is free again after each strip
        options.log_severity_level = 3
        try:
            session = onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])
        except Exception as error:
            raise ValueError(str(error).splitlines()[0]) from None
        takes = {one.name: one.shape for one in session.get_inputs()}
        gives = {one.name: one.shape for one in session.get_outputs()}
        if set(takes) != {INPUT} or len(takes[INPUT]) != 4 or takes[INPUT][1] != len(NAMES):
            raise ValueError(f"it has the inputs {takes}, not {INPUT} (1, {len(NAMES)}, rows, columns)")
        if OUTPUT not in gives or len(gives[OUTPUT]) != 4 or gives[OUTPUT][1] != len(CLASSES):
            raise ValueError(f"it has the outputs {gives}, not {OUTPUT} (1, {len(CLASSES)}, rows, columns)")
        metadata = session.get_modelmeta().custom_metadata_map
        return cls(metadata.get("version", name), session)

    def probabilities(self, images: Single) -> Single:
        """Return the probability of each class (len(CLASSES), rows, columns) from channels (len(NAMES), rows, columns)."""
        (found,) = self.session.run([OUTPUT], {INPUT: images[None]})
        if found.shape[2:] != images.shape[1:] or not (found.min() >= 0.0 and found.max() <= 1.0 + 1e-4):
            raise UserError(
                f"the network {self.version} gives no probabilities for each pixel: use another, or --set detect.model=0"
            )
        return np.asarray(found[0], np.float32)

    def water(self, picture: LiningImage) -> UInt8:
        """Return the probability of water of each pixel of a picture (rows, columns), in steps of 1/255.

        It is 0 off the lining, and farther than BEYOND from the kilometre.
        """
        grid, inner = picture.grid, picture.grid.inner
        scale = Scale.of(grid.pixel)
        step, around, beyond = (-(-length // scale.span) * scale.unit for length in (STRIP, REACH + FIELD, BEYOND))
        begin, end = max(inner.start - beyond, 0), min(inner.stop + beyond, grid.columns)
        out = np.zeros(picture.state.shape, np.uint8)

        def strip(first: int, stop: int) -> None:
            first, stop = begin + first, begin + stop
            low = max(first - around, 0)
            here, within = np.s_[:, low : stop + around], slice(first - low, stop - low)
            level, column = picture.level[here], grid.first_column + low
            out[:, first:stop] = self._water_of(picture.state[here], level, grid.pixel, grid.bottom, column, within)

        in_blocks(strip, end - begin, step)
        return out

    def _water_of(self, state: UInt8, level: Int16, pixel: float, bottom: int, first_column: int, within: slice) -> UInt8:
        """Return the probability of water of the columns ``within`` a strip, in steps of 1/255; 0 off the lining.

        The other columns are their surroundings. For the rest see :func:`tunneldb.segmentation.channels.channels`.
        """
        rows, start, stop = len(state), within.start, within.stop
        off = state[:, start:stop] > PixelState.RECESS
        if not (level != NODATA).any():
            return np.zeros(off.shape, np.uint8)
        images, margins = channels(state, level, pixel, bottom, first_column)
        scale = Scale.of(pixel)
        around = -(-FIELD // scale.span)
        begin = max((margins.left + start) // scale.unit - around, 0)
        end = -(-(margins.left + stop) // scale.unit) + around
        images = np.ascontiguousarray(images[:, :, begin * scale.span : end * scale.span])
        found = resized(self.probabilities(images)[WATER], scale)
        first = margins.left + start - begin * scale.unit
        found = found[margins.above : margins.above + rows, first : first + stop - start]
        return np.where(off, 0, np.rint(CERTAIN * found)).astype(np.uint8)


def resized(image: Single, scale: Scale) -> Single:
    """Bring an image of the network's pixels to those of a picture, linearly between their middles."""
    if scale.repeated > 1:
        n = scale.repeated
        rows, columns = (size // n for size in image.shape)
        return np.asarray(image.reshape(rows, n, columns, n).mean(axis=(1, 3)))
    return enlarged(image, scale.combined)
