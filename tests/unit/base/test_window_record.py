# SPDX-License-Identifier: MIT OR Apache-2.0
import json

import pytest

from bentwing.base.plain import plain
from bentwing.base.window_record import WindowRecord

COMMON = {
    "time": 1.5, "n_surfels": 40, "n_matches": 12, "inlier_share": 0.75, "residual_rms": 1.25,
    "iterations": 3, "converged": True, "degenerate": False,
    "translation_eigenvalues": [0.1, 0.3, 0.6], "rotation_eigenvalues": [0.2, 0.3, 0.5],
}  # fmt: skip
WINDOW = COMMON | {
    "n_fixed_matches": 4, "weakest_direction": None, "n_blind": 0, "gyro_rms": 0.9, "gyro_correlation": 0.1, "latency": 0.003,
    "gyro_bias": [0.0] * 3, "accel_bias": [0.0] * 3, "gravity": [0.0, 0.0, 9.8],
    "extrinsic_translation": [0.0] * 3, "extrinsic_quat_xyzw": [0.0, 0.0, 0.0, 1.0],
    "std": {"latency": [1e-4]},
}  # fmt: skip
SWEEP = COMMON | {
    "n_points": 900, "n_planar": 300, "n_edges": 20, "n_line_matches": 5, "registered": True,
    "new_share": 0.1, "registration_rmse": 0.02,
}  # fmt: skip
LOST_SCAN = {
    "time": 1.5, "n_surfels": 40, "registered": False, "n_points": 0, "n_matches": 0,
    "inlier_share": None, "residual_rms": None, "registration_rmse": None, "iterations": 0,
    "converged": False, "degenerate": True,
}  # fmt: skip


@pytest.mark.parametrize("record", [WINDOW, SWEEP, LOST_SCAN], ids=["window", "sweep", "lost"])
def test_a_record_comes_back_from_json_with_the_fields_it_had(record):
    read = WindowRecord.from_json(json.loads(json.dumps(record)))
    assert read.to_json() == record
    assert plain([read]) == [record]


def test_what_a_later_version_has_added_is_left_out():
    assert WindowRecord.from_json(SWEEP | {"colour": "red"}).to_json() == SWEEP
