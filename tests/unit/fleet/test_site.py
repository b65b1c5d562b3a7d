# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is done for many recordings, where, how often, and what is said of it: with maps that take no time."""

from __future__ import annotations

import json
import sys
from collections import Counter
from threading import Barrier

import distributed
import pytest

from bentwing.base.errors import InputError, UsageError
from bentwing.base.progress import LineProgress, Progress
from bentwing.fleet import process
from bentwing.fleet.cluster import MEMORY, RETRIES, ClusterPool
from bentwing.fleet.opened import side_by_side
from bentwing.fleet.plan import Choice
from bentwing.fleet.pool import Job, LocalPool
from bentwing.fleet.process import ProcessDiedError
from bentwing.fleet.site import map_fleet, map_site


@pytest.fixture(scope="module")
def client():
    """A cluster in this process; its workers have less memory than a recording takes."""
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=False, dashboard_address=None,
            resources={MEMORY: 100},
        ) as cluster,
        distributed.Client(cluster) as client,
    ):  # fmt: skip
        yield client


@pytest.fixture
def fleet(client, work, tmp_path):
    """Map a manifest into the same site."""

    def run(manifest, **options):
        work.calls.clear()
        return map_fleet(manifest, tmp_path / "site", client=client, **options)

    return run


def states(site):
    return {one.name: one.state for one in site.recordings}


def record_of(site):
    return json.loads((site.out / "site.json").read_text())


def test_recordings_are_mapped_and_those_that_belong_together_merged(fleet, manifest):
    site = fleet(manifest(a1="1", a2="2", b1="3"))
    assert states(site) == {"a1": "good", "a2": "good", "b1": "good"}
    assert site.is_complete
    for name in ("a1", "a2", "b1"):
        assert (site.out / "recordings" / name / "map.laz").is_file()
    assert [group.runs for group in site.groups] == [("a1", "a2"), ("b1",)]
    assert (site.out / "groups" / "a" / "map.laz").is_file()
    record = record_of(site)
    assert record["complete"]
    assert [group["folder"] for group in record["groups"]] == ["groups/a", "recordings/b1"]
    page = (site.out / "index.html").read_text()
    assert "separate maps" in page
    assert 'href="groups/a/report.html"' in page


def test_a_recording_that_cannot_be_mapped_does_not_stop_the_others(fleet, manifest):
    path = manifest(a1="1", bad="refused", worse="failed", a2="2")
    with path.open("a") as file:
        file.write("\ngone,gone.bag")
    site = fleet(path)
    assert states(site) == {
        "a1": "good", "bad": "refused", "worse": "failed", "a2": "good", "gone": "refused",
    }  # fmt: skip
    assert not site.is_complete
    assert [group.runs for group in site.groups] == [("a1", "a2")]
    reasons = {one["name"]: one["reason"] for one in record_of(site)["recordings"]}
    assert "no message could be read" in reasons["bad"]
    assert "gone.bag: No such file" in reasons["gone"]
    page = (site.out / "index.html").read_text()
    assert all(f"{name} (" in page for name in ("bad", "worse", "gone"))


def test_what_is_finished_is_not_done_again(fleet, manifest, work):
    path = manifest(a1="1", a2="2", b1="3")
    fleet(path)
    site = fleet(path)
    assert not work.calls
    assert all(one.is_earlier for one in site.recordings)
    assert site.groups[0].is_earlier


def test_another_recording_is_mapped_alone_and_merges_what_it_touches(fleet, manifest, work):
    fleet(manifest(a1="1", a2="2", b1="3", c1="5", c2="6"))
    site = fleet(manifest(a1="1", a2="2", b1="3", b2="4", c1="5", c2="6"))
    assert work.calls == {"b2": 1, "merge": 1, "b1-b2": 1}
    assert {group.runs: group.is_earlier for group in site.groups} == {
        ("a1", "a2"): True, ("b1", "b2"): False, ("c1", "c2"): True,
    }  # fmt: skip


def test_a_recording_that_is_left_out_leaves_its_group(fleet, manifest):
    fleet(manifest(a1="1", a2="2"))
    site = fleet(manifest(a1="1", b1="3"))
    assert [group.runs for group in site.groups] == [("a1",), ("b1",)]
    assert [path.name for path in (site.out / "groups").iterdir()] == ["groups.json"]


