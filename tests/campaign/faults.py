# SPDX-License-Identifier: MIT OR Apache-2.0
"""Faults by kind: each makes, from a seed, a command whose input or surroundings are wrong."""

from __future__ import annotations

import os
import shutil
import signal
import struct
import subprocess
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from subprocess import Popen
from typing import TYPE_CHECKING, Any

from campaign.messages import rewritten
from campaign.options import hostile_option, whole
from campaign.usual import RESUMED, WRITERS, Usual, usual
from campaign.watched import run

if TYPE_CHECKING:
    import random

Disturb = Callable[["Popen[bytes]"], None]
RECORDINGS = ("recording.bag", "recording.mcap")
MEGABYTE = 2**20

_STARTS = 0.3  # s, in which Python itself starts, before any program can say that it is interrupted


@dataclass(frozen=True, slots=True)
class Healthy:
    """What faults are made of: a simulated recording as bag and MCAP, and a run of it.

    Attributes
    ----------
    folder : of the recordings, their payload and their truth
    run : a finished run of the bag
    """

    folder: Path
    run: Path

    @property
    def recordings(self) -> list[str]:
        """Names of the recordings that there are."""
        return [name for name in RECORDINGS if (self.folder / name).exists()]

    def later(self) -> Path:
        """Return a run of a later part of the bag, made when it is first asked for."""
        later = self.run.with_name("later")
        if not later.exists():
            ended = run(_map(self.folder / RECORDINGS[0], self, later, "--start", "6"))
            assert ended.code == 0, ended.said
        return later

    @property
    def payload(self) -> Path:
        """The description of the head."""
        return self.folder / "payload.yaml"


@dataclass(frozen=True, slots=True)
class Attempt:
    """A command to try.

    Attributes
    ----------
    command : arguments of `bentwing`
    out : the folder of its results, if it has one
    meanwhile : disturbs the process
    limits : resource limits of the process: name and value
    again : a command that is run afterwards, undisturbed, and has to end well
    second : a command that is run at the same time
    usual : what the command makes undisturbed, in the folder that the fault was given
    before_again, cleanup : are called before `again`, and at the end
    """

    command: list[Any]
    out: Path | None = None
    meanwhile: Disturb | None = None
    limits: tuple[tuple[str, int], ...] = ()
    again: list[Any] | None = None
    second: list[Any] | None = None
    usual: Usual | None = None
    before_again: Callable[[], None] | None = None
    cleanup: Callable[[], None] | None = None


def _map(recording: Path, healthy: Healthy, out: Path, *more: Any) -> list[Any]:
    return ["map", recording, "-p", healthy.payload, "-o", out, "--duration", "6", "-q", *more]


def _damaged(source: Path, target: Path, draw: random.Random) -> Path:
    """A copy with flipped bits, bytes lost, bytes repeated, a hole, or its end cut off."""
    data = bytearray(source.read_bytes())
    kind = draw.choice(["flips", "lost", "repeated", "hole", "cut", "swapped"])
    at = draw.randrange(len(data))
    size = min(draw.choice([1, 8, 1000, 100_000]), len(data) - at)
    if kind == "flips":
        for _ in range(draw.choice([1, 10, 1000])):
            data[draw.randrange(len(data))] ^= 1 << draw.randrange(8)
    elif kind == "lost":
        del data[at : at + size]
    elif kind == "repeated":
        data[at:at] = data[at : at + size]
    elif kind == "hole":
        data[at : at + size] = bytes(size)
    elif kind == "cut":
        del data[at:]
    else:
        data[at : at + size] = draw.randbytes(size)
    target.write_bytes(data)
    return target


def in_bytes(healthy: Healthy, folder: Path, draw: random.Random) -> Attempt:
    """Any input of any command with its bytes damaged."""
    name = draw.choice(
        [*healthy.recordings, "payload.yaml", "map.laz", "trajectory.txt", "run.json"]
    )
    if name in RECORDINGS:
        given = _damaged(healthy.folder / name, folder / name, draw)
        command = draw.choice(
            [_map(given, healthy, folder / "run"), ["info", given, "-p", healthy.payload]]
        )
        return Attempt(command, folder / "run" if command[0] == "map" else None)
    if name == "payload.yaml":
        given = _damaged(healthy.payload, folder / name, draw)
        return Attempt(["info", healthy.folder / RECORDINGS[0], "-p", given])
    if name == "run.json":
        run = _copied(healthy.run, folder / "given")
        _damaged(run / name, run / name, draw)
        return Attempt(["evaluate", run, "-o", folder / "out", "-q"], folder / "out")
    given = _damaged(healthy.run / name, folder / name, draw)
    option = "--reference-map" if name == "map.laz" else "--reference-trajectory"
    good = healthy.run / name
    command = draw.choice([["evaluate", given], ["evaluate", good, option, given]])
    return Attempt([*command, "-o", folder / "out", "-q"], folder / "out")


