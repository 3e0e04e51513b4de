"""Images of other instruments, placed in the unrolled plane of a survey."""

from __future__ import annotations

import datetime as dt

from sqlalchemy import BigInteger, CheckConstraint, Identity, Index, UniqueConstraint, text
from sqlalchemy.orm import Mapped, mapped_column

from tunneldb.database.models.base import NOW, SURVEY, Base, at_most, one_of, parent

KINDS = ("thermal", "photo", "radar", "moisture", "other")
PLACEMENTS = ("coordinates", "points", "frames", "poses")


class ImportedImage(Base):
    """Image of another instrument; its pixels are in the table of images."""

    __tablename__ = "imported_image"
    __table_args__ = (
        UniqueConstraint("survey_id", "name"),
        one_of("kind", *KINDS),
        one_of("placement", *PLACEMENTS),
        CheckConstraint("name ~ '^[a-z0-9][a-z0-9-]{0,39}$'", name="name"),
        at_most("unit", 20),
        at_most("source", 1000),
        {
            "comment": "Images of other instruments, placed in the unrolled plane of a survey; their pixels are blocks of kind "
            "imported_NAME in tunnel.image"
        },
    )

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    name: Mapped[str] = mapped_column(comment="Name within the survey: small letters, digits and hyphens")
    kind: Mapped[str] = mapped_column(comment="thermal, photo, radar, moisture or other")
    colour: Mapped[bool] = mapped_column(comment="True if it has the bands red, green and blue")
    unit: Mapped[str] = mapped_column(comment="Unit of its values, such as °C; empty without one")
    value_from: Mapped[float] = mapped_column(comment="Least value of the source, in the unit")
    value_to: Mapped[float] = mapped_column(comment="Greatest value of the source, in the unit")
    step: Mapped[float] = mapped_column(comment="Size of one stored step, in the unit")
    pixel: Mapped[float] = mapped_column(comment="Side of a pixel, m")
    placement: Mapped[str] = mapped_column(
        comment="How it was placed: coordinates (of the file), points (control points), frames (a table of places), or poses"
        " (of the cameras of an E57 file)"
    )
    model: Mapped[str | None] = mapped_column(
        comment="Mapping fitted to control points: similarity, affine or piecewise (along the tunnel); NULL without points"
    )
    frames: Mapped[int] = mapped_column(comment="Number of source images")
    points: Mapped[int | None] = mapped_column(comment="Number of control points")
    outliers: Mapped[int | None] = mapped_column(comment="Number of control points that were not used")
    residual: Mapped[float | None] = mapped_column(comment="Root mean square of the residuals of the points that were used, m")
    predicted: Mapped[float | None] = mapped_column(
        comment="The same of points that are predicted from the others, m; NULL without redundant points"
    )
    chainage_from: Mapped[float] = mapped_column(comment="Least chainage of its frame, m")
    chainage_to: Mapped[float] = mapped_column(comment="Greatest chainage of its frame, m")
    arc_from: Mapped[float] = mapped_column(comment="Least arc of its frame, m, positive right looking up-chainage")
    arc_to: Mapped[float] = mapped_column(comment="Greatest arc of its frame, m")
    source: Mapped[str] = mapped_column(comment="Name of the file that was imported")
    warnings: Mapped[list[str]] = mapped_column(comment="Warnings about its placement")
    imported_by: Mapped[str] = mapped_column(server_default=text("CURRENT_USER"), comment="Role that imported it")
    imported_at: Mapped[dt.datetime] = mapped_column(server_default=NOW, comment="Time of the import")


class FindingImage(Base):
    """Values of another image than the intensity under a finding, and around it."""

    __tablename__ = "finding_image"
    __table_args__ = (
        Index("finding_image_finding_idx", "finding_id", text("COALESCE(imported_image_id, 0)"), unique=True),
        Index(None, "imported_image_id"),
        {
            "comment": "Values of other images than the intensity under findings, and around them: the image in colour of the "
            "scan, and imported images"
        },
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    finding_id: Mapped[int] = mapped_column(parent("finding"), comment="Finding")
    imported_image_id: Mapped[int | None] = mapped_column(
        parent("imported_image"), comment="Imported image; NULL for the image in colour of the scan"
    )
    outline_key: Mapped[str] = mapped_column(comment="Key of the outline that was measured: the values are of no other one")
    mean: Mapped[float] = mapped_column(comment="Mean under the outline, in the image's unit; of colours, lightness L*")
    surroundings: Mapped[float] = mapped_column(comment="Median of the lining around it, in the same unit")
    spread: Mapped[float] = mapped_column(comment="Standard deviation there, from the median absolute deviation")
    share: Mapped[float] = mapped_column(comment="Share of the pixels under the outline that have values, 0 to 1")
