"""A simulated tunnel, and what an undisturbed batch makes of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from faults.killer import reading, whole
from faults.project import Project, State, batch, runs, state
from faults.scene import anyhow, make, split


@dataclass(frozen=True)
class Survey:
    """A project, its scan files, and the state that a batch leaves which nothing disturbs."""

    project: Project
    files: list[Path]
    undisturbed: State

    def points(self) -> dict[int, tuple[int, int]]:
        """Of each kilometre, how many points it has, and how many of them lie in a segment."""
        rows = self.undisturbed["point"]
        return {
            int(km): (int((rows["km"] == km).sum()), int((rows["segment"][rows["km"] == km] >= 0).sum()))
            for km in np.unique(rows["km"])
        }

    def kilometres(self) -> list[int]:
        """All that the tunnel has."""
        return sorted(self.points())


@pytest.fixture(scope="session")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Survey]:
    """Five kilometres: each way in which a file lies over their borders is there once."""
    last = 4
    scene = make(1, last)
    files = split(scene.scan, tmp_path_factory.mktemp("survey"), anyhow)
    project = Project(scene)
    try:
        with reading(project, range(last + 1)) as seen:
            project.run(*batch(files))
        survey = Survey(project, files, state(project))
        assert whole(seen, survey.points()) == []
        assert [row for row in runs(project) if row[3] != 1] == []
        assert {row[2:4] for row in survey.undisturbed["status"]} == {("done", False)}
        assert survey.undisturbed["jobs"] == survey.undisturbed["incoming"] == survey.undisturbed["scratch"] == []
        assert len(survey.undisturbed["finding"]) >= 2 * last - 1
        yield survey
    finally:
        project.close()
