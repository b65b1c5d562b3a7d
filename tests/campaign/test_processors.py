# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is the same on any x86-64, whichever kernels of linear algebra its processor chooses."""

import json
import math
import platform

import numpy as np
import pytest

from campaign.watched import run

KERNELS = ("Nehalem", "Haswell")  # without and with fused multiply-add
SAME = ("trajectory.txt", "odometry.txt", "map.laz")
ITERATED = (
    1e-6  # s, m, rad: of what is found by steps until they are small, as the clock of a reference
)
# Of a record, what differs from run to run.
OF_THE_RUN = ("started", "command", "timings", "peak_memory_mb", "hashes")


of_x86 = pytest.mark.skipif(
    platform.machine() not in {"x86_64", "AMD64"}, reason="kernels of x86-64"
)


@pytest.mark.slow
@of_x86
def test_a_run_is_the_same_with_the_kernels_of_other_processors(simulated, tmp_path):
    recording = simulated("office", 22.0)
    outs = []
    for kernel in KERNELS:
        outs.append(tmp_path / kernel)
        command = ["map", recording / "recording.bag", "-p", recording / "payload.yaml", "-q"]
        ended = run(
            [*command, "--duration", "8", "-o", outs[-1]],
            environment={"OPENBLAS_CORETYPE": kernel},
        )
        assert ended.code == 0, ended.said
    for name in SAME:
        first, second = ((out / name).read_bytes() for out in outs)
        assert first == second, name
    covariances = [np.loadtxt(out / "trajectory_covariance.txt") for out in outs]
    np.testing.assert_allclose(*covariances, rtol=1e-6, atol=1e-15)
    records = [json.loads((out / "run.json").read_text()) for out in outs]
    ours, theirs = ({k: v for k, v in r.items() if k not in OF_THE_RUN} for r in records)
    assert_alike(ours, theirs)


@pytest.mark.slow
@of_x86
def test_a_calibration_and_an_evaluation_are_alike_with_the_kernels_of_other_processors(
    ground, simulated, tmp_path
):
    recording, healthy = simulated("office", 22.0), ground.healthy
    truth = ["--reference-trajectory", recording / "truth_trajectory.txt"]
    surface = ["--reference-map", recording / "truth_scene.ply"]
    commands = {
        "calibration": ["calibrate", recording / "recording.bag", "-p", healthy.payload],
        "evaluation": ["evaluate", healthy.run, *truth, *surface],
    }
    for name, command in commands.items():
        records = []
        for kernel in KERNELS:
            out = tmp_path / f"{name}_{kernel}"
            ended = run([*command, "-o", out, "-q"], environment={"OPENBLAS_CORETYPE": kernel})
            assert ended.code == 0, ended.said
            records.append(json.loads((out / f"{name}.json").read_text()))
        assert_alike(*records, absolute=ITERATED)
    payloads = [
        (tmp_path / f"calibration_{kernel}" / "payload.yaml").read_bytes() for kernel in KERNELS
    ]
    assert payloads[0] == payloads[1]


def assert_alike(ours, theirs, where="", *, absolute=1e-9):
    """Both say the same, numbers to what sums of BLAS keep of them."""
    if isinstance(ours, dict):
        assert ours.keys() == theirs.keys(), where
        for key, value in ours.items():
            assert_alike(value, theirs[key], f"{where}.{key}", absolute=absolute)
    elif isinstance(ours, list):
        assert len(ours) == len(theirs), where
        for i, value in enumerate(ours):
            assert_alike(value, theirs[i], f"{where}[{i}]", absolute=absolute)
    elif isinstance(ours, float):
        assert math.isclose(ours, theirs, rel_tol=1e-6, abs_tol=absolute), (where, ours, theirs)
    else:
        assert ours == theirs, where
