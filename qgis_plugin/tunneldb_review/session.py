"""Review in progress: the logic of the dock, without its widgets."""

from __future__ import annotations

import time
from typing import Any, Callable, Dict, List, Optional

from . import sql
from .database import ChangedMeanwhileError, Database, DatabaseError
from .worklist import OPEN, Filter, Finding, Pace, WorkList, progress_text

REFUSED = "taken back"
"""Database errors for a step that can never be undone; other errors may pass, such as a missing server."""


class Session:
    """Steps through the findings of a survey, and writes the inspector's verdicts.

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
        self.coverage = ""
        """Statement on what was not searched for leaks, or hardly inspected, in the kilometres of the list; else empty."""

    def load(self, survey: str, asked: Filter, order: str) -> None:
        """Read the findings of a survey, and go to the first."""
        key = next((key for key, name, _ in self.surveys if name == survey), None)
        if key is None:
            raise DatabaseError(f"no survey {survey!r} of a tunnel in this database")
        rows = self.database.rows(sql.findings(key))
        if survey != self.survey:
            self.steps, self.pace = [], Pace()
        self.survey, self.survey_id = survey, key
        self.findings = {finding.id: finding for finding in (Finding(**sql.listed(row)) for row in rows)}
        self.work, self.facts = WorkList(), None  # what cannot be read is not shown
        self.ask(asked, order)

    def again(self, asked: Filter, order: str) -> None:
        """Read the survey again, after a rerun of detect say, and stay at the finding that is shown if it is still there."""
        here = self.work.current
        self.load(self.survey, asked, order)
        if here is not None and self.work.go(here.id):
            self.look()

    def ask(self, asked: Filter, order: str) -> None:
        """Sort the selected findings, and go to the first."""
        was = self.work, self.facts
        self.work, self.facts = WorkList.of(self.findings.values(), asked, order), None
        try:
            self._read_coverage(asked)
            self.next()
        except DatabaseError:
            self.work, self.facts = was
            raise

    def next(self) -> bool:
        """Go to the next; return False if there is none."""
        return self._go(self.work.next)

    def previous(self) -> bool:
        """Go to the previous one; return False if there is none."""
        return self._go(self.work.previous)

    def write(self, **values: Any) -> bool:
        """Write review, kind or remark of the current finding; return False if it is already so.

        What somebody else wrote alike since it was read is no step of this session; what this person wrote is one, as its
        answer may have been lost with the connection.

        Raises
        ------
        ChangedMeanwhileError
            Somebody else has changed it: nothing is written, and facts are those that hold now.
        """
        if self.facts is None:
            raise DatabaseError("there is no finding to review")
        wanted = {name: value for name, value in values.items() if self.facts[name] != value}
        if not wanted:
            return False
        key = int(self.facts["id"])
        try:
            wrote = self.database.review(key, self.facts, wanted)
        except ChangedMeanwhileError:
            self._read(key)
            raise
        if wrote:
            self.facts.update(wanted)
            self._note(key, {name: value for name, value in wanted.items() if name != "remark"})
        elif not self._read(key) or self.facts["reviewed_by"] != self.database.person:
            return False
        self.steps.append(key)
        if wanted.get("review", OPEN) != OPEN:
            self.pace.count(self.clock())
        return True

    def look(self) -> None:
        """Read all facts of the current finding again."""
        current = self.work.current
        if current is not None and not self._read(current.id):
            raise DatabaseError(f"finding {current.id} does not exist any more: load the survey again")

    def undo(self, **begun: Any) -> str:
        """Undo the last step of this session, and go to its finding; return a sentence.

        What the database refuses to take back is not tried again.

        Parameters
        ----------
        begun : str or None
            What of the finding that is shown was not entered yet, as for :meth:`write`: written before one
            goes to another.
        """
        if not self.steps:
            raise DatabaseError("there is no review to undo")
        key = self.steps[-1]
        if begun and not self.undoes_shown and self.write(**begun):
            self.steps[-2:] = [self.steps[-1], key]
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
                return f"Finding {key}: undone: {what}."
        return f"Finding {key}: undone: {what}; it is not in the current selection."

    @property
    def undoes_shown(self) -> bool:
        """Return True if the last step was one of the current finding."""
        return self.facts is not None and self.steps[-1:] == [self.facts["id"]]

    def progress(self) -> str:
        """Return how far one is, and how fast."""
        return progress_text(self.work, self.pace)

    def _read_coverage(self, asked: Filter) -> None:
        self.coverage = ""
        backwards = None not in (asked.km_from, asked.km_to) and asked.km_from > asked.km_to  # type: ignore[operator]
        if self.survey_id is not None and not backwards:
            ((said,),) = self.database.rows(sql.coverage(self.survey_id, asked.km_from, asked.km_to))
            self.coverage = str(said or "")

    def _note(self, key: int, values: Dict[str, str]) -> None:
        self.work.change(key, **values)
        place = next((finding for finding in self.work.findings if finding.id == key), None)
        if place is not None:
            self.findings[key] = place

    def _go(self, step: Callable[[], bool]) -> bool:
        """Step until there is a selected finding; if reading fails, nothing changes.

        What is gone leaves the list; what others have reviewed meanwhile is passed over where only open ones are wanted.
        """
        was, kept = self.work.current, self.facts
        try:
            while step():
                current = self.work.current
                assert current is not None
                if not self._read(current.id):
                    self.findings.pop(current.id, None)
                    self._stay(was)
                    self.work.drop(current.id)
                elif not self.work.asked.open_only or (self.facts or {}).get("review") == OPEN:
                    return True
        except DatabaseError:
            self._stay(was)
            self.facts = kept
            raise
        self._stay(was)
        self.facts = kept
        return False

    def _stay(self, finding: Optional[Finding]) -> None:
        """Go back to the previous position."""
        if finding is None or not self.work.go(finding.id):
            self.work.at = -1

    def _read(self, key: int) -> bool:
        """Read the facts of a finding into facts and list; return True if it exists."""
        rows = self.database.rows(sql.facts(key))
        if not rows:
            return False
        self.facts = sql.told(rows[0])
        self._note(key, {name: self.facts[name] for name in ("review", "kind")})
        return True
