# SPDX-License-Identifier: MIT OR Apache-2.0
"""What was asked of a run, as one hash."""

import pytest

from bentwing.closing.georeference.settings import GeoreferenceSettings
from bentwing.run.request import request_of
from bentwing.run.settings import RunSettings

INPUTS = [{"name": "recording.bag", "bytes": 7, "sha256": "ab", "hashed": "all"}]


@pytest.mark.parametrize("name", ["control_points", "fixes"])
def test_a_file_that_is_read_beside_the_recording_is_part_of_it_by_its_content(tmp_path, name):
    file = tmp_path / "points"
    settings = RunSettings(georeferencing=GeoreferenceSettings(**{name: file}))
    found = []
    for content in ("one", "other", "one"):
        file.write_text(content)
        found.append(request_of(settings, INPUTS))
    assert found[0] == found[2] != found[1]


def test_threads_change_nothing_and_other_settings_and_inputs_do():
    plain = request_of(RunSettings(), INPUTS)
    assert request_of(RunSettings(threads=1), INPUTS) == plain
    assert request_of(RunSettings(map_spacing=0.1), INPUTS) != plain
    assert request_of(RunSettings(), [{**INPUTS[0], "sha256": "cd"}]) != plain
