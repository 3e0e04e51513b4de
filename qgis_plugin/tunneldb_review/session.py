"""A review under way: what the dock shows and does, without its widgets."""

from __future__ import annotations

import time
from typing import Any, Callable, Dict, List, Optional

from . import sql
from .database import ChangedMeanwhileError, Database, DatabaseError
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
        self.work, self.facts = WorkList(), None  # what cannot be read is not shown
        self.ask(asked, order)

    def again(self, asked: Filter, order: str) -> None:
        """Read the survey again, after a rerun of detect say, and stay at the finding that is shown if it is still there."""
        here = self.work.current
        self.load(self.survey, asked, order)
        if here is not None and self.work.go(here.id):
            self.look()

    def ask(self, asked: Filter, order: str) -> None:
        """Put those in order that are asked for, and go to the first that is wanted."""
        was = self.work, self.facts
        self.work, self.facts = WorkList.of(self.findings.values(), asked, order), None
        try:
            self.next()
        except DatabaseError:
            self.work, self.facts = was
            raise

    def next(self) -> bool:
        """Go to the next; False where there is none."""
        return self._go(self.work.next)

    def previous(self) -> bool:
        """Go to the one before; False where there is none."""
        return self._go(self.work.previous)

    def write(self, **values: Any) -> bool:
        """Write review, kind or remark of the finding that is shown; False where it is so already.

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
        """Read again all that is told of the finding that is shown."""
        current = self.work.current
        if current is not None and not self._read(current.id):
            raise DatabaseError(f"finding {current.id} is gone: read the survey again")

    def undo(self, **begun: Any) -> str:
        """Take back the last step of this session, and go to its finding; returns a sentence.

        What the database refuses to take back is not tried again.

        Parameters
        ----------
        begun : str or None
            What of the finding that is shown was not entered yet, as for :meth:`write`: written before one
            goes to another.
        """
        if not self.steps:
            raise DatabaseError("nothing was reviewed here that could be taken back")
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
                return f"Finding {key}: what was {what} is taken back."
        return f"Finding {key}: what was {what} is taken back; it is not in the list that is asked for."

    @property
    def undoes_shown(self) -> bool:
        """Whether the last step was one of the finding that is shown."""
        return self.facts is not None and self.steps[-1:] == [self.facts["id"]]

    def progress(self) -> str:
        """Return how far one is, and how fast."""
        return progress_text(self.work, self.pace)

    def _note(self, key: int, values: Dict[str, str]) -> None:
        self.work.change(key, **values)
        place = next((finding for finding in self.work.findings if finding.id == key), None)
        if place is not None:
            self.findings[key] = place

    def _go(self, step: Callable[[], bool]) -> bool:
        """Step until there is a finding that is asked for; what cannot be read leaves all as it is.

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
        """Go back to where one was."""
        if finding is None or not self.work.go(finding.id):
            self.work.at = -1

    def _read(self, key: int) -> bool:
        """Read what is told of a finding into facts and list; whether it is there."""
        rows = self.database.rows(sql.facts(key))
        if not rows:
            return False
        self.facts = sql.told(rows[0])
        self._note(key, {name: self.facts[name] for name in ("review", "kind")})
        return True
