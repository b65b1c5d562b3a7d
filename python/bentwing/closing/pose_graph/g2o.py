# SPDX-License-Identifier: MIT OR Apache-2.0
"""Pose graphs as `.g2o` files: `VERTEX_SE3:QUAT`, `EDGE_SE3:QUAT` and `FIX`.

A file gives information matrices translation first and for the vector part of the error's quaternion; as
in GTSAM they are taken for the logarithm of the error, and reordered to rotation first.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.atomic import write_text
from bentwing.base.errors import InputError
from bentwing.base.regular_file import require_regular
from bentwing.closing.pose_graph.graph import (
    MAP,
    Links,
    PoseGraph,
    nearest_semidefinite,
    semidefinite,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

_VERTEX, _EDGE, _FIX = "VERTEX_SE3:QUAT", "EDGE_SE3:QUAT", "FIX"
_ROTATION_FIRST = np.array([3, 4, 5, 0, 1, 2])
_UPPER = np.triu_indices(6)
_N_POSE, _N_INFORMATION = 7, 21
_MOST_BYTES = 2**30
_LONGEST_LINE = 10_000  # characters; what is longer is read as several lines


@dataclass(frozen=True, slots=True)
class G2oGraph:
    """A pose graph with what its file said besides.

    Attributes
    ----------
    graph : nodes in the order of the file; links between neighbours in that order are trusted; the
        first node is fixed where no `FIX` names one
    ids : (N,) int64, the file's numbers of the nodes
    unknown_tags : how many lines had a tag that is not understood, by tag
    n_repaired : information matrices that were not positive semidefinite and became the nearest that is
    """

    graph: PoseGraph
    ids: NDArray[np.int64]
    unknown_tags: dict[str, int]
    n_repaired: int


def read_g2o(path: Path | str) -> G2oGraph:
    """Read a pose graph.

    Parameters
    ----------
    path : file to read

    Raises
    ------
    InputError
        If the file cannot be read, a line is incomplete or not finite, a quaternion has no length,
        a node appears twice, or a link names a node that is not there.
    """
    path = Path(path)
    lines = _Lines(path)
    require_regular(path, _MOST_BYTES)
    try:
        with path.open(encoding="utf-8") as file:
            for number, line in enumerate(iter(lambda: file.readline(_LONGEST_LINE), ""), start=1):
                lines.take(number, line)
    except (OSError, UnicodeDecodeError) as error:
        msg = f"{path}: not readable as a pose graph ({error})"
        raise InputError(msg) from error
    return lines.finished()


class _Lines:
    """The lines of a file, sorted by what they say."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._rows: dict[int, int] = {}
        self._poses: list[list[float]] = []
        self._edges: list[tuple[int, int, int]] = []
        self._measured: list[list[float]] = []
        self._fixed: list[tuple[int, int]] = []
        self._unknown: Counter[str] = Counter()

    def take(self, number: int, line: str) -> None:
        """Take the line with this number, from 1."""
        tag, *fields = line.split() or ["#"]
        if tag == _VERTEX:
            (node,), values = self._parsed(number, line, fields, 1, _N_POSE)
            if node in self._rows:
                self._refuse(number, f"node {node} appears a second time")
            self._rows[node] = len(self._poses)
            self._poses.append(values)
        elif tag == _EDGE:
            (start, end), values = self._parsed(number, line, fields, 2, _N_POSE + _N_INFORMATION)
            self._edges.append((number, start, end))
            self._measured.append(values)
        elif tag == _FIX:
            nodes, _ = self._parsed(number, line, fields, max(len(fields), 1), 0)
            self._fixed += [(number, node) for node in nodes]
        elif not tag.startswith("#"):
            self._unknown[tag] += 1

    def finished(self) -> G2oGraph:
        """Return the graph of all lines taken."""
        if not self._poses:
            msg = f"{self._path}: holds no pose; expected lines of `{_VERTEX} id x y z qx qy qz qw`"
            raise InputError(msg)
        poses = np.array(self._poses)
        fixed = np.zeros(len(poses), np.bool_)
        fixed[[self._row(number, node) for number, node in self._fixed] or [0]] = True
        links, n_repaired = self._links()
        graph = PoseGraph(poses[:, :3].copy(), poses[:, 3:].copy(), links, fixed)
        return G2oGraph(
            graph, np.array(list(self._rows), np.int64), dict(self._unknown), n_repaired
        )

    def _links(self) -> tuple[Links, int]:
        nodes = np.array(
            [(self._row(n, start), self._row(n, end)) for n, start, end in self._edges], np.int64
        ).reshape(-1, 2)
        measured = np.array(self._measured).reshape(-1, _N_POSE + _N_INFORMATION)
        upper = np.zeros((len(nodes), 6, 6))
        upper[:, _UPPER[0], _UPPER[1]] = measured[:, _N_POSE:]
        full = upper + np.triu(upper, 1).swapaxes(1, 2)
        information = full[:, _ROTATION_FIRST][:, :, _ROTATION_FIRST]
        wrong = ~semidefinite(information)
        information[wrong] = nearest_semidefinite(information[wrong])
        links = Links(
            nodes,
            measured[:, :3].copy(),
            measured[:, 3:_N_POSE].copy(),
            np.ascontiguousarray(information),
            np.abs(nodes[:, 1] - nodes[:, 0]) == 1,
        )
        return links, int(np.count_nonzero(wrong))

    def _parsed(
        self, number: int, line: str, fields: list[str], n_nodes: int, n_values: int
    ) -> tuple[list[int], list[float]]:
        """Numbers of nodes, then a pose with a unit quaternion and what else there is."""
        try:
            nodes = [int(field) for field in fields[:n_nodes]]
            values = [float(field) for field in fields[n_nodes:]]
            complete = len(nodes) == n_nodes and len(values) == n_values
        except ValueError:
            complete = False
        if not complete or not np.isfinite(values).all() or any(abs(n) >= 2**63 for n in nodes):
            tag = line.split()[0]
            wanted = f"{n_nodes} node numbers and {n_values} finite values after {tag}"
            self._refuse(number, f"expected {wanted}, found {line[:80]!r}")
        if n_values:
            length = float(np.linalg.norm(values[3:_N_POSE]))
            if not 0.0 < length < np.inf:
                self._refuse(number, "the quaternion has no length")
            values[3:_N_POSE] = [value / length for value in values[3:_N_POSE]]
        return nodes, values

    def _row(self, number: int, node: int) -> int:
        if node not in self._rows:
            self._refuse(number, f"node {node} has no {_VERTEX} line")
        return self._rows[node]

    def _refuse(self, number: int, what: str) -> None:
        msg = f"{self._path}, line {number}: {what}"
        raise InputError(msg)


