"""The plugin in real QGIS when the server goes away, when another reviews the same, and when a command is cancelled.

Runs under the Python that has PyQGIS, says what it saw as JSON. PGSERVICEFILE has *review* and *owner*.

Usage: interrupted_in_qgis.py PROJECT PLUGINS COMMAND FOLDER
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import qgis.utils
from qgis.core import QgsApplication, QgsProcessingContext, QgsProcessingFeedback, QgsProject, QgsSettings
from qgis.gui import QgsGui
from qgis.PyQt.QtCore import QCoreApplication, Qt
from qgis.PyQt.QtTest import QTest
from review_in_qgis import NAME, at, load, press, wait

STATE = (
    "SELECT (SELECT string_agg(s::text, ',' ORDER BY s.name) FROM tunnel.stage s),"
    " (SELECT md5(string_agg(p.oid::text, ',' ORDER BY p.oid)) FROM pg_proc p"
    " WHERE p.pronamespace = ANY (ARRAY['tunnel_api', 'tunnel_internal']::regnamespace[]))"
)
_OTHERS = "SELECT count(*) FROM pg_stat_activity WHERE datname = current_database() AND application_name LIKE 'tunneldb%'"
WAITING, BACKENDS = f"{_OTHERS} AND wait_event_type = 'Lock'", _OTHERS

begun: list[QgsApplication] = []
"""The application, which ends where nobody holds it."""


def ask(query: str, database: str = "") -> str:
    """Ask the database as its owner."""
    where = "service=owner" + (f" dbname={database}" if database else "")
    done = subprocess.run(["psql", "-XAtqd", where, "-c", query], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def take_away(name: str) -> None:
    """Let nobody connect to the database, and end who is."""
    ask(f'ALTER DATABASE "{name}" ALLOW_CONNECTIONS false', "postgres")
    ask(f"SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = '{name}'", "postgres")


def give_back(name: str) -> None:
    ask(f'ALTER DATABASE "{name}" ALLOW_CONNECTIONS true', "postgres")


def lost(dock: Any) -> dict[str, Any]:
    """Connections are cut, once for a moment and once until several keys were pressed and a remark was typed."""
    name = ask("SELECT current_database()")
    seen: dict[str, Any] = {"cut": at(dock)}
    ask("SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE usename = 'ines' AND datname = current_database()")
    press(dock, Qt.Key_C)
    seen["cut_said"] = dock.message.text()
    seen["lost"] = at(dock)
    take_away(name)
    seen["away"] = []
    for key in (Qt.Key_C, Qt.Key_N):
        press(dock, key)
        seen["away"].append([dock.message.text(), at(dock), dock.session.facts["id"], dock.session.facts["review"]])
    press(dock, Qt.Key_F5)
    seen["read_again"] = bar()
    press(dock, Qt.Key_M)
    QTest.keyClicks(dock.panel.remark, "wet again")
    QTest.keyClick(dock.panel.remark, Qt.Key_Return)
    seen["remark_kept"] = [dock.message.text(), dock.panel.remark.text(), dock.panel.remark.hasFocus()]
    give_back(name)
    QTest.mouseClick(dock.panel.buttons["confirm"], Qt.LeftButton)  # without Enter: the remark goes with the verdict
    wait(dock)
    seen["back_said"], seen["back"] = dock.message.text(), at(dock)
    dock.take_keys()
    return seen


def two(dock: Any) -> dict[str, Any]:
    """Somebody else reviews the finding that is shown and the next, and a rerun takes the one after that away."""
    seen: dict[str, Any] = {"first": at(dock)}
    _, second, third, fourth = [at(dock), *(finding.id for finding in dock.session.work.ahead(3))]
    ask(f"UPDATE tunnel_api.finding_unrolled SET review = 'rejected', remark = 'soot' WHERE id = {at(dock)}")
    press(dock, Qt.Key_C)
    seen["said"], seen["stays"] = dock.message.text(), at(dock)
    seen["shown"] = [dock.session.facts["review"], dock.panel.remark.text(), "rejected" in dock.panel.head.text()]
    seen["kept"] = ask(f"SELECT review, remark FROM tunnel_api.finding WHERE id = {at(dock)}")
    press(dock, Qt.Key_M)
    QTest.keyClicks(dock.panel.remark, "no soot")
    QTest.keyClick(dock.panel.remark, Qt.Key_Return)
    ask(f"UPDATE tunnel_api.finding_unrolled SET review = 'rejected' WHERE id = {second}")
    ask(f"DELETE FROM tunnel.finding WHERE id = {third}")
    press(dock, Qt.Key_C)
    return {**seen, "wanted": fourth, "came": at(dock), "listed": third in [f.id for f in dock.session.work.findings]}


def rerun(dock: Any) -> dict[str, Any]:
    """Another finding is there, as after a rerun, and F5 was pressed."""
    here = at(dock)
    new = ask(
        "INSERT INTO tunnel_api.finding_unrolled (survey_id, kind, geom) SELECT survey_id, 'missing_bolt',"
        f" public.ST_PointOnSurface(geom) FROM tunnel_api.finding_unrolled WHERE id = {here} RETURNING id"
    )
    press(dock, Qt.Key_F5)
    return {"stays": at(dock) == here, "new": int(new) in [finding.id for finding in dock.session.work.findings], "said": bar()}


def not_entered(dock: Any) -> dict[str, Any]:
    """A step is taken back while a remark is typed, at the finding of that step and at the next one."""
    dock.go_on.setChecked(False)
    here, line = at(dock), dock.panel.remark
    press(dock, Qt.Key_C)
    seen: dict[str, Any] = {"before": [line.text(), remarked(here)]}
    line.clear()
    QTest.keyClicks(line, "drips")
    seen["same"] = [undone(dock) == here, line.text(), remarked(here)]
    press(dock, Qt.Key_C)
    seen["with"] = remarked(here)
    press(dock, Qt.Key_N)
    other = at(dock)
    line.clear()
    QTest.keyClicks(line, "old stain")
    seen["other"] = [other != here, undone(dock) == here, line.text(), remarked(here), remarked(other)]
    seen["then"] = [undone(dock) == other, line.text(), remarked(other)]
    dock.go_on.setChecked(True)
    return seen


def undone(dock: Any) -> int | None:
    """Where one is after the button was pressed that takes a step back."""
    QTest.mouseClick(dock.panel.buttons["undo"], Qt.LeftButton)
    wait(dock)
    return at(dock)


def remarked(finding: int | None) -> str:
    """Review and remark of a finding in the database."""
    return ask(f"SELECT review, remark FROM tunnel_api.finding WHERE id = {finding}")


def ended(dock: Any) -> str:
    """All is read again while the dock is connected to nothing."""
    dock.end()
    qgis.utils.plugins[NAME].reload()
    return bar()


def bar() -> str:
    """What the message bar of QGIS says, which is put away."""
    said = str(qgis.utils.iface.bar.currentItem().text())
    qgis.utils.iface.bar.clearWidgets()
    return said


def typed_in_lists(dock: Any) -> dict[str, Any]:
    """Letters that find an entry of a list are no verdicts; afterwards keys are the dock's again."""
    order, reviewed = dock.filters.order, dock.session.work.reviewed
    order.setFocus()
    QTest.keyClicks(order, "by c")
    chosen = order.currentText()
    QTest.keyClick(order, Qt.Key_Return)
    wait(dock)
    return {"reviewed": dock.session.work.reviewed - reviewed, "order": chosen, "keys": dock.widget().hasFocus()}


