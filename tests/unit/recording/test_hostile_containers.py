# SPDX-License-Identifier: MIT OR Apache-2.0
"""Files that announce more than they hold, and files that change while they are read."""

import bz2
import resource
import struct
import sys

import pytest

from bentwing.base.errors import InputError, RecordingError
from bentwing.base.yaml_files import read_yaml
from bentwing.recording.containers.decompress import decompressed
from bentwing.recording.containers.source import open_source

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd


def field(name, value):
    return struct.pack("<I", len(name) + 1 + len(value)) + name + b"=" + value


def record(data, **fields):
    header = b"".join(field(name.encode(), value) for name, value in fields.items())
    return struct.pack("<I", len(header)) + header + struct.pack("<I", len(data)) + data


def peak():
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


@pytest.mark.parametrize("compression", ["bz2", "zstd"])
def test_a_chunk_that_decompresses_to_more_than_it_may_is_refused(compression):
    zeros = bytes(2**22)
    packed = bz2.compress(zeros) if compression == "bz2" else zstd.compress(zeros)
    assert decompressed(compression, packed, 2**22) == zeros
    for most in (2**22 - 1, 1000):
        with pytest.raises(ValueError, match=f"more than the {most} bytes"):
            decompressed(compression, packed, most)
    with pytest.raises(ValueError, match="too early"):
        decompressed(compression, packed[:-20], 2**22)


def test_a_bag_of_a_few_bytes_does_not_fill_the_memory(tmp_path):
    packer = bz2.BZ2Compressor()
    bomb = b"".join(packer.compress(bytes(2**22)) for _ in range(200)) + packer.flush()
    path = tmp_path / "bomb.bag"
    chunk = record(bomb, op=b"\5", compression=b"bz2", size=bytes(4))
    path.write_bytes(b"#ROSBAG V2.0\n" + chunk)
    before = peak()
    with pytest.raises(RecordingError, match="a chunk of more than"):
        open_source([path])
    assert peak() - before < 4e8


def test_a_file_of_zeros_is_refused_without_reading_it(tmp_path):
    path = tmp_path / "zeros.bag"
    with path.open("wb") as file:
        file.truncate(2**32)
    before = peak()
    with pytest.raises(RecordingError, match="not a ROS 1 bag"):
        open_source([path])
    assert peak() - before < 2**26


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("a: " + "[" * 10_000, "more than 50 sections"),
        ("a: &a [1]\nb: [*a, *a]\n", "alias"),
        ("#" * 2**21, "has more than"),
    ],
)
def test_yaml_that_grows_when_it_is_read_is_refused(tmp_path, text, problem):
    path = tmp_path / "payload.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=problem):
        read_yaml(path, "", InputError)


@pytest.mark.parametrize("change", ["cut", "replace", "delete"])
def test_a_recording_that_changes_between_passes_is_refused(change, simulated, tmp_path):
    path = tmp_path / "recording.bag"
    path.write_bytes((simulated("office", 22.0) / "recording.bag").read_bytes())
    source = open_source([path])
    topics = {topic.name for topic in source.topics}
    assert sum(1 for _ in source.messages(topics)) == sum(t.count for t in source.topics)
    if change == "cut":
        with path.open("rb+") as file:
            file.truncate(path.stat().st_size // 2)
    elif change == "replace":
        (tmp_path / "other").write_bytes(path.read_bytes())
        (tmp_path / "other").replace(path)
    else:
        path.unlink()
    with pytest.raises(RecordingError, match=r"recording\.bag: (has changed|is gone)"):
        list(source.messages(topics))
    source.close()


def test_a_recording_that_is_cut_during_a_pass_is_refused(simulated, tmp_path):
    path = tmp_path / "recording.bag"
    path.write_bytes((simulated("office", 22.0) / "recording.bag").read_bytes())
    source = open_source([path])
    messages = source.messages({topic.name for topic in source.topics})
    for _ in range(10):
        next(messages)
    with path.open("rb+") as file:
        file.truncate(path.stat().st_size // 2)
    with pytest.raises(RecordingError, match="has changed"):
        list(messages)
    source.close()
