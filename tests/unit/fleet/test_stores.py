# SPDX-License-Identifier: MIT OR Apache-2.0
"""Recordings and sites in an object store."""

from __future__ import annotations

import json
import os
import pickle
import tempfile
from pathlib import Path

import numpy as np
import pytest

from bentwing.base.errors import InputError, UsageError
from bentwing.base.progress import Progress
from bentwing.fleet import store as stores
from bentwing.fleet.mirror import Away
from bentwing.fleet.opened import side_by_side
from bentwing.fleet.plan import Choice
from bentwing.fleet.site import map_fleet, map_site
from bentwing.fleet.store import ChangedError, Store
from bentwing.fleet.stored import Carried, Stored
from bentwing.fleet.task import MapTask
from support.stores import breaking, forget_connections, s3_store


@pytest.fixture
def bucket(monkeypatch, tmp_path):
    """An empty bucket, and a temporary folder of this test's own."""
    (tmp_path / "scratch").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "scratch"))
    with s3_store(monkeypatch) as bucket:
        yield bucket


@pytest.fixture
def fleet(bucket, work):
    """Map what is in the bucket."""
    assert bucket.url == "s3://flights"

    def run(recordings, out):
        work.calls.clear()
        progress = Progress()
        return map_site([recordings], out, Choice(), side_by_side(1, progress), progress)

    return run


def flights(bucket, **contents):
    for name, content in contents.items():
        bucket.put(f"flights/{name}.bag", content)


def states(site):
    return {one.name: one.state for one in site.recordings}


def test_recordings_of_a_bucket_are_mapped_and_merged_into_a_folder(fleet, bucket, tmp_path):
    flights(bucket, a1="1", a2="2", b1="refused")
    out = tmp_path / "site"
    site = fleet("s3://flights/flights", out)
    assert states(site) == {"a1": "good", "a2": "good", "b1": "refused"}
    assert [group.runs for group in site.groups] == [("a1", "a2")]
    record = json.loads((out / "recordings" / "a1" / "run.json").read_text())
    assert record["recordings"] == ["s3://flights/flights/a1.bag"]
    assert site.recordings[2].reason == "s3://flights/flights/b1.bag: no message could be read"
    assert not list((tmp_path / "scratch").glob("bentwing-*"))


def test_of_a_bucket_only_what_has_changed_is_mapped_again(fleet, bucket, work, tmp_path):
    flights(bucket, a1="1", a2="2", b1="3")
    fleet("s3://flights/flights", tmp_path / "site")
    bucket.put("flights/a2.bag", "2")  # written again, but the same
    site = fleet("s3://flights/flights", tmp_path / "site")
    assert not work.calls
    assert all(one.is_earlier for one in site.recordings)
    bucket.put("flights/b1.bag", "4")
    fleet("s3://flights/flights", tmp_path / "site")
    assert work.calls == {"b1": 1, "merge": 1}


def test_a_site_in_a_bucket_is_that_of_a_folder(fleet, bucket, tmp_path):
    flights(bucket, a1="1", a2="2", b1="3")
    here = fleet("s3://flights/flights", tmp_path / "site")
    away = fleet("s3://flights/flights", "s3://flights/site")
    assert away.url == "s3://flights/site"
    assert states(away) == states(here)
    files = {
        path.relative_to(here.out).as_posix() for path in here.out.rglob("*") if path.is_file()
    }
    written = {name.removeprefix("site/") for name in bucket.written() if name.startswith("site/")}
    assert written == files
    for name in files:
        if name.endswith((".laz", ".txt", ".html")):
            assert bucket.read(f"site/{name}") == (here.out / name).read_bytes(), name
    for name in written:
        if name.endswith(".json"):
            assert str(tmp_path) not in bucket.read(f"site/{name}").decode(), name
    assert json.loads(bucket.read("site/site.json"))["complete"]
    assert not list((tmp_path / "scratch").glob("bentwing-*"))


def test_in_a_bucket_only_what_is_missing_is_made_again(fleet, bucket, work):
    flights(bucket, a1="1", a2="2", b1="3", b2="4")
    fleet("s3://flights/flights", "s3://flights/site")
    before = bucket.written()
    site = fleet("s3://flights/flights", "s3://flights/site")
    assert not work.calls
    assert all(one.is_earlier for one in [*site.recordings, *site.groups])
    unchanged = {n for n, when in bucket.written().items() if when == before.get(n)}
    assert {*before} - unchanged <= {"site/site.json", "site/index.html"}
    bucket.remove("site/recordings/a1/run.json")  # as if its worker had been killed
    bucket.remove("site/recordings/b2/map.laz")
    fleet("s3://flights/flights", "s3://flights/site")
    assert work.calls == {"a1": 1, "b2": 1}
    assert {*bucket.written()} == {*before}


def test_a_map_that_is_no_more_is_removed_from_the_bucket(fleet, bucket):
    flights(bucket, a1="1", a2="2", b1="3")
    fleet("s3://flights/flights", "s3://flights/site")
    bucket.remove("flights/a2.bag")
    site = fleet("s3://flights/flights", "s3://flights/site")
    assert [group.runs for group in site.groups] == [("a1",), ("b1",)]
    left = [name for name in bucket.written() if name.startswith("site/groups/")]
    assert left == ["site/groups/groups.json"]


