# SPDX-License-Identifier: MIT OR Apache-2.0
"""The directions in which rooms may depend on each other, as ARCHITECTURE.md gives them."""

from __future__ import annotations

import ast
import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "python" / "bentwing"
CORE = "bentwing._core"


def table(heading: str) -> dict[str, set[str]]:
    """Rows of the table below a heading: the name in the first column, the names in the second."""
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    section = text.split(f"### {heading}\n", 1)[1].split("\n#", 1)[0]
    rows = [line.strip("|").split("|") for line in section.splitlines() if line.startswith("|")]
    return {names(first).pop(): names(second) for first, second, *_ in rows[2:]}


def names(cell: str) -> set[str]:
    return set(re.findall(r"(?<=`)[\w.]+(?=`)|\bfoundation\b", cell))


def rooms_table() -> dict[str, set[str]]:
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    sentence = re.search(r"^The foundation: (.+)\.$", text, re.MULTILINE)
    assert sentence is not None, "ARCHITECTURE.md no longer names the foundation"
    foundation = names(sentence[1])
    return {
        room: (allowed - {"foundation"}) | (foundation if "foundation" in allowed else set())
        for room, allowed in table("Python rooms").items()
    }


def modules() -> dict[str, Path]:
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def room_of(module: str) -> str:
    """`bentwing.map.project` → `map`; the package itself is the room `__init__`."""
    parts = module.split(".")
    return parts[1] if len(parts) > 1 else "__init__"


def imports(module: str, path: Path) -> set[str]:
    """Modules of bentwing that a file imports, wherever in the file, as far as they can be told."""
    known = {*modules(), CORE}
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            above = package.rsplit(".", node.level - 1)[0] if node.level else ""
            base = ".".join(part for part in (above, node.module) if part)
            inner = {f"{base}.{alias.name}" for alias in node.names} & known
            found |= inner or {base}
    return {name for name in found if name.split(".")[0] == "bentwing"}


def test_every_python_room_has_a_row_in_the_table() -> None:
    rooms = {room_of(module) for module in modules()}
    missing = rooms - set(rooms_table())
    assert not missing, f"add rows to ARCHITECTURE.md, 'Python rooms': {sorted(missing)}"


def test_the_table_names_only_rooms_it_has_rows_for() -> None:
    rows = rooms_table()
    unknown = set().union(*rows.values()) - set(rows)
    assert not unknown, f"ARCHITECTURE.md, 'Python rooms' allows rooms without a row: {unknown}"


def test_the_table_of_rooms_has_no_cycle() -> None:
    rows = rooms_table()
    while rows:
        free = [room for room, allowed in rows.items() if not allowed & set(rows)]
        assert free, f"these rooms may import each other in a circle: {sorted(rows)}"
        rows = {room: allowed for room, allowed in rows.items() if room not in free}


def test_python_rooms_import_only_what_the_table_allows() -> None:
    rows = rooms_table()
    wrong = [
        f"{module} imports {imported}: `{room_of(module)}` may not import `{room_of(imported)}`"
        for module, path in modules().items()
        for imported in sorted(imports(module, path))
        if imported != CORE
        and room_of(imported) not in {room_of(module), *rows.get(room_of(module), set())}
    ]
    assert not wrong, "\n".join(wrong)


def test_only_named_modules_import_the_compiled_core() -> None:
    allowed = set(table("The compiled core"))
    users = {module for module, path in modules().items() if CORE in imports(module, path)}
    assert users <= allowed, f"may not import {CORE}: {sorted(users - allowed)}"


def workspace_crates() -> dict[str, dict[str, set[str]]]:
    """Crates under crates/ by the name of their folder: crates and packages they depend on."""
    if shutil.which("cargo") is None:
        pytest.skip("cargo is not installed")
    command = ["cargo", "metadata", "--format-version", "1", "--no-deps", "--offline"]
    answer = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    packages = {
        Path(package["manifest_path"]).parent: package
        for package in json.loads(answer.stdout)["packages"]
        if Path(package["manifest_path"]).parent.parent.name == "crates"
    }
    return {
        folder.name: {
            "crates": {Path(d["path"]).name for d in package["dependencies"] if d.get("path")},
            "packages": {d["name"] for d in package["dependencies"]},
        }
        for folder, package in packages.items()
    }


def test_crates_depend_only_on_what_the_table_allows() -> None:
    rows = table("Crates")
    crates = workspace_crates()
    assert set(rows) == set(crates), "ARCHITECTURE.md, 'Crates' and crates/ differ"
    wrong = [
        f"{crate} depends on {sorted(found['crates'] - rows[crate])}"
        for crate, found in crates.items()
        if not found["crates"] <= rows[crate]
    ]
    assert not wrong, "\n".join(wrong)


def test_only_the_bindings_know_python() -> None:
    knowing = {
        crate
        for crate, found in workspace_crates().items()
        if found["packages"] & {"pyo3", "numpy"}
    }
    assert knowing == {"python"}
