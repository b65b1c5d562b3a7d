# SPDX-License-Identifier: MIT OR Apache-2.0
"""g2o files of any content either give a graph or an error that names file and line."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bentwing.base.errors import InputError
from bentwing.closing.pose_graph import (
    MAP,
    Links,
    PoseGraph,
    nearest_semidefinite,
    read_g2o,
    write_g2o,
)

IDENTITY = " ".join(str(float(i == j)) for i in range(6) for j in range(i, 6))
VALID = (
    "# a comment\nVERTEX_SE3:QUAT 7 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 3 1 0 0 0 0 0.1 1\nFIX 3\n"
    f"EDGE_SE3:QUAT 7 3 1 0 0 0 0 0 2 {IDENTITY}\nVERTEX_XY 4 1 2\nVERTEX_XY 5 1 2\n"
)
shared = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)


@pytest.fixture
def read(tmp_path):
    def read(text, encoding="utf-8"):
        path = tmp_path / "graph.g2o"
        path.write_bytes(text.encode(encoding) if isinstance(text, str) else text)
        return read_g2o(path)

    return read


def test_a_file_says_nodes_links_what_is_fixed_and_what_was_not_understood(read):
    found = read(VALID)
    assert found.ids.tolist() == [7, 3]
    assert found.graph.fixed.tolist() == [False, True]
    assert found.graph.links.nodes.tolist() == [[0, 1]]
    assert found.graph.links.quats_xyzw.tolist() == [[0, 0, 0, 1]]
    assert found.unknown_tags == {"VERTEX_XY": 2}
    assert found.n_repaired == 0


def test_without_a_fix_the_first_node_is_fixed(read):
    assert read(VALID.replace("FIX 3\n", "")).graph.fixed.tolist() == [True, False]


def test_information_becomes_rotation_first(read):
    upper = np.triu(np.arange(1.0, 37).reshape(6, 6) / 100) + 10 * np.eye(6)
    text = " ".join(map(str, upper[np.triu_indices(6)]))
    information = read(VALID.replace(IDENTITY, text)).graph.links.information[0]
    full = upper + np.triu(upper, 1).T
    np.testing.assert_array_equal(information[:3, :3], full[3:, 3:])
    np.testing.assert_array_equal(information[3:, 3:], full[:3, :3])
    np.testing.assert_array_equal(information[:3, 3:], full[3:, :3])


def test_an_indefinite_information_is_repaired_and_counted(read):
    found = read(VALID.replace(IDENTITY, "-1 " + IDENTITY.split(" ", 1)[1]))
    assert found.n_repaired == 1
    assert np.linalg.eigvalsh(found.graph.links.information[0]).min() >= 0


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("EDGE_SE3:QUAT 7 3", "EDGE_SE3:QUAT 7 9", "line 5: node 9 has no VERTEX_SE3:QUAT line"),
        ("FIX 3", "FIX 8", "line 4: node 8 has no"),
        ("FIX 3", "FIX", "line 4: expected 1 node numbers"),
        ("QUAT 3 1 0", "QUAT 7 1 0", "line 3: node 7 appears a second time"),
        ("QUAT 3 1 0", "QUAT 3 nan 0", "line 3: expected 1 node numbers and 7 finite values"),
        ("QUAT 3 1 0", "QUAT 3.5 1 0", "line 3: expected"),
        ("0 0 2 1.0", "0 0 0 1.0", "line 5: the quaternion has no length"),
    ],
)
def test_an_error_names_file_and_line(read, old, new, message):
    assert old in VALID
    with pytest.raises(InputError, match=rf"graph\.g2o, {message}"):
        read(VALID.replace(old, new, 1))


def test_a_file_without_poses_or_that_is_not_there_is_an_input_error(read, tmp_path):
    with pytest.raises(InputError, match="holds no pose"):
        read("# nothing\n")
    with pytest.raises(InputError, match="not readable as a pose graph"):
        read_g2o(tmp_path / "absent.g2o")


def graph_or_none(read, content):
    try:
        return read(content).graph
    except InputError as error:
        if "graph.g2o" not in str(error):
            raise
        return None


@shared
@given(cut=st.integers(0, len(VALID)))
def test_a_file_cut_anywhere_gives_a_graph_or_an_input_error(read, cut):
    graph = graph_or_none(read, VALID[:cut])
    assert graph is None or len(graph) in {1, 2}


@shared
@given(place=st.integers(0, len(VALID) - 1), junk=st.binary(min_size=1, max_size=8))
def test_garbage_anywhere_gives_a_graph_or_an_input_error(read, place, junk):
    data = VALID.encode()
    graph = graph_or_none(read, data[:place] + junk + data[place + len(junk) :])
    assert graph is None or np.isfinite(graph.positions).all()


@shared
@given(data=st.data(), n=st.integers(2, 5), n_links=st.integers(0, 6))
def test_what_is_written_is_read_back_exactly(tmp_path, data, n, n_links):
    seed = data.draw(st.integers(0, 2**32 - 1))
    rng = np.random.default_rng(seed)
    scale = 10.0 ** data.draw(st.integers(-6, 6))
    factors = rng.normal(size=(n_links, 6, 6)) * scale
    ends = [data.draw(st.permutations(range(n)))[:2] for _ in range(n_links)]
    links = Links(
        np.array(ends, np.int64).reshape(-1, 2),
        rng.normal(size=(n_links, 3)) * scale,
        unit(rng, n_links),
        nearest_semidefinite(factors @ factors.swapaxes(1, 2)),
        np.zeros(n_links, bool),
    )
    fixed = rng.random(n) < 0.5
    fixed[0] = True
    graph = PoseGraph(rng.normal(size=(n, 3)) * scale, unit(rng, n), links, fixed)
    ids = np.array(data.draw(st.lists(st.integers(0, 10**9), min_size=n, max_size=n, unique=True)))
    write_g2o(tmp_path / "written.g2o", graph, ids)
    found = read_g2o(tmp_path / "written.g2o")
    np.testing.assert_array_equal(found.ids, ids)
    np.testing.assert_array_equal(found.graph.positions, graph.positions)
    np.testing.assert_array_equal(found.graph.fixed, fixed)
    np.testing.assert_array_equal(found.graph.links.nodes, links.nodes)
    np.testing.assert_allclose(found.graph.quats_xyzw, graph.quats_xyzw, atol=1e-15)
    upper = np.triu_indices(6)
    written = links.information[:, upper[0], upper[1]]
    read = found.graph.links.information[:, upper[0], upper[1]]
    np.testing.assert_allclose(read, written, atol=1e-9 * scale**2)


def unit(rng, n):
    quats = rng.normal(size=(n, 4))
    return quats / np.linalg.norm(quats, axis=1, keepdims=True)


def test_priors_have_no_line_and_are_refused(tmp_path):
    links = Links(
        np.array([[MAP, 0]]),
        np.zeros((1, 3)),
        np.array([[0, 0, 0, 1.0]]),
        np.eye(6)[None],
        np.ones(1, bool),
    )
    graph = PoseGraph(np.zeros((1, 3)), np.array([[0, 0, 0, 1.0]]), links, np.zeros(1, bool))
    with pytest.raises(ValueError, match="neither priors nor gravity"):
        write_g2o(tmp_path / "graph.g2o", graph)
