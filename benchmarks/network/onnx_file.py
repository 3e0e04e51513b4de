"""Write the network as ONNX: probabilities (1, CLASSES, rows, columns) from images (1, channels, rows, columns)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from benchmarks.network import unet


def write_onnx(weights: Mapping[str, np.ndarray], channels: int, path: Path, notes: Mapping[str, str]) -> None:
    """Write the graph; rows and columns must be multiples of :data:`tunneldb.segmentation.channels.STRIDE`."""
    nodes, constants = [], [numpy_helper.from_array(np.array([1, 1, 2, 2], np.float32), "twice")]

    def conv(x: str, name: str, *, relu: bool = True) -> str:
        d = unet.dilation(name)
        kernel = np.ascontiguousarray(weights[f"{name}.w"].transpose(3, 2, 0, 1))
        constants.extend(
            [numpy_helper.from_array(kernel, f"{name}.w"), numpy_helper.from_array(weights[f"{name}.b"], f"{name}.b")]
        )
        pad = d * (kernel.shape[2] // 2)
        nodes.append(
            helper.make_node(
                "Conv", [x, f"{name}.w", f"{name}.b"], [f"{name}.y"], kernel_shape=list(kernel.shape[2:]), dilations=[d, d],
                pads=[pad] * 4,
            )
        )  # fmt: skip
        if relu:
            nodes.append(helper.make_node("Relu", [f"{name}.y"], [name]))
        return name if relu else f"{name}.y"

    # Four neighbours, one after the other, of all channels: as in training.
    nodes.append(helper.make_node("SpaceToDepth", ["images"], ["fours"], blocksize=2))
    x, kept = "fours", list[str]()
    for k in range(len(unet.WIDTHS) - 1):
        x = conv(conv(x, f"down{k}a"), f"down{k}b")
        kept.append(x)
        nodes.append(helper.make_node("MaxPool", [x], [f"pool{k}"], kernel_shape=[2, 2], strides=[2, 2]))
        x = f"pool{k}"
    for k in range(len(unet.DILATIONS)):
        x = conv(x, f"deep{k}")
    for k in reversed(range(len(unet.WIDTHS) - 1)):
        nodes.append(
            helper.make_node(
                "Resize", [x, "", "twice"], [f"larger{k}"], mode="nearest", nearest_mode="floor",
                coordinate_transformation_mode="asymmetric",
            )
        )  # fmt: skip
        nodes.append(helper.make_node("Concat", [f"larger{k}", kept[k]], [f"both{k}"], axis=1))
        x = conv(conv(f"both{k}", f"up{k}a"), f"up{k}b")
    nodes.append(helper.make_node("DepthToSpace", [conv(x, "out", relu=False)], ["logits"], blocksize=2, mode="DCR"))
    nodes.append(helper.make_node("Softmax", ["logits"], ["probabilities"], axis=1))
    graph = helper.make_graph(
        nodes, "wet lining",
        [helper.make_tensor_value_info("images", TensorProto.FLOAT, [1, channels, "rows", "columns"])],
        [helper.make_tensor_value_info("probabilities", TensorProto.FLOAT, [1, unet.CLASSES, "rows", "columns"])],
        constants,
    )  # fmt: skip
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    helper.set_model_props(model, dict(notes))
    onnx.checker.check_model(model)
    onnx.save(model, path)


def read_weights(path: Path) -> dict[str, np.ndarray]:
    """Read the weights that :func:`write_onnx` wrote."""
    constants = {one.name: numpy_helper.to_array(one) for one in onnx.load(path).graph.initializer}
    return {
        name: value.transpose(2, 3, 1, 0) if name.endswith(".w") else value
        for name, value in constants.items()
        if name.endswith((".w", ".b"))
    }
