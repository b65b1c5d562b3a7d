# SPDX-License-Identifier: MIT OR Apache-2.0
"""The tables of options and settings in the documentation, as a hook of mkdocs fills them in."""

from __future__ import annotations

import re
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest

from bentwing.cli.commands import COMMANDS, load
from bentwing.map import MAP_FORMATS
from bentwing.odometry import ESTIMATORS
from bentwing.simulate.faults import FAULTS

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def hook():
    spec = spec_from_file_location("option_tables", ROOT / "docs" / "hooks" / "option_tables.py")
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def rows_of(text):
    """Cells of a table's rows, below its heading."""
    heading, rule, *rows = text.splitlines()
    assert re.fullmatch(r"\|(-+\|)+", rule)
    n_columns = heading.count("|") - 1
    cells = [[cell.strip() for cell in re.split(r"(?<!\\)\|", row)[1:-1]] for row in rows]
    assert all(len(row) == n_columns for row in cells)
    return cells


@pytest.mark.parametrize("name", COMMANDS)
def test_a_table_has_every_option_of_a_command_with_its_meaning(hook, name):
    rows = rows_of(hook.on_page_markdown(f"<!-- options: {name} -->"))
    parameters = load(name).params
    assert len(rows) == len(parameters)
    listed = {word for row in rows for word in re.findall(r"`(-[\w-]+)", row[0])}
    options = [one for one in parameters if one.param_type_name == "option"]
    assert listed == {word for one in options for word in one.opts}
    assert all(row[2].endswith(".") for row in rows)
    required = {row[0] for row in rows if row[1] == "required"}
    assert len(required) == sum(one.required for one in parameters)


def test_a_table_has_defaults_and_choices(hook):
    rows = {row[0]: row[1:] for row in rows_of(hook.table("options", "map"))}
    formats = ", ".join(f"`{name}`" for name in MAP_FORMATS)
    assert rows["`--map-format NAME`"] == ["`laz`", f"Format of the map. One of {formats}."]
    assert rows["`-j`, `--threads N`"][0] == "all cores"
    assert rows["`--keep-moving`"][0] == ""


@pytest.mark.parametrize("name", ESTIMATORS)
def test_a_table_has_every_setting_of_an_estimator(hook, name):
    model, _ = hook.settings_models()[name]
    rows = rows_of(hook.on_page_markdown(f"<!-- settings: {name} -->"))
    assert [row[0].strip("`").removesuffix(".…") for row in rows] == list(model.model_fields)


def test_a_table_has_one_setting_and_no_empty_column(hook):
    text = hook.on_page_markdown("<!-- settings: CleanSettings.moving -->")
    assert text.startswith("| setting | default | meaning |")
    assert [row[:2] for row in rows_of(text)] == [["`cleaning.moving`", "`true`"]]


def test_a_table_has_default_unit_and_range(hook):
    rows = {row[0]: row[1:] for row in rows_of(hook.table("settings", "kalman"))}
    assert rows["`scan`"][:3] == ["`0.1`", "s", "≥\xa00.02, ≤\xa01"]
    assert rows["`rotation`"][:3] == ["`encoder`", "", "`encoder`, `ignored`"]
    surfels = [row[0] for row in rows_of(hook.table("settings", "SurfelSettings"))]
    assert "`surfels.max_gap`" in surfels


def test_a_table_has_the_faults_of_a_family(hook):
    rows = dict(rows_of(hook.table("faults", "encoder")))
    assert rows["`encoder-degrees`"] == "The encoder is in degrees."
    assert all(name.startswith("`encoder-") for name in rows)


def test_the_page_of_simulate_has_every_fault(hook):
    page = (ROOT / "docs" / "commands" / "simulate.md").read_text(encoding="utf-8")
    filled = hook.on_page_markdown(page)
    assert set(re.findall(r"^\| `([\w.-]+)` \|", filled, re.MULTILINE)) >= set(FAULTS)


def test_every_setting_is_described_with_its_unit(hook):
    for known, (model, _) in hook.settings_models().items():
        assert "Undefined" not in hook.table("settings", known)
        for name, field in model.model_fields.items():
            assert field.description, f"{model.__name__}.{name}"
            # What is measured has a unit in its type or has none; it is not told in words.
            assert not re.search(r", (s|m|rad|Hz|m/s)$", field.description), name


def test_every_marker_of_the_documentation_is_filled_in(hook):
    for page in sorted((ROOT / "docs").rglob("*.md")):
        filled = hook.on_page_markdown(page.read_text(encoding="utf-8"))
        assert not re.search(r"<!-- *(options|settings|faults)\b", filled), page


@pytest.mark.parametrize(
    "marker", ["options: mop", "settings: mop", "faults: mop", "settings: CleanSettings.mop"]
)
def test_a_marker_of_nothing_stops_the_build(hook, marker):
    with pytest.raises((KeyError, ModuleNotFoundError), match="mop"):
        hook.on_page_markdown(f"<!-- {marker} -->")
