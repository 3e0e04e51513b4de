"""The plugin in real QGIS when others, or the same person elsewhere, write just what is written in the dock.

Runs under the Python that has PyQGIS, says what it saw as JSON. PGSERVICEFILE has *review*, of an operator, and *owner*.

Usage: together_in_qgis.py PROJECT PLUGINS COMMAND FOLDER
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from typing import Any

from interrupted_in_qgis import ask, begin
from qgis.PyQt.QtCore import Qt
from review_in_qgis import at, press

CONFIRM = "UPDATE tunnel_api.finding_unrolled SET review = 'confirmed' WHERE id = {}"
BLOCKED = (
    "SELECT count(*) FROM pg_stat_activity WHERE datname = current_database() AND usename = 'otto' AND wait_event_type = 'Lock'"
)


def write(person: str, query: str) -> None:
    """Write as a person, elsewhere."""
    subprocess.run(["psql", "-XAtqd", f"service=owner user={person}", "-c", query], capture_output=True, text=True, check=True)


def pressed(dock: Any, key: Any) -> dict[str, Any]:
    """What comes of a key."""
    here, steps, pace = at(dock), len(dock.session.steps), dock.session.pace.done
    press(dock, key)
    return {
        "finding": here, "went_on": at(dock) != here, "steps": len(dock.session.steps) - steps,
        "counted": dock.session.pace.done - pace, "said": dock.message.text(),
    }  # fmt: skip


def alike(dock: Any, person: str) -> dict[str, Any]:
    """A person confirms the finding that is shown, then it is confirmed in the dock, and taken back."""
    write(person, CONFIRM.format(at(dock)))
    confirmed = pressed(dock, Qt.Key_C)
    return {"confirmed": confirmed, "undone": pressed(dock, Qt.Key_Z)}


def at_once(dock: Any) -> dict[str, Any]:
    """Ines confirms what is shown, and her transaction ends while the one of the dock waits for it."""
    holder = subprocess.Popen(
        ["psql", "-XAtqd", "service=owner user=ines"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert holder.stdin is not None
    assert holder.stdout is not None
    print(f"BEGIN; {CONFIRM.format(at(dock))}; SELECT 'held';", file=holder.stdin, flush=True)
    assert holder.stdout.readline().strip() == "held"
    waited: list[bool] = []

    def let_go() -> None:
        until = time.monotonic() + 30
        while not int(ask(BLOCKED)) and time.monotonic() < until:
            time.sleep(0.1)
        waited.append(time.monotonic() < until)
        print("COMMIT;", file=holder.stdin, flush=True)

    other = threading.Thread(target=let_go)
    other.start()
    confirmed = pressed(dock, Qt.Key_C)
    other.join()
    holder.communicate(timeout=20)
    return {"waited": waited[0], "confirmed": confirmed, "undone": pressed(dock, Qt.Key_Z)}


def main() -> None:
    """Do all of it."""
    dock = begin().dock
    seen = {"ines": alike(dock, "ines"), "at_once": at_once(dock), "otto": alike(dock, "otto")}
    print(json.dumps(seen))
    sys.stdout.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
