"""Draw samples with their truth, and what a network takes for wet.

    python -m benchmarks.network.look DIR/scenes/round_09/rail-cast.npz -o FILE.png
    python -m benchmarks.network.look DIR/scenes/round_09/rail-cast.npz --network DIR/NAME.onnx -o FILE.png

Green: wet. Orange: dark but dry, or bright. Violet: can't be told. Red: taken for wet by the network.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from PIL import Image
from scipy import ndimage

from benchmarks.network.sample import LIMIT, OTHER, WET, Sample
from benchmarks.network.seen import see
from tunneldb.segmentation.network import WATER, Network

COLOURS = {WET: (0, 200, 80), OTHER: (255, 150, 0), LIMIT: (170, 80, 255)}
RED = (255, 30, 30)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.network.look", description=__doc__.splitlines()[0])
    parser.add_argument("sample", type=Path)
    parser.add_argument("--network", type=Path, metavar="FILE.onnx")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="FILE.png")
    arguments = parser.parse_args()
    network = Network.load(arguments.network.read_bytes(), arguments.network.stem) if arguments.network else None
    Image.fromarray(draw(Sample.load(arguments.sample), network)).save(arguments.output)


def draw(sample: Sample, network: Network | None = None) -> np.ndarray:
    """Colour the smoothed level of a sample, with outlines of its truth and of what a network takes for wet."""
    seen = see(sample)
    grey = np.clip(200 + 45 * seen.images[1].astype(np.float32), 0, 255)
    image = np.repeat(np.where(seen.lining, grey, 90)[..., None], 3, axis=2).astype(np.uint8)
    masks = [(seen.label == value, colour) for value, colour in COLOURS.items()]
    if network is not None:
        wet = network.probabilities(seen.images.astype(np.float32))[WATER] >= 0.5
        masks.append((wet & seen.lining, RED))
    for mask, colour in masks:
        image[mask & ~ndimage.binary_erosion(mask)] = colour
    return image


if __name__ == "__main__":
    main()
