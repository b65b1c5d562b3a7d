# SPDX-License-Identifier: MIT OR Apache-2.0
"""The Python in README.md and docs/ uses public names only, and type checkers accept it."""

from __future__ import annotations

import ast
import re
import subprocess
import sys

import pytest

import bentwing
from support.structure import ROOT

PUBLIC = {"bentwing", *(f"bentwing.{name}" for name in bentwing.PACKAGES)}
# What a reader has at hand: arrays of sensors, and the carrier's state.
AT_HAND = """\
import numpy as np
from numpy.typing import NDArray
from collections.abc import Callable
import bentwing
from bentwing.flight import FlightLink
from bentwing.recording import ImuBatch

points: NDArray[np.float32]
times: NDArray[np.float64]
more_points: NDArray[np.float64]
more_times: NDArray[np.float64]
gyro: NDArray[np.float64]
accel: NDArray[np.float64]
lidar_position: NDArray[np.float64]
position: NDArray[np.float64]
velocity: NDArray[np.float64]
imu: ImuBatch
payload: bentwing.Payload
prior: bentwing.Trajectory
next_prior: bentwing.Trajectory
time: float
now: float
stamp: float
rate: float
yaw: float
roll: float
pitch: float
link: FlightLink
servo: Callable[[float], None]
"""


def snippets():
    """Blocks of Python in the documentation by file and line."""
    found = {}
    for path in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]:
        text = path.read_text(encoding="utf-8")
        for block in re.finditer(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
            line = text.count("\n", 0, block.start()) + 1
            found[f"{path.relative_to(ROOT)}:{line}"] = block[1]
    return found


SNIPPETS = snippets()


def check(tmp_path, sources):
    """What mypy says about sources, each a file of its own; the cache is that of `make check`."""
    for number, source in enumerate(sources):
        (tmp_path / f"snippet_{number}.py").write_text(AT_HAND + source, encoding="utf-8")
    command = [sys.executable, "-m", "mypy", "--config-file", ROOT / "pyproject.toml"]
    command += ["--cache-dir", ROOT / ".mypy_cache", *sorted(tmp_path.glob("snippet_*.py"))]
    answer = subprocess.run(command, cwd=ROOT, check=False, capture_output=True, text=True)
    return answer.stdout + answer.stderr


def test_type_checkers_accept_every_snippet(tmp_path):
    pytest.importorskip("mypy")
    assert len(SNIPPETS) > 8
    said = check(tmp_path, SNIPPETS.values())
    assert said.startswith("Success"), f"{list(enumerate(SNIPPETS))}\n{said}"


def test_type_checkers_refuse_names_that_are_not_public(tmp_path):
    pytest.importorskip("mypy")
    said = check(tmp_path, ["bentwing.nothing\n", "bentwing.map.nothing\n", "prior.time\n"])
    assert said.count("error: ") == 3, said


@pytest.mark.parametrize("source", SNIPPETS.values(), ids=SNIPPETS.keys())
def test_snippets_import_from_public_packages_only(source):
    imported = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            imported |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            imported.add(node.module)
    assert {name for name in imported if name.startswith("bentwing")} <= PUBLIC


def test_so_do_the_examples():
    for path in (ROOT / "examples").glob("*.py"):
        test_snippets_import_from_public_packages_only(path.read_text(encoding="utf-8"))
