"""docker-compose.yml: what Compose's own schema says, and what workers need that it can't know."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
COMPOSE = ROOT / "docker-compose.yml"


def problems(file: Path) -> str:
    """What the validator says against a file; empty if nothing."""
    if importlib.util.find_spec("check_jsonschema") is None:
        pytest.skip("check-jsonschema is not installed")
    command = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", "vendor.compose-spec", str(file)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    return "" if result.returncode == 0 else result.stdout + result.stderr


@pytest.fixture
def services() -> dict[str, Any]:
    yaml = pytest.importorskip("ruamel.yaml")
    return yaml.YAML(typ="safe").load(COMPOSE)["services"]


def test_the_file_is_valid_compose() -> None:
    assert problems(COMPOSE) == ""


@pytest.mark.parametrize(
    ("right", "wrong"),
    [("depends_on:", "depend_on:"), ("condition: service_healthy", "condition: healthy"), ("init: true", "init: [1]")],
)
def test_the_validator_finds_mistakes(tmp_path: Path, right: str, wrong: str) -> None:
    text = COMPOSE.read_text("utf-8")
    assert right in text
    copy = tmp_path / "docker-compose.yml"
    copy.write_text(text.replace(right, wrong, 1))
    assert problems(copy)


def test_workers_can_be_scaled(services: dict[str, Any]) -> None:
    worker = services["worker"]
    assert not {"container_name", "ports", "hostname"} & worker.keys()  # of these there could be only one
    assert worker["depends_on"]["database"]["condition"] == "service_healthy"
    assert "healthcheck" in services["database"]
    assert worker["command"][0] == "worker"


def test_workers_see_the_scans_under_the_path_that_the_operator_gave(services: dict[str, Any]) -> None:
    (scans,) = services["worker"]["volumes"]
    assert scans["source"] == scans["target"]
    assert scans["read_only"] is True


def test_no_password_is_in_the_file(services: dict[str, Any]) -> None:
    for service in services.values():
        for name, value in service["environment"].items():
            if "PASSWORD" in name:
                assert value.startswith("${POSTGRES_PASSWORD:?")
    assert "password" not in services["worker"]["environment"]["TUNNELDB_DSN"]


def test_layers_are_served_of_a_coordinate_system_that_is_named(services: dict[str, Any]) -> None:
    service = services["ogc-api"]
    assert service["environment"]["OGC_SRID"] == "${OGC_SRID:-}"
    *shell, script = service["command"]
    script = script.replace("$$", "$").replace("exec uvicorn", "exec echo uvicorn")
    for srid, refused in (("", True), ("25830", False)):
        done = subprocess.run(
            [*shell, script], env=os.environ | {"OGC_SRID": srid}, capture_output=True, text=True, check=False
        )
        assert (done.returncode != 0) == refused
        assert ("OGC_SRID: set it to the EPSG code" in done.stderr) == refused
        assert ("uvicorn" in done.stdout) != refused


def test_the_image_is_built_from_all_that_the_wheel_needs() -> None:
    kept = {line[1:] for line in (ROOT / ".dockerignore").read_text().splitlines() if line.startswith("!")}
    copied = {
        word
        for line in (ROOT / "Dockerfile").read_text().splitlines()
        if line.startswith("COPY ")
        for word in line.split()[1:-1]
    }
    assert copied == kept == {"pyproject.toml", "README.md", "LICENSE", "tunneldb", "sql", "migrations"}
