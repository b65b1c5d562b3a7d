# SPDX-License-Identifier: MIT OR Apache-2.0
"""What `bentwing map` has loaded when its recording is open: nothing that only some runs or later stages need."""

import subprocess
import sys

import pytest

LATER = (
    "laspy",
    "matplotlib",
    "pyproj",
    "scipy",
    "bentwing.calibrate.draft.draft",
    "bentwing.calibrate.set_up.find",
    "bentwing.closing.beams.find",
    "bentwing.closing.georeference.georeference",
    "bentwing.closing.global_registration.closing",
    "bentwing.closing.joining",
    "bentwing.closing.localize.prior_map",
    "bentwing.closing.places.match",
    "bentwing.map.project",
    "bentwing.report.page",
    "bentwing.run.merging",
)
SCRIPT = """
import sys
from bentwing.recording.recording import Recording
opened = Recording.__init__
def told(self, *arguments, **options):
    opened(self, *arguments, **options)
    print(*sys.modules)
    sys.exit()
Recording.__init__ = told
sys.argv = ["bentwing", "map", *sys.argv[1:]]
from bentwing.cli.main import run
run()
"""


@pytest.fixture(scope="module")
def loaded(simulated, tmp_path_factory):
    office = simulated("office", 22.0)
    arguments = [office / "recording.bag", "--payload", office / "payload.yaml"]
    out = tmp_path_factory.mktemp("start") / "run"
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, *arguments, "-o", out],
        check=True,
        capture_output=True,
        text=True,
    )
    return set(done.stdout.split())


@pytest.mark.parametrize("name", LATER)
def test_what_is_needed_later_is_loaded_later(loaded, name):
    assert "bentwing.recording.recording" in loaded
    assert name not in loaded
