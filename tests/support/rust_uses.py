# SPDX-License-Identifier: MIT OR Apache-2.0
"""Which Rust files use which, as their `use` declarations say; what the tests in a file use is left out."""

from __future__ import annotations

import re
from pathlib import Path

CRATES = Path(__file__).resolve().parents[2] / "crates"

Module = tuple[str, ...]
USE = re.compile(r"^ *(?:pub(?:\([^)]*\))? )?use ([^;]+);", re.MULTILINE)
TESTS = re.compile(r"^#\[cfg\(test\)\]\n(?:pub(?:\(crate\))? )?mod \w+ \{$", re.MULTILINE)


def spread(tree: str) -> list[str]:
    """`a::{b, c::{d, e}}` → `a::b`, `a::c::d`, `a::c::e`; new names are dropped."""
    tree = tree.strip()
    if "{" not in tree:
        return [re.sub(r" as \w+$", "", tree)]
    head, rest = tree.split("{", 1)
    paths, depth, start = [], 0, 0
    for place, letter in enumerate(rest):
        if letter == "{":
            depth += 1
        elif letter in ",}" and depth == 0:
            paths.append(rest[start:place])
            start = place + 1
        elif letter == "}":
            depth -= 1
    return [head + path for part in paths if part.strip() for path in spread(part)]


class Crate:
    """The files of a crate by their modules, and what each of them uses."""

    def __init__(self, folder: Path) -> None:
        root = folder / "src"
        self.files: dict[Module, Path] = {}
        for path in sorted(root.rglob("*.rs")):
            parts = path.relative_to(root).with_suffix("").parts
            self.files[() if parts == ("lib",) else parts] = path
        self.uses = {module: self._uses(module) for module in self.files}

    def _uses(self, module: Module) -> list[tuple[str, ...]]:
        """Paths within the crate, from its root."""
        text = TESTS.split(self.files[module].read_text(encoding="utf-8"))[0]
        found = []
        for tree in USE.findall(text):
            for path in spread(" ".join(tree.split())):
                first, *names = (name.strip() for name in path.split("::"))
                if first == "crate":
                    found.append(tuple(names))
                elif first == "super":
                    found.append((*module[:-1], *names))
                elif (*module, first) in self.files:
                    found.append((*module, first, *names))
        return found

    def owner(
        self, path: tuple[str, ...], seen: frozenset[tuple[str, ...]] = frozenset()
    ) -> Module:
        """Return the module that defines what a path names, through whatever passes it on."""
        module = path
        while module not in self.files:
            module = module[:-1]
        rest = path[len(module) :]
        passed_on = [use for use in self.uses[module] if rest and use[-1] == rest[0]]
        if passed_on and path not in seen:
            return self.owner((*passed_on[0], *rest[1:]), seen | {path})
        return module

    def arrows(self) -> dict[str, set[str]]:
        """Files that each file uses."""

        def name(module: Module) -> str:
            return str(self.files[module].relative_to(CRATES))

        return {
            name(module): {name(self.owner(use)) for use in uses} - {name(module)}
            for module, uses in self.uses.items()
        }


def arrows() -> dict[str, set[str]]:
    """Files of all crates that each of their files uses."""
    found: dict[str, set[str]] = {}
    for folder in sorted(CRATES.iterdir()):
        if (folder / "src" / "lib.rs").exists():
            found |= Crate(folder).arrows()
    return found
