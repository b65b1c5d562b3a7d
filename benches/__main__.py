# SPDX-License-Identifier: MIT OR Apache-2.0
"""`python -m benches` lists the benches; `python -m benches NAME …` runs one of them."""

from __future__ import annotations

import ast
import importlib
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent
GROUPS = ("kernels", "accuracy", "cost", "papers")


def benches() -> dict[str, Path]:
    """The files of the benches in Python by their names."""
    files = [path for group in GROUPS for path in sorted((ROOT / group).glob("*.py"))]
    found = {path.stem: path for path in files if path.stem != "__init__"}
    return {**found, "peers": ROOT / "peers" / "__main__.py"}


def criterion() -> dict[str, Path]:
    """The files of the benches in Rust by their names."""
    files = sorted(ROOT.rglob("*.rs"))
    return {path.stem: path for path in files if "criterion_main!" in path.read_text("utf-8")}


def summary(path: Path) -> str:
    """What a bench measures: the first line of its documentation."""
    text = path.read_text("utf-8")
    if path.suffix == ".rs":
        return next(row[3:].strip() for row in text.splitlines() if row.startswith("//!"))
    return (ast.get_docstring(ast.parse(text)) or "").partition("\n")[0]


def listed() -> str:
    """One line for each bench: what it measures, and its command."""
    rows = [(summary(path), f"python -m benches {name}") for name, path in benches().items()]
    rows += [
        (summary(path), f"cargo bench -p bentwing_benches --bench {name}")
        for name, path in criterion().items()
    ]
    width = max(len(command) for _, command in rows)
    return "\n".join(f"{command:{width}}  {what}" for what, command in rows)


def main() -> None:
    """List the benches, or run one."""
    if len(sys.argv) == 1 or sys.argv[1] in ("-h", "--help"):
        print(listed())
        return
    name, found = sys.argv[1], benches()
    if name not in found:
        sys.exit(f"no bench is called {name}; these are: {', '.join(found)}")
    module = ".".join((ROOT.name, *found[name].relative_to(ROOT).with_suffix("").parts))
    sys.argv[:2] = [f"python -m benches {name}"]
    importlib.import_module(module).main()


if __name__ == "__main__":
    main()
