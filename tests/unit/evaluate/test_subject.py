# SPDX-License-Identifier: MIT OR Apache-2.0
"""Which trajectory of a folder a reference is compared with."""

import json

import numpy as np
import pytest

from bentwing.base.errors import UsageError
from bentwing.base.trajectory import Trajectory
from bentwing.evaluate.subject import find_subject

START = 1_700_000_000 * 10**9


def poses():
    times = np.arange(0.0, 20.0, 0.1)
    places = np.column_stack([times, np.sin(times), np.zeros(len(times))])
    return Trajectory(times, places, np.tile([0.0, 0.0, 0.0, 1.0], (len(times), 1)))


@pytest.fixture
def merged(tmp_path):
    """Two flights an hour apart in one map."""
    folder = tmp_path / "site"
    folder.mkdir()
    runs = []
    for name, hours in (("a", 0), ("b", 1)):
        poses().write_tum(folder / f"trajectory_{name}.txt", START + hours * 3600 * 10**9)
        runs.append({"name": name, "trajectory": f"trajectory_{name}.txt"})
    record = {"kind": "bentwing run", "complete": True, "runs": runs}
    (folder / "run.json").write_text(json.dumps(record))
    return folder


def test_a_reference_is_compared_with_the_flight_of_its_time(merged, tmp_path):
    poses().write_tum(tmp_path / "truth.txt", START + 3600 * 10**9)
    subject = find_subject(merged)
    assert subject.trajectory is None
    assert subject.flown_with(tmp_path / "truth.txt").trajectory == merged / "trajectory_b.txt"


@pytest.mark.parametrize(
    ("late", "said"), [(600, "no flight was under way"), (3600, "several flights were")]
)
def test_a_reference_of_no_flight_or_of_two_is_refused_and_says_what_to_give(
    merged, tmp_path, late, said
):
    poses().write_tum(merged / "trajectory_a.txt", START + 3600 * 10**9)
    poses().write_tum(tmp_path / "truth.txt", START + late * 10**9)
    with pytest.raises(UsageError, match=said) as refused:
        find_subject(merged).flown_with(tmp_path / "truth.txt")
    assert "trajectory_b.txt" in str(refused.value)


def test_a_folder_without_a_trajectory_cannot_be_compared_with_one(tmp_path):
    (tmp_path / "map.ply").touch()
    poses().write_tum(tmp_path / "truth.txt", START)
    with pytest.raises(UsageError, match="no trajectory"):
        find_subject(tmp_path).flown_with(tmp_path / "truth.txt")
