"""Train the network on families of scenes and on painted pictures, and write it as ONNX.

    python -m benchmarks.network.train --cache DIR --without round_06 round_07 round_08 round_09 --steps 1500 -o DIR/a.onnx

Runs in an environment of its own with JAX, Optax and ONNX (see README). What is in a family that is left out is never read.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import optax

from benchmarks.network import unet
from benchmarks.network.onnx_file import write_onnx
from benchmarks.network.sample import LIMIT, OTHER, WET, Sample
from benchmarks.network.seen import Seen, see
from tunneldb.segmentation.channels import DOWNWARDS, NAMES

CROP, BATCH = 192, 4
"""Side of a crop, pixels, and crops of a step."""

PAINTED = 0.5
"""Share of the crops that are painted."""

WARM = 50
"""Steps in which the rate grows."""

WEIGHTS = (1.0, 2.0, 1.5)
"""Of pixels of each class."""

STRONGER = (0.6, 1.5)
"""Factors on the contrasts of a crop: by them all is fainter or stronger, the noise too."""

CONTRASTS, ROUGH = 5, 5
"""Number of the first channels, which are contrasts; the channel of the noise's logarithm."""

MEMORY = 0.998
"""What is kept of the mean of the weights, which is the result, in a step."""


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.network.train", description=__doc__.splitlines()[0])
    parser.add_argument("--cache", type=Path, required=True, metavar="DIR")
    parser.add_argument("--without", nargs="*", default=[], metavar="FAMILY", help="families that are left out")
    parser.add_argument("--steps", type=int, default=3000)
    parser.add_argument("--minutes", type=float, default=np.inf, help="stop after so many, whatever the steps")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rate", type=float, default=2e-3)
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="FILE.onnx")
    arguments = parser.parse_args()
    families = [path for path in sorted((arguments.cache / "scenes").iterdir()) if path.name not in arguments.without]
    scans = [see(Sample.load(path)) for family in families if family.name != "painted" for path in sorted(family.glob("*.npz"))]
    painted = [see(Sample.load(path)) for path in sorted((arguments.cache / "scenes" / "painted").glob("*.npz"))]
    print(f"{len(scans)} scans of {', '.join(f.name for f in families)}, {len(painted)} painted pictures", flush=True)
    weights = train(scans, painted, arguments)
    notes = {
        "version": arguments.output.stem, "without": " ".join(arguments.without), "seed": str(arguments.seed),
        "steps": str(arguments.steps), "scans": str(len(scans)), "painted": str(len(painted)),
    }  # fmt: skip
    write_onnx({name: np.asarray(value) for name, value in weights.items()}, len(NAMES), arguments.output, notes)


def train(scans: Sequence[Seen], painted: Sequence[Seen], options: argparse.Namespace) -> dict[str, Any]:
    """Train for so many steps; the rate falls to nothing by their end, or by the end of the minutes."""
    rng = np.random.default_rng(options.seed)
    weights = jax.tree.map(jnp.asarray, unet.initial(len(NAMES), options.seed))
    machine = optax.inject_hyperparams(optax.adamw)(learning_rate=options.rate, weight_decay=1e-4)
    state, start, losses, mean = machine.init(weights), time.monotonic(), list[float](), weights

    @jax.jit
    def step(weights: Any, state: Any, images: Any, label: Any, use: Any) -> Any:
        value, slope = jax.value_and_grad(loss)(weights, images, label, use)
        norm = optax.global_norm(slope)
        slope = jax.tree.map(lambda g: g * jnp.minimum(1.0, 1.0 / (norm + 1e-6)), slope)
        change, state = machine.update(slope, state, weights)
        return optax.apply_updates(weights, change), state, value

    for count in range(options.steps):
        share = max(count / options.steps, (time.monotonic() - start) / (60.0 * options.minutes))
        if share >= 1.0:
            break
        batch = [crop(painted if rng.random() < PAINTED or not scans else scans, rng) for _ in range(BATCH)]
        images, label, use = (np.stack(part) for part in zip(*batch, strict=True))
        rate = options.rate * min(1.0, (count + 1) / WARM) * 0.5 * (1.0 + np.cos(np.pi * share))
        state.hyperparams["learning_rate"] = jnp.asarray(rate)
        weights, state, value = step(weights, state, images, label, use)
        kept = min(MEMORY, (count + 1) / (count + 10))
        mean = optax.incremental_update(weights, mean, 1.0 - kept)
        losses.append(float(value))
        if len(losses) % 50 == 0:
            print(f"{len(losses)} steps, {time.monotonic() - start:.0f} s, loss {np.mean(losses[-50:]):.4f}", flush=True)
    print(f"{len(losses)} steps, {time.monotonic() - start:.0f} s", flush=True)
    return mean


