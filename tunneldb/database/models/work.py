"""Requested work, workers, runs, and manual changes."""

from __future__ import annotations

import datetime as dt
from typing import Any

from sqlalchemy import ARRAY, BigInteger, ForeignKey, Identity, Index, Text, text
from sqlalchemy.orm import Mapped, mapped_column

from tunneldb.database.models.base import AUDIT_SCHEMA, CLOCK, KM, SURVEY, Base, one_of, parent


class Stage(Base):
    """Stage of a kilometre, or measure."""

    __tablename__ = "stage"
    __table_args__ = {"comment": "Stages of a kilometre and measures, in their order; tunneldb init fills it anew"}  # noqa: RUF012

    step: Mapped[int] = mapped_column(primary_key=True, autoincrement=False, comment="Number in the order of stages, from 1")
    name: Mapped[str] = mapped_column(unique=True, comment="Name")
    reads: Mapped[list[str]] = mapped_column(ARRAY(Text), comment="Stages whose results in the kilometre itself it rests on")
    reads_beside: Mapped[list[str]] = mapped_column(
        ARRAY(Text), comment="Stages whose results in the kilometres before and after it rests on"
    )
    parameters: Mapped[list[str]] = mapped_column(ARRAY(Text), comment="Prefixes of the parameters that it depends on")
    on_demand: Mapped[bool] = mapped_column(comment="True for a measure, which a command of its own runs")
    subject: Mapped[list[str]] = mapped_column(
        ARRAY(Text), comment="Parameters of a run that distinguish results of the stage in one kilometre"
    )
    tables: Mapped[list[str]] = mapped_column(ARRAY(Text), comment="Tables of schema tunnel that hold its results")


class StageInput(Base):
    """Parameter of a measure's runs that says what the result was made from."""

    __tablename__ = "stage_input"
    __table_args__ = (
        one_of("holds", "run", "checksum", "survey"),
        {"comment": "Parameters of runs that say what a result was made from; tunneldb init fills it anew"},
    )

    stage: Mapped[str] = mapped_column(
        ForeignKey("tunnel.stage.name", ondelete="CASCADE"), primary_key=True, comment="Name of the measure"
    )
    number: Mapped[int] = mapped_column(primary_key=True, autoincrement=False, comment="Order of comparison, from 1")
    key: Mapped[str] = mapped_column(comment="Name of the parameter")
    holds: Mapped[str] = mapped_column(comment="run: keys of runs; checksum; survey: key of the older survey")
    reason: Mapped[str | None] = mapped_column(comment="Why a result is out of date whose parameter would be another now")


class Goal(Base):
    """Requested stage of a kilometre."""

    __tablename__ = "goal"
    __table_args__ = {"comment": "Requested stages of each kilometre"}  # noqa: RUF012

    survey_id: Mapped[int] = mapped_column(parent("survey"), primary_key=True, comment=SURVEY)
    km: Mapped[int] = mapped_column(primary_key=True, autoincrement=False, comment=KM)
    stage: Mapped[str] = mapped_column(comment="Stage up to which the kilometre is to be brought")
    parameters: Mapped[dict[str, Any]] = mapped_column(server_default=text("'{}'"), comment="Parameters of the stages")
    requested_at: Mapped[dt.datetime] = mapped_column(server_default=CLOCK, comment="Time of the request")
    retry_after: Mapped[dt.datetime | None] = mapped_column(comment="Stages that failed before this moment are tried again")


class Worker(Base):
    """Worker process."""

    __tablename__ = "worker"
    __table_args__ = {"comment": "Workers that serve the queue"}  # noqa: RUF012

    id: Mapped[int] = mapped_column(
        BigInteger, primary_key=True, autoincrement=False, comment="Key: that of the queue's worker"
    )
    host: Mapped[str] = mapped_column(comment="Machine that it runs on")
    pid: Mapped[int] = mapped_column(comment="Number of its process")
    started_at: Mapped[dt.datetime] = mapped_column(server_default=CLOCK, comment="Time of the start")
    stop: Mapped[bool] = mapped_column(
        server_default=text("false"), comment="True if it was asked to finish its current job and exit"
    )


