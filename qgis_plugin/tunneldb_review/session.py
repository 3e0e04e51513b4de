"""A review under way: what the dock shows and does, without its widgets."""

from __future__ import annotations

import time
from typing import Any, Callable, Dict, List, Optional

from . import sql
from .database import Database, DatabaseError
from .worklist import OPEN, Filter, Finding, Pace, WorkList, progress_text

REFUSED = "taken back"
"""What the database says of a step that will never be taken back; all else may pass, as a server that is away."""


class Session:
    """Steps through the findings of a survey, and writes what a person says of them.

    Parameters
    ----------
    database : Database
    clock : callable
        Returns a time, s.
    """

    def __init__(self, database: Database, clock: Callable[[], float] = time.monotonic) -> None:
        self.database = database
        self.clock = clock
        self.kinds = [(str(code), str(label)) for code, label in database.rows(sql.KINDS)]
        self.surveys = [(int(key), str(name), str(tunnel)) for key, name, tunnel, _ in database.rows(sql.SURVEYS)]
        self.survey = ""
        self.survey_id: Optional[int] = None
        self.findings: Dict[int, Finding] = {}
        self.work = WorkList()
        self.pace = Pace()
        self.steps: List[int] = []
        self.facts: Optional[Dict[str, Any]] = None

    def load(self, survey: str, asked: Filter, order: str) -> None:
        """Read what there is to review in a survey, and go to the first."""
        key = next((key for key, name, _ in self.surveys if name == survey), None)
        if key is None:
            raise DatabaseError(f"there is no survey {survey!r} of a tunnel in this database")
        rows = self.database.rows(sql.findings(key))
        if survey != self.survey:
            self.steps, self.pace = [], Pace()
        self.survey, self.survey_id = survey, key
        self.findings = {finding.id: finding for finding in (Finding(**sql.listed(row)) for row in rows)}
        self.ask(asked, order)

    def ask(self, asked: Filter, order: str) -> None:
        """Put those in order that are asked for, and go to the first."""
        self.work = WorkList.of(self.findings.values(), asked, order)
        self.look()

    def look(self) -> None:
        """Read all that is told of the current finding."""
        current = self.work.current
        rows = self.database.rows(sql.facts(current.id)) if current is not None else []
        self.facts = sql.told(rows[0]) if rows else None
        if current is not None and self.facts is None:
            raise DatabaseError(f"finding {current.id} is gone: read the survey again")

    def next(self) -> bool:
        """Go to the next; False where there is none."""
        return self._went(self.work.next())

    def previous(self) -> bool:
        """Go to the one before; False where there is none."""
        return self._went(self.work.previous())

    def write(self, **values: Any) -> bool:
        """Write review, kind or remark of the current finding; False where it is so already."""
        if self.facts is None:
            raise DatabaseError("there is no finding to review")
        wanted = {name: value for name, value in values.items() if self.facts[name] != value}
        if not wanted:
            return False
        key = int(self.facts["id"])
        self.database.review(key, self.facts, wanted)
        self.steps.append(key)
        self.facts.update(wanted)
        self._note(key, {name: value for name, value in wanted.items() if name != "remark"})
        if wanted.get("review", OPEN) != OPEN:
            self.pace.count(self.clock())
        return True

    def undo(self) -> str:
        """Take back the last step of this session, and go to its finding; returns a sentence.

        What the database refuses to take back is not tried again.
        """
        if not self.steps:
            raise DatabaseError("nothing was reviewed here that could be taken back")
        key = self.steps[-1]
        try:
            what = self.database.undo(key)
        except DatabaseError as error:
            if REFUSED in str(error):
                self.steps.pop()
            raise
        self.steps.pop()
        rows = self.database.rows(sql.facts(key))
        if rows:
            told = sql.told(rows[0])
            self._note(key, {name: told[name] for name in ("review", "kind")})
            if self.work.go(key):
                self.facts = told
                return f"Finding {key}: what was {what} is taken back."
        return f"Finding {key}: what was {what} is taken back; it is not in the list that is asked for."

    def progress(self) -> str:
        """Return how far one is, and how fast."""
        return progress_text(self.work, self.pace)

    def _note(self, key: int, values: Dict[str, str]) -> None:
        self.work.change(key, **values)
        place = next((finding for finding in self.work.findings if finding.id == key), None)
        if place is not None:
            self.findings[key] = place

    def _went(self, went: bool) -> bool:
        if went:
            self.look()
        return went
