# SPDX-License-Identifier: MIT OR Apache-2.0
"""The Python in README.md and docs/ uses public names only, and type checkers accept it."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys

import pytest

import bentwing
from support.structure import PACKAGE, ROOT

PUBLIC = {"bentwing", *(f"bentwing.{name}" for name in bentwing.PACKAGES)}
# What a reader has at hand: arrays of sensors, and the carrier's state.
AT_HAND = """\
import bentwing as bentwing
import numpy as np
from numpy.typing import NDArray
from collections.abc import Callable
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


def mypy(folder):
    """The command that checks a folder with mypy; the cache is that of `make check`."""
    pytest.importorskip("mypy")
    config = ["--config-file", ROOT / "pyproject.toml", "--cache-dir", ROOT / ".mypy_cache"]
    return ["mypy", *config, *sorted(folder.iterdir())]


def pyright(folder):
    """The same with pyright, in the form that needs no download: basedpyright."""
    pytest.importorskip("basedpyright")
    config = {"typeCheckingMode": "standard", "extraPaths": [str(PACKAGE.parent)]}
    (folder / "pyrightconfig.json").write_text(json.dumps(config), encoding="utf-8")
    options = ["--level", "error", "--pythonpath", sys.executable, "--project", folder]
    return ["basedpyright", *options]


CHECKERS = pytest.mark.parametrize("checker", [mypy, pyright])


def errors(checker, folder, sources):
    """Lines with errors that a type checker finds in sources, each a file of its own."""
    (folder / "at_hand.pyi").write_text(AT_HAND, encoding="utf-8")
    for number, source in enumerate(sources):
        text = f"from at_hand import *\n{source}"
        (folder / f"snippet_{number}.py").write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", *checker(folder)]
    answer = subprocess.run(command, cwd=ROOT, check=False, capture_output=True, text=True)
    assert answer.returncode in {0, 1}, answer.stderr
    return [line for line in answer.stdout.splitlines() if " error: " in line]


@CHECKERS
def test_type_checkers_accept_every_snippet(checker, tmp_path):
    assert len(SNIPPETS) > 8
    assert not errors(checker, tmp_path, SNIPPETS.values()), list(enumerate(SNIPPETS))


@CHECKERS
def test_type_checkers_refuse_names_and_choices_that_do_not_exist(checker, tmp_path):
    wrong = ["bentwing.nothing", "bentwing.map.nothing", "prior.time"]
    wrong += ["bentwing.Odometry(payload, estimator='slam')"]
    assert len(errors(checker, tmp_path, wrong)) == len(wrong)


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
