# SPDX-License-Identifier: MIT OR Apache-2.0
"""Every reader of files: with any bytes changed, it reads the file or raises an error of ours.

Inputs that once broke one stay as `@example`.
"""

from __future__ import annotations

import struct

import numpy as np
import pytest
from hypothesis import example, given

from bentwing.base.covariances import PoseCovariances
from bentwing.base.errors import BentwingError
from bentwing.base.run_record import finished_record, read_record
from bentwing.base.trajectory import Trajectory
from bentwing.base.tum import read_poses
from bentwing.closing.georeference.control_point_file import read_control_points
from bentwing.closing.pose_graph import read_g2o
from bentwing.evaluate.track import read_track
from bentwing.map.chunk import MapChunk
from bentwing.map.read import read_points
from bentwing.map.read_mesh import read_mesh
from bentwing.map.writer import open_map
from bentwing.recording import Payload
from bentwing.recording.containers.source import open_source
from bentwing.run.choose import read_settings
from bentwing.run.settings import RunSettings
from support.changed_bytes import EDITS, SHARED, changed, outcome

N = 40


def cloud(path):
    rng = np.random.default_rng(0)
    with open_map(path, path.suffix[1:], 10**18) as writer:
        points, times = rng.uniform(-5, 5, (N, 3)), np.sort(rng.uniform(0, 9, N))
        writer.write(MapChunk(points, times, np.full(N, 3, np.float32)))


def compressed_pcd(path):
    columns = np.arange(3 * N, dtype="<f4").tobytes()
    packed = b"".join(bytes([19]) + columns[k : k + 20] for k in range(0, len(columns), 20))
    header = (
        f"VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {N}\nHEIGHT 1\n"
        f"POINTS {N}\nDATA binary_compressed\n"
    )
    path.write_bytes(header.encode() + struct.pack("<II", len(packed), len(columns)) + packed)


def text_pcd(path):
    rows = "\n".join("1.5 2 3" for _ in range(N))
    path.write_text(
        f"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nPOINTS {N}\nDATA ascii\n{rows}\n"
    )


def mesh(path):
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()
    faces = struct.pack("<B3I", 3, 0, 1, 2)
    header = (
        "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        "property float z\nelement face 1\nproperty list uchar uint vertex_indices\nend_header\n"
    )
    path.write_bytes(header.encode() + vertices + faces)


def poses(path):
    times = np.arange(8) * 0.1
    quats = np.tile([0.0, 0.0, 0.0, 1.0], (8, 1))
    Trajectory(times, np.ones((8, 3)), quats).write_tum(path, 10**18)


def covariances(path):
    PoseCovariances(np.arange(4) * 1.0, np.tile(np.eye(6), (4, 1, 1))).write(path, 10**18)


def graph(path):
    upper = " ".join(str(float(i == j)) for i in range(6) for j in range(i, 6))
    path.write_text(
        "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 1 0 0 0 0 0.1 1\nFIX 0\n"
        f"EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1 {upper}\n"
    )


def bag(path):
    from rosbags.rosbag1 import Writer

    with Writer(path) as writer:
        known = writer.add_connection("/s", "std_msgs/msg/String", msgdef="string data", md5sum="0")
        for i in range(9):
            writer.write(known, 10**18 + i, struct.pack("<I", 3) + b"abc")


def mcap(path):
    def record(kind, content):
        return struct.pack("<BQ", kind, len(content)) + content

    def text(value):
        return struct.pack("<I", len(value)) + value

    schema = record(3, struct.pack("<H", 1) + text(b"std_msgs/msg/String") + text(b"") + text(b""))
    channel = record(4, struct.pack("<HH", 1, 1) + text(b"/s") + text(b"cdr") + bytes(4))
    messages = [record(5, struct.pack("<HIQQ", 1, i, 10**18 + i, 0) + b"abc") for i in range(9)]
    inside = schema + channel + b"".join(messages)
    chunk = struct.pack("<QQQI", 0, 0, len(inside), 0) + text(b"") + struct.pack("<Q", len(inside))
    path.write_bytes(b"\x89MCAP0\r\n" + record(6, chunk + inside) + record(15, bytes(4)))


def pcap(path):
    payload = bytes([255, 238]) + bytes(1204)
    udp = struct.pack(">HHHH", 2368, 2368, 8 + len(payload), 0) + payload
    ip = struct.pack(
        ">BBHHHBBH4s4s", 69, 0, 20 + len(udp), 0, 0, 9, 17, 0, b"\1\1\1\1", b"\2\2\2\2"
    )
    frame = bytes(12) + b"\x08\0" + ip + udp
    head = b"\xd4\xc3\xb2\xa1" + struct.pack("<HHiIII", 2, 4, 0, 0, 65535, 1)
    records = [struct.pack("<IIII", 1, i, len(frame), len(frame)) + frame for i in range(3)]
    path.write_bytes(head + b"".join(records))


def run_folder(path):
    path.write_text(
        '{"kind": "bentwing run", "complete": true, "files": ["map.laz"], "hashes": {"map.laz": '
        '{"bytes": 3, "sha256": "0"}}, "settings": {}, "segments": [[0.0, 1.0]], "start_ns": 5}'
    )


def read_folder(path):
    read_record(path.parent)
    finished_record(path.parent)


def drain(path):
    source = open_source([path])
    try:
        for _ in source.messages([topic.name for topic in source.topics]):
            pass
    finally:
        source.close()


READERS = {
    "map.las": (cloud, read_points),
    "map.laz": (cloud, read_points),
    "map.ply": (cloud, read_points),
    "map.pcd": (cloud, read_points),
    "compressed.pcd": (compressed_pcd, read_points),
    "text.pcd": (text_pcd, read_points),
    "mesh.ply": (mesh, read_mesh),
    "map.e57": (cloud, read_points),
    "poses.txt": (poses, read_poses),
    "track.txt": (poses, read_track),
    "covariances.txt": (covariances, lambda path: PoseCovariances.read(path, 10**18)),
    "graph.g2o": (graph, read_g2o),
    "marks.csv": (
        lambda path: path.write_text("id,x,y,z,radius,use\na,1,2,3,0.5,check\nb,1,2,3,0.5,\n"),
        read_control_points,
    ),
    "payload.yaml": (lambda path: path.write_text(Payload.default().to_yaml()), Payload.load),
    "settings.yaml": (lambda path: path.write_text(RunSettings().to_yaml()), read_settings),
    "run.json": (run_folder, read_folder),
    "a.bag": (bag, drain),
    "a.mcap": (mcap, drain),
    "a.pcap": (pcap, drain),
}


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """The bytes of a sound file for each reader, which reads it."""
    folder, found = tmp_path_factory.mktemp("sound"), {}
    for name, (write, read) in READERS.items():
        if name.endswith(".e57"):
            pytest.importorskip("pye57", reason="the extra `e57` is not installed")
        path = folder / name
        write(path)
        (folder / "map.laz").touch()
        if name != "run.json":
            read(path)
        found[name] = path.read_bytes()
    return found


@pytest.mark.parametrize("name", READERS)
@SHARED
@given(edits=EDITS)
# sizes of layers and of chunks in LAZ, by which a decoder makes room or gives up
@example(edits=[("number", 0.9, 5)])
@example(edits=[("number", 0.99, 10)])
@example(edits=[("cut", 0.0, 0)])
@example(edits=[("text", 0.5, 7)])
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_a_file_with_changed_bytes_is_read_or_refused(tmp_path, sound, name, edits):
    path = tmp_path / name
    path.write_bytes(changed(sound[name], edits))
    assert outcome(READERS[name][1], path) in {None, BentwingError}
