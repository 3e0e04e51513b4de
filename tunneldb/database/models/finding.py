"""Kinds, severities and photos of findings."""

from __future__ import annotations

import datetime as dt

from sqlalchemy import BigInteger, CheckConstraint, Identity, Index, SmallInteger, Text, text
from sqlalchemy.dialects.postgresql import ARRAY
from sqlalchemy.orm import Mapped, mapped_column

from tunneldb.database.models.base import CLOCK, SURVEY, Base, parent


class FindingKind(Base):
    """Kind of finding."""

    __tablename__ = "finding_kind"
    __table_args__ = (
        CheckConstraint("code ~ '^[a-z][a-z0-9_]*$'", name="code"),
        CheckConstraint("geometries <@ '{polygon,line,point}' AND cardinality(geometries) > 0", name="geometries"),
        CheckConstraint("(code <> 'leak' OR wet) AND (code NOT IN ('joint', 'dark') OR NOT wet)", name="wet"),
        {"comment": "Kinds of findings, which an owner extends; those of detection are leak, joint and dark"},
    )

    id: Mapped[int] = mapped_column(Identity(), unique=True, comment="Key")
    code: Mapped[str] = mapped_column(primary_key=True, comment="Its code, in lower case")
    label: Mapped[str] = mapped_column(comment="Its name, in the owner's words")
    geometries: Mapped[list[str]] = mapped_column(ARRAY(Text), comment="What it may be drawn as: polygon, line, point")
    wet: Mapped[bool] = mapped_column(
        server_default=text("false"), comment="Whether it counts as wet in statistics and classes"
    )
    position: Mapped[int] = mapped_column(comment="Its place in lists")
    active: Mapped[bool] = mapped_column(server_default=text("true"), comment="Whether it is offered for what is drawn")


class Severity(Base):
    """Degree of severity."""

    __tablename__ = "severity"
    __table_args__ = (
        CheckConstraint("id BETWEEN 1 AND 4", name="id"),
        {"comment": "Words for the degrees of severity, which an owner changes to his own"},
    )

    id: Mapped[int] = mapped_column(SmallInteger, primary_key=True, autoincrement=False, comment="1, the least, to 4")
    label: Mapped[str] = mapped_column(comment="Its name, in the owner's words")
    text: Mapped[str | None] = mapped_column(comment="What it means")


class FindingSum(Base):
    """Change of the sums of findings by a change of findings."""

    __tablename__ = "finding_sum"
    __table_args__ = (
        Index(None, "survey_id"),
        {
            "comment": "What each change of findings adds to their numbers, areas and lengths: the sums of the rows are those "
            "of all findings. Rows are put together now and then"
        },
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    kind: Mapped[str] = mapped_column(comment="Kind, as judged")
    wet: Mapped[bool] = mapped_column(comment="Whether it counts as wet")
    origin: Mapped[str] = mapped_column(comment="How their outlines came about")
    severity: Mapped[int | None] = mapped_column(SmallInteger, comment="Severity")
    state: Mapped[str] = mapped_column(comment="open or confirmed, which count, rejected, gone, dry, same or merged")
    measured: Mapped[bool] = mapped_column(comment="Whether they were measured on the image")
    findings: Mapped[int] = mapped_column(BigInteger, comment="By how many they became more")
    area: Mapped[float] = mapped_column(comment="By how much their area grew, m²")
    length: Mapped[float] = mapped_column(comment="By how much the length of lines grew, m")
    extent: Mapped[float] = mapped_column(comment="The same, with what is no line as long as along the tunnel, m")


class Photo(Base):
    """Photo of a finding."""

    __tablename__ = "photo"
    __table_args__ = (
        CheckConstraint("path <> ''", name="path"),
        Index(None, "anomaly_id"),
        {"comment": "Photos of findings, by path or URL"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    anomaly_id: Mapped[int] = mapped_column(parent("anomaly"), comment="Finding that it shows")
    path: Mapped[str] = mapped_column(comment="Path or URL")
    caption: Mapped[str | None] = mapped_column(comment="What it shows")
    added_by: Mapped[str] = mapped_column(server_default=text("SESSION_USER"), comment="Who added it")
    added_at: Mapped[dt.datetime] = mapped_column(server_default=CLOCK, comment="When it was added")
