import datetime as dt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tunneldb.database.copy import PointZ, pack
from tunneldb.pointcloud.spool import ROW
from tunneldb.store.point_rows import by_chainage, pack_rows
from tunneldb.store.survey import Survey

SURVEY = Survey(7, "s", 1, "t", 25830, False, 0.0, 10.0, dt.date(2024, 5, 4), None, "none", "static", "none")


def test_rows_are_packed_as_columns_are() -> None:
    rng = np.random.default_rng(1)
    rows = np.zeros(1000, ROW)
    for name in ("x", "y", "z", "chainage", "time", "intensity"):
        rows[name] = rng.normal(0, 1e6, len(rows))
    rows["scan_id"], rows["tag"] = rng.integers(-(2**31), 2**31, len(rows)), rng.integers(0, 300, len(rows))
    rows["classification"] = rng.integers(0, 256, len(rows))
    file_ids = rng.integers(-(2**31), 2**31, 300).astype(np.int32)
    ordered = rows[np.argsort(rows["chainage"], kind="stable")]
    expected = pack(
        [
            np.full(len(rows), 7, np.int32),
            np.full(len(rows), -12, np.int32),
            ordered["chainage"],
            ordered["time"],
            PointZ(np.column_stack([ordered[axis] for axis in "xyz"]), 25830),
            ordered["scan_id"],
            file_ids[ordered["tag"]],
            ordered["intensity"],
            ordered["classification"].astype(np.int16),
        ]
    )
    assert b"".join(pack_rows(SURVEY, -12, rows, file_ids)) == expected
    assert b"".join(pack_rows(SURVEY, -12, rows[:0], file_ids)) == b""


@given(st.lists(st.floats(-1e6, 1e6) | st.sampled_from([0.0, 1.0, 999.125])))
@settings(deadline=None)
def test_order_of_chainage(values: list[float]) -> None:
    chainage = np.array(values)
    np.testing.assert_array_equal(by_chainage(chainage), np.argsort(chainage, kind="stable"))


@pytest.mark.parametrize("profiles", [1, 3, 5000])
def test_order_of_profiles(profiles: int) -> None:
    rng = np.random.default_rng(1)
    chainage = rng.integers(0, profiles, 20_000) * 0.05 + rng.normal(0, 1e-9, 20_000)
    np.testing.assert_array_equal(by_chainage(chainage), np.argsort(chainage, kind="stable"))