def write_g2o(path: Path | str, graph: PoseGraph, ids: NDArray[np.int64] | None = None) -> None:
    """Write a pose graph, atomically; the numbers are exact.

    Parameters
    ----------
    path : file to write
    graph : without priors and gravity terms, for which the format has no lines
    ids : (N,) int64, numbers of the nodes in the file; default: from 0

    Raises
    ------
    ValueError
        If the graph has priors or gravity terms.
    """
    if len(graph.gravity.nodes) or (graph.links.nodes == MAP).any():
        msg = "graph: g2o files hold neither priors nor gravity terms"
        raise ValueError(msg)
    names = (np.arange(len(graph)) if ids is None else ids).tolist()
    poses = np.hstack([graph.positions, graph.quats_xyzw]).tolist()
    lines = [_line(_VERTEX, [name], pose) for name, pose in zip(names, poses, strict=True)]
    lines += [_line(_FIX, [names[row]], []) for row in np.flatnonzero(graph.fixed).tolist()]
    links = graph.links
    information = links.information[:, _ROTATION_FIRST][:, :, _ROTATION_FIRST]
    values = np.hstack(
        [links.positions, links.quats_xyzw, information[:, _UPPER[0], _UPPER[1]]]
    ).tolist()
    for (start, end), row in zip(links.nodes.tolist(), values, strict=True):
        lines.append(_line(_EDGE, [names[start], names[end]], row))
    write_text(Path(path), "".join(lines))


def _line(tag: str, nodes: list[int], values: list[float]) -> str:
    return " ".join([tag, *map(str, nodes), *map(repr, values)]) + "\n"