def crop(pictures: Sequence[Seen], rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cut a piece out of a picture, half of them about wet lining if there is any, perhaps mirrored, upside down or fainter."""
    one = pictures[rng.integers(len(pictures))]
    wet = np.argwhere(one.label == WET) if rng.random() < 0.5 else np.empty((0, 2), int)
    middle = wet[rng.integers(len(wet))] + rng.integers(-70, 71, 2) if len(wet) else rng.integers(0, one.label.shape)
    images = np.zeros((CROP, CROP, one.images.shape[0]), np.float32)
    label, use = np.zeros((CROP, CROP), np.int32), np.zeros((CROP, CROP), np.float32)
    low = [int(np.clip(m - CROP // 2, 0, max(n - CROP, 0))) // 2 * 2 for m, n in zip(middle, one.label.shape, strict=True)]
    there = tuple(slice(a, a + CROP) for a in low)
    height, width = one.label[there].shape
    images[:height, :width] = one.images[:, *there].transpose(1, 2, 0)
    label[:height, :width] = np.where(one.label[there] == OTHER, 2, one.label[there] == WET)
    use[:height, :width] = one.lining[there] & (one.label[there] != LIMIT)
    factor = np.exp(rng.uniform(*np.log(STRONGER)))
    images[..., :CONTRASTS] *= factor
    images[..., ROUGH] += np.log(factor)
    if rng.random() < 0.5:
        images, label, use = images[:, ::-1], label[:, ::-1], use[:, ::-1]
    if rng.random() < 0.5:
        images, label, use = images[::-1].copy(), label[::-1], use[::-1]
        images[..., DOWNWARDS] *= -1
    return images, label, use


def loss(weights: Any, images: Any, label: Any, use: Any) -> Any:
    """Cross entropy of the classes, and one minus the overlap of what is wet (Milletari et al., 2016)."""
    logits = forward(weights, images)
    entropy = -jnp.take_along_axis(jax.nn.log_softmax(logits), label[..., None], -1)[..., 0]
    counted = use * jnp.asarray(WEIGHTS)[label]
    p, wet = jax.nn.softmax(logits)[..., 1] * use, (label == 1) * use
    overlap = (2 * (p * wet).sum() + 50.0) / (p.sum() + wet.sum() + 50.0)
    return (entropy * counted).sum() / (counted.sum() + 1.0) + 0.5 * (1.0 - overlap)


@partial(jax.jit)
def forward(weights: Any, x: Any) -> Any:
    """Logits (n, rows, columns, CLASSES) of images (n, rows, columns, channels)."""

    def conv(x: Any, name: str) -> Any:
        d = unet.dilation(name)
        y = jax.lax.conv_general_dilated(
            x, weights[f"{name}.w"], (1, 1), "SAME", rhs_dilation=(d, d), dimension_numbers=("NHWC", "HWIO", "NHWC")
        )
        return y + weights[f"{name}.b"]

    kept = []
    n, rows, columns, channels = x.shape
    x = (
        x.reshape(n, rows // 2, 2, columns // 2, 2, channels)
        .transpose(0, 1, 3, 2, 4, 5)
        .reshape(n, rows // 2, columns // 2, -1)
    )
    for k in range(len(unet.WIDTHS) - 1):
        x = jax.nn.relu(conv(jax.nn.relu(conv(x, f"down{k}a")), f"down{k}b"))
        kept.append(x)
        x = jax.lax.reduce_window(x, -jnp.inf, jax.lax.max, (1, 2, 2, 1), (1, 2, 2, 1), "VALID")
    for k in range(len(unet.DILATIONS)):
        x = jax.nn.relu(conv(x, f"deep{k}"))
    for k in reversed(range(len(unet.WIDTHS) - 1)):
        x = jnp.concatenate([jnp.repeat(jnp.repeat(x, 2, 1), 2, 2), kept[k]], -1)
        x = jax.nn.relu(conv(jax.nn.relu(conv(x, f"up{k}a")), f"up{k}b"))
    x = conv(x, "out").reshape(n, rows // 2, columns // 2, 2, 2, unet.CLASSES)
    return x.transpose(0, 1, 3, 2, 4, 5).reshape(n, rows, columns, unet.CLASSES)


if __name__ == "__main__":
    main()
