"""Detection on a picture: search and judgement alone, as the stage ``detect`` does them, by any model."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from unittest import mock

from benchmarks.blind.run import Outcome
from benchmarks.evidence.candidates import LEAST
from tunneldb.anomalies import verdict
from tunneldb.anomalies.background.relate import relate
from tunneldb.anomalies.coverage import Coverage, measure_coverage
from tunneldb.anomalies.detect import Detection, classify_region, find_anomalies
from tunneldb.anomalies.evidence import EvidenceModel
from tunneldb.anomalies.records import Anomaly
from tunneldb.raster.image import LiningImage
from tunneldb.segmentation.network import Network


@contextmanager
def judged_by(model: EvidenceModel) -> Iterator[None]:
    """Have regions judged by a model, and not by the one that comes with the program."""
    with mock.patch.object(verdict, "standard_model", return_value=model):
        yield


def detect(picture: LiningImage, truth: Outcome, network: Network | None) -> tuple[Outcome, dict[int, Coverage]]:
    """Find what is dark in a picture.

    Parameters
    ----------
    picture : LiningImage
        Stays as it is.
    truth : Outcome
        What was found when the picture was made counts no more.
    network : Network or None
        The segmentation network.

    Returns
    -------
    outcome : Outcome
        Without classes of waterproofing.
    coverage : dict of int to Coverage
        Of the picture's kilometre.
    """
    picture = LiningImage(picture.grid, picture.state, picture.level.copy(), picture.gaps)
    background, contrast = relate(picture, [], network)
    found = find_anomalies(contrast, background, LEAST)
    coverage = measure_coverage(contrast.state, found.wet, picture.grid, found.size)
    anomalies = _whole(found)
    verdicts = [anomaly.verdict for anomaly in anomalies]
    outcome = Outcome(
        truth.scene, truth.lining, truth.phenomenon, truth.true, truth.drops, truth.phenomena, truth.limits,
        [anomaly.outline for anomaly in anomalies], [one.kind for one in verdicts],
        [one.confidence if one.kind == "leak" else 1.0 - one.confidence for one in verdicts],
        [list(one.reasons) for one in verdicts], float(coverage.seen.sum()), truth.seconds, truth.other, truth.other_kinds,
    )  # fmt: skip
    return outcome, {picture.grid.km: coverage}


def _whole(found: Detection) -> list[Anomaly]:
    """Return all detected regions, including those at an end of the only kilometre."""
    cut = [classify_region(region, LEAST) for region in found.cut]
    return [*found.anomalies, *(anomaly for anomaly in cut if anomaly is not None)]
