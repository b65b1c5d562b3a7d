# SPDX-License-Identifier: MIT OR Apache-2.0
"""What commands do when nothing disturbs them, with which a command that was stopped is compared."""

from __future__ import annotations

import hashlib
import tempfile
from dataclasses import dataclass
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from campaign.options import whole
from campaign.watched import run

if TYPE_CHECKING:
    from campaign.faults import Healthy

_NEEDED = {"mesh": "open3d", "view": "rerun", "fleet": "distributed"}  # packages of extras
WRITERS = [
    name
    for name in (
        "map", "localize", "fleet", "merge", "export", "calibrate", "payload", "evaluate", "report",
        "section", "terrain", "view", "simulate", "mesh",
    )
    if find_spec(_NEEDED.get(name, "bentwing"))
]  # fmt: skip
# Says which recordings an earlier call had finished, which a call behind one that was stopped finds.
_OF_ONE_CALL = frozenset({"out/site.json"})
RESUMED = frozenset({"map", "localize"})


@dataclass(frozen=True, slots=True)
class Usual:
    """What a command takes and leaves behind.

    Attributes
    ----------
    seconds : of wall time
    names : of all files in its folder, inputs included
    hashes : of those files that two calls make alike
    """

    seconds: float
    names: frozenset[str]
    hashes: dict[str, str]

    def differences(self, folder: Path) -> list[str]:
        """Say what is another in the folder of a command."""
        found = hashes_of(folder)
        odd = [f"{name} is missing" for name in sorted(self.names - {*found})]
        odd += [f"{name} is left" for name in sorted({*found} - self.names)]
        return odd + [
            f"{name} is another" for name, sha in self.hashes.items() if found.get(name, sha) != sha
        ]


@lru_cache
def usual(name: str, healthy: Healthy) -> Usual:
    """Call a command twice, undisturbed."""
    found = []
    for _ in range(2):
        with tempfile.TemporaryDirectory() as temporary:
            ended = run(whole(name, healthy, Path(temporary)))
            assert ended.code == 0, (name, ended.said)
            found.append(hashes_of(Path(temporary)))
    first, second = found
    assert first.keys() == second.keys()
    alike = {n: sha for n, sha in first.items() if second[n] == sha and n not in _OF_ONE_CALL}
    return Usual(ended.seconds, frozenset(first), alike)


def hashes_of(folder: Path) -> dict[str, str]:
    """Return the SHA-256 of all files in a folder by their place in it."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in files
    }
