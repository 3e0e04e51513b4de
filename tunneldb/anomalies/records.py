"""Plain records of detection: anomalies, earlier findings, and regions at the ends of kilometres."""

from __future__ import annotations

from dataclasses import dataclass

from shapely.geometry import Polygon

from tunneldb.anomalies.regions import Region
from tunneldb.anomalies.verdict import Verdict
from tunneldb.geometry.stationing import KILOMETRE


@dataclass(frozen=True)
class Anomaly:
    """An anomaly in the unrolled plane.

    Attributes
    ----------
    outline : Polygon
        (chainage, arc), m.
    darkening_mean, darkening_max : float
        Mean and greatest darkening relative to the background, dB.
    contrast : float
        Mean darkening in standard deviations of the surrounding background.
    image_share : float
        Share of its pixels with points, 0 to 1.
    verdict : Verdict
        Its classification.
    """

    outline: Polygon
    darkening_mean: float
    darkening_max: float
    contrast: float
    image_share: float
    verdict: Verdict


@dataclass(frozen=True)
class EarlierFinding:
    """Finding of an earlier detection run.

    Attributes
    ----------
    id : int
        Key.
    km : int
        Kilometre of its middle.
    reviewed : bool
        True if an inspector edited it: a review, a kind, a severity, a remark, a photo, or a merge.
    wet : bool
        True if its kind counts as wet, by the inspector, else as detected.
    dry : bool
        True if it is open and a dry region removes it. Detection does not find it again for that reason.
    outline : Polygon
        (chainage, arc), m.
    """

    id: int
    km: int
    reviewed: bool
    wet: bool
    dry: bool
    outline: Polygon


@dataclass(frozen=True)
class BoundaryRegion:
    """A dark region that reaches an end of its kilometre.

    Attributes
    ----------
    id : int
        Key.
    km : int
        Kilometre.
    finding : int or None
        Key of the finding that it is a part of.
    region : Region
        Its pixels.
    """

    id: int
    km: int
    finding: int | None
    region: Region

    def reaches(self, plane: int) -> bool:
        """Return True if the region touches the beginning of kilometre ``plane``, from either side."""
        column = round(plane * KILOMETRE / self.region.pixel)
        return column in (self.region.column, self.region.stop)

    def concerns(self, km: int) -> bool:
        """Return True if the region lies in kilometre ``km`` or touches one of its ends from outside."""
        return self.km == km or (self.km == km - 1 and self.reaches(km)) or (self.km == km + 1 and self.reaches(km + 1))