def test_paths_are_those_of_the_caller_wherever_the_work_is_done(
    fleet, manifest, tmp_path, monkeypatch
):
    manifest(a1="1")
    (tmp_path / "marks.csv").write_text("id,x,y,z\nm1,0,0,0\n")
    (tmp_path / "settings.yaml").write_text("georeferencing: {control_points: marks.csv}")
    monkeypatch.chdir(tmp_path)
    site = fleet("flights.csv", settings="settings.yaml")
    assert states(site) == {"a1": "good"}


def test_a_changed_recording_is_mapped_again_and_no_other(fleet, manifest, work):
    fleet(manifest(a1="1", a2="2"))
    fleet(manifest(a1="1", a2="2 more"))
    assert work.calls["a2"] == 1
    assert not work.calls["a1"]


def test_other_settings_map_all_again_and_threads_do_not(fleet, manifest, work):
    path = manifest(a1="1", b1="2")
    fleet(path)
    fleet(path, threads=3)
    assert not work.calls
    fleet(path, map_spacing=0.1)
    assert work.calls == {"a1": 1, "b1": 1, "merge": 1}


def test_work_that_dies_is_tried_again(fleet, manifest, work):
    work.deaths["a1"] = work.deaths["merge"] = RETRIES
    site = fleet(manifest(a1="1", a2="2"))
    assert site.is_complete
    assert work.calls["a1"] == work.calls["merge"] == RETRIES + 1
    names = {path.name for path in site.out.iterdir()}
    assert names == {"recordings", "groups", "site.json", "index.html"}


def test_work_that_dies_is_given_twice_the_memory_up_to_what_a_worker_has(client, work):
    asked = []

    class Asked:
        def submit(self, *arguments, resources, **options):
            asked.append(resources[MEMORY])
            return client.submit(*arguments, resources=resources, **options)

        def __getattr__(self, name):
            return getattr(client, name)

    def dies(task, threads):
        del threads
        raise ProcessDiedError(task)

    job = Job("dies", dies, "killed", 40.0)
    ((found, error),) = ClusterPool(Asked(), None).results([job])
    assert found is job
    assert isinstance(error, ProcessDiedError)
    assert asked == [40.0, 80.0, 100.0]
    assert not work.calls


def test_without_a_cluster_work_that_dies_is_tried_again_by_itself(
    work, manifest, tmp_path, monkeypatch
):
    path = manifest(a1="1", a2="2", a3="3", a4="4")
    both, running, beside = Barrier(2), Counter(), {}

    def mapped(kind, order, name, processes):
        running[name] += 1
        if name in {"a1", "a2"} and not work.calls[name]:
            both.wait(60)
        beside[name] = len(running)
        try:
            return work(kind, order, name, processes)
        finally:
            del running[name]

    work.deaths["a1"], work.deaths["a2"] = 1, 2
    monkeypatch.setattr(process, "run_process", mapped)
    opened = lambda megabytes, n_jobs: LocalPool(2, 1, print)  # noqa: ARG005, E731
    site = map_site([path], tmp_path / "out", Choice(), opened, Progress(), merges=False)
    assert states(site) == {"a1": "good", "a2": "failed", "a3": "good", "a4": "good"}
    assert work.calls["a1"] == work.calls["a2"] == 2
    assert beside["a1"] == beside["a2"] == 1


def test_the_largest_recording_is_begun_first(work, manifest, tmp_path):
    path = manifest(a1="1", a2="2" * 3000, a3="3" * 2000)
    opened = lambda megabytes, n_jobs: LocalPool(1, 1, print)  # noqa: ARG005, E731
    site = map_site([path], tmp_path / "out", Choice(), opened, Progress(), merges=False)
    assert list(work.calls) == ["a2", "a3", "a1"]
    assert [one.name for one in site.recordings] == ["a1", "a2", "a3"]


def test_work_that_another_process_does_is_waited_for(fleet, manifest, work):
    work.twins.add("a1")
    assert fleet(manifest(a1="1", a2="2")).is_complete
    assert work.calls["a1"] == 1


def test_a_recording_that_is_damaged_now_does_not_show_its_earlier_run(fleet, manifest):
    fleet(manifest(a1="1"))
    site = fleet(manifest(a1="refused"))
    assert states(site) == {"a1": "refused"}
    assert record_of(site)["recordings"][0]["folder"] is None


