"""A sample as the network sees it: its channels, and the truth at its pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.network.sample import LIMIT, OTHER, WET, Sample
from tunneldb.raster.state import PixelState
from tunneldb.segmentation.channels import Scale, channels, repeated


@dataclass(frozen=True)
class Seen:
    """Input and truth at the network's resolution.

    Attributes
    ----------
    images : (channels, rows, columns) float16 array
    label : (rows, columns) uint8 array
        DRY, WET, LIMIT or OTHER of :mod:`benchmarks.network.sample`.
    lining : (rows, columns) bool array
        Pixels that can be lining, with points or without.
    """

    images: NDArray[np.float16]
    label: NDArray[np.uint8]
    lining: NDArray[np.bool_]


def see(sample: Sample) -> Seen:
    """Bring a sample to the network's resolution."""
    column = round(sample.west / sample.pixel)
    images, margins = channels(sample.state, sample.level, sample.pixel, sample.bottom, column)
    scale = Scale.of(sample.pixel)
    labels = margins.pad(sample.label, 0)
    label = np.where(_shares(labels == OTHER, scale) >= 0.5, OTHER, 0)
    label = np.where(_shares(labels == WET, scale) >= 0.5, WET, label)
    label = np.where(_shares(labels == LIMIT, scale) > 0.0, LIMIT, label).astype(np.uint8)
    lining = _shares(margins.pad(sample.state, PixelState.OFF) <= PixelState.RECESS, scale) >= 0.5
    return Seen(images.astype(np.float16), label, lining)


def _shares(mask: NDArray[np.bool_], scale: Scale) -> NDArray[np.float64]:
    """Return the share of the image pixels of each pixel of the network that are in a mask."""
    n = scale.combined
    rows, columns = (size // n for size in mask.shape)
    return np.asarray(repeated(mask.reshape(rows, n, columns, n).mean(axis=(1, 3)), scale))
