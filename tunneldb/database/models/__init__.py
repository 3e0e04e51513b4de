"""Tables of schemas `tunnel` and `tunnel_audit`, as SQLAlchemy models.

Alembic compares these with the database; `migrations/baseline/tables.sql` is written from them. Units: metres,
decibels, seconds, square metres, unless a comment says otherwise.
"""

from tunneldb.database.models.base import AUDIT_SCHEMA, SCHEMA, Base
from tunneldb.database.models.catalog import AlignmentElement, Pose, Reference, Station, StationEquation, Survey, Tunnel
from tunneldb.database.models.change import ChangeImage, ChangeRegion, ChangeSection, LeakChange
from tunneldb.database.models.clearance import ClearanceInfringement, ClearanceSection, Gauge
from tunneldb.database.models.files import FileKm, Incoming, Point, ScanFile
from tunneldb.database.models.finding import BoundaryRegion, FeatureList, Finding, FindingKind, FindingSum, Photo, Severity
from tunneldb.database.models.geometry import AxisVertex, Section, SectionClass, Segment
from tunneldb.database.models.ground import Cluster, Ground, Lining, TargetSphere
from tunneldb.database.models.leak import (
    Coverage,
    Image,
    LearnedModel,
    Radiometry,
    RangeCurve,
    Region,
    Waterproof,
)
from tunneldb.database.models.ring import Ring, RingChord
from tunneldb.database.models.shape import DesignProfile, DeviationSection
from tunneldb.database.models.sonar import Bed, Ladder, RegistrationResidual, SonarPoint, SonarScan
from tunneldb.database.models.structures import Face, Member, Spot
from tunneldb.database.models.surfaces import EvennessArea, EvennessSection, ThicknessSection
from tunneldb.database.models.work import Audit, Goal, Run, Stage, Worker

__all__ = [
    "AUDIT_SCHEMA",
    "SCHEMA",
    "AlignmentElement",
    "Audit",
    "AxisVertex",
    "Base",
    "Bed",
    "BoundaryRegion",
    "ChangeImage",
    "ChangeRegion",
    "ChangeSection",
    "ClearanceInfringement",
    "ClearanceSection",
    "Cluster",
    "Coverage",
    "DesignProfile",
    "DeviationSection",
    "EvennessArea",
    "EvennessSection",
    "Face",
    "FeatureList",
    "FileKm",
    "Finding",
    "FindingKind",
    "FindingSum",
    "Gauge",
    "Goal",
    "Ground",
    "Image",
    "Incoming",
    "Ladder",
    "LeakChange",
    "LearnedModel",
    "Lining",
    "Member",
    "Photo",
    "Point",
    "Pose",
    "Radiometry",
    "RangeCurve",
    "Reference",
    "Region",
    "RegistrationResidual",
    "Ring",
    "RingChord",
    "Run",
    "ScanFile",
    "Section",
    "SectionClass",
    "Segment",
    "Severity",
    "SonarPoint",
    "SonarScan",
    "Spot",
    "Stage",
    "Station",
    "StationEquation",
    "Survey",
    "TargetSphere",
    "ThicknessSection",
    "Tunnel",
    "Waterproof",
    "Worker",
]
