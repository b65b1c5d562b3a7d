# SPDX-License-Identifier: MIT OR Apache-2.0
"""Which recordings a folder holds, and what they are called."""

from __future__ import annotations

import pytest

from bentwing.base.errors import RecordingError
from bentwing.fleet.discover import find_recordings


@pytest.fixture
def tree(tmp_path):
    """Make empty files, and return the folder."""

    def make(*names):
        for name in names:
            path = tmp_path / "flights" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.touch()
        return tmp_path / "flights"

    return make


def found(folder):
    """Names with what they are of, relative to the folder."""
    return {
        entry.name: [str(part.relative_to(folder)) for part in entry.parts]
        for entry in find_recordings([folder])
    }


def test_recordings_are_named_by_their_place_in_the_folder(tree):
    folder = tree("a.bag", "north/recording.bag", "north/notes.txt", "south/one/b.pcap")
    assert found(folder) == {
        "a": ["a.bag"],
        "north": ["north/recording.bag"],
        "south_one_b": ["south/one/b.pcap"],
    }


def test_another_recording_beside_does_not_rename_the_first(tree):
    before = found(tree("north/recording.bag"))
    after = found(tree("south/recording.bag", "recording.bag"))
    assert before.items() <= after.items()


def test_a_folder_of_ros_2_files_is_one_recording(tree):
    folder = tree("x/metadata.yaml", "x/x_0.db3", "y/y_0.mcap", "y/y_1.mcap")
    assert found(folder) == {"x": ["x"], "y": ["y"]}


def test_links_are_followed_and_may_run_in_a_circle(tree, tmp_path):
    elsewhere = tmp_path / "disk"
    elsewhere.mkdir()
    (elsewhere / "b.bag").touch()
    folder = tree("a.bag")
    (folder / "disk").symlink_to(elsewhere)
    (elsewhere / "round").symlink_to(folder)
    assert found(folder) == {"a": ["a.bag"], "disk_b": ["disk/b.bag"]}


def test_results_and_hidden_files_are_no_recordings(tree):
    folder = tree("a.bag", "run/run.json", "run/b.bag", "site/site.json", "site/recordings/c.bag", ".d.bag", ".e/f.bag")  # fmt: skip
    assert list(found(folder)) == ["a"]


def test_what_cannot_be_read_is_a_recording_of_its_own(tree):
    assert list(found(tree("a.bag", "b.bag"))) == ["a", "b"]


def test_parts_of_one_recording_are_found_by_their_times(tree, ros1):
    folder = tree("c.bag")
    for name, start in (("b_0", 0.0), ("b_1", 2.0), ("later", 100.0)):
        ros1.write(folder / f"{name}.bag", [("/imu", start + 0.1 * k, ros1.imu(start + 0.1 * k)) for k in range(20)])  # fmt: skip
    assert found(folder) == {
        "b_0": ["b_0.bag", "b_1.bag"],
        "c": ["c.bag"],
        "later": ["later.bag"],
    }


def test_the_head_of_a_recording_is_described_beside_it_or_above(tree):
    folder = tree("payload.yaml", "a.bag", "north/payload.yaml", "north/b.bag", "x/metadata.yaml", "x/payload.yaml")  # fmt: skip
    described = {e.name: str(e.payload.relative_to(folder)) for e in find_recordings([folder])}
    assert described == {
        "a": "payload.yaml",
        "north_b": "north/payload.yaml",
        "x": "x/payload.yaml",
    }


def test_a_folder_without_recordings_is_refused(tree):
    with pytest.raises(RecordingError, match="a folder without recordings"):
        find_recordings([tree("notes.txt")])
