"""Actions: what is to be done about findings, by whom and until when."""

from __future__ import annotations

import datetime as dt
from decimal import Decimal

from sqlalchemy import BigInteger, CheckConstraint, ForeignKey, Identity, Index, Numeric, text
from sqlalchemy.orm import Mapped, mapped_column

from tunneldb.database.models.base import CLOCK, SCHEMA, SURVEY, Base, at_most, bounded, one_of, parent


class Action(Base):
    """Action that an inspection demands."""

    __tablename__ = "action"
    __table_args__ = (
        one_of("urgency", "immediate", "urgent", "planned", "monitor"),
        one_of("state", "open", "ordered", "done", "verified"),
        CheckConstraint("measure <> ''", name="measure"),
        at_most("measure", 2000),
        at_most("element", 200),
        at_most("responsible", 200),
        at_most("remark", 10000),
        bounded("place", "chainage_from", "chainage_to", "arc"),
        CheckConstraint("chainage_from <= chainage_to", name="order"),
        CheckConstraint("due >= '1900-01-01' AND due <= '2199-12-31'", name="due"),
        CheckConstraint("cost >= 0 AND cost <= 1e12 AND (cost IS NULL) = (currency IS NULL)", name="cost"),
        CheckConstraint("currency ~ '^[A-Z]{3}$'", name="currency"),
        Index(None, "survey_id"),
        Index(None, "finding_id"),
        {"comment": "Actions that inspections demand: measure, urgency, responsible, due date, cost, state"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    finding_id: Mapped[int | None] = mapped_column(
        ForeignKey(f"{SCHEMA}.finding.id", ondelete="SET NULL"), comment="Finding that it is about"
    )
    element: Mapped[str | None] = mapped_column(comment="Name of the element that it is about")
    chainage_from: Mapped[float] = mapped_column(comment="Chainage of its beginning, m")
    chainage_to: Mapped[float] = mapped_column(comment="Chainage of its end, m")
    arc: Mapped[float | None] = mapped_column(comment="Arc of its place, m from the crown; NULL: the whole circumference")
    measure: Mapped[str] = mapped_column(comment="What is to be done")
    urgency: Mapped[str] = mapped_column(
        server_default=text("'planned'"), comment="immediate, urgent, planned or monitor (observe only)"
    )
    responsible: Mapped[str | None] = mapped_column(comment="Person or firm that does it")
    due: Mapped[dt.date | None] = mapped_column(comment="Day until which it is to be done")
    cost: Mapped[Decimal | None] = mapped_column(Numeric(14, 2), comment="Cost, in currency")
    currency: Mapped[str | None] = mapped_column(comment="Currency of the cost, ISO 4217")
    state: Mapped[str] = mapped_column(server_default=text("'open'"), comment="open, ordered, done or verified")
    remark: Mapped[str | None] = mapped_column(comment="Remark")
    added_by: Mapped[str] = mapped_column(server_default=text("SESSION_USER"), comment="Role that added it")
    added_at: Mapped[dt.datetime] = mapped_column(server_default=CLOCK, comment="Time when it was added")
    changed_by: Mapped[str | None] = mapped_column(comment="Role that changed it last")
    changed_at: Mapped[dt.datetime | None] = mapped_column(comment="Time of the last change")


class AsOf(Base):
    """Moment at which a transaction shows a survey; a trigger refuses its commit, so that the table is always empty."""

    __tablename__ = "as_of"
    __table_args__ = {"comment": "Empty: a row marks a transaction that shows the past, and a trigger refuses its commit"}  # noqa: RUF012

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    moment: Mapped[dt.datetime] = mapped_column(comment="Moment that is shown")
