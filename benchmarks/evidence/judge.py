"""What detection is worth on tunnels of which the model knows none: each family judged by a model fitted to all others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.run import Outcome
from benchmarks.blind.score import calibration_error, hold, row
from benchmarks.common import print_table, progress
from benchmarks.evidence.detection import detect, judged_by
from benchmarks.evidence.fit import Array, cooled, fit_model, temperature
from benchmarks.evidence.networks import Networks
from benchmarks.evidence.pictures import pictures
from tunneldb.anomalies.evidence import EvidenceModel

HEADER = ("family", "scenes", "true", "found", "called", "right", "false", "leak F1", "area F1", "false/1000", "calibration")


@dataclass(frozen=True)
class Regions:
    """All regions that a model is fitted to.

    Attributes
    ----------
    features : (n, features) float array
    leak : (n,) bool array
    weights : (n,) float array
    families : (n,) object array
        Name of the family of each.
    held : (n,) float array
        Probability of each by a model fitted to other groups.
    """

    features: Array
    leak: NDArray[np.bool_]
    weights: Array
    families: NDArray[np.object_]
    held: Array

    def model_without(self, family: str, rounds: int) -> EvidenceModel:
        """Fit a model to all other families, and cool it by what is true of those of them that were scanned."""
        others = self.families != family
        model = fit_model(self.features[others], self.leak[others], self.weights[others], rounds, f"without {family}", {})
        scanned = others & (self.families != "painted")
        if not scanned.any():
            return model
        return cooled(model, max(temperature(self.held[scanned], self.leak[scanned], self.weights[scanned]), 1.0))


def judge(regions: Regions, rounds: int, families: Sequence[str], folder: Path, networks: Networks, dsn: str | None) -> None:
    """Detect in the pictures of each family by a model that knows none of it, and print what came out."""
    rows, every = [], []
    for family in families:
        with judged_by(regions.model_without(family, rounds)):
            seen = networks.of(family)
            outcomes = [detect(picture, truth, seen)[0] for picture, truth in pictures(family, folder, dsn)]
        rows.append(_cells(family, outcomes))
        progress("  ".join(rows[-1]))
        every += outcomes
    print_table("each family judged by a model fitted to the others", HEADER, [*rows, _cells("all", every)])


def _cells(name: str, outcomes: Sequence[Outcome]) -> list[str]:
    v = row(hold(outcomes))
    counts = [str(int(v[key])) for key in ("true", "found", "called", "right", "false")]
    shares = [f"{v[key]:.3f}" for key in ("f1", "area_f1")]
    return [name, str(len(outcomes)), *counts, *shares, f"{v['false_per_1000']:.2f}", f"{calibration_error(outcomes):.3f}"]
