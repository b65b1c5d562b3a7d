# SPDX-License-Identifier: MIT OR Apache-2.0
"""Packages and crates may import those above them in the lists of ARCHITECTURE.md."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING

import pytest

from support import rust_uses, structure

if TYPE_CHECKING:
    from support.structure import Arrows

needs_cargo = pytest.mark.skipif(shutil.which("cargo") is None, reason="cargo is not installed")


def upwards(order: list[str], arrows: Arrows) -> list[str]:
    """Arrows to what stands below in the list."""
    assert set(order) == set(arrows), "ARCHITECTURE.md lists others than there are"
    return [
        f"{name} imports {other}"
        for name, others in arrows.items()
        for other in sorted(others)
        if order.index(other) >= order.index(name)
    ]


def test_packages_import_only_packages_above_them() -> None:
    assert not upwards(structure.listed("Packages"), structure.package_arrows())


@needs_cargo
def test_crates_depend_only_on_crates_above_them() -> None:
    assert not upwards(structure.listed("Crates"), structure.crate_arrows())


@needs_cargo
def test_the_pictures_show_the_imports_as_they_are() -> None:
    for name, text in structure.pictures().items():
        drawn = (structure.PICTURES / name).read_text(encoding="utf-8")
        assert drawn == text, f"{name} is out of date: make structure"


def test_no_files_import_each_other_in_a_circle() -> None:
    # A package's __init__ gathers what is in it for others; inside, its files import each other.
    gathered = {m for m, path in structure.modules().items() if path.name == "__init__.py"}
    inside = {
        module: {other for other in others if not f"{module}.".startswith(f"{other}.")}
        for module, others in structure.imports().items()
        if module not in gathered or module.count(".") > 0
    }
    assert not structure.circles(inside)


def test_no_files_of_a_crate_use_each_other_in_a_circle() -> None:
    arrows = rust_uses.arrows()
    rows = "registration/src/system/rows.rs"
    assert "registration/src/system/normal_equations.rs" in arrows[rows]
    assert not structure.circles(arrows)


def test_only_packages_that_compute_import_the_compiled_core() -> None:
    text = (structure.ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    sentence = next(line for line in text.splitlines() if line.startswith("The compiled core"))
    users = {
        structure.package_of(module)
        for module, others in structure.imports().items()
        if structure.CORE in others
    }
    assert users == {name for name in structure.listed("Packages") if f"`{name}`" in sentence}


@needs_cargo
def test_only_the_bindings_know_python() -> None:
    knowing = {
        name for name, crate in structure.crates().items() if crate["packages"] & {"pyo3", "numpy"}
    }
    assert knowing == {"python"}
