# SPDX-License-Identifier: MIT OR Apache-2.0
"""Commands with inputs of which each has one kind of fault: one sentence, bounded memory, no bug."""

import bz2
import os
import struct

import pytest

from campaign.watched import run

MOST_MB = 500


def bomb(folder):
    """A bag of some kilobytes with a chunk of gigabytes."""
    packer = bz2.BZ2Compressor()
    data = b"".join(packer.compress(bytes(2**24)) for _ in range(60)) + packer.flush()
    fields = [b"op=\5", b"compression=bz2", b"size=\0\0\0\0"]
    header = b"".join(struct.pack("<I", len(field)) + field for field in fields)
    record = struct.pack("<I", len(header)) + header + struct.pack("<I", len(data)) + data
    (folder / "bomb.bag").write_bytes(b"#ROSBAG V2.0\n" + record)
    return ["info", folder / "bomb.bag"]


def zeros(folder):
    with (folder / "zeros.bag").open("wb") as file:
        file.truncate(3 * 2**30)
    return ["info", folder / "zeros.bag"]


def deep(folder):
    (folder / "deep.yaml").write_text("a: " + "[" * 20_000)
    return ["map", folder / "none.bag", "-p", folder / "deep.yaml", "-o", folder / "run"]


def device(folder):
    return ["map", folder / "none.bag", "-p", "/dev/zero", "-o", folder / "run"]


def threads(folder):
    return ["map", folder / "none.bag", "-o", folder / "run", "--threads", "100000"]


def endless_line(folder):
    with (folder / "poses.txt").open("wb") as file:
        file.truncate(2**30)
    (folder / "good.txt").write_text("0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n")
    given = ["--reference-trajectory", folder / "poses.txt", "-o", folder / "out"]
    return ["evaluate", folder / "good.txt", *given]


def hole(name, head, *before, after=()):
    """A file of 3 GB of which nothing but the beginning was written."""

    def fault(folder):
        with (folder / name).open("wb") as file:
            file.write(head)
            file.truncate(3 * 2**30)
        outputs = [] if before[0] == "info" else ["-o", folder / "out"]
        return [*before, folder / name, *after, *outputs]

    fault.__name__ = f"hole in {name}"
    return fault


def wide_pcd(folder):
    """Points of 10,000 columns, a million in each part."""
    names = " ".join(["x", "y", "z", *(f"c{i}" for i in range(9_997))])
    ones, head = " ".join(["1"] * 10_000), f"FIELDS {names}\nSIZE "
    fours, kinds = " ".join(["4"] * 10_000), " ".join(["F"] * 10_000)
    text = f"{head}{fours}\nTYPE {kinds}\nCOUNT {ones}\nPOINTS 100000000\nDATA ascii\n"
    with (folder / "wide.pcd").open("wb") as file:
        file.write(text.encode() + b"1 " * 400_000)
    return ["evaluate", folder / "wide.pcd", "-o", folder / "out"]


def pipe(folder):
    os.mkfifo(folder / "map.laz")
    return ["evaluate", folder / "map.laz", "-o", folder / "out"]


PCAP = b"\xd4\xc3\xb2\xa1" + struct.pack("<HHiIII", 2, 4, 0, 0, 65535, 1)
PCD = b"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nPOINTS 100000000\nDATA ascii\n"
PLY = b"ply\nformat ascii 1.0\nelement vertex 100000000\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
HOLES = [
    hole("hole.mcap", b"\x89MCAP0\r\n", "info"),
    hole("hole.pcap", PCAP, "info"),
    hole("hole.db3", b"SQLite format 3\0", "info"),
    hole("hole.bag", b"#ROSBAG V2.0\n", "info"),
    hole("hole.pcd", PCD, "evaluate"),
    hole("hole.ply", PLY, "evaluate"),
    hole("hole.las", b"LASF", "evaluate"),
    hole("hole.laz", b"", "evaluate"),
    hole("hole.e57", b"ASTM-E57", "evaluate"),
    hole("hole.txt", b"", "evaluate"),
]


@pytest.mark.parametrize(
    "fault",
    [
        *(bomb, zeros, deep, device, threads, endless_line, wide_pcd, pipe),
        *(pytest.param(fault, marks=pytest.mark.slow) for fault in HOLES),
    ],
    ids=lambda fault: fault.__name__,
)
def test_a_faulty_input_ends_in_one_sentence_and_little_memory(fault, tmp_path):
    ended = run(fault(tmp_path))
    assert ended.code in {2, 3}, ended.said
    # `info` may have a page about what it could read.
    n_sentences = ended.said.count("bentwing: error:") + ended.said.count("not fit for mapping")
    assert n_sentences == 1, ended.said
    assert "Traceback" not in ended.said
    assert ended.peak_mb < MOST_MB, ended


def test_a_simulation_that_was_killed_leaves_nothing_in_the_way(tmp_path):
    command = [
        "simulate",
        "office",
        "--duration",
        "22",
        "--head",
        "hokuyo-nod",
        "-o",
        tmp_path / "a",
    ]

    def kill_once_it_writes(process):
        while not list(tmp_path.glob("a/.files.partial/recording.bag")):
            assert process.poll() is None
        process.kill()

    assert run(command, meanwhile=kill_once_it_writes).code == -9
    assert not (tmp_path / "a" / "recording.bag").exists()
    assert run(command).code == 0
    assert (tmp_path / "a" / "recording.bag").exists()
    assert not list(tmp_path.glob("a/.*"))
