# SPDX-License-Identifier: MIT OR Apache-2.0
"""The command line accepts what README and docs show, and every command has its page."""

from __future__ import annotations

import re
import shlex
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
import typer

from bentwing.cli.commands import COMMANDS
from bentwing.cli.main import app
from bentwing.map import MAP_FORMATS
from bentwing.odometry import ESTIMATORS

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
FENCE = re.compile(r"^```(?:console|bash|sh)\n(.*?)^```", re.MULTILINE | re.DOTALL)
ANY_FENCE = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)
CODE = re.compile(r"`([^`]+)`")


def shown_lines() -> list[str]:
    """Lines that begin with `bentwing`, after a prompt or not, continued lines joined."""
    blocks = [
        block.replace("\\\n", " ")
        for page in PAGES
        for block in FENCE.findall(page.read_text(encoding="utf-8"))
    ]
    lines = {line.strip().removeprefix("$ ") for block in blocks for line in block.splitlines()}
    return sorted(line for line in lines if line.startswith("bentwing "))


def spans_of(page: Path) -> set[str]:
    """Code within the sentences of a page."""
    prose = ANY_FENCE.sub("", page.read_text(encoding="utf-8"))
    return {" ".join(span.split()) for span in CODE.findall(prose)}


def mentioned_commands() -> list[str]:
    """Commands within sentences, which may leave out arguments."""
    return sorted(
        {span for page in PAGES for span in spans_of(page) if span.startswith("bentwing ")}
    )


def resolve(*words: str) -> tuple[Any, list[str], typer.Context]:
    """Command, rest of its words and context that typer finds for the words of a line."""
    group: Any = typer.main.get_command(app)
    context = typer.Context(group, info_name="bentwing")
    _, command, rest = group.resolve_command(context, list(words))
    return command, rest, context


def parse(line: str) -> None:
    """Parse a line as the command line does, without running the command."""
    _, *words = shlex.split(line, comments=True)
    if words[0].startswith("-"):  # an option of bentwing itself
        known = {
            name for parameter in typer.main.get_command(app).params for name in parameter.opts
        }
        assert set(words) <= {"--help", *known}
        return
    command, rest, context = resolve(*words)
    with suppress(typer.Exit):  # --help
        command.make_context(command.name, rest, parent=context)


def options_of(name: str) -> set[str]:
    command, _, _ = resolve(name)
    return {"--help", *(option for known in command.params for option in known.opts)}


def test_the_documentation_shows_commands() -> None:
    assert len(shown_lines()) >= 20


@pytest.mark.parametrize("line", shown_lines())
def test_a_shown_command_line_is_accepted(line: str) -> None:
    parse(line)


@pytest.mark.parametrize("line", mentioned_commands())
def test_a_mentioned_command_exists_with_its_options(line: str) -> None:
    try:
        parse(line)
    except typer.BadParameter as error:
        if "Missing" not in type(error).__name__:  # its class is not public
            raise


@pytest.mark.parametrize("line", ["bentwing mop a.bag", "bentwing map a.bag -o out --mop"])
def test_a_line_with_an_unknown_word_is_not_accepted(line: str) -> None:
    with pytest.raises(Exception, match="mop"):
        parse(line)


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_a_page_that_lists_its_options_and_names_no_others(name: str) -> None:
    page = ROOT / "docs" / "commands" / f"{name}.md"
    assert f"<!-- options: {name} -->" in page.read_text(encoding="utf-8")
    named = {span.split()[0] for span in spans_of(page) if span.startswith("-")}
    assert named <= options_of(name)


@pytest.mark.parametrize("name", ESTIMATORS)
def test_every_estimator_has_a_page_that_lists_its_settings(name: str) -> None:
    page = ROOT / "docs" / "estimators" / f"{name}.md"
    assert f"<!-- settings: {name} -->" in page.read_text(encoding="utf-8")


@pytest.mark.parametrize("name", MAP_FORMATS)
def test_the_page_of_the_map_says_how_exact_every_format_is(name: str) -> None:
    rows = [line for line in (ROOT / "docs" / "map.md").read_text().splitlines() if "|" in line]
    assert any(f"`{name}`" in row.split("|")[1] for row in rows)
