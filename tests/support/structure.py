# SPDX-License-Identifier: MIT OR Apache-2.0
"""The structure of the code as its imports show it, and the pictures of it in the documentation.

`python tests/support/structure.py` prints the arrows between packages and between crates;
`--draw` renews the pictures in docs/images/architecture.
"""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "python" / "bentwing"
PICTURES = ROOT / "docs" / "images" / "architecture"
CORE = "bentwing._core"
# The doors of the house: they name what is inside and may import all of it.
DOORS = {"__init__", "__main__"}

Arrows = dict[str, set[str]]


def listed(heading: str) -> list[str]:
    """Names in the first column of the table below a heading of ARCHITECTURE.md, in order."""
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    section = text.split(f"## {heading}\n", 1)[1].split("\n## ", 1)[0]
    return re.findall(r"^\| `(\w+)` \|", section, re.MULTILINE)


def modules() -> dict[str, Path]:
    """Modules of the package with their files."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def package_of(module: str) -> str:
    """`bentwing.map.project` → `map`; the package itself is `__init__`."""
    parts = module.split(".")
    return parts[1] if len(parts) > 1 else "__init__"


def imports() -> Arrows:
    """Modules of bentwing that each module imports, wherever in the file, the core among them.

    Imports for type checking count like any others.
    """
    known = {*modules(), CORE}
    found: Arrows = {}
    for module, path in modules().items():
        own = found.setdefault(module, set())
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                own |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                inner = {f"{node.module}.{alias.name}" for alias in node.names} & known
                own |= inner or {node.module}
        own.intersection_update(known)
    return found


def package_arrows() -> Arrows:
    """Packages that each package imports; the core and the doors are left out."""
    found: Arrows = {}
    for module, others in imports().items():
        package = package_of(module)
        if package in DOORS:
            continue
        named = {package_of(other) for other in others if other != CORE}
        found.setdefault(package, set()).update(named - {package} - DOORS)
    return found


def crates() -> dict[str, dict[str, set[str]]]:
    """Crates by folder: the `crates` and the `packages` of others that they depend on."""
    command = ["cargo", "metadata", "--format-version", "1", "--no-deps", "--offline"]
    answer = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    found = {}
    for package in json.loads(answer.stdout)["packages"]:
        folder = Path(package["manifest_path"]).parent
        if folder.parent.name != "crates":
            continue
        needed = [d for d in package["dependencies"] if d["kind"] != "dev"]
        found[folder.name] = {
            "crates": {Path(d["path"]).name for d in needed if d.get("path")},
            "packages": {d["name"] for d in needed},
        }
    return found


def crate_arrows() -> Arrows:
    """Crates that each crate depends on."""
    return {name: crate["crates"] for name, crate in crates().items()}


def circles(arrows: Arrows) -> list[list[str]]:
    """Groups that import each other (Tarjan's strongly connected components)."""
    index: dict[str, int] = {}
    lowest: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(name: str) -> None:
        index[name] = lowest[name] = len(index)
        stack.append(name)
        for other in sorted(arrows.get(name, ())):
            if other not in index:
                visit(other)
                lowest[name] = min(lowest[name], lowest[other])
            elif other in stack:
                lowest[name] = min(lowest[name], index[other])
        if lowest[name] == index[name]:
            group = stack[stack.index(name) :]
            del stack[stack.index(name) :]
            if len(group) > 1:
                found.append(sorted(group))

    for name in sorted(arrows):
        if name not in index:
            visit(name)
    return found


def picture(order: list[str], arrows: Arrows) -> str:
    """Draw who imports whom as a triangle: rows import columns, nothing is above the diagonal."""
    cell, left, top = 26, 120, 104
    side = cell * len(order)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {left + side + 12} {top + side + 12}" '
        'font-family="sans-serif" font-size="13">',
        f'<rect width="{left + side + 12}" height="{top + side + 12}" fill="white"/>',
    ]
    for row, name in enumerate(order):
        y = top + cell * row
        middle = y + cell / 2
        parts.append(
            f'<text x="{left - 8}" y="{middle + 4}" text-anchor="end">{name}</text>'
            f'<text transform="translate({left + cell * row + cell / 2 + 4} {top - 8}) rotate(-60)">'
            f"{name}</text>"
        )
        for column, other in enumerate(order[: row + 1]):
            x = left + cell * column
            fill = "#d9d9d9" if column == row else "#f4f6f8"
            parts.append(
                f'<rect x="{x + 1}" y="{y + 1}" width="{cell - 2}" height="{cell - 2}" fill="{fill}"/>'
            )
            if other in arrows.get(name, ()):
                parts.append(
                    f'<circle cx="{x + cell / 2}" cy="{middle}" r="6" fill="#1f6f9f">'
                    f"<title>{name} imports {other}</title></circle>"
                )
    return "\n".join([*parts, "</svg>", ""])


def pictures() -> dict[str, str]:
    """Return the pictures by the names of their files."""
    return {
        "packages.svg": picture(listed("Packages"), package_arrows()),
        "crates.svg": picture(listed("Crates"), crate_arrows()),
    }


def _say(what: str, order: list[str], arrows: Arrows) -> None:
    upwards = sum(order.index(b) >= order.index(a) for a, others in arrows.items() for b in others)
    total = sum(map(len, arrows.values()))
    print(f"{what}: {len(order)}, {total} arrows between them, {upwards} upwards")
    for name in order:
        print(f"  {name:18} {' '.join(sorted(arrows[name], key=order.index))}")


def main() -> None:
    """Print the arrows, or draw them."""
    if "--draw" in sys.argv:
        PICTURES.mkdir(parents=True, exist_ok=True)
        for name, text in pictures().items():
            (PICTURES / name).write_text(text, encoding="utf-8")
            print(PICTURES / name)
        return
    _say("packages", listed("Packages"), package_arrows())
    _say("crates", listed("Crates"), crate_arrows())


if __name__ == "__main__":
    main()
