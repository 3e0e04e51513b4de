"""Probabilities of wet lining by ONNX Runtime, in tiles.

    python -m benchmarks.network.predict FILE.onnx --cache DIR round_09 metro     # into DIR/probabilities/FILE
    python -m benchmarks.network.predict FILE.onnx --cache DIR round_09 --check   # cut otherwise, by more threads

Runs in the environment for training: the program has no ONNX Runtime yet.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import jax
import numpy as np
import onnxruntime
from numpy.typing import NDArray

from benchmarks.network.features import see
from benchmarks.network.onnx_file import read_weights
from benchmarks.network.sample import Sample
from benchmarks.network.train import forward
from benchmarks.network.unet import HALO, STRIDE

TILE = 512
"""Side of a tile without its halo, pixels."""


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.network.predict", description=__doc__.splitlines()[0])
    parser.add_argument("model", type=Path, metavar="FILE.onnx")
    parser.add_argument("families", nargs="+", metavar="FAMILY")
    parser.add_argument("--cache", type=Path, required=True, metavar="DIR")
    parser.add_argument("--check", action="store_true", help="compare tiles, threads and JAX; writes nothing")
    arguments = parser.parse_args()
    network = session(arguments.model)
    for family in arguments.families:
        for path in sorted((arguments.cache / "scenes" / family).glob("*.npz")):
            images = see(Sample.load(path)).images
            start = time.perf_counter()
            found = probabilities(network, images)
            seconds = time.perf_counter() - start
            if arguments.check:
                others = {
                    "tiles of 256": probabilities(network, images, 256),
                    "one tile": probabilities(network, images, 100_000),
                    "2 threads": probabilities(session(arguments.model, 2), images),
                    "again": probabilities(network, images),
                    "JAX": trained(arguments.model, images),
                }
                print(f"{family} {path.stem}", {name: float(np.abs(p - found).max()) for name, p in others.items()}, flush=True)
                continue
            target = arguments.cache / "probabilities" / arguments.model.stem / family / f"{path.stem}.npy"
            target.parent.mkdir(parents=True, exist_ok=True)
            np.save(target, found.astype(np.float16))
            print(f"{family} {path.stem}: {images.shape[0]} x {images.shape[1]} pixels in {seconds:.1f} s", flush=True)


def trained(path: Path, images: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the same by the code that trains."""
    rows, columns, channels = images.shape
    whole = np.zeros((1, -(-rows // STRIDE) * STRIDE, -(-columns // STRIDE) * STRIDE, channels), np.float32)
    whole[0, :rows, :columns] = images
    found = jax.nn.softmax(forward(read_weights(path), whole))
    return np.asarray(found)[0, :rows, :columns].transpose(2, 0, 1)


def session(path: Path, threads: int = 1) -> onnxruntime.InferenceSession:
    """Open a model."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads, options.inter_op_num_threads = threads, 1
    return onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])


def probabilities(network: onnxruntime.InferenceSession, images: NDArray[np.float32], tile: int = TILE) -> NDArray[np.float32]:
    """Probabilities (CLASSES, rows, columns) from images (rows, columns, channels), tile by tile, each seen with its halo."""
    rows, columns, _ = images.shape
    high, wide = (-(-n // STRIDE) * STRIDE for n in (rows, columns))
    whole = np.zeros((1, images.shape[2], high, wide), np.float32)
    whole[0, :, :rows, :columns] = images.transpose(2, 0, 1)
    found = []
    for top in range(0, high, tile):
        strip = []
        for left in range(0, wide, tile):
            low, first = max(top - HALO, 0), max(left - HALO, 0)
            last, stop = min(top + tile, high), min(left + tile, wide)
            (part,) = network.run(None, {"images": whole[:, :, low : last + HALO, first : stop + HALO]})
            strip.append(part[0, :, top - low : last - low, left - first : stop - first])
        found.append(np.concatenate(strip, axis=2))
    return np.concatenate(found, axis=1)[:, :rows, :columns]


if __name__ == "__main__":
    main()
