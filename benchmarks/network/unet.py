"""The network: a U-Net of plain convolutions, as arrays of weights; training and ONNX share its plan."""

from __future__ import annotations

from typing import Any

import numpy as np

WIDTHS = (16, 32, 48, 64)
"""Channels at 8, 16, 32 and 64 cm: pixels of 4 cm come in, and go out, in fours."""

DILATIONS = (1, 1, 2)
"""Of the convolutions at the coarsest pixels."""

CLASSES = 3
"""Dry lining, wet, dark but dry or bright."""


def shapes(channels: int) -> dict[str, tuple[int, int, int, int]]:
    """Shapes (height, width, in, out) of all convolutions by name."""
    out: dict[str, tuple[int, int, int, int]] = {}
    before = 4 * channels
    for k, width in enumerate(WIDTHS[:-1]):
        out[f"down{k}a"], out[f"down{k}b"] = (3, 3, before, width), (3, 3, width, width)
        before = width
    for k in range(len(DILATIONS)):
        out[f"deep{k}"] = (3, 3, before, WIDTHS[-1])
        before = WIDTHS[-1]
    for k in reversed(range(len(WIDTHS) - 1)):
        width = WIDTHS[k]
        out[f"up{k}a"], out[f"up{k}b"] = (3, 3, before + width, width), (3, 3, width, width)
        before = width
    out["out"] = (1, 1, before, 4 * CLASSES)
    return out


def initial(channels: int, seed: int) -> dict[str, Any]:
    """Weights and biases to begin with (He et al., 2015)."""
    rng, weights = np.random.default_rng(seed), {}
    for name, shape in shapes(channels).items():
        spread = np.sqrt((2.0 if name != "out" else 0.1) / np.prod(shape[:3]))
        weights[f"{name}.w"] = rng.normal(0, spread, shape).astype(np.float32)
        weights[f"{name}.b"] = np.zeros(shape[3], np.float32)
    return weights


def dilation(name: str) -> int:
    """Dilation of a convolution."""
    return DILATIONS[int(name[4:])] if name.startswith("deep") else 1
