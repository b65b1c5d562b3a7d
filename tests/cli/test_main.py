# SPDX-License-Identifier: MIT OR Apache-2.0
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from bentwing.base.errors import (
    BentwingError,
    EstimationError,
    InputError,
    RecordingError,
    UsageError,
)
from bentwing.cli.main import run_command
from bentwing.closing import GeoreferenceSettings
from bentwing.map.clean import CleanSettings
from bentwing.recording import Payload
from bentwing.run import pipeline
from bentwing.run.found import Found
from bentwing.run.settings import RunSettings, run_settings

BENTWING = "from bentwing.cli.entry import run; run()"


@pytest.fixture
def called(monkeypatch):
    """Stand in for the pipeline; the list receives the arguments of each call."""
    calls = []

    def record(*arguments, **options):
        calls.append((arguments, options))
        return Found()

    monkeypatch.setattr(pipeline, "run_recording", record)
    return calls


def failing(monkeypatch, error):
    def fail(*_, **__):
        raise error

    monkeypatch.setattr(pipeline, "run_recording", fail)


def test_version_is_one_line(capsys):
    assert run_command(["--version"]) == 0
    assert capsys.readouterr().out.startswith("bentwing ")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["fly"], "No such command: fly; see `bentwing --help`"),
        (["mpa"], "did you mean map?"),
        (["--helps"], "did you mean --help?"),
        (["map"], "Missing argument 'RECORDING'; see `bentwing map --help`"),
        (["map", "a.bag"], "Missing option '--out' / '-o'; see `bentwing map --help`"),
        (["merge", "a"], "Missing option '--out' / '-o'; see `bentwing merge --help`"),
        (["map", "a.bag", "-o", "out", "--set"], "requires an argument; see `bentwing map --help`"),
        (["map", "a.bag", "-o", "out", "--payloads", "b"], "did you mean --payload?"),
        (["map", "a.bag", "-o", "out", "--estimator", "kalmans"], "did you mean kalman?"),
        (["reproduce", "kaul2051"], "did you mean kaul2015?"),
        (["reproduce", "fu2023", "--part", "flights"], "did you mean flight?"),
        (["simulate", "courtyards", "-o", "out"], "did you mean courtyard?"),
        (["simulate", "office", "-o", "out", "--event", "spinstall"], "did you mean spin-stall?"),
        (["simulate"], "Choose from: courtyard, compound,"),
        (["map", "a.bag", "-o", "out", "--frobnicate"], "No such option"),
        (["map", "a.bag", "-o", "out", "--threads", "none"], "--threads"),
        (["map", "a.bag", "-o", "out", "--threads", "0"], "--threads"),
        (["map", "a.bag", "-o", "out", "--start", "-1"], "--start"),
        (
            ["map", "a.bag", "-o", "out", "--estimator", "magic"],
            "'magic' is not one of 'continuous'",
        ),
        (["map", "a.bag", "-o", "out", "--map-format", "obj"], "'obj' is not one of 'laz'"),
    ],
)
def test_wrong_usage_is_one_sentence_and_exit_code_2(capsys, arguments, message):
    assert run_command(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("bentwing: error: ")
    assert message in err
    assert err.count("\n") == 1


def test_options_reach_the_pipeline(called, capsys, monkeypatch, tmp_path):
    # The files do not exist: say that they are the parts of one recording.
    monkeypatch.setattr("bentwing.recording.flights.flights_of", lambda paths: [paths])
    head = tmp_path / "head.yaml"
    head.write_text("name: head\n")
    arguments = [
        "map", "a.mcap", "b.mcap", "--payload", str(head), "-o", "out", "--map-format", "ply",
        "--map-spacing", "0.02", "--no-loop-closure", "--threads", "2", "--start", "5",
        "--duration", "60", "--keep-moving", "--epsg", "25832", "--control-points", "targets.csv",
        "--no-map", "--quiet",
    ]  # fmt: skip
    assert run_command(arguments) == 0
    ((paths, out, chosen, payload), options) = called[0]
    assert (paths, out, payload) == ([Path("a.mcap"), Path("b.mcap")], Path("out"), head)
    options.pop("progress")
    assert options == {"resume": False}
    assert chosen == run_settings(
        payload=Payload.load(head),
        map_format="ply",
        map_spacing=0.02,
        loop_closure=False,
        writes_map=False,
        threads=2,
        start=5.0,
        duration=60.0,
        cleaning=CleanSettings(moving=False),
        georeferencing=GeoreferenceSettings(epsg=25832, control_points=Path("targets.csv")),
    )
    assert capsys.readouterr() == ("", "")


def test_settings_are_shown_without_a_recording(called, capsys, tmp_path):
    head = tmp_path / "head.yaml"
    head.write_text("name: seven\n")
    assert run_command(["map", "--print-settings", "--payload", str(head)]) == 0
    shown = RunSettings.model_validate(yaml.safe_load(capsys.readouterr().out))
    assert shown == run_settings(payload=Payload.load(head))
    assert called == []


def test_a_finished_map_says_where_the_report_is(called, capsys):
    assert run_command(["map", "a.mcap", "-o", "out"]) == 0
    assert len(called) == 1
    assert "out/report.html" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (BentwingError("m"), 1),
        (UsageError("m"), 2),
        (RecordingError("m"), 3),
        (EstimationError("m"), 4),
        (KeyboardInterrupt(), 130),
    ],
)
def test_every_expected_error_has_its_exit_code_and_no_traceback(monkeypatch, capsys, error, code):
    failing(monkeypatch, error)
    assert run_command(["map", "a.mcap", "-o", "out"]) == code
    expected = "interrupted" if isinstance(error, KeyboardInterrupt) else "m"
    assert capsys.readouterr().err == f"bentwing: error: {expected}\n"


