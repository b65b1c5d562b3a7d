# SPDX-License-Identifier: MIT OR Apache-2.0
"""Names that no file can have, and places where nothing can be written, for every path of every command."""

import resource

import pytest

from bentwing.base.errors import UsageError
from bentwing.base.new_file import require_folder, require_new, require_writable
from bentwing.cli.commands import COMMANDS, load
from bentwing.cli.main import run_command
from campaign.options import whole

PATHS = {"FILE", "FOLDER", "RECORDING", "RUN", "MAP", "MANIFEST|FOLDER"}
EVERY = [(name, p) for name in COMMANDS for p in load(name).params if p.metavar in PATHS]
WRITTEN = [(name, p) for name, p in EVERY if p.name == "out" or "rite " in p.help]
READ = [pair for pair in EVERY if pair not in WRITTEN]
# no name may be so long; no path; there is a file where a folder would be; nothing can be made
NO_INPUT = {"name": "a" * 300, "path": "/a" * 2100, "in a file": "{file}/b"}
NO_OUTPUT = {**NO_INPUT, "nowhere": "/proc/b"}


def told(pairs):
    return [f"{name} {parameter.name}" for name, parameter in pairs]


def given(words, parameter, value):
    """The words of a command with another value of an option, or of its last argument."""
    name, *rest = map(str, words)
    if parameter.param_type_name == "argument":
        return [
            name,
            *rest[: rest.index("init") + 1 if "init" in rest else 0],
            value,
            *_options(rest),
        ]
    for at, word in enumerate(rest):
        if word in parameter.opts:
            return [name, *rest[: at + 1], value, *rest[at + 2 :]]
    return [name, *rest, parameter.opts[0], value]


def _options(words):
    first = next((at for at, word in enumerate(words) if word.startswith("-")), len(words))
    return words[first:]


@pytest.fixture
def refused(ground, tmp_path, monkeypatch, capfd):
    """Run a command with such a path; return what it says."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()

    def run(name, parameter, value):
        before = whole(name, ground.healthy, tmp_path)
        capfd.readouterr()
        code = run_command(given(before, parameter, value.format(file=tmp_path / "file")))
        said = "".join(capfd.readouterr())
        assert code in {2, 3}, said
        assert said.count("bentwing: error:") == 1, said
        return said

    return run


@pytest.mark.parametrize("value", NO_INPUT.values(), ids=NO_INPUT)
@pytest.mark.parametrize(("name", "parameter"), READ, ids=told(READ))
def test_an_input_that_cannot_be_there_is_refused(name, parameter, value, refused):
    refused(name, parameter, value)


@pytest.mark.parametrize("value", NO_OUTPUT.values(), ids=NO_OUTPUT)
@pytest.mark.parametrize(("name", "parameter"), WRITTEN, ids=told(WRITTEN))
def test_an_output_that_cannot_be_written_is_refused_before_any_work(
    name, parameter, value, refused
):
    assert "done in" not in refused(name, parameter, value)


@pytest.mark.parametrize("check", [require_folder, require_writable, require_new])
def test_a_place_on_a_full_disk_is_refused_and_nothing_stays_there(check, tmp_path):
    _, most = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, most))
    try:
        with pytest.raises(UsageError, match="cannot be written"):
            check(tmp_path / "b")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))
    check(tmp_path / "b")
    assert not list(tmp_path.iterdir())
