# SPDX-License-Identifier: MIT OR Apache-2.0
"""`--settings` and `--set`: what `--print-settings` prints can be changed and given back."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from bentwing.base.errors import InputError, UsageError
from bentwing.odometry import ESTIMATORS
from bentwing.recording import Payload
from bentwing.run import pipeline
from bentwing.run.choose import changes_of, choose, merged
from bentwing.run.found import Found
from bentwing.run.settings import RunSettings

HEAD = """
name: stand
lidar: {kind: vlp16}
imu: {topic: /imu, gyro_noise: 1.0e-3}
T_imu_lidar: {translation: [0.1, 0.0, 0.0]}
"""


@pytest.fixture
def head(tmp_path):
    path = tmp_path / "head.yaml"
    path.write_text(HEAD)
    return path


@pytest.fixture
def written(tmp_path):
    """Write a settings file."""

    def write(text):
        path = tmp_path / "settings.yaml"
        path.write_text(text)
        return path

    return write


@pytest.fixture
def called(monkeypatch):
    """Stand in for the pipeline; the list receives the arguments of each call."""
    calls = []

    def record(*arguments, **options):
        calls.append((arguments, options))
        return Found()

    monkeypatch.setattr(pipeline, "run_recording", record)
    return calls


@pytest.mark.parametrize(
    ("assignments", "changes"),
    [
        ([], {}),
        (["window=4"], {"continuous": {"window": 4}}),
        (["continuous.window=4"], {"continuous": {"window": 4}}),
        (
            ["registration.knot_interval = 0.1"],
            {"continuous": {"registration": {"knot_interval": 0.1}}},
        ),
        (
            ["surfels.n_levels=3", "surfels.max_gap=0.1", "surfels.n_levels=2"],
            {"continuous": {"surfels": {"n_levels": 2, "max_gap": 0.1}}},
        ),
        (
            ["frozen=[latency]", "edges=false"],
            {"continuous": {"frozen": ["latency"], "edges": False}},
        ),
        (["loop_closure.stretch=4"], {"loop_closure": {"stretch": 4}}),
        (["map_spacing=0.1"], {"map_spacing": 0.1}),
        (["name=a=b"], {"continuous": {"name": "a=b"}}),
    ],
)
def test_assignments_become_nested_settings(assignments, changes):
    assert changes_of(assignments, "continuous") == changes


@pytest.mark.parametrize("text", ["window", "window=", "=4", "registration.=1", ".window=4"])
def test_an_assignment_without_a_name_or_value_is_refused(text):
    with pytest.raises(UsageError, match="give a name and a value"):
        changes_of([text], "continuous")


@pytest.mark.parametrize(
    "text", ["kalman.scan=0.2", "payload.lidar.latency=0.1", "estimator=kalman"]
)
def test_an_assignment_changes_neither_estimator_nor_head(text):
    with pytest.raises(UsageError, match="give --payload and --estimator instead"):
        changes_of([text], "continuous")


def test_no_setting_of_an_estimator_is_hidden_by_one_of_the_run():
    for name in ESTIMATORS:
        of_estimator = type(RunSettings.model_fields[name].default).model_fields
        assert not set(of_estimator) & set(RunSettings.model_fields)


def test_a_value_that_is_no_yaml_is_refused():
    with pytest.raises(UsageError, match=r"--set 'frozen=\[a': the value is not valid YAML"):
        changes_of(["frozen=[a"], "continuous")


def test_merging_changes_within_mappings_and_leaves_its_arguments_alone():
    base = {"a": {"b": 1, "c": [1, 2]}, "d": None}
    assert merged(base, {"a": {"c": [3]}, "d": {"e": 4}}) == {
        "a": {"b": 1, "c": [3]},
        "d": {"e": 4},
    }
    assert base == {"a": {"b": 1, "c": [1, 2]}, "d": None}


def test_nothing_given_leaves_everything_at_its_defaults():
    assert choose(None, [], None, {}) == RunSettings()


def test_assignments_go_over_options_over_the_file_over_the_defaults(written):
    file = written(
        "map_format: ply\nmap_spacing: 0.5\nthreads: 1\n"
        "continuous: {window: 4, registration: {max_outer: 9, n_inner: 2}}"
    )
    options = {"map_spacing": 0.2, "threads": 2, "cleaning": {"moving": False}}
    chosen = choose(file, ["registration.max_outer=7", "threads=3"], None, options)
    assert (chosen.map_format, chosen.map_spacing, chosen.threads) == ("ply", 0.2, 3)
    assert not chosen.cleaning.moving
    assert chosen.continuous.window == 4.0
    assert chosen.continuous.registration.max_outer == 7
    assert chosen.continuous.registration.n_inner == 2
    assert chosen.continuous.shift == 1.5


def test_a_file_with_settings_of_one_estimator_chooses_it(written):
    assert choose(written("kalman: {scan: 0.2}"), [], None, {}).estimator == "kalman"


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_what_is_printed_is_accepted_unchanged(bentwing, head, tmp_path, estimator):
    call = ("map", "--print-settings")
    printed = bentwing(*call, "-p", head, "--estimator", estimator)
    assert printed.code == 0, printed.err
    file = tmp_path / "printed.yaml"
    file.write_text(printed.out)
    again = bentwing(*call, "--settings", file)
    assert again.out == printed.out
    chosen = choose(file, [], None, {})
    assert chosen.estimator == estimator
    assert chosen.payload == Payload.load(head)
    assert chosen.payload.describes_imu


def test_the_default_head_is_printed_as_one_that_describes_no_imu(bentwing, tmp_path):
    file = tmp_path / "printed.yaml"
    file.write_text(bentwing("map", "--print-settings").out)
    payload = choose(file, [], None, {}).payload
    assert payload == Payload.default()
    assert not payload.describes_imu


def test_an_imu_that_is_not_to_be_used_stays_so(bentwing, tmp_path):
    head, file = tmp_path / "head.yaml", tmp_path / "printed.yaml"
    head.write_text("lidar: {kind: vlp16}\nimu: null\n")
    file.write_text(bentwing("map", "--print-settings", "-p", head).out)
    assert yaml.safe_load(file.read_text())["payload"]["imu"] is None
    assert choose(file, [], None, {}).payload.imu is None


@pytest.mark.parametrize("command", [("map",), ("localize", "--map", "site")])
def test_settings_reach_the_pipeline(bentwing, called, written, head, command):
    file = written(f"kalman: {{scan: 0.2}}\npayload: {yaml.safe_load(HEAD)}")
    options = ("--settings", file, "--set", "max_features=900", "--map-format", "ply")
    done = bentwing(*command, "a.bag", "-o", "out", *options)
    assert done.code == 0, done.err
    (((_, _, chosen, payload_file), _),) = called
    assert payload_file is None
    assert chosen.payload == Payload.load(head)
    assert (chosen.estimator, chosen.map_format) == ("kalman", "ply")
    assert (chosen.kalman.scan, chosen.kalman.max_features) == (0.2, 900)
    assert chosen.prior_map == (Path("site") if command[0] == "localize" else None)


@pytest.mark.parametrize(
    ("text", "options", "code", "says"),
    [
        (None, ["--set", "windows=4"], 2, "--set: continuous: unknown key 'windows'; did you mean 'window'?"),
        (None, ["--set", "surfels.n_level=4"], 2, "did you mean 'n_levels'?"),
        (None, ["--set", "window=-4"], 2, "--set: continuous.window: input should be greater than or equal to 0.5"),
        (None, ["--set", "window=long"], 2, "found 'long'"),
        (None, ["--set", "map_format=obj"], 2, "'obj'"),
        ("continuous: {windows: 4}", [], 3, "settings.yaml: continuous: unknown key 'windows'; did you mean"),
        ("continuum: {window: 4}", [], 3, "unknown key 'continuum'; did you mean 'continuous'?"),
        ("window: 4", [], 3, "settings.yaml: unknown key 'window'; valid are map_format,"),
        ("continuous: 4", [], 3, "settings.yaml: continuous: input should be"),
        ("a: b: c", [], 3, "not valid YAML"),
        ("", [], 3, "holds no settings; give settings as"),
        ("kalman: {}", ["--estimator", "ndt"], 2, "holds settings of kalman, but the estimator is ndt"),
        ("payload: {lidar: {max_rang: 3}}", [], 3, "payload.lidar: unknown key 'max_rang'; did you"),
        ("payload: {name: other}", ["-p", "head.yaml"], 2, "another sensor head than the payload"),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_refused_in_one_sentence(
    bentwing, called, written, head, monkeypatch, text, options, code, says
):
    monkeypatch.chdir(head.parent)
    file = [] if text is None else ["--settings", written(text)]
    said = bentwing("map", "a.bag", "-o", "out", *file, *options)
    assert said.code == code
    assert says in said.err
    assert said.err.count("\n") == 1
    assert called == []


def test_a_settings_file_that_is_not_there_is_refused():
    with pytest.raises(InputError, match="no such file; give settings as"):
        choose(Path("nowhere.yaml"), [], None, {})


def test_the_same_head_in_file_and_payload_is_no_contradiction(written, head):
    file = written(f"payload: {yaml.safe_load(HEAD)}")
    assert choose(file, [], head, {}).payload == Payload.load(head)


def test_a_run_with_printed_settings_is_the_same_run(bentwing, office, tmp_path):
    recording, head, file = office / "recording.bag", office / "payload.yaml", tmp_path / "s.yaml"
    short = ("--duration", "9", "--map-spacing", "0.2", "-q")
    file.write_text(bentwing("map", "--print-settings", "-p", head).out)
    for out, options in (("one", ("-p", head)), ("two", ("--settings", file))):
        assert bentwing("map", recording, *options, "-o", tmp_path / out, *short).code == 0
    for name in ("trajectory.txt", "odometry.txt", "map.laz"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


def test_a_head_without_a_described_imu_is_stored_as_such():
    """A run is read again by what its record says of the head."""
    stored = RunSettings().to_json()["payload"]
    assert not Payload.model_validate(stored).describes_imu