def test_a_full_disk_is_told_as_such(monkeypatch, capsys):
    failing(monkeypatch, OSError(28, "No space left on device", "out/map.laz"))
    assert run_command(["map", "a.mcap", "-o", "out"]) == 1
    said = capsys.readouterr().err
    assert said.startswith("bentwing: error: out/map.laz: No space left on device; make room there")


@pytest.mark.parametrize("name", ["rec\x1b[2J.bag", "a\nb.bag", "h\udcf6hle.bag"])
def test_names_that_nothing_can_show_are_refused_before_any_work(monkeypatch, capsys, name):
    failing(monkeypatch, AssertionError("it began"))
    assert run_command(["map", name, "-o", "out"]) == 2
    said = capsys.readouterr().err
    assert "rename the file" in said
    assert said.rstrip("\n").isprintable()


def test_what_an_error_says_of_a_file_cannot_command_the_terminal(monkeypatch, capsys):
    failing(monkeypatch, InputError("no field \x1b]0;title\x07 in it\nsecond line"))
    run_command(["map", "a.mcap", "-o", "out"])
    assert "no field \\x1b]0;title\\x07 in it\nsecond" in capsys.readouterr().err


@pytest.mark.parametrize("debug", [False, True])
def test_an_unexpected_error_asks_to_be_reported(monkeypatch, capsys, debug):
    monkeypatch.delenv("BENTWING_DEBUG", raising=False)
    monkeypatch.setattr(os, "environ", dict(os.environ))
    failing(monkeypatch, ZeroDivisionError("division by zero"))
    option = ["--debug"] if debug else []
    assert run_command([*option, "map", "a.mcap", "-o", "out"]) == 70
    err = capsys.readouterr().err
    assert "please report it" in err
    assert ("Traceback" in err) is debug


def test_an_interrupt_ends_a_running_command(tmp_path):
    script = f"""
import signal, time
signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job ignores it
from bentwing.recording import Payload
from bentwing.run import pipeline
def busy(*_, **__):
    print("busy", flush=True)
    time.sleep(60)
pipeline.run_recording = busy
import sys
sys.argv = ["bentwing", "map", "a", "-o", {str(tmp_path)!r}]
{BENTWING}
"""
    process = subprocess.Popen(
        [sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "busy\n"
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=20)
    assert process.returncode == 130
    assert err == "bentwing: error: interrupted\n"


def test_several_flights_without_a_map_are_refused(called, capsys, monkeypatch):
    monkeypatch.setattr("bentwing.recording.flights.flights_of", lambda paths: [[p] for p in paths])
    assert run_command(["map", "a.mcap", "b.mcap", "-o", "out", "--no-map"]) == 2
    assert "--no-map with 2 flights" in capsys.readouterr().err
    assert called == []
