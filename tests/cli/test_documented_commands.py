# SPDX-License-Identifier: MIT OR Apache-2.0
"""What README and docs tell a user to type exists, with every option."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

pytest.importorskip("bentwing.cli.main", reason="the command line is not there yet")

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
FENCE = re.compile(r"^```(?:console|bash|sh)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def documented_commands() -> list[str]:
    """Lines that begin with `bentwing`, after a prompt or not, continued lines joined."""
    blocks = [
        block.replace("\\\n", " ")
        for page in PAGES
        for block in FENCE.findall(page.read_text(encoding="utf-8"))
    ]
    lines = {line.strip().removeprefix("$ ") for block in blocks for line in block.splitlines()}
    return sorted(line for line in lines if line.startswith("bentwing "))


@cache
def help_of(*command: str) -> str:
    answer = subprocess.run(
        [sys.executable, "-c", "from bentwing.cli.main import run; run()", *command, "--help"],
        check=False,
        capture_output=True,
        text=True,
        env=os.environ | {"COLUMNS": "200", "NO_COLOR": "1", "TERM": "dumb"},
    )
    assert answer.returncode == 0, f"bentwing {shlex.join(command)} --help: {answer.stderr}"
    return answer.stdout


def test_the_documentation_shows_commands() -> None:
    assert len(documented_commands()) >= 3


@pytest.mark.parametrize("line", documented_commands())
def test_a_documented_command_exists_with_its_options(line: str) -> None:
    _, subcommand, *arguments = shlex.split(line, comments=True)
    known = set(re.findall(r"(?<![\w-])--?[a-zA-Z][\w-]*", help_of(subcommand)))
    used = {argument.partition("=")[0] for argument in arguments if argument.startswith("-")}
    assert used <= known, f"{line}: `bentwing {subcommand}` knows no {sorted(used - known)}"
