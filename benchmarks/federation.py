"""Questions over all tunnels: on one server with 30 surveys, and over a hub of three servers with 12, 9 and 9 of them.

    python -m benchmarks.federation                        # starts five embedded servers, fills four, asks, removes them
    python -m benchmarks.federation --keep FOLDER          # keeps them there, and asks again without filling
    python -m benchmarks.federation --option use_remote_estimate=true      # with estimates of the servers

All servers run on this machine, without delay between them. Each question is asked in a session of its own: first cold (plans,
connections to the servers), then warm, the median of five. The questions are those of docs/cookbook.md that make sense over
several tunnels, without the name of a survey; on one server the same text reads the schema tunnel_shared, or, where the page
asks over all tunnels already, its own text.

Of each question on the hub it is noted what is sent to the servers, by EXPLAIN VERBOSE.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import psycopg
from psycopg import sql
from psycopg.conninfo import make_conninfo

from benchmarks.common import print_table, progress, save, tunneldb
from benchmarks.questions import PAGE, questions
from benchmarks.synthetic import Size, make
from tunneldb.database.server import Server
from tunneldb.federation.target import PLANNING as OPTIONS

SERVERS = {"north": "abcd", "south": "efg", "west": "hij"}
"""Tunnels of each server; each has three surveys."""

SETTINGS = {"shared_buffers": "256MB", "fsync": "off", "max_wal_size": "256MB"}
WARM = 5

HUB_QUESTIONS = {
    "How many leaks per km do all tunnels have, by class of waterproofing?": """
        WITH kilometre AS (
            SELECT k.*, s.tunnel, dense_rank() OVER (PARTITION BY s.server, s.tunnel_id ORDER BY s.date DESC, s.id DESC) AS age
              FROM tunnel_hub.km_waterproof k JOIN tunnel_hub.survey s ON s.server = k.server AND s.id = k.survey_id
             WHERE k.class IS NOT NULL)
        SELECT server, tunnel, survey, class, count(*) AS kilometres, sum(patches) AS leaks,
               round((1000 * sum(patches) / sum(chainage_to - chainage_from))::numeric, 1) AS leaks_per_km,
               round(sum(wet_area)::numeric, 2) AS wet_m2
          FROM kilometre WHERE age = 1
         GROUP BY server, tunnel, survey, class ORDER BY class DESC, leaks_per_km DESC""",
    "Which tunnels became wetter since their last survey?": """
        WITH compared AS (
            SELECT server, survey_id, old_survey_id FROM tunnel_hub.change_section GROUP BY server, survey_id, old_survey_id),
        pair AS (
            SELECT DISTINCT ON (n.server, n.tunnel_id) n.server, n.tunnel, n.id AS survey_id, o.id AS old_survey_id,
                   o.name AS since, n.name AS survey
              FROM compared c
              JOIN tunnel_hub.survey n ON n.server = c.server AND n.id = c.survey_id
              JOIN tunnel_hub.survey o ON o.server = c.server AND o.id = c.old_survey_id
             ORDER BY n.server, n.tunnel_id, n.date DESC, o.date DESC)
        SELECT p.server, p.tunnel, p.since, p.survey, count(*) FILTER (WHERE c.state = 'new') AS new,
               count(*) FILTER (WHERE c.state = 'grown') AS grown, count(*) FILTER (WHERE c.state = 'dry') AS dry,
               round(sum(c.area_change)::numeric, 2) AS wet_more_m2
          FROM pair p
          JOIN tunnel_hub.leak_change c
            ON c.server = p.server AND c.survey_id = p.survey_id AND c.old_survey_id = p.old_survey_id
         WHERE c.state IN ('new', 'grown', 'shrunk', 'dry')
         GROUP BY p.server, p.tunnel, p.since, p.survey
        HAVING sum(c.area_change) > 2 * sqrt(sum(c.area_change_se ^ 2)) ORDER BY wet_more_m2 DESC""",
    "Which leaks of all tunnels are not reviewed yet?": """
        WITH newest AS (
            SELECT DISTINCT ON (s.server, s.tunnel_id) s.server, s.tunnel, s.id
              FROM tunnel_hub.survey s
              JOIN (SELECT server, survey_id FROM tunnel_hub.finding_count WHERE wet GROUP BY server, survey_id) l
                ON l.server = s.server AND l.survey_id = s.id
             ORDER BY s.server, s.tunnel_id, s.date DESC, s.id DESC)
        SELECT n.server, n.tunnel, l.survey, l.id, l.label, round(l.area::numeric, 2) AS area_m2
          FROM newest n JOIN tunnel_hub.leak l ON l.server = n.server AND l.survey_id = n.id
         WHERE l.detected AND l.review = 'open'
         ORDER BY l.area DESC, l.id LIMIT 100""",
    "What is the progress of the review in each survey of all tunnels?": """
        SELECT s.server, s.tunnel, s.name AS survey, s.date, sum(c.open) AS open, sum(c.confirmed) AS confirmed,
               sum(c.rejected) AS rejected
          FROM tunnel_hub.finding_count c JOIN tunnel_hub.survey s ON s.server = c.server AND s.id = c.survey_id
         WHERE c.wet
         GROUP BY s.server, s.tunnel, s.id, s.name, s.date
        HAVING sum(c.open + c.confirmed + c.rejected) > 0
         ORDER BY s.server, s.tunnel, s.date DESC""",
    "Which leaks over 0.2 m² are there between two chainages, and on which segment?": """
        SELECT l.server, l.survey, l.id, l.label, l.segment, s.label_from, s.label_to
          FROM tunnel_hub.leak l
          LEFT JOIN tunnel_hub.segment s ON s.server = l.server AND s.survey_id = l.survey_id AND s.n = l.segment
         WHERE l.detected AND l.review <> 'rejected' AND l.area > 0.2 AND l.chainage_from BETWEEN 1000 AND 1500
         ORDER BY l.server, l.survey, l.chainage_from""",
    "Which are the largest of the whole tunnel?": """
        SELECT server, survey, id, label, area, review FROM tunnel_hub.leak
         WHERE detected AND review <> 'rejected' ORDER BY area DESC LIMIT 20""",
    "Which deserve a second look?": """
        SELECT server, survey, id, label, kind, confidence, reasons FROM tunnel_hub.finding
         WHERE detected AND review = 'open' AND confidence < 0.5 ORDER BY confidence LIMIT 100""",
    "How much of each kilometre is wet?": """
        SELECT server, survey, km, lining_area, seen_share, wet_area, leaks, largest_area FROM tunnel_hub.km_statistics
         ORDER BY server, survey, km""",
    "Which class does each kilometre meet?": """
        SELECT server, survey, km, seen_share, wet_ratio, patches, class FROM tunnel_hub.km_waterproof
         ORDER BY server, survey, km""",
    "Who reviewed how many leaks?": """
        SELECT server, who, count(*) AS edits, count(*) FILTER (WHERE after @> '{"review": "confirmed"}') AS confirmed, max(at)
          FROM tunnel_hub.audit WHERE view = 'finding' GROUP BY server, who ORDER BY edits DESC""",
    "What changed since a date?": """
        SELECT server, survey, at, who, what, km, detail FROM tunnel_hub.change
         WHERE at >= '2024-05-05' ORDER BY at DESC LIMIT 50""",
    "Which leaks were found for the first time in the last week?": """
        SELECT server, survey, id, label, created_at FROM tunnel_hub.leak
         WHERE detected AND created_at >= (SELECT now() - interval '7 days') ORDER BY created_at DESC LIMIT 100""",
    "Which kilometres are stale, and why?": """
        SELECT server, survey, km, stage, reason, done_at FROM tunnel_hub.stage_status
         WHERE stale ORDER BY server, survey, km, step""",
    "Which sections are doubtful?": """
        SELECT server, survey, label, half_width, points, interpolated FROM tunnel_hub.section
         WHERE interpolated > 0 ORDER BY interpolated DESC LIMIT 10""",
    "Where is the tunnel steepest?": """
        SELECT server, survey, n, label_from, label_to, slope FROM tunnel_hub.segment ORDER BY abs(slope) DESC LIMIT 10""",
    "Which objects are in the tunnel?": """
        SELECT server, survey, label, chainage_to - chainage_from AS length_m, height_to, points FROM tunnel_hub.cluster
         WHERE class_name = 'object' AND height_to > 1 ORDER BY server, survey, chainage_from""",
    "Where does a loading gauge fail?": """
        SELECT server, survey, label, track, class, depth, clock FROM tunnel_hub.clearance_infringement
         WHERE counts ORDER BY depth DESC LIMIT 100""",
    "What is the least margin of each 100 m?": """
        SELECT server, survey, track, floor(chainage_from / 100) AS hundred, min(margin) AS margin, avg(seen_share) AS seen
          FROM tunnel_hub.clearance_section GROUP BY server, survey, track, floor(chainage_from / 100)
         ORDER BY server, survey, track, hundred""",
    "Which ten sections have the most underbreak?": """
        SELECT server, survey, label, underbreak, deviation_greatest FROM tunnel_hub.deviation_section
         WHERE layer = 'lining' ORDER BY underbreak DESC LIMIT 10""",
    "Which ten places are the most uneven?": """
        SELECT server, survey, label, gap, direction, area FROM tunnel_hub.evenness_area
         WHERE layer = 'lining' ORDER BY gap DESC LIMIT 10""",
    "Which rings are oval by more than 5 ‰?": """
        SELECT server, survey, count(*), max(ovality) FROM tunnel_hub.ring WHERE ovality > 0.005
         GROUP BY server, survey ORDER BY 4 DESC""",
    "Which are the ten greatest steps between rings?": """
        SELECT server, survey, number, label, step_greatest FROM tunnel_hub.ring
         WHERE step_greatest IS NOT NULL ORDER BY abs(step_greatest) DESC LIMIT 10""",
    "Which leaks grew most?": """
        SELECT server, survey, label, area_old, area_new, area_change FROM tunnel_hub.leak_change
         WHERE state = 'grown' ORDER BY area_change DESC LIMIT 10""",
    "How many findings of each kind and origin are there?": """
        SELECT kind, origin, sum(counted) AS counted, sum(confirmed) AS confirmed, sum(area) AS area
          FROM tunnel_hub.finding_count GROUP BY kind, origin ORDER BY kind, origin""",
    "Which cracks are longer than a metre, the most severe first?": """
        SELECT server, survey, id, label, severity_label, length, width_mm FROM tunnel_hub.finding
         WHERE kind = 'crack' AND counted AND length > 1 ORDER BY severity DESC NULLS LAST, length DESC LIMIT 100""",
    "Which severe findings have no photo?": """
        SELECT server, survey, id, label, kind_label, severity, remark FROM tunnel_hub.finding
         WHERE counted AND severity >= 3 AND photos = 0 ORDER BY severity DESC LIMIT 100""",
    "Who drew what, and when?": """
        SELECT server, drawn_by, origin, count(*) AS findings, max(drawn_at) AS last FROM tunnel_hub.finding
         WHERE origin <> 'detected' GROUP BY server, drawn_by, origin ORDER BY server, drawn_by, origin""",
    "Which actions are overdue, and who is responsible?": """
        SELECT server, survey, id, label, measure, urgency, responsible, due, state FROM tunnel_hub.action
         WHERE overdue ORDER BY due, id""",
    "What do the open actions cost, by urgency and currency?": """
        SELECT urgency, currency, count(*) AS actions, sum(cost) AS cost FROM tunnel_hub.action
         WHERE state IN ('open', 'ordered') GROUP BY urgency, currency ORDER BY urgency, currency""",
    "Which severe findings have no action?": """
        SELECT f.server, f.survey, f.id, f.label, f.severity FROM tunnel_hub.finding f
         WHERE f.counted AND f.severity >= 3
           AND NOT EXISTS (SELECT FROM tunnel_hub.action a WHERE a.server = f.server AND a.finding_id = f.id)
         ORDER BY f.severity DESC, f.server, f.id LIMIT 100""",
}
"""Questions over all tunnels by their headings in the cookbook, as they are asked on a hub."""

ABOVE = {
    "filter": re.compile(r"^ *(Filter|One-Time Filter):", re.MULTILINE),
    "join": re.compile(r"(Nested Loop|Hash (\w+ )*Join|Merge (\w+ )*Join|Hash Anti|SubPlan)"),
    "sort": re.compile(r"^[ >-]*(Incremental )?Sort$|Merge Append", re.MULTILINE),
    "aggregate": re.compile(r"(?<!Relations: )\b(\w*Aggregate|WindowAgg|Unique)\b(?! on)"),
}
"""Steps that the hub does itself, in a plan without its remote statements."""

BELOW = {
    "filter": re.compile(r"\bWHERE\b"),
    "join": re.compile(r"\bJOIN\b"),
    "sort": re.compile(r"\bORDER BY\b"),
    "aggregate": re.compile(r"\bGROUP BY\b|\b(count|sum|max|min)\("),
}
"""The same steps in the statements that the servers get."""


def steps(plan: str) -> dict[str, str]:
    """Return where each step of a plan is done: servers, hub, both, or nowhere."""
    remote = "\n".join(re.findall(r"Remote SQL: (.*)", plan))
    local = "\n".join(line for line in plan.splitlines() if not re.match(r" *(Remote SQL|Relations|Output):", line))
    found = {}
    for step in ABOVE:
        sent, kept = bool(BELOW[step].search(remote)), bool(ABOVE[step].search(local))
        found[step] = {(True, True): "both", (True, False): "servers", (False, True): "hub", (False, False): ""}[sent, kept]
    return found


def ask(dsn: str, query: str) -> dict[str, Any]:
    """Ask a question in a session of its own; milliseconds by the clock of the one who asks, and the number of rows."""
    taken = []
    with psycopg.connect(dsn, autocommit=True) as connection:
        connection.execute("SET tunneldb.server = 'one'")
        for _ in range(1 + WARM):
            begin = time.perf_counter()
            rows = connection.execute(query.encode(), prepare=False).fetchall()
            taken.append(1000 * (time.perf_counter() - begin))
    return {"first_ms": taken[0], "warm_ms": statistics.median(taken[1:]), "rows": len(rows)}


def explain(dsn: str, query: str) -> str:
    with psycopg.connect(dsn) as connection:
        return "\n".join(row[0] for row in connection.execute(b"EXPLAIN (VERBOSE, COSTS OFF) " + query.encode()))


def measure(one: str, hub: str, word: str) -> dict[str, dict[str, Any]]:
    """Ask all questions on one server and over the hub."""
    asked = questions(PAGE)
    found = {}
    for title, query in HUB_QUESTIONS.items():
        if title not in asked:
            raise SystemExit(f"the cookbook has no question {title!r}")
        if word.lower() not in title.lower():
            continue
        progress(title)
        alone = asked[title] if "demo-" not in asked[title] and "'demo'" not in asked[title] else _on_one(query)
        plan = explain(hub, query)
        before, over, after = ask(one, alone), ask(hub, query), ask(one, alone)
        alone_ms = min(before["warm_ms"], after["warm_ms"])
        found[title] = {
            "one_ms": alone_ms, "one_rows": before["rows"], "hub_ms": over["warm_ms"], "hub_first_ms": over["first_ms"],
            "hub_rows": over["rows"], "ratio": over["warm_ms"] / alone_ms, "steps": steps(plan), "plan": plan,
        }  # fmt: skip
    return found


def _on_one(query: str) -> str:
    return query.replace("tunnel_hub.", "tunnel_shared.")


def fill(dsn: str, tunnels: str, size: Size) -> None:
    tunneldb("init", dsn=dsn)
    for tunnel in tunnels:
        progress(f"tunnel {tunnel}")
        with psycopg.connect(dsn) as connection:
            make(connection, f"{tunnel}-2024", size)
    with psycopg.connect(dsn, autocommit=True) as connection:
        connection.execute("CREATE ROLE hub_reader LOGIN IN ROLE tunnel_viewer")


def prepare(folder: Path, size: Size) -> tuple[str, str]:
    """Start the servers, fill those that are empty, make the hub; return the DSNs of the one server and of the hub."""
    filled = (folder / "hub" / "cluster").exists()
    dsns = {name: Server(folder / name, SETTINGS).start() for name in ("one", "hub", *SERVERS)}
    if not filled:
        for name, tunnels in {"one": "".join(SERVERS.values()), **SERVERS}.items():
            progress(name)
            fill(dsns[name], tunnels, size)
    for name in SERVERS:
        target = make_conninfo(dsns[name], user="hub_reader")
        seconds = tunneldb("federate", "add", name, "--dsn", target, dsn=dsns["hub"])
        progress(f"federate add {name}: {seconds:.1f} s")
    return dsns["one"], dsns["hub"]


def set_options(hub: str, options: dict[str, str]) -> None:
    with psycopg.connect(hub, autocommit=True) as connection:
        for name in SERVERS:
            for key, value in options.items():
                connection.execute(
                    sql.SQL("ALTER SERVER {} OPTIONS ({} {} {})").format(
                        sql.Identifier(f"tunnel_server_{name}"),
                        sql.SQL("SET" if key in OPTIONS else "ADD"),
                        sql.Identifier(key),
                        sql.Literal(value),
                    )
                )


def report(found: dict[str, dict[str, Any]]) -> None:
    header = ("question", "rows", "one, ms", "hub, ms", "ratio", "first, ms", "filter", "join", "sort", "aggregate")
    rows = [
        (
            title, one["hub_rows"], f"{one['one_ms']:.1f}", f"{one['hub_ms']:.1f}", f"{one['ratio']:.2f}",
            f"{one['hub_first_ms']:.0f}", *one["steps"].values(),
        )
        for title, one in found.items()
    ]  # fmt: skip
    print_table("Questions over 30 surveys", header, rows)
    over = [title for title, one in found.items() if one["ratio"] > 3]
    print(f"\n{len(found) - len(over)} of {len(found)} within 3 times the time on one server")
    for title, one in found.items():
        if one["one_rows"] != one["hub_rows"]:
            print(f"{title}: {one['one_rows']} rows on one server, {one['hub_rows']} over the hub")
    for title in over:
        print(f"\n{title}\n{found[title]['plan']}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="folder of the servers, which is kept")
    parser.add_argument("--km", type=int, default=25, help="kilometres of each tunnel")
    parser.add_argument("--leaks", type=int, default=5000, help="leaks of each tunnel")
    parser.add_argument("--only", default="", metavar="WORD", help="questions whose heading holds it")
    parser.add_argument("--option", action="append", default=[], metavar="NAME=VALUE", help="option of the foreign servers")
    parser.add_argument("--setting", action="append", default=[], metavar="NAME=VALUE", help="setting of the hub's planner")
    arguments = parser.parse_args()
    size = Size(arguments.km, arguments.leaks, 0, arguments.leaks // 10, arguments.leaks // 5)
    folder = arguments.keep or Path(tempfile.mkdtemp(prefix="tunneldb-federation-"))
    load = os.getloadavg()[0]
    try:
        one, hub = prepare(folder, size)
        set_options(hub, dict(option.split("=", 1) for option in arguments.option))
        planned = make_conninfo(hub, options=" ".join(f"-c {setting}" for setting in arguments.setting))
        found = measure(one, planned, arguments.only)
        report(found)
    finally:
        for name in ("one", "hub", *SERVERS):
            Server(folder / name, SETTINGS).stop()
        if not arguments.keep:
            shutil.rmtree(folder, ignore_errors=True)
    print(f"\n{save('federation', {'load_average_before': load, 'command': sys.argv[1:], 'questions': found})}")


if __name__ == "__main__":
    main()