def in_messages(healthy: Healthy, folder: Path, draw: random.Random) -> Attempt:
    """Messages that are wrong: numbers, stamps, sizes, or that are not there."""
    bag = rewritten(healthy.folder / RECORDINGS[0], folder / RECORDINGS[0], draw)
    if draw.random() < 0.3:
        return Attempt(["info", bag, "-p", healthy.payload])
    return Attempt(_map(bag, healthy, folder / "run"), folder / "run")


def in_headers(healthy: Healthy, folder: Path, draw: random.Random) -> Attempt:
    """Numbers in an input that announce what is not there: sizes, counts, offsets."""
    name = draw.choice([*healthy.recordings, "map.laz"])
    source = healthy.run / name if name == "map.laz" else healthy.folder / name
    data = bytearray(source.read_bytes())
    for _ in range(draw.choice([1, 3])):
        form = draw.choice(["<I", "<Q", "<H", "<q"])
        span = draw.choice([400, len(data) - 8, 100_000])
        at = draw.randrange(min(span, len(data) - 8))
        values = [0, 1, 2**31 - 1, 2**32 - 1, 2**62, 2**64 - 1, len(data)]
        size = struct.calcsize(form)
        data[at : at + size] = (draw.choice(values) & (2 ** (8 * size) - 1)).to_bytes(
            size, "little"
        )
    (folder / name).write_bytes(data)
    if name == "map.laz":
        command = ["evaluate", folder / name, "-o", folder / "out", "-q"]
        return Attempt(command, folder / "out")
    return Attempt(_map(folder / name, healthy, folder / "run"), folder / "run")


def in_options(healthy: Healthy, folder: Path, draw: random.Random) -> Attempt:
    """A value that an option or a setting should not have."""
    return Attempt(hostile_option(healthy, folder, draw), None)


def in_paths(healthy: Healthy, folder: Path, draw: random.Random) -> Attempt:
    """A device, a pipe, a socket, a folder, a hole of gigabytes, a loop of links, or an odd name."""
    os.mkfifo(folder / "pipe.bag")
    (folder / "loop.bag").symlink_to(folder / "loop.bag")
    (folder / "folder.bag").mkdir()
    with (folder / "hole.bag").open("wb") as hole:
        hole.write((healthy.folder / RECORDINGS[0]).read_bytes()[:5000])
        hole.truncate(3 * 2**30)
    names = ["pipe", "loop", "folder", "hole"]
    path = folder / f"{draw.choice(names)}.bag"
    odd = [
        "/dev/zero",
        "/dev/full",
        "/proc/self/mem",
        folder / "a\nb.bag",
        os.fsdecode(b"h\xf6hle.bag"),
    ]
    path = draw.choice([path, draw.choice(odd)])
    for suffix in ("laz", "yaml", "txt", "mcap", "pcap", "csv", "json"):
        link = folder / f"link.{suffix}"
        if "\n" not in str(path) and str(path).isprintable():
            link.symlink_to(path)
    out, bag = folder / "out", healthy.folder / RECORDINGS[0]
    commands: list[list[Any]] = [
        ["info", path],
        _map(path, healthy, out),
        ["map", bag, "-p", path, "-o", out],
        ["map", bag, "-p", healthy.payload, "-o", out, "--control-points", path],
        ["map", bag, "-p", healthy.payload, "-o", out, "--settings", path],
        ["localize", bag, "-p", healthy.payload, "-o", out, "--map", folder / "link.laz"],
        ["evaluate", folder / "link.laz", "-o", out],
        ["evaluate", healthy.run / "trajectory.txt", "--reference-trajectory", path, "-o", out],
        ["evaluate", healthy.run / "map.laz", "--reference-map", folder / "link.laz", "-o", out],
        ["evaluate", path, "-o", out],
        ["merge", path, healthy.run, "-o", out],
        ["view", path, "--save", folder / "run.rrd"],
        ["info", folder / "link.mcap"],
        ["info", folder / "link.pcap"],
        ["plan", path],
    ]
    return Attempt(draw.choice(commands), out)