class Run(Base):
    """Run of a stage."""

    __tablename__ = "run"
    __table_args__ = (
        one_of("outcome", "running", "done", "failed"),
        Index(None, "survey_id", "stage", "km", "subject", "started_at", "id"),
        Index(None, "job_id"),
        {"comment": "Ledger of every stage that was run"},
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    survey_id: Mapped[int] = mapped_column(parent("survey"), comment=SURVEY)
    km: Mapped[int | None] = mapped_column(comment="Kilometre; none for the whole survey")
    stage: Mapped[str] = mapped_column(comment="Name of the stage (tunnel.stage), or read, spheres, members, import")
    parameters: Mapped[dict[str, Any]] = mapped_column(server_default=text("'{}'"), comment="Parameters that it ran with")
    versions: Mapped[dict[str, Any]] = mapped_column(
        server_default=text("'{}'"), comment="Versions of the program and of its libraries"
    )
    counts: Mapped[dict[str, Any]] = mapped_column(server_default=text("'{}'"), comment="Counts and measured values")
    backend_pid: Mapped[int] = mapped_column(server_default=text("pg_backend_pid()"), comment="Server process that it ran in")
    backend_start: Mapped[dt.datetime | None] = mapped_column(
        comment="Start time of that process, as in pg_stat_activity; identifies interrupted runs"
    )
    started_at: Mapped[dt.datetime] = mapped_column(server_default=text("clock_timestamp()"), comment="Beginning of the run")
    finished_at: Mapped[dt.datetime | None] = mapped_column(comment="End of the run")
    outcome: Mapped[str] = mapped_column(server_default=text("'running'"), comment="running, done or failed")
    message: Mapped[str | None] = mapped_column(comment="Why it failed")
    worker: Mapped[str | None] = mapped_column(comment="Machine and process that it ran on")
    job_id: Mapped[int | None] = mapped_column(BigInteger, comment="Job of the queue that it was, if it was one")
    subject: Mapped[str] = mapped_column(
        server_default=text("''"),
        comment="Values of the parameters that distinguish results of the stage in one kilometre, as tunnel.stage has them: "
        "layer, older survey, track and gauge; a trigger writes it",
    )


class Audit(Base):
    """Row changed manually."""

    __tablename__ = "entry"
    __table_args__ = (
        one_of("action", "insert", "update", "delete"),
        Index(None, "survey", "at"),
        Index(None, "view", "row_id"),
        Index(None, "undoes", postgresql_where=text("undoes IS NOT NULL")),
        Index(None, "part_of", postgresql_where=text("part_of IS NOT NULL")),
        {
            "schema": AUDIT_SCHEMA,
            "comment": "What people changed through the views: who, when, before and after; outlives what it speaks of",
        },
    )

    id: Mapped[int] = mapped_column(BigInteger, Identity(always=True), primary_key=True, comment="Key")
    at: Mapped[dt.datetime] = mapped_column(server_default=CLOCK, comment="When")
    who: Mapped[str] = mapped_column(server_default=text("SESSION_USER"), comment="Role that was logged in")
    survey: Mapped[str] = mapped_column(comment="Name of the survey")
    view: Mapped[str] = mapped_column(comment="Edited view: finding, spot, axis_vertex, region or photo")
    row_id: Mapped[int] = mapped_column(BigInteger, comment="Key of the row in that view")
    action: Mapped[str] = mapped_column(comment="insert, update or delete")
    before: Mapped[dict[str, Any] | None] = mapped_column(comment="Columns that changed, as they were; none of an insert")
    after: Mapped[dict[str, Any] | None] = mapped_column(comment="The same as they are now; none of a delete")
    undoes: Mapped[int | None] = mapped_column(BigInteger, comment="Entry that this one takes back")
    part_of: Mapped[int | None] = mapped_column(
        BigInteger, comment="Entry of the step that this one is a part of: a split, a merge or a delete"
    )
    kept: Mapped[dict[str, Any] | None] = mapped_column(comment="Measured values of a finding before its outline changed")
    imported_by: Mapped[str | None] = mapped_column(comment="Role that imported it with an archive of the survey")
    imported_at: Mapped[dt.datetime | None] = mapped_column(comment="When; who and at are then what the archive says")
