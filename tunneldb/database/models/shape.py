"""Design profiles of tunnels, and deviations of the linings of surveys from them."""

from __future__ import annotations

import datetime as dt

from sqlalchemy import BigInteger, CheckConstraint, Identity, Index, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column

from tunneldb.database.models.base import CLOCK, KM, SURVEY, TUNNEL, Base, Floats, Reals, one_of, parent

LAYERS = ("lining", "shotcrete", "excavation")
"""Layers of profiles, from inside."""


class DesignProfile(Base):
    """Outline that is valid from one chainage to another."""

    __tablename__ = "design_profile"
    __table_args__ = (
        UniqueConstraint("tunnel_id", "layer", "name"),
        one_of("layer", *LAYERS),
        CheckConstraint("chainage_from < chainage_to", name="chainage"),
        CheckConstraint("cardinality(outline) >= 6 AND cardinality(outline) % 3 = 0", name="outline"),
        {"comment": "Design profiles of a tunnel, by layer; between two of a layer the one goes over into the other linearly"},
    )

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True, comment="Key")
    tunnel_id: Mapped[int] = mapped_column(parent("tunnel"), comment=TUNNEL)
    name: Mapped[str] = mapped_column(comment="Name")
    layer: Mapped[str] = mapped_column(comment="lining, shotcrete or excavation")
    chainage_from: Mapped[float] = mapped_column(comment="Chainage of the given axis from which it holds, m")
    chainage_to: Mapped[float] = mapped_column(comment="Chainage up to which it holds, m")
    outline: Mapped[Floats] = mapped_column(
        comment="Vertices: to the right of the axis, above it, m, and bulge of the edge to the next vertex; clockwise"
        " looking up-chainage"
    )
    source: Mapped[str] = mapped_column(comment="File that it was read from")
    added_at: Mapped[dt.datetime] = mapped_column(server_default=CLOCK, comment="Time when it was added")


class DeviationSection(Base):
    """Lining of a step of chainage compared with its design."""

    __tablename__ = "deviation_section"
    __table_args__ = (
        UniqueConstraint("survey_id", "layer", "chainage_from"),
        Index(None, "survey_id", "layer", "overbreak"),
        Index(None, "survey_id", "layer", "underbreak"),
        one_of("layer", *LAYERS),
        {"comment": "Deviation of the lining from its design profile, in steps of chainage and of length along the profile"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    km: Mapped[int] = mapped_column(comment=KM)
    layer: Mapped[str] = mapped_column(comment="Layer of the profile: lining, shotcrete or excavation")
    profile: Mapped[str] = mapped_column(comment="Name of the profile, of a transition both")
    chainage_from: Mapped[float] = mapped_column(comment="Chainage of its beginning, m")
    chainage_to: Mapped[float] = mapped_column(comment="Chainage of its end, m")
    design_length: Mapped[float] = mapped_column(comment="Length of the profile in its middle, m")
    seen_length: Mapped[float] = mapped_column(comment="Inspected length of the profile, m")
    overbreak: Mapped[float] = mapped_column(comment="Area outside the profile, of what is seen, m²")
    underbreak: Mapped[float] = mapped_column(comment="Area inside the profile, of what is seen, m²")
    noise_area: Mapped[float] = mapped_column(
        comment="Standard deviation of underbreak less overbreak by the scatter of pixels, m²"
    )
    over_right: Mapped[float] = mapped_column(comment="By how much overbreak grows when the axis moves to the right, m²/m")
    over_up: Mapped[float] = mapped_column(comment="By how much overbreak grows when the axis moves up, m²/m")
    under_right: Mapped[float] = mapped_column(comment="By how much underbreak grows when the axis moves to the right, m²/m")
    under_up: Mapped[float] = mapped_column(comment="By how much underbreak grows when the axis moves up, m²/m")
    sigma: Mapped[float | None] = mapped_column(
        comment="Scatter of pixels within cells: noise, and the lining's texture, m; NULL where nothing is seen"
    )
    shift_right: Mapped[float | None] = mapped_column(
        comment="Shift of the lining as a whole to the right of the profile, m; NULL if too little was inspected"
    )
    shift_up: Mapped[float | None] = mapped_column(comment="Shift of the lining as a whole above the profile, m")
    deviation_mean: Mapped[float | None] = mapped_column(
        comment="Mean deviation of the cells seen, m; NULL where nothing is seen"
    )
    deviation_least: Mapped[float | None] = mapped_column(comment="Least mean of a cell, m: the greatest overbreak")
    least_at: Mapped[float | None] = mapped_column(comment="Distance of that cell along the profile, m")
    deviation_greatest: Mapped[float | None] = mapped_column(comment="Greatest mean of a cell, m: the greatest underbreak")
    greatest_at: Mapped[float | None] = mapped_column(comment="Distance of that cell along the profile, m")
    deviation: Mapped[Reals] = mapped_column(
        comment="Mean deviation in cells of equal length along the profile, from its beginning, m, positive inside; "
        "NaN: not inspected"
    )
