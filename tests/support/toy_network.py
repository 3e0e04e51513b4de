"""Segmentation networks made by hand: one that answers by darkness alone, and one that looks as far as a network may."""

from __future__ import annotations

import numpy as np
from onnx import NodeProto, TensorProto, helper, numpy_helper

from tunneldb.segmentation.channels import CONTRAST, NAMES, STRIDE

CHANNEL = NAMES.index("level of 0.08 m to the ring")


def toy_network(drop: float = 2.0, steepness: float = 40.0, channels: int = len(NAMES), version: str | None = None) -> bytes:
    """Return the ONNX file of a network for which lining is water from ``drop`` on, dB, below the brightest of its ring."""
    weight = np.zeros((3, channels, 1, 1), np.float32)
    weight[1, CHANNEL] = -steepness
    bias = np.array([0.0, -steepness * drop / CONTRAST, -50.0], np.float32)
    nodes = [
        helper.make_node("Conv", ["images", "weight", "bias"], ["logits"], kernel_shape=[1, 1]),
        helper.make_node("Softmax", ["logits"], ["probabilities"], axis=1),
    ]
    return _file(nodes, {"weight": weight, "bias": bias}, channels, version)


def wide_network(seed: int = 1) -> bytes:
    """Return a network with random weights that pools pixels of STRIDE, and in which each pixel depends on a wide area."""
    rng, n, far = np.random.default_rng(seed), 8, 6
    weights = {
        "a": rng.normal(0, 0.3, (n, len(NAMES), 3, 3)),
        "b": rng.normal(0, 0.4, (n, n, 3, 3)),
        "c": rng.normal(0, 0.8, (3, 2 * n, 3, 3)),
        "by": np.array([1, 1, STRIDE, STRIDE]),
    }
    nearest = {"mode": "nearest", "nearest_mode": "floor", "coordinate_transformation_mode": "asymmetric"}
    nodes = [
        helper.make_node("Conv", ["images", "a"], ["near"], kernel_shape=[3, 3], pads=[1] * 4),
        helper.make_node("MaxPool", ["near"], ["pooled"], kernel_shape=[STRIDE] * 2, strides=[STRIDE] * 2),
        helper.make_node("Conv", ["pooled", "b"], ["wide"], kernel_shape=[3, 3], dilations=[far] * 2, pads=[far] * 4),
        helper.make_node("Resize", ["wide", "", "by"], ["large"], **nearest),
        helper.make_node("Concat", ["near", "large"], ["both"], axis=1),
        helper.make_node("Conv", ["both", "c"], ["logits"], kernel_shape=[3, 3], pads=[1] * 4),
        helper.make_node("Softmax", ["logits"], ["probabilities"], axis=1),
    ]
    return _file(nodes, weights, len(NAMES), "wide")


def _file(nodes: list[NodeProto], constants: dict[str, np.ndarray], channels: int, version: str | None) -> bytes:
    shapes = {"images": channels, "probabilities": 3}
    ends = [helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, n, "rows", "columns"]) for name, n in shapes.items()]
    arrays = [numpy_helper.from_array(value.astype(np.float32), name) for name, value in constants.items()]
    graph = helper.make_graph(nodes, "toy", ends[:1], ends[1:], arrays)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    if version is not None:
        helper.set_model_props(model, {"version": version})
    return bytes(model.SerializeToString())
