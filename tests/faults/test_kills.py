"""Whatever is killed while a batch runs, and whenever: its end is that of a batch which nothing disturbed."""

from __future__ import annotations

import os
import random
import time

from faults.conftest import Survey
from faults.killer import Killer, reading, whole
from faults.project import batch, differences, runs, state

KILLS = int(os.environ.get("KILLS", "7"))
SEED = int(os.environ.get("SEED", "1"))


def test_kills_lose_nothing_and_double_nothing(survey: Survey) -> None:
    """As many batches as it takes for all the kills; `make faults` asks for a hundred."""
    rounds = 0
    started = time.monotonic()
    killer = Killer(survey.project, batch(survey.files), random.Random(SEED))
    while killer.killed.total() < KILLS:
        rounds += 1
        survey.project.fresh()
        with reading(survey.project, survey.kilometres()) as seen:
            for kind in killer.run(KILLS - killer.killed.total()):
                print(f"\r{killer.killed.total()} of {KILLS} kills, batch {rounds}: {kind:<8}", end="", flush=True)
        assert differences(survey.undisturbed, state(survey.project)) == []
        assert [row for row in runs(survey.project) if row[3] != 1] == []
        assert whole(seen, survey.points()) == []
    kinds = ", ".join(f"{kind} {count}" for kind, count in sorted(killer.killed.items()))
    seconds = time.monotonic() - started
    print(f"\r{killer.killed.total()} kills ({kinds}) in {rounds} batches, typed {killer.typed} times, {seconds:.0f} s")
    print("each batch ended as the undisturbed one, row for row")