def cancel() -> dict[str, Any]:
    """Cancel init in the midst of its transaction, while it waits for a lock."""
    algorithm = QgsApplication.processingRegistry().createAlgorithmById("tunneldb:init")
    context, feedback = QgsProcessingContext(), QgsProcessingFeedback(False)
    seen: dict[str, Any] = {"before": ask(STATE)}
    holder = subprocess.Popen(["psql", "-XAtqd", "service=owner"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert holder.stdin is not None
    assert holder.stdout is not None
    print("BEGIN; LOCK TABLE tunnel.stage; SELECT 'held';", file=holder.stdin, flush=True)
    assert holder.stdout.readline().strip() == "held"

    def cancel_it() -> None:
        until = time.monotonic() + 30
        while not int(ask(WAITING)) and time.monotonic() < until:
            time.sleep(0.1)
        seen["children"] = children() - {holder.pid}
        feedback.cancel()

    canceller = threading.Thread(target=cancel_it)
    canceller.start()
    start = time.monotonic()
    results, well = algorithm.run({}, context, feedback, {}, False)
    canceller.join()
    seen["left"] = len(children() & seen["children"])
    seen["children"] = len(seen["children"])
    print("ROLLBACK;", file=holder.stdin, flush=True)
    holder.communicate(timeout=20)
    until = time.monotonic() + 10
    while int(ask(BACKENDS)) and time.monotonic() < until:
        time.sleep(0.1)
    seen |= {"seconds": time.monotonic() - start, "backends": int(ask(BACKENDS)), "after": ask(STATE)}
    return {**seen, **results, "well": well, "log": feedback.textLog()}


def children() -> set[int]:
    """Processes that this one has started and that run."""
    return set(map(int, Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()))


def begin() -> Any:
    """Open the project in QGIS with the plugin and its dock; returns the plugin."""
    application = QgsApplication([], True)
    begun.append(application)
    application.initQgis()
    QgsGui.editorWidgetRegistry().initEditors()
    QCoreApplication.setOrganizationName("tunneldb-test")
    project, plugins, command = sys.argv[1:4]
    QgsSettings().setValue("tunneldb_review/command", command)
    assert QgsProject.instance().read(project)
    load(plugins)
    plugin = qgis.utils.plugins[NAME]
    window = qgis.utils.iface.window
    window.show()
    window.activateWindow()
    assert QTest.qWaitForWindowActive(window)
    plugin.review()
    wait(plugin.dock)
    return plugin


def main() -> None:
    """Do all of it."""
    dock = begin().dock
    seen: dict[str, Any] = {"not_entered": not_entered(dock), "lists": typed_in_lists(dock)}
    seen |= {"lost": lost(dock), "two": two(dock), "rerun": rerun(dock)}
    seen["ended"] = ended(dock)
    QgsSettings().setValue("tunneldb_review/way", "service")
    QgsSettings().setValue("tunneldb_review/service", "owner")
    seen["cancel"] = cancel()
    print(json.dumps(seen))
    sys.stdout.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
