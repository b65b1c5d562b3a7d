# SPDX-License-Identifier: MIT OR Apache-2.0
"""Help pages and completion: what a user sees before anything is read."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import get_args

import pytest

from bentwing.base import errors
from bentwing.cli.commands import COMMANDS, load
from bentwing.cli.main import INTERRUPTED, UNEXPECTED, run_command
from bentwing.odometry import EstimatorName
from bentwing.reproduce import PARTS
from bentwing.reproduce.names import PaperName, PartName

# typer itself takes pydantic, as soon as a command has options.
HEAVY = ("numpy", "rich", "laspy", "rosbags", "scipy", "bentwing.run.pipeline")
# The same short form stands for the same option in every command.
SHORT = {"-o": "--out", "-p": "--payload", "-q": "--quiet", "-j": "--threads"}


# What a command can end with: done, any error of ours, a bug, an interrupt.
EXIT_CODES = {0, UNEXPECTED, INTERRUPTED} | {
    kind.exit_code for kind in vars(errors).values() if isinstance(kind, type)
}


def codes_in(text, row):
    """The exit codes that a table names, a row each."""
    found = [int(code) for code in re.findall(row, text, re.MULTILINE)]
    assert found == sorted(set(found))
    return set(found)


def run_python(script, **environment):
    done = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | environment,
    )
    return done.stdout


def completed(*words):
    """What the shell offers for the last word."""
    return run_python(
        "from bentwing.cli.main import run; run()",
        _BENTWING_COMPLETE="complete_bash",
        COMP_WORDS=shlex.join(["bentwing", *words]),
        COMP_CWORD=str(len(words)),
    ).split()


@pytest.fixture
def help_of(capsys):
    def page(*command, option="--help"):
        assert run_command([*command, option]) == 0
        return capsys.readouterr().out

    return page


def test_the_list_of_commands_says_what_each_is_for(help_of):
    page = " ".join(help_of().split())
    for name, line in COMMANDS.items():
        assert f"{name} {line}" in page
    assert "Exit codes" in page


def test_a_call_without_arguments_shows_the_help_and_is_wrong(capsys):
    assert run_command([]) == 2
    assert "Commands:" in capsys.readouterr().out


@pytest.mark.parametrize("name", [None, *COMMANDS])
def test_a_help_page_loads_nothing_heavy(name):
    command = ["--help"] if name is None else [name, "--help"]
    shown = run_python(
        f"import sys; from bentwing.cli.main import run_command; run_command({command}); "
        f"print([m for m in {HEAVY} if m in sys.modules])"
    )
    assert shown.splitlines()[-1] == "[]"


@pytest.mark.parametrize("name", COMMANDS)
def test_a_help_page_has_a_sentence_examples_and_exit_codes(help_of, name):
    page = help_of(name)
    usage, _, sentence = page.split("\n")[:3]
    assert usage.startswith(f"Usage: bentwing {name} ")
    assert sentence.startswith("  ")
    assert f"Examples:\n  bentwing {name} " in page
    assert codes_in(page.partition("Exit codes:\n")[2], r"^  (\d+) ") == EXIT_CODES
    assert page == help_of(name, option="-h")
    assert max(map(len, page.splitlines())) <= 110


def test_the_documentation_names_every_exit_code():
    page = (Path(__file__).parents[2] / "docs" / "commands.md").read_text(encoding="utf-8")
    table = page.partition("## Exit codes\n")[2].partition("\n\nBefore")[0]
    assert codes_in(table, r"^\| (\d+) \|") == EXIT_CODES


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_has_a_sentence_and_a_group(name):
    for parameter in load(name).params:
        assert parameter.help.endswith("."), parameter.name
        assert parameter.rich_help_panel, parameter.name


@pytest.mark.parametrize("name", COMMANDS)
def test_an_option_has_the_same_short_form_in_every_command(name):
    for parameter in load(name).params:
        if parameter.param_type_name == "option":
            names = set(parameter.opts)
            for short, long in SHORT.items():
                assert (short in names) == (long in names), parameter.name


def test_required_options_are_marked(help_of):
    page = " ".join(help_of("map").split())
    assert "-o, --out FOLDER Write into this folder. [required]" in page
    assert "one after the other. [required]" in page


@pytest.mark.parametrize(
    ("command", "line"),
    [
        (name, line)
        for name in COMMANDS
        for line in load(name).epilog.split("\n\n")[0].splitlines()[2:]
    ],
)
def test_an_example_of_a_help_page_can_be_typed(command, line):
    program, name, *arguments = shlex.split(line.partition(" > ")[0])
    assert (program, name) == ("bentwing", command)
    with load(name).make_context(name, arguments) as context:
        assert context.params


def test_the_papers_and_parts_of_options_are_those_there_are():
    assert get_args(PaperName) == tuple(PARTS)
    assert set(get_args(PartName)) == {name for parts in PARTS.values() for name in parts}


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        (["lo"], {"localize"}),
        (["map", "--pa"], {"--payload"}),
        (["map", "--estimator", ""], set(get_args(EstimatorName))),
        (["simulate", "court"], {"courtyard"}),
        (["simulate", "office", "--event", "spin"], {"spin-stall"}),
        (["--ins"], {"--install-completion"}),
    ],
)
def test_the_shell_completes_commands_options_and_choices(words, offered):
    assert set(completed(*words)) == offered


@pytest.mark.parametrize(("given", "used"), [(None, "1"), ("3", "3")])
def test_matrices_are_computed_by_one_thread_unless_the_user_says_otherwise(given, used):
    script = (
        "import os, sys; sys.argv = ['bentwing', '--version']\n"
        "from bentwing.cli.main import run\n"
        "try: run()\n"
        "except SystemExit: print(os.environ['OPENBLAS_NUM_THREADS'])"
    )
    environment = {} if given is None else {"OPENBLAS_NUM_THREADS": given}
    assert run_python(script, **environment).splitlines()[-1] == used
