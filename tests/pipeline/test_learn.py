"""The command `learn`: reviews in the database to what is in force, and back; who may; what is stale then."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import psycopg
import pytest
from psycopg.conninfo import make_conninfo
from support.command import command

from tunneldb.anomalies.evidence import standard_model
from tunneldb.anomalies.features import FEATURES
from tunneldb.anomalies.learning import Adjustment
from tunneldb.store.learned import STORED, apply_learned, feature_list, load_measured, model_in_force

SURVEY = "demo-2024"
STALE = "SELECT stage, reason FROM tunnel_api.stage_status WHERE stale"
REASON = "adapted model changed since"
MANY = 120


@pytest.fixture(scope="session")
def template(example_template: str) -> str:
    return example_template


def as_json(*arguments: object, code: int = 0) -> dict[str, Any]:
    told: dict[str, Any] = json.loads(command(*arguments, "--json", code=code).stdout)
    return told


def tunnel_id(conn: psycopg.Connection) -> int:
    (key,) = conn.execute("SELECT id FROM tunnel.tunnel").fetchone()  # type: ignore[misc]
    return int(key)


def stale(conn: psycopg.Connection) -> list[tuple[str, str]]:
    rows = conn.execute(STALE).fetchall()
    conn.rollback()
    return rows


@pytest.fixture
def reviewed(conn: psycopg.Connection) -> psycopg.Connection:
    """The example with MANY anomalies more, a metre apart: half of what the model calls leaks was rejected by an inspector."""
    rng = np.random.default_rng(1)
    pool = rng.normal(0, 2, (40000, len(FEATURES)))
    p = standard_model().probabilities(pool)
    pool = pool[(p > 0.55) & (p < 0.95)][:MANY]
    assert len(pool) == MANY
    order = feature_list(conn)
    for k, features in enumerate(pool):
        conn.execute(
            "INSERT INTO tunnel.finding (survey_id, km, chainage_from, chainage_to, arc_from, arc_to, clock, kind, confidence,"
            " area, darkening_mean, darkening_max, image_share, unrolled, map, surface, review, feature_list_id,"
            " features, evidence,"
            " model) SELECT survey_id, km, %(c)s, %(c)s + 0.5, 0, 0.5, 12, 'leak', 0.7, 0.2, 3, 4, 1, unrolled, map, surface,"
            " %(review)s, %(order)s, %(features)s, %(evidence)s, '1' FROM tunnel.finding WHERE id = 1",
            {
                "c": 12310.0 + 1.5 * k, "review": "rejected" if rng.random() < 0.85 else "confirmed", "order": order,
                "features": [*features.tolist(), 1.0], "evidence": json.dumps({"faint": -1.26, "salts": 2.0, "thin": 0.01}),
            },
        )  # fmt: skip
    conn.commit()
    return conn


def test_without_reviews_it_is_one_line(conn: psycopg.Connection) -> None:
    conn.execute("UPDATE tunnel.finding SET review = 'open'")
    conn.commit()
    output = command("learn", SURVEY, code=2).stderr
    assert output.startswith("tunneldb: no finding of demo-2024 was reviewed yet")
    assert output.count("\n") == 1


def test_reviews_of_anomalies_without_features_are_one_line(conn: psycopg.Connection) -> None:
    """The example's anomalies are as a database from before migration 0021 has them; three are reviewed."""
    output = command("learn", SURVEY, "--apply", code=2).stderr
    assert output.startswith("tunneldb: demo-2024: 3 reviewed findings have no features: run detect again")
    assert output.count("\n") == 1
    assert as_json("learn", SURVEY, "--list")["learned"] == []


def test_outlines_drawn_by_hand_are_counted_apart_and_need_no_new_detection(reviewed: psycopg.Connection) -> None:
    """Detection never measures them, unless it finds them, too."""
    reviewed.execute("UPDATE tunnel.finding SET origin = 'drawn' WHERE review <> 'open' AND features IS NULL")
    reviewed.commit()
    learned = command("learn", SURVEY, "--json")
    told = json.loads(learned.stdout)
    assert told["unused"][SURVEY] == {"detected": 0, "gone": 0, "drawn": 3}
    assert told["without_features"] == {SURVEY: 0}
    assert f"{SURVEY}: 3 reviewed findings have an outline drawn by hand" in learned.stderr
    assert "run detect again" not in learned.stderr
    (original,) = reviewed.execute("SELECT min(id) FROM tunnel.finding WHERE features IS NOT NULL").fetchone()
    reviewed.execute(
        "UPDATE tunnel.finding SET same_as = (SELECT min(id) FROM tunnel.finding WHERE origin = 'drawn') WHERE id = %s",
        [original],
    )
    reviewed.execute("UPDATE tunnel.finding SET detected = false WHERE origin = 'detected' AND features IS NULL")
    reviewed.commit()
    assert as_json("learn", SURVEY)["unused"][SURVEY]["drawn"] == 2
    reviewed.execute("UPDATE tunnel.finding SET review = 'open' WHERE origin = 'detected'")
    reviewed.execute("UPDATE tunnel.finding SET same_as = NULL")
    reviewed.commit()
    refused = command("learn", SURVEY, code=2).stderr
    assert refused.startswith(f"tunneldb: {SURVEY}: 3 reviewed findings have an outline drawn by hand")
    assert refused.count("\n") == 1


