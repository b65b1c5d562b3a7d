# SPDX-License-Identifier: MIT OR Apache-2.0
"""Places of files: the office that is scanned twice, and what is no run."""

import numpy as np
import pytest

from bentwing.errors import UsageError
from bentwing.places import match_places, places_of_cloud, places_of_run


def test_a_folder_without_a_run_is_refused(tmp_path):
    with pytest.raises(UsageError, match="no bentwing run"):
        places_of_run(tmp_path)


def test_two_scans_of_an_office_are_registered_without_a_guess(shared_data):
    scans = shared_data / "room_scans"
    first, second = (places_of_cloud(scans / f"room_scan{n}.pcd") for n in (1, 2))
    (found,) = match_places(first, second)
    assert found.accepted, found.reason
    T = found.alignment.T_a_b
    assert np.degrees(np.arctan2(T[1, 0], T[0, 0])) == pytest.approx(40.8, abs=0.5)
    np.testing.assert_allclose(T[:3, 3], [1.97, 0.06, 0.03], atol=0.05)
    assert found.agreement.distance < 0.015