def test_a_manifest_in_a_bucket_names_what_lies_beside_it(fleet, bucket, tmp_path):
    bucket.put("north/a.bag", "1")
    bucket.put("north/cave/metadata.yaml", "")
    bucket.put("north/cave/cave_0.db3", "2")
    bucket.put("north/flights.csv", "name,recording\na1,a.bag\nb1,gone.bag\n")
    site = fleet("s3://flights/north/flights.csv", tmp_path / "site")
    assert states(site) == {"a1": "good", "b1": "refused"}
    assert site.recordings[1].reason.startswith("s3://flights/north/gone.bag: no such object")
    bucket.put("north/flights.csv", "name,recording\na1,a.bag\na1,cave\n")
    with pytest.raises(
        InputError, match=r"s3://flights/north/flights\.csv, line 3: has the name 'a1'"
    ):
        fleet("s3://flights/north/flights.csv", tmp_path / "site")


def test_names_that_no_file_can_have_are_left_out(fleet, bucket, tmp_path):
    flights(bucket, a1="1")
    for name in ("flights/../up.bag", "flights//b.bag", f"flights/{'c' * 300}.bag"):
        bucket.put(name, "2")
    assert states(fleet("s3://flights/flights", tmp_path / "site")) == {"a1": "good"}
    assert not (tmp_path / "up.bag").exists()


def test_a_place_of_something_else_is_refused(fleet, bucket):
    flights(bucket, a1="1")
    with pytest.raises(InputError, match="is not empty and holds no earlier site"):
        fleet("s3://flights/flights", "s3://flights/flights")
    assert [*bucket.written()] == ["flights/a1.bag"]


@pytest.mark.parametrize(
    ("url", "says"),
    [
        ("s3://nowhere/flights", "s3://nowhere/flights: no such object or bucket"),
        ("s3://flights/nothing", "s3://flights/nothing: nothing is there"),
    ],
)
def test_what_is_not_there_is_said_so(fleet, tmp_path, url, says):
    with pytest.raises(InputError, match=says):
        fleet(url, tmp_path / "site")
    assert not (tmp_path / "site").exists()


def test_a_scheme_that_nothing_reads_is_refused(tmp_path):
    with pytest.raises(UsageError, match="ftps9://host/x: cannot be read"):
        map_fleet("ftps9://host/x", tmp_path / "site", workers=1)


def test_a_key_without_rights_is_said_so(bucket):
    import requests

    requests.post(f"{bucket.endpoint}/moto-api/reset-auth", data=b"0", timeout=10)
    try:
        with pytest.raises(InputError, match="s3://flights: the store allows no access"):
            Store(bucket.url).files()
    finally:
        requests.post(f"{bucket.endpoint}/moto-api/reset-auth", data=b"inf", timeout=10)


def test_an_object_that_changes_is_not_read_as_if_it_had_not(bucket, tmp_path, monkeypatch):
    bucket.put("a.bag", b"1" * 5000)
    stored = Stored.at("s3://flights/a.bag")
    bucket.put("a.bag", b"2" * 5000)
    with pytest.raises(ChangedError, match="has changed since it was listed"):
        stored.fetch(tmp_path)
    stored = Stored.at("s3://flights/a.bag")
    monkeypatch.setattr(stores, "_BLOCK", 1000)
    read = []

    class Written(type(Path())):
        def open(self, *words):
            file = super().open(*words)

            class Counting:
                def __enter__(self):
                    return self

                def __exit__(self, *error):
                    file.close()

                def tell(self):
                    return file.tell()

                def write(self, block):
                    read.append(block)
                    if len(read) == 2:
                        bucket.put("a.bag", b"3" * 5000)
                    return file.write(block)

            return Counting()

    ((name, file),) = stored.files
    with pytest.raises(ChangedError, match="was replaced while it was read"):
        Store(stored.url).fetch(name, file, Written(tmp_path / "b.bag"))
    assert len(read) == 2


def test_a_connection_that_breaks_is_taken_up_again(bucket, tmp_path, monkeypatch):
    content = np.random.default_rng(1).bytes(3_000_000)
    bucket.put("a.bag", content)
    monkeypatch.setattr(stores, "_PAUSES", (0.1,))
    monkeypatch.setattr(stores, "_BLOCK", 2**19)
    with breaking(bucket.endpoint, n_breaks=5, after=300_000) as endpoint:
        monkeypatch.setenv("AWS_ENDPOINT_URL", endpoint)
        forget_connections()
        path = Stored.at("s3://flights/a.bag").fetch(tmp_path)
    assert path.read_bytes() == content


def test_a_store_that_does_not_answer_is_said_so(bucket, monkeypatch):
    assert os.environ["AWS_ENDPOINT_URL"] == bucket.endpoint
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:1")
    forget_connections()
    with pytest.raises(InputError, match="s3://flights: no connection with the store"):
        Store(bucket.url, patience=0.0).files()


def test_what_does_not_fit_on_the_disk_is_not_begun(bucket, tmp_path, monkeypatch):
    bucket.put("a.bag", "1")
    stored = Stored.at("s3://flights/a.bag")
    monkeypatch.setattr("shutil.disk_usage", lambda _: type("Usage", (), {"free": 2**20}))
    with pytest.raises(InputError, match="let TMPDIR name a larger disk"):
        stored.fetch(tmp_path / "in")
    assert not (tmp_path / "in").exists()


def test_any_file_system_of_fsspec_is_read(fleet, work, tmp_path):
    folder = tmp_path / "there"
    folder.mkdir()
    (folder / "a1.bag").write_text("1")
    assert states(fleet(f"file://{folder}", f"file://{tmp_path}/site")) == {"a1": "good"}
    assert work.calls == {"a1": 1}
    assert (tmp_path / "site" / "recordings" / "a1" / "map.laz").is_file()


def test_work_that_goes_to_another_host_can_be_sent(bucket):
    bucket.put("a.bag", "1")
    task = MapTask(
        "a", Path("a"), (Stored.at("s3://flights/a.bag"),), Carried("p", b"x"), "", "", 1.0
    )
    away = Away("s3://flights/site", Path(), task)
    assert pickle.loads(pickle.dumps(away)) == away
