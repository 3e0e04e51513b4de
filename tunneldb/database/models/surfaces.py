"""Layers between the linings of two surveys, and evenness of a lining."""

from __future__ import annotations

from typing import Any

from sqlalchemy import BigInteger, Identity, Index, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column

from tunneldb.database.models.base import KM, SURVEY, Base, Reals, geometry, one_of, parent
from tunneldb.database.models.shape import LAYERS


class ThicknessSection(Base):
    """Layer between the linings of two surveys, for a step of chainage."""

    __tablename__ = "thickness_section"
    __table_args__ = (
        UniqueConstraint(
            "survey_id", "before_id", "layer", "chainage_from",
            name="thickness_section_survey_id_before_id_layer_chainage_from_key",
        ),
        Index(None, "before_id"),
        Index("thickness_section_survey_id_thickness_least_idx", "survey_id", "thickness_least"),
        one_of("layer", *LAYERS),
        {"comment": "What lies between the linings of two surveys, along normals of a layer's profiles, in steps of chainage"},
    )  # fmt: skip

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment="Later survey")
    before_id: Mapped[int] = mapped_column(parent("survey"), comment="Earlier survey")
    km: Mapped[int] = mapped_column(comment=KM)
    layer: Mapped[str] = mapped_column(comment="Layer whose profiles both were compared with")
    chainage_from: Mapped[float] = mapped_column(comment="Chainage of its beginning, m")
    chainage_to: Mapped[float] = mapped_column(comment="Chainage of its end, m")
    design_length: Mapped[float] = mapped_column(comment="Length of the profile in its middle, m")
    compared_length: Mapped[float] = mapped_column(comment="Length that both surveys inspected, m")
    area: Mapped[float] = mapped_column(comment="Area between the two surfaces, of what both saw, m²")
    noise_area: Mapped[float] = mapped_column(comment="Standard deviation of the area by the scatter of pixels, m²")
    by_right: Mapped[float] = mapped_column(comment="By how much the area grows when the later survey moves to the right, m²/m")
    by_up: Mapped[float] = mapped_column(comment="By how much the area grows when the later survey moves up, m²/m")
    thickness_mean: Mapped[float | None] = mapped_column(comment="Mean of the cells that both saw, m; NULL without any")
    thickness_least: Mapped[float | None] = mapped_column(comment="Least of a cell, m")
    least_at: Mapped[float | None] = mapped_column(comment="Distance of that cell along the profile, m")
    thickness: Mapped[Reals] = mapped_column(
        comment="In cells of equal length along the profile, from its beginning, m; NaN where either saw nothing"
    )


class EvennessSection(Base):
    """Gaps beneath a virtual straightedge on the lining, for a step of chainage."""

    __tablename__ = "evenness_section"
    __table_args__ = (
        UniqueConstraint("survey_id", "layer", "chainage_from"),
        one_of("layer", *LAYERS),
        {"comment": "Gaps beneath a straightedge on the lining, the curvature of the design taken out, in steps of chainage"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    km: Mapped[int] = mapped_column(comment=KM)
    layer: Mapped[str] = mapped_column(comment="Layer whose profiles are the template")
    straightedge: Mapped[float] = mapped_column(comment="Length of the straightedge, m")
    gap_limit: Mapped[float] = mapped_column(comment="Limit of the gap beneath it, m")
    chainage_from: Mapped[float] = mapped_column(comment="Chainage of its beginning, m")
    chainage_to: Mapped[float] = mapped_column(comment="Chainage of its end, m")
    arc_from: Mapped[float] = mapped_column(comment="Arc of the first cell's edge, m")
    cell: Mapped[float] = mapped_column(comment="Side of a cell, m")
    lining_area: Mapped[float] = mapped_column(comment="Lining that was seen, m²")
    measured_area: Mapped[float] = mapped_column(comment="Part of it beneath a straightedge, along or around, m²")
    over_area: Mapped[float] = mapped_column(comment="Part of it with a gap greater than the limit, m²")
    gap_along: Mapped[float | None] = mapped_column(
        comment="Greatest gap beneath a straightedge laid along the tunnel, m; NULL where none could be laid"
    )
    gap_along_at: Mapped[float | None] = mapped_column(comment="Arc of that, m")
    gap_around: Mapped[float | None] = mapped_column(
        comment="Greatest gap beneath one laid around the section, m; NULL where none could be laid"
    )
    gap_around_at: Mapped[float | None] = mapped_column(comment="Arc of that, m")
    waviness: Mapped[float | None] = mapped_column(
        comment="Greatest depth of a hollow over the distance to its nearer rim; NULL where there is none"
    )
    sigma: Mapped[float | None] = mapped_column(comment="Standard deviation of a cell's mean by the scatter of pixels, m")
    along: Mapped[Reals] = mapped_column(
        comment="Greatest gap beneath a straightedge laid along, by cells of arc, m; NaN where none could be laid"
    )
    around: Mapped[Reals] = mapped_column(
        comment="Greatest gap beneath a straightedge laid around, by cells of arc, m; NaN where none could be laid"
    )


class EvennessArea(Base):
    """Area where the gap beneath a straightedge exceeds the limit."""

    __tablename__ = "evenness_area"
    __table_args__ = (
        Index("evenness_area_survey_id_layer_km_idx", "survey_id", "layer", "km"),
        Index("evenness_area_survey_id_layer_gap_idx", "survey_id", "layer", "gap"),
        one_of("layer", *LAYERS),
        one_of("direction", "along", "around"),
        {"comment": "Where the gap beneath a straightedge is greater than the limit; cut by the ends of kilometres"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    km: Mapped[int] = mapped_column(comment=KM)
    layer: Mapped[str] = mapped_column(comment="Layer whose profiles are the template")
    area: Mapped[float] = mapped_column(comment="Area, m²")
    gap: Mapped[float] = mapped_column(comment="Greatest gap in it, m")
    direction: Mapped[str] = mapped_column(comment="along or around: how the straightedge lay")
    geom: Mapped[Any] = mapped_column(geometry("POLYGON"), comment="In the unrolled plane, m")
