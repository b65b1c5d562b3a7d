# SPDX-License-Identifier: MIT OR Apache-2.0
"""What every source file of the project has in common."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SPDX = "SPDX-License-Identifier: MIT OR Apache-2.0"
MAX_LINES = 500
SUFFIXES = {".py", ".pyi", ".rs"}
# One compiled module has one stub, however much it exposes.
WHOLE = {"_core.pyi"}


def sources(*folders: str) -> list[Path]:
    found = [
        path
        for folder in folders
        for path in sorted((ROOT / folder).rglob("*"))
        if path.suffix in SUFFIXES and "target" not in path.relative_to(ROOT).parts
    ]
    assert found, f"no source files below {folders}"
    return found


def own_lines(path: Path) -> int:
    """Lines of a file without its own unit tests."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".rs":
        text = re.split(r"^#\[cfg\(test\)\]\s*\nmod \w+ \{", text, maxsplit=1, flags=re.MULTILINE)[
            0
        ]
    return len(text.splitlines())


def is_test(path: Path) -> bool:
    return path.name == "tests.rs" or "tests" in path.relative_to(ROOT).parts


def test_no_source_file_exceeds_500_lines() -> None:
    long = {
        str(path.relative_to(ROOT)): own_lines(path)
        for path in sources("python", "crates")
        if not is_test(path) and path.name not in WHOLE and own_lines(path) > MAX_LINES
    }
    assert not long, f"look for the seam: {long}"


def test_every_source_file_starts_with_its_licence() -> None:
    without = [
        str(path.relative_to(ROOT))
        for path in sources("python", "crates", "tests", "benches", "docs", "examples")
        if SPDX not in path.read_text(encoding="utf-8").partition("\n")[0]
    ]
    assert not without, f"the first line must hold '{SPDX}': {without}"


def imported(path: Path) -> set[str]:
    """First parts of the names that a file imports, wherever in it."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.add(node.module.partition(".")[0])
    return found


@pytest.mark.parametrize(("folder", "others"), [("tests", {"benches"}), ("benches", {"support"})])
def test_tests_and_benches_do_not_import_each_other(folder, others) -> None:
    across = {
        str(path.relative_to(ROOT)): sorted(imported(path) & others)
        for path in sources(folder)
        if path.suffix == ".py" and imported(path) & others
    }
    assert not across, "what both need belongs to bentwing.evaluate"


@pytest.mark.parametrize(
    ("page", "section", "least"),
    [("CONTRIBUTING.md", "Recipes", 40), ("ARCHITECTURE.md", "Where to add", 8)],
)
def test_every_file_that_the_recipes_name_exists(page, section, least) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    found = re.search(rf"^## {section}$(.*?)^## ", text, re.MULTILINE | re.DOTALL)
    assert found
    # Names in angle brackets are those of files to be added.
    named = set(re.findall(r"(?<![\w/>])(?:[\w.]+/)+[\w.]*(?![\w<])", found[1]))
    assert len(named) >= least
    assert sorted(name for name in named if not (ROOT / name).exists()) == []


def checks(function: ast.FunctionDef, others: dict[str, ast.FunctionDef]) -> bool:
    """Whether a function, or one of its file that it calls, can fail a test."""
    others = {name: other for name, other in others.items() if other is not function}
    for node in ast.walk(function):
        if isinstance(node, ast.Assert):
            return True
        if isinstance(node, ast.Call):
            name = ast.unparse(node.func).rpartition(".")[2]
            if name in {"raises", "warns", "fail"} or name.startswith("assert_"):
                return True
            if name in others and checks(others[name], others):
                return True
    return False


def test_every_test_checks_something() -> None:
    idle = []
    for path in sources("tests", "benches"):
        if path.name.startswith("test_"):
            tree = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
            functions = {node.name: node for node in tree if isinstance(node, ast.FunctionDef)}
            tests = [f for name, f in functions.items() if name.startswith("test_")]
            idle += [f"{path.name}: {f.name}" for f in tests if not checks(f, functions)]
    assert not idle