def test_features_of_a_version_that_measured_less_are_none(reviewed: psycopg.Connection) -> None:
    conn = reviewed
    conn.execute("UPDATE tunnel.feature_list SET names = names[2:]")
    conn.commit()
    assert f"{MANY + 3} reviewed findings have no features" in command("learn", SURVEY, code=2).stderr


def test_features_in_another_order_are_told_by_their_names(reviewed: psycopg.Connection) -> None:
    conn = reviewed
    before = load_measured(conn, [tunnel_id(conn)])
    (own,) = conn.execute("SELECT max(id) FROM tunnel.feature_list").fetchone()
    conn.execute(
        "UPDATE tunnel.feature_list SET names = ARRAY(SELECT unnest(names || 'new'::text) ORDER BY 1 DESC) WHERE id = %s", [own]
    )
    names = conn.execute("SELECT names FROM tunnel.feature_list WHERE id = %s", [own]).fetchone()[0]
    for key, values in conn.execute("SELECT id, features FROM tunnel.finding WHERE features IS NOT NULL").fetchall():
        by_name = {**dict(zip(STORED, values, strict=True)), "new": 9.0}
        conn.execute("UPDATE tunnel.finding SET features = %s WHERE id = %s", [[by_name[name] for name in names], key])
    after = load_measured(conn, [tunnel_id(conn)])
    assert np.array_equal(after.features, before.features, equal_nan=True)
    assert after.known.sum() == MANY


def test_a_plan_changes_nothing(reviewed: psycopg.Connection) -> None:
    told = as_json("learn", SURVEY)
    assert told["reviews"].keys() == {"confirmed leak", "rejected"}
    assert sum(told["reviews"].values()) == MANY
    assert told["without_features"] == {SURVEY: 3}
    assert [one["way"] for one in told["held_out"]] == ["base", "recalibrated", "refit", "extended"]
    assert told["chosen"] != "base"
    losses = {one["way"]: one["loss"] for one in told["held_out"]}
    assert losses[told["chosen"]] == min(losses.values()) < losses["base"]
    base = told["held_out"][0]
    assert (base["false_leaks"], base["missed"]) == (told["reviews"]["rejected"], 0)  # all are called leaks as yet
    (changes,) = told["changes"]
    assert (changes["survey"], changes["anomalies"]) == (SURVEY, MANY)
    assert changes["from_leak"] > 0.6 * MANY
    assert changes["to_leak"] == 0
    assert len(told["largest"]) == 10
    assert all(one["was"] == "leak" != one["will_be"] and one["after"] < 0.5 < one["before"] for one in told["largest"])
    assert told["applied"] == {}
    assert as_json("learn", SURVEY, "--list")["learned"] == []
    assert stale(reviewed) == []
    assert "nothing was changed: --apply puts this in force" in command("learn", SURVEY).output