def in_permissions(healthy: Healthy, folder: Path, draw: random.Random) -> Attempt:
    """A folder that is a file, belongs to something else, or lies where nothing can be made."""
    out = folder / "out"
    kind = draw.choice(["file", "other", "in_file", "proc"])
    if kind == "file":
        out.write_text("mine")
    elif kind == "other":
        out.mkdir()
        (out / "thesis.txt").write_text("mine")
    elif kind == "in_file":
        (folder / "file").write_text("mine")
        out = folder / "file" / "out"
    else:
        out = Path("/proc/out")
    bag = healthy.folder / RECORDINGS[0]
    command = draw.choice(
        [
            _map(bag, healthy, out),
            ["evaluate", healthy.run, "-o", out],
            ["simulate", "office", "--duration", "22", "-o", out, "-q"],
            ["calibrate", bag, "-p", healthy.payload, "-o", out],
            ["merge", healthy.run, "-o", out],
        ]
    )
    return Attempt(command)


def in_disk(healthy: Healthy, folder: Path, draw: random.Random) -> Attempt:
    """The disk is full: a small one where one can be mounted, else no file may become large."""
    size, disk = int(10 ** draw.uniform(3.5, 7.0)), folder / "disk"
    disk.mkdir()
    if not _mounted("-t", "tmpfs", "-o", f"size={size}", "tmpfs", disk):
        command = _map(healthy.folder / RECORDINGS[0], healthy, folder / "run")
        limits = (("RLIMIT_FSIZE", size),)
        return Attempt(command, folder / "run", limits=limits, again=[*command, "--resume"])
    command = _map(healthy.folder / RECORDINGS[0], healthy, disk / "run")
    return Attempt(
        command,
        disk / "run",
        again=[*command, "--resume"],
        before_again=lambda: _require(_mounted("-o", "remount,size=200m", disk)),
        cleanup=lambda: _require(_done("umount", "-l", disk)),
    )


def _mounted(*arguments: str | Path) -> bool:
    return hasattr(os, "geteuid") and os.geteuid() == 0 and _done("mount", *arguments)


def _done(*command: str | Path) -> bool:
    try:
        return subprocess.run(command, check=False, capture_output=True).returncode == 0
    except OSError:
        return False


def _require(is_done: bool) -> None:
    assert is_done


def in_time(healthy: Healthy, folder: Path, draw: random.Random) -> Attempt:
    """The command is killed, or asked to end, at any moment."""
    number = draw.choice([signal.SIGKILL, signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
    name = draw.choice(WRITERS)
    undisturbed = usual(name, healthy)
    after = _STARTS + draw.uniform(0.0, 1.1) * undisturbed.seconds
    command = whole(name, healthy, folder)

    def end(process: Popen[bytes]) -> None:
        until = time.monotonic() + after
        while process.poll() is None and time.monotonic() < until:
            time.sleep(0.01)
        if process.poll() is None:
            process.send_signal(number)

    again = [*command, "--resume"] if name in RESUMED else command
    return Attempt(command, folder / "out", end, again=again, usual=undisturbed)


def in_use(healthy: Healthy, folder: Path, draw: random.Random) -> Attempt:
    """The recording changes while it is mapped: cut off, written over, replaced, or removed."""
    bag = folder / RECORDINGS[0]
    shutil.copy(healthy.folder / RECORDINGS[0], bag)
    kind, after = draw.choice(["cut", "over", "replaced", "removed"]), draw.uniform(2.0, 9.0)

    def change(process: Popen[bytes]) -> None:
        until = time.monotonic() + after
        while process.poll() is None and time.monotonic() < until:
            time.sleep(0.01)
        if process.poll() is not None:
            return
        if kind == "cut":
            os.truncate(bag, bag.stat().st_size // 2)
        elif kind == "over":
            with bag.open("r+b") as file:
                file.seek(bag.stat().st_size // 2)
                file.write(bytes(MEGABYTE))
        elif kind == "replaced":
            other = folder / "other.bag"
            shutil.copy(healthy.folder / RECORDINGS[0], other)
            other.replace(bag)
        else:
            bag.unlink()

    return Attempt(_map(bag, healthy, folder / "run"), folder / "run", change)


def of_two(healthy: Healthy, folder: Path, draw: random.Random) -> Attempt:
    """Two commands write into one folder."""
    del draw
    command = _map(healthy.folder / RECORDINGS[0], healthy, folder / "run")
    return Attempt(command, folder / "run", second=command)


def _copied(source: Path, target: Path) -> Path:
    shutil.copytree(source, target)
    return target


KINDS: dict[str, Callable[[Healthy, Path, random.Random], Attempt]] = {
    "messages": in_messages,
    "bytes": in_bytes,
    "headers": in_headers,
    "options": in_options,
    "paths": in_paths,
    "permissions": in_permissions,
    "disk": in_disk,
    "kill": in_time,
    "change": in_use,
    "writers": of_two,
}