def test_work_that_keeps_dying_is_named_and_the_rest_is_done(fleet, manifest, work):
    work.deaths["a1"] = RETRIES + 1
    site = fleet(manifest(a1="1", a2="2", a3="3"))
    assert states(site) == {"a1": "failed", "a2": "good", "a3": "good"}
    assert site.recordings[0].reason == "the process of a1 was killed"
    assert [group.runs for group in site.groups] == [("a2", "a3")]


def test_runs_are_kept_where_the_merging_fails(fleet, manifest, work):
    work.deaths["merge"] = RETRIES + 1
    site = fleet(manifest(a1="1", a2="2"))
    assert states(site) == {"a1": "good", "a2": "good"}
    assert site.failure == "the process of merge was killed"
    assert not site.is_complete
    assert fleet(manifest(a1="1", a2="2")).is_complete
    assert set(work.calls) == {"merge", "a1-a2"}


def test_the_same_recording_counts_once(fleet, manifest):
    site = fleet(manifest(a1="1", a2="1"))
    assert states(site) == {"a1": "good", "a2": "refused"}
    assert "is the same recording as a1" in site.recordings[1].reason


@pytest.mark.parametrize("wrong", ["window: 1e9", "colour: red"])
def test_settings_that_are_wrong_for_all_are_no_matter_of_one(fleet, manifest, tmp_path, wrong):
    (tmp_path / "settings.yaml").write_text(f"continuous: {{{wrong}}}")
    with pytest.raises(InputError, match=r"settings\.yaml: continuous"):
        fleet(manifest(a1="1"), settings=tmp_path / "settings.yaml")
    assert not (tmp_path / "site").exists()


def test_a_folder_of_something_else_is_left_alone(fleet, manifest, tmp_path):
    (tmp_path / "site").mkdir()
    (tmp_path / "site" / "thesis.tex").touch()
    with pytest.raises(UsageError, match="holds no earlier site"):
        fleet(manifest(a1="1"))


def test_a_place_that_holds_something_else_is_no_run_folder(fleet, manifest, tmp_path):
    fleet(manifest(a1="1"))
    mine = tmp_path / "site" / "recordings" / "a2" / "thesis.tex"
    mine.parent.mkdir()
    mine.touch()
    site = fleet(manifest(a1="1", a2="2"))
    assert states(site) == {"a1": "good", "a2": "refused"}
    assert "holds something else than a run" in site.recordings[1].reason
    assert mine.exists()


def test_a_folder_is_mapped_without_a_cluster(work, tmp_path):
    for name in ("north", "south"):
        (tmp_path / "flights" / name).mkdir(parents=True)
        (tmp_path / "flights" / name / "recording.bag").write_text(name)

    def run():
        work.calls.clear()
        opened = side_by_side(None, Progress())
        return map_site([tmp_path / "flights"], tmp_path / "out", Choice(), opened, Progress(), merges=False)  # fmt: skip

    site = run()
    assert states(site) == {"north": "good", "south": "good"}
    assert site.groups is None
    assert (tmp_path / "out" / "north" / "map.laz").is_file()
    run()
    assert not work.calls


@pytest.mark.usefixtures("work")
def test_the_memory_of_the_work_is_stated(manifest, tmp_path, capsys):
    opened = side_by_side(None, LineProgress())
    map_site([manifest(a1="1")], tmp_path / "out", Choice(), opened, LineProgress(), merges=False)
    said = capsys.readouterr().err
    assert "1 at a time: the largest recording takes about 0.7 GB" in said
    assert "[1/1] a1: good" in said


def test_without_dask_a_sentence_says_what_to_install(manifest, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UsageError, match=r"pip install 'bentwing\[fleet\]'"):
        map_fleet(manifest(a1="1"), tmp_path / "site")
    assert not (tmp_path / "site").exists()


@pytest.mark.parametrize("where", ["argument", "DASK_ADDRESS"])
def test_workers_and_a_scheduler_contradict_each_other(manifest, tmp_path, monkeypatch, where):
    address = "tcp://127.0.0.1:1"
    if where == "DASK_ADDRESS":
        monkeypatch.setenv(where, address)
    scheduler = address if where == "argument" else None
    with pytest.raises(UsageError, match="give one of them"):
        map_fleet(manifest(a1="1"), tmp_path / "site", workers=2, scheduler=scheduler)
