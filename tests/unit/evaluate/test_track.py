# SPDX-License-Identifier: MIT OR Apache-2.0
import contextlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bentwing.base.errors import InputError
from bentwing.evaluate.track import bridges, read_track

POSITIONS = "1700000000.25 1 2 3\n1700000000.5 2 3 4\n1700000001 4 5 6\n"


@pytest.fixture
def track(tmp_path):
    def read(content):
        path = tmp_path / "reference.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return read_track(path)

    return read


@pytest.mark.parametrize(
    "text", [POSITIONS, POSITIONS.replace(" ", ","), "t,x,y,z\n" + POSITIONS.replace(" ", ", "),
             "# total station\n\n" + POSITIONS]
)  # fmt: skip
def test_positions_are_read_from_spaces_or_commas_with_a_heading_or_not(track, text):
    found = track(text)
    assert found.times.tolist() == [0, 0.25, 0.75]
    assert found.positions.tolist() == [[1, 2, 3], [2, 3, 4], [4, 5, 6]]
    assert found.origin_ns == 1_700_000_000_250_000_000
    assert found.quats_xyzw is None


def test_poses_are_read_and_their_quaternions_made_unit(track):
    found = track("0 1 2 3 0 0 0 1\n1 1 2 3 0 0 0.7072 0.7072\n2 1 2 3 1 0 0 0\n")
    assert np.allclose(np.linalg.norm(found.quats_xyzw, axis=1), 1, atol=1e-15)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("", "holds no pose"),
        ("0 1 2 3\n", "holds 1 measurements"),
        ("0 1 2\n" * 3, "expected `t x y z"),
        ("1 0 0 0 0 1 0 0 0 0 1 0\n" * 3, "as KITTI writes them, without times"),
        ("0 1 2 3\n1 1 2 3 0 0 0 1\n2 1 2 3\n", "line 2"),
        ("1403636579763555584 1 2 3\n", "t in seconds"),
        ("t,north,east,height\n0,1,2,3\n", "its columns are"),
        ("1e999980 1 2 3\n" * 3, "line 1"),
        ("1e-999980 1 2 3\n" * 3, "line 1"),
        ("0 1 2 3\n2 1 2 3\n1 1 2 3\n", "stamps must increase"),
        ("0 1 2 3\n1 nan 2 3\n2 1 2 3\n", "measurement 2 is not finite"),
        ("0 1 2 3 0 0 0 1\n1 1 2 3 0 0 0 0\n2 1 2 3 0 0 0 1\n", "length 0"),
        ("0 1 2 3 10 20 30 40\n" + "1 1 2 3 0 0 0 1\n2 1 2 3 0 0 0 1\n", "unit quaternions"),
        ("nan 1 2 3\n1 1 2 3\n2 1 2 3\n", "line 1"),
        (b"\xff\xfe\x00", "not readable"),
    ],
)
def test_other_formats_are_refused_with_what_was_found(track, content, says):
    with pytest.raises(InputError, match=says):
        track(content)


EUROC = """#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], v_RS_R_x [m s^-1]
1403715524907143168,1,2,3,0.5,0.1,-0.7,-0.5,9
1403715524912143104,2,3,4,1,0,0,0,9
1403715524917143040,4,5,6,1,0,0,0,9
"""


def test_columns_in_another_order_are_read_by_their_names(track):
    found = track(EUROC)
    assert found.origin_ns == 1403715524907143168
    assert found.times[1] == pytest.approx(0.004999936, abs=1e-12)
    assert found.positions.tolist() == [[1, 2, 3], [2, 3, 4], [4, 5, 6]]
    np.testing.assert_allclose(found.quats_xyzw[0], [0.1, -0.7, -0.5, 0.5], atol=1e-12)
    named = track("t,x,y,z,qw,qx,qy,qz\n0,1,2,3,1,0,0,0\n1,2,3,4,0,1,0,0\n2,4,5,6,1,0,0,0\n")
    assert named.quats_xyzw.tolist() == [[0, 0, 0, 1], [1, 0, 0, 0], [0, 0, 0, 1]]


def test_of_measurements_with_one_stamp_the_first_is_taken_and_the_rest_counted(track):
    found = track("0 1 2 3\n0 9 9 9\n0 9 9 9\n1 2 3 4\n2 4 5 6\n")
    assert found.positions.tolist() == [[1, 2, 3], [2, 3, 4], [4, 5, 6]]
    assert found.n_repeats == 2


def test_a_device_is_no_trajectory():
    with pytest.raises(InputError):
        read_track(Path("/dev/zero"))


def test_a_missing_file_is_an_input_error(tmp_path):
    with pytest.raises(InputError, match="not readable"):
        read_track(tmp_path / "nowhere.txt")


@settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    st.one_of(st.binary(max_size=200), st.text(alphabet="0123456789.eE+-, \n#tnaif", max_size=200))
)
def test_whatever_the_bytes_are_the_answer_is_a_track_or_an_input_error(track, content):
    try:
        found = track(content)
    except InputError:
        return
    assert np.isfinite(found.times).all()
    assert np.isfinite(found.positions).all()


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.integers(0, 200))
def test_a_truncated_file_is_read_up_to_there_or_refused(track, cut):
    text = "".join(f"{i} {i}.5 2.25 3.125 0 0 0 1\n" for i in range(10))
    with contextlib.suppress(InputError):
        assert len(track(text[:cut]).times) <= 10


def test_silences_of_the_stamps_are_not_bridged():
    stamps = np.concatenate([np.arange(0, 5, 0.1), np.arange(9, 12, 0.1)])
    asked = np.array([-0.1, 0.05, 4.9, 5.5, 8.9, 9.0, 11.95, 12.0])
    assert bridges(stamps, asked).tolist() == [True, False, False, True, True, False, True, True]
