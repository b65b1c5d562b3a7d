# SPDX-License-Identifier: MIT OR Apache-2.0
"""Captures: which datagrams come out, and what is said of files that are none."""

from __future__ import annotations

import pytest

from bentwing.base.errors import RecordingError
from bentwing.recording.containers.source import open_source

NS = 1_700_000_000 * 10**9


def read(path):
    source = open_source([path])
    names = {topic.name for topic in source.topics}
    return list(source.messages(names)), source


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize(
    ("magic", "stamp_ns"), [(0xA1B2C3D4, NS + 123_456_000), (0xA1B23C4D, NS + 123_456_789)]
)
def test_a_datagram_comes_with_its_address_port_and_exact_time(
    tmp_path, packets, order, magic, stamp_ns
):
    frames = [(stamp_ns, packets.ethernet(packets.udp(b"hello")[0]))]
    path = packets.write_pcap(tmp_path / "a.pcap", frames, magic=magic, order=order)
    messages, source = read(path)
    assert messages == [("192.168.1.201:2368", stamp_ns, b"hello")]
    assert (source.start_ns, source.cdr, source.warnings) == (stamp_ns, False, [])


@pytest.mark.parametrize(
    ("link", "head"),
    [
        (1, bytes(12) + b"\x08\x00"),
        (1, bytes(12) + b"\x81\x00\x00\x07\x08\x00"),
        (1, bytes(12) + b"\x88\xa8\x00\x07\x81\x00\x00\x07\x08\x00"),
        (101, b""),
        (113, bytes(14) + b"\x08\x00"),
        (276, b"\x08\x00" + bytes(18)),
        (0, b"\x02\x00\x00\x00"),
    ],
    ids=["ethernet", "vlan", "two vlans", "raw", "linux any", "linux any 2", "loopback"],
)  # fmt: skip
def test_every_usual_link_type_is_read(tmp_path, packets, link, head):
    frames = [(NS, head + packets.udp(b"hello")[0])]
    messages, _ = read(packets.write_pcap(tmp_path / "a.pcap", frames, link=link))
    assert [data for _, _, data in messages] == [b"hello"]


def test_padding_of_short_frames_is_left_out(tmp_path, packets):
    frames = [(NS, packets.ethernet(packets.udp(b"hi")[0]) + bytes(16))]
    messages, _ = read(packets.write_pcap(tmp_path / "a.pcap", frames))
    assert messages[0][2] == b"hi"


@pytest.mark.parametrize("reverse", [False, True])
def test_fragments_are_joined(tmp_path, packets, reverse):
    payload = bytes(i % 251 for i in range(12608))
    fragments = packets.udp(payload, identity=7)
    assert len(fragments) == 9
    ordered = fragments[::-1] if reverse else fragments
    frames = [(NS + i, packets.ethernet(fragment)) for i, fragment in enumerate(ordered)]
    messages, _ = read(packets.write_pcap(tmp_path / "a.pcap", frames, magic=0xA1B23C4D))
    assert messages == [("192.168.1.201:2368", NS + 8, payload)]


def test_datagrams_with_missing_fragments_are_counted_and_memory_stays_bounded(tmp_path, packets):
    frames = [
        (NS + i, packets.ethernet(packets.udp(bytes(4000), identity=i)[0])) for i in range(200)
    ]
    _, source = read(packets.write_pcap(tmp_path / "a.pcap", frames, magic=0xA1B23C4D))
    assert [(topic.name, topic.count) for topic in source.topics] == [("incomplete datagrams", 136)]


def test_other_traffic_is_counted(tmp_path, packets):
    frames = [
        (NS, packets.ethernet(bytes(28), protocol=0x0806)),
        (NS, packets.ethernet(packets.udp(bytes(512), port=8308)[0])),
        (NS, packets.ethernet(packets.udp(bytes(100))[0][:60])),
        (NS, b""),
    ]
    _, source = read(packets.write_pcap(tmp_path / "a.pcap", frames))
    assert {(topic.name, topic.type): topic.count for topic in source.topics} == {
        ("other frames", "other/not_udp"): 2,
        ("192.168.1.201:8308", "udp/other"): 1,
        ("incomplete datagrams", "udp/incomplete"): 1,
    }


@pytest.mark.parametrize("cut", [1, 10, 60])
def test_a_truncated_capture_is_read_to_where_it_ends(tmp_path, packets, cut):
    frames = [(NS + i * 10**9, packets.ethernet(packets.udp(b"hello")[0])) for i in range(3)]
    path = packets.write_pcap(tmp_path / "a.pcap", frames)
    path.write_bytes(path.read_bytes()[:-cut])
    messages, source = read(path)
    assert len(messages) == 2
    (warning,) = source.warnings
    assert "cut off at byte" in warning
    assert "2 messages of 1.0 s before that are used" in warning


def test_damage_ends_the_reading(tmp_path, packets):
    frames = [(NS, packets.ethernet(packets.udp(b"hello")[0]))] * 2
    path = packets.write_pcap(tmp_path / "a.pcap", frames)
    path.write_bytes(path.read_bytes() + b"\xff" * 40)
    messages, source = read(path)
    assert len(messages) == 2
    assert "damaged at byte" in source.warnings[0]


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"\x0a\x0d\x0d\x0a" + bytes(40), "pcapng format.*`editcap -F pcap a.pcap a-old.pcap`"),
        (b"", "not a pcap capture.*nothing"),
        (b"#ROSBAG V2.0\n" + bytes(40), "not a pcap capture.*tcpdump"),
        (b"\xd4\xc3\xb2\xa1" + bytes(16) + b"\x69\0\0\0", "link type 105.*network interface"),
        (b"\xd4\xc3\xb2\xa1" + bytes(16) + b"\x01\0\0\0", "without a single frame"),
    ],
)  # fmt: skip
def test_what_is_no_capture_gets_one_sentence(tmp_path, content, sentence):
    path = tmp_path / "a.pcap"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=sentence) as raised:
        open_source([path])
    assert str(path) in str(raised.value)
    assert "\n" not in str(raised.value)
