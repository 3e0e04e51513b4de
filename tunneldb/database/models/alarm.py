"""Limits of series of a tunnel: a value that reaches one is a warning or an alarm."""

from __future__ import annotations

import datetime as dt

from sqlalchemy import CheckConstraint, Identity, UniqueConstraint, text
from sqlalchemy.orm import Mapped, mapped_column

from tunneldb.database.models.base import CLOCK, TUNNEL, Base, at_most, bounded, one_of, parent

QUANTITIES = ("ovality", "convergence", "wet_area", "growth")
"""Quantities with limits."""


class AlarmLimit(Base):
    """Limits of a quantity, for warnings and alarms."""

    __tablename__ = "alarm_limit"
    __table_args__ = (
        UniqueConstraint("tunnel_id", "name"),
        at_most("name", 100),
        at_most("reference", 200),
        one_of("quantity", *QUANTITIES),
        bounded("place", "chainage_from", "chainage_to"),
        CheckConstraint("chainage_from < chainage_to", name="order"),
        CheckConstraint(
            "(step IS NOT NULL) = (quantity IN ('wet_area', 'growth')) AND step >= 1 AND step <= '1000000'::float8", name="step"
        ),
        CheckConstraint(
            "(clock_from IS NOT NULL) = (quantity = 'convergence') AND (clock_to IS NOT NULL) = (quantity = 'convergence')"
            " AND clock_from >= 0 AND clock_from <= 12 AND clock_to >= 0 AND clock_to <= 12"
            " AND abs(abs(clock_from - clock_to) - 6) <= '0.05'::float8",
            name="clock",
        ),
        CheckConstraint("reference IS NULL OR quantity = 'convergence'", name="reference"),
        CheckConstraint("min_inspected >= 0 AND min_inspected <= 1", name="min_inspected"),
        CheckConstraint("warning > 0 AND alarm >= warning AND alarm <= '100000000'::float8", name="limits"),
        {"comment": "Limits of series of tunnels: values that are a warning or an alarm"},
    )

    id: Mapped[int] = mapped_column(Identity(always=True), primary_key=True, comment="Key")
    tunnel_id: Mapped[int] = mapped_column(parent("tunnel"), comment=TUNNEL)
    name: Mapped[str] = mapped_column(comment="Name")
    quantity: Mapped[str] = mapped_column(
        comment="ovality (of each ring, share of the design diameter), convergence (change of a chord since the reference"
        " survey, m, either sign), wet_area (of each stretch, m²) or growth (of the wet area of each stretch since the earlier"
        " inspection, m² per year)"
    )
    chainage_from: Mapped[float | None] = mapped_column(
        comment="Chainage from which it applies, m; NULL: beginning of the tunnel"
    )
    chainage_to: Mapped[float | None] = mapped_column(comment="Chainage up to which it applies, m; NULL: end of the tunnel")
    step: Mapped[float | None] = mapped_column(
        comment="Length of the stretches of wet_area and growth, from multiples of it, m"
    )
    clock_from: Mapped[float | None] = mapped_column(comment="Clock position of one end of the chord of convergence, hours")
    clock_to: Mapped[float | None] = mapped_column(comment="Clock position of the other end, opposite, hours")
    reference: Mapped[str | None] = mapped_column(
        comment="Name of the survey since which convergence counts; NULL: the earliest that another one was compared with"
    )
    min_inspected: Mapped[float] = mapped_column(
        server_default=text("0.95"), comment="Inspected share below which a value below the limits is no all-clear, 0 to 1"
    )
    warning: Mapped[float] = mapped_column(comment="Value from which it is a warning, in the unit of the quantity")
    alarm: Mapped[float] = mapped_column(comment="Value from which it is an alarm, in the unit of the quantity")
    added_at: Mapped[dt.datetime] = mapped_column(server_default=CLOCK, comment="Time when it was added")
