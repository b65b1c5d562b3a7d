# SPDX-License-Identifier: MIT OR Apache-2.0
"""Lists of recordings as users write them, and as they must not."""

from __future__ import annotations

import pytest

from bentwing.base.errors import InputError
from bentwing.fleet.entry import Entry
from bentwing.fleet.manifest import read_manifest

YAML = """
payload: head.yaml
recordings:
  - {name: morning, recording: a.bag, start: 3}
  - recording: [parts/b_0.bag, parts/b_1.bag]
    payload: other.yaml
    project: project.yaml
    marks: marks.csv
"""
CSV = """\ufeffName, recording, payload, project, marks, start
morning, a.bag, head.yaml, , , 3

, parts/b_0.bag; parts/b_1.bag, other.yaml, project.yaml, marks.csv,
"""


@pytest.fixture
def read(tmp_path):
    """Read a manifest of a text."""

    def read(text, suffix=".yaml"):
        path = tmp_path / f"flights{suffix}"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_manifest(path)

    return read


@pytest.mark.parametrize(("text", "suffix"), [(YAML, ".yaml"), (YAML, ".yml"), (CSV, ".csv")])
def test_a_manifest_says_the_same_as_yaml_and_as_a_table(read, tmp_path, text, suffix):
    parts = (tmp_path / "parts/b_0.bag", tmp_path / "parts/b_1.bag")
    assert read(text, suffix) == [
        Entry("morning", (tmp_path / "a.bag",), tmp_path / "head.yaml", start=3.0),
        Entry(
            "b_0", parts, tmp_path / "other.yaml", tmp_path / "project.yaml", tmp_path / "marks.csv"
        ),
    ]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "lists no recordings"),
        ("- a.bag", "lists no recordings"),
        ("recordings: []", "recordings: tuple should have at least 1 item"),
        ("recordings: a.bag", "recordings: "),
        ("recordings: [{name: a}]", "recordings[0].recording: required, but not given"),
        ("recordings: [{recording: []}]", "recordings[0].recording: "),
        ("recordings: [{recording: a.bag, payloads: b}]", "recordings[0]: unknown key 'payloads'; did you mean 'payload'?"),
        ("recordings: [{recording: a.bag}, {recording: b.bag, start: -1}]", "recordings[1].start: "),
        ("recordings: [{recording: a.bag, start: .nan}]", "recordings[0].start: "),
        ("recordings: [{recording: a.bag, name: ../up}]", "'../up' cannot be the name of a folder"),
        ("recordings: [{recording: a.bag, name: .hidden}]", "cannot be the name of a folder"),
        ("recordings: [{recording: a.bag, name: ''}]", "cannot be the name of a folder"),
        (f"recordings: [{{recording: a.bag, name: {'n' * 200}}}]", "has 200 characters"),
        ("recordings: [{recording: a.bag, name: x}, {recording: b.bag, name: x}]", "recordings[1]: has the name 'x' of recordings[0], too"),
        ("recordings: [{recording: a.bag, name: x}, {recording: a.bag, name: y}]", "recordings[1]: has the recording of recordings[0], too"),
        ("recordings: [&a {recording: a.bag}, *a]", "alias"),
        ("recordings: [{", "not valid YAML"),
        (b"recordings: [{recording: \xff}]", "cannot be read"),
    ],
)  # fmt: skip
def test_a_bad_manifest_is_refused_with_the_key(read, text, says):
    with pytest.raises(InputError) as refused:
        read(text)
    assert "flights.yaml" in str(refused.value)
    assert says in str(refused.value)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "lists no recordings"),
        ("name,recording\n", "lists no recordings"),
        ("name,payload\na,b\n", "line 1: has no column 'recording'"),
        ("recording,colour\na.bag,red\n", "line 1: column 'colour' is twice or unknown"),
        ("recording,name,name\n", "line 1: column 'name' is twice or unknown"),
        ("recording\na.bag\nb.bag,c.bag\n", "line 3: has 2 cells below 1 columns"),
        ("name,recording\n\na,\n", "line 3: recording: required, but not given"),
        ("recording,start\na.bag,0\nb.bag,soon\n", "line 3: start: "),
        ("recording\na.bag\n\na.bag\n", "line 4: has the name 'a' of line 2, too"),
        ('recording\n"a.bag\n', "cannot be read as CSV"),
        (b"recording\n\xff.bag\n", "is no UTF-8 text"),
    ],
)
def test_a_bad_table_is_refused_with_the_line(read, text, says):
    with pytest.raises(InputError) as refused:
        read(text, ".csv")
    assert "flights.csv" in str(refused.value)
    assert says in str(refused.value)


@pytest.mark.parametrize("name", ["gone.yaml", "gone.csv"])
def test_a_manifest_that_is_not_there_is_named(tmp_path, name):
    with pytest.raises(InputError, match=f"{name}: no such file"):
        read_manifest(tmp_path / name)
