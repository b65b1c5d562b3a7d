# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a user says of a project, in a file of its own or in payload.yaml."""

import pytest

from bentwing.base.errors import InputError
from bentwing.recording import Payload
from bentwing.recording.sections.project import Project, project_in


def written(tmp_path, text):
    path = tmp_path / "project.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_keys_stand_alone_or_below_project(tmp_path):
    alone = Project.load(
        written(tmp_path, "name: Nord\nnumber: 4711\nclient: |\n  City of\n  Elm\n")
    )
    below = Project.load(written(tmp_path, "project:\n  name: Nord\n"))
    assert (alone.name, alone.number, alone.client) == ("Nord", "4711", "City of Elm")
    assert below.name == "Nord"


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("sit: x", "did you mean 'site'?"),
        ("name: [1]", "name: input should be a valid string"),
        ("time_zone: Mars/Phobos", "give one such as Europe/Berlin"),
        ("{}", "says nothing of a project"),
        ("- a", "says nothing of a project"),
        (f"name: {'x' * 300}", "at most 200 characters"),
        ('name: "a\\0b"', "has a NUL"),
        ('name: "a\\x07b"', "control characters"),
    ],
)
def test_what_cannot_be_used_is_named(tmp_path, text, part):
    path = written(tmp_path, text)
    with pytest.raises(InputError, match=r"project\.yaml") as caught:
        Project.load(path)
    assert part in str(caught.value)


def test_a_payload_keeps_its_project(tmp_path):
    payload = Payload.model_validate({"project": {"name": "Nord", "operator": "A. Muster"}})
    payload.save(tmp_path / "payload.yaml")
    assert Payload.load(tmp_path / "payload.yaml").project == payload.project
    record = {"settings": {"payload": payload.model_dump(mode="json")}}
    assert project_in(record) == payload.project
    assert project_in({}) is None