def test_what_is_applied_is_in_force_until_it_is_undone(reviewed: psycopg.Connection) -> None:
    conn = reviewed
    told = as_json("learn", SURVEY, "--apply", "--note", "soot")
    assert told["applied"] == {"demo": 1}
    assert stale(conn) == [("detect", REASON)]
    judge = model_in_force(conn, tunnel_id(conn))
    assert (judge.id, judge.note) == (1, None)
    assert judge.model.version == f"{standard_model().version}+learned 1"
    again = as_json("learn", SURVEY)  # held against what is in force now
    assert again["changes"][0]["from_leak"] == again["changes"][0]["to_leak"] == 0
    command("learn", SURVEY, "--apply")
    (second, first) = as_json("learn", SURVEY, "--list")["learned"]
    assert (first["id"], first["in_force"], first["note"], first["surveys"]) == (1, False, "soot", [SURVEY])
    assert (second["id"], second["in_force"], second["note"]) == (2, True, None)
    assert first["reviews"] == told["reviews"]
    assert first["loss"] < first["loss_base"]
    assert "in force" in command("learn", SURVEY, "--list").output
    conn.rollback()
    assert as_json("learn", SURVEY, "--undo")["undone"] == {"demo": 2}
    assert model_in_force(conn, tunnel_id(conn)).id == 1
    conn.rollback()
    assert stale(conn) == [("detect", REASON)]
    command("learn", SURVEY, "--undo")
    assert stale(conn) == []  # detection never went by it
    assert model_in_force(conn, tunnel_id(conn)).model is standard_model()
    conn.rollback()
    assert "tunnel demo has no adjustment from reviews" in command("learn", SURVEY, "--undo", code=2).stderr
    audit = conn.execute(
        "SELECT survey, row_id, action, after ->> 'note', after ->> 'undone' FROM tunnel_api.audit"
        " WHERE view = 'learned_model' ORDER BY id"
    ).fetchall()
    assert audit == [
        (SURVEY, 1, "insert", "soot", None), (SURVEY, 2, "insert", None, None),
        (SURVEY, 2, "update", None, "true"), (SURVEY, 1, "update", None, "true"),
    ]  # fmt: skip


def test_detection_that_went_by_what_is_in_force_is_not_stale(reviewed: psycopg.Connection) -> None:
    conn = reviewed
    command("learn", SURVEY, "--apply")
    conn.execute("UPDATE tunnel.run SET counts = counts || '{\"learned\": 1}' WHERE stage = 'detect'")
    conn.commit()
    assert stale(conn) == []
    command("learn", SURVEY, "--undo")
    assert stale(conn) == [("detect", REASON)]


def test_what_was_learned_for_another_model_is_not_used_and_says_so(reviewed: psycopg.Connection) -> None:
    conn = reviewed
    command("learn", SURVEY, "--apply")
    conn.execute("UPDATE tunnel.learned_model SET base = 'of old'")
    judge = model_in_force(conn, tunnel_id(conn))
    assert judge.id == 1
    assert judge.model is standard_model()
    assert judge.note is not None
    assert "adjusts model of old" in judge.note


@pytest.mark.parametrize("options", [("--apply", "--undo"), ("--undo", "--list"), ("--note", "soot")])
def test_options_that_do_not_go_together(conn: psycopg.Connection, options: tuple[str, ...]) -> None:
    assert command("learn", SURVEY, *options, code=2).stderr.count("\n") == 1


@pytest.mark.parametrize(("name", "may"), [("vera", False), ("ines", False), ("otto", True)])
def test_operators_apply_and_undo_and_nobody_else(
    reviewed: psycopg.Connection, people: None, dsn: str, name: str, may: bool
) -> None:
    with psycopg.connect(make_conninfo(dsn, user=name), autocommit=True) as person:
        adjustment = Adjustment("recalibrated", 0.9, -0.5)

        def apply() -> int:
            return apply_learned(person, 1, adjustment, [SURVEY], {"rejected": 12}, (0.7, 0.6), None)

        if not may:
            with pytest.raises(psycopg.errors.InsufficientPrivilege):
                apply()
            with pytest.raises(psycopg.errors.InsufficientPrivilege):
                person.execute("SELECT tunnel_internal.learned_undo(1)")
        else:
            number = apply()
            assert person.execute("SELECT tunnel_internal.learned_undo(1)").fetchone() == (number,)
            with pytest.raises(psycopg.errors.InsufficientPrivilege):
                person.execute("SELECT tunnel_internal.note_learned(1, 1, NULL, '{}')")
        seen = person.execute("SELECT applied_by, undone_by FROM tunnel_api.learned_model").fetchall()
        assert seen == ([("otto", "otto")] if may else [])


def test_evidence_is_told_by_the_views(reviewed: psycopg.Connection) -> None:
    rows = reviewed.execute("SELECT evidence, model FROM tunnel_api.leak_map WHERE model IS NOT NULL").fetchall()
    assert set(rows) == {("for a leak: salts at the rim 2.0; against: faint 1.3", "1")}
    assert reviewed.execute("SELECT count(*) FROM tunnel_api.leak WHERE evidence IS NULL").fetchone() == (7,)
    shown = reviewed.execute(
        "SELECT reason, log_odds FROM tunnel_api.finding_evidence WHERE finding_id = (SELECT max(id) FROM tunnel.finding)"
    ).fetchall()
    assert dict(shown) == {"faint": -1.26, "salts": 2.0, "thin": 0.01}
