# SPDX-License-Identifier: MIT OR Apache-2.0
"""Commands with inputs of which each has one kind of fault: one sentence, bounded memory, no bug."""

import bz2
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


@pytest.mark.parametrize("fault", [bomb, zeros, deep, device, threads, endless_line])
def test_a_faulty_input_ends_in_one_sentence_and_little_memory(fault, tmp_path):
    ended = run(fault(tmp_path))
    assert ended.code in {2, 3}, ended.said
    assert len([line for line in ended.said.splitlines() if "error" in line]) == 1, ended.said
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
