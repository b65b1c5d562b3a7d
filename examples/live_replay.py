# SPDX-License-Identifier: MIT OR Apache-2.0
"""Replay a recording as if its sensors delivered now, and watch the pose and the map come.

    python examples/live_replay.py recording.bag --payload payload.yaml

One thread feeds by the stamps, another asks for the pose 200 times a second. The map grows in the
rerun viewer (`pip install 'bentwing[view]'`), in a file with `--save out.rrd`, or with `--foxglove 8765`
in Foxglove, which connects to that port (`pip install 'bentwing[foxglove]'`); `--no-viewer` only prints
how old poses are, how long a call takes, and, with the truth, how wrong they are.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from threading import Event, Thread
from typing import TYPE_CHECKING

import numpy as np

import bentwing
from bentwing import Trajectory, read_tum
from bentwing.evaluate import absolute_error
from bentwing.flight import FoxgloveServer
from bentwing.odometry import ContinuousSettings
from bentwing.recording import LidarBatch

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bentwing.flight import StampedPose
    from bentwing.recording import Batch

POSE_RATE_HZ = 200.0
SCAN = 0.025  # s, of points that are fed together
MAP_INTERVAL = 0.25  # s of wall time between updates of the viewer


class Replay:
    """Feeds a recording by its stamps from a thread of its own, and remembers when.

    Attributes
    ----------
    fed : last stamp of each piece of points, s, and the wall time at which it was fed
    done : set when there is nothing left
    """

    def __init__(
        self, recording: bentwing.Recording, odometry: bentwing.Odometry, speed: float
    ) -> None:
        self.fed: list[tuple[float, float]] = []
        self.done = Event()
        self._recording = recording
        self._odometry = odometry
        self._speed = speed
        self._thread = Thread(target=self._run, name="sensors", daemon=True)

    def start(self) -> None:
        """Begin to feed."""
        self._thread.start()

    def _run(self) -> None:
        begin = time.perf_counter()
        try:
            for stamp, feed in pieces(self._recording, self._odometry):
                time.sleep(max(0.0, begin + stamp / self._speed - time.perf_counter()))
                if feed():
                    self.fed.append((stamp, time.perf_counter()))
        finally:
            self.done.set()


def pieces(recording: bentwing.Recording, odometry: bentwing.Odometry) -> Iterator[tuple]:
    """Yield when to feed what: single inertial samples, and the points of a scan."""
    for batch in recording.batches():
        for part in parts(batch):
            yield float(part[0][-1]), lambda part=part, batch=batch: add(odometry, batch, part)


def parts(batch: Batch) -> list[tuple[np.ndarray, ...]]:
    """Cut a batch as the drivers of its sensor would."""
    names = {"LidarBatch": ("points",), "ImuBatch": ("gyro", "accel"), "EncoderBatch": ("angles",)}
    arrays = [batch.times, *(getattr(batch, name) for name in names[type(batch).__name__])]
    if hasattr(batch, "points"):
        cuts = np.arange(batch.times[0], batch.times[-1], SCAN)[1:]
        rows = np.searchsorted(batch.times, cuts)
    else:
        rows = np.arange(1, len(batch.times))
    split = [np.split(array, rows) for array in arrays]
    return [part for part in zip(*split, strict=True) if len(part[0])]


def add(odometry: bentwing.Odometry, batch: Batch, part: tuple[np.ndarray, ...]) -> bool:
    """Feed one piece; returns whether it was points."""
    if isinstance(batch, LidarBatch):
        odometry.feed(LidarBatch(part[1], part[0]))
        return True
    odometry.feed(type(batch)(*part))
    return False


class Viewer:
    """The map, the way and the pose in rerun; nothing without a viewer."""

    def __init__(self, save: Path | None, *, shown: bool) -> None:
        self._rerun = None
        self._part = 0
        self._way: list[np.ndarray] = []
        self._next = 0.0
        if not shown:
            return
        import rerun

        self._rerun = rerun
        rerun.init("bentwing live", spawn=save is None)
        if save is not None:
            rerun.save(save)
        rerun.log("map", rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)

    def show(self, odometry: bentwing.Odometry, pose: StampedPose) -> None:
        """Show what is new, at most every `MAP_INTERVAL`."""
        rerun, now = self._rerun, time.perf_counter()
        if rerun is None or now < self._next:
            return
        self._next = now + MAP_INTERVAL
        rerun.set_time("recording", duration=pose.time)
        update = odometry.new_points()
        if update.replaces:
            rerun.log("map/points", rerun.Clear(recursive=True))
        if len(update.points):
            colors = height_colors(update.points[:, 2])
            cloud = rerun.Points3D(update.points, colors=colors, radii=-1.5)
            rerun.log(f"map/points/{self._part}", cloud)
            self._part += 1
        self._way.append(pose.position)
        rerun.log("map/way", rerun.LineStrips3D([np.array(self._way)]))
        rotation = rerun.Quaternion(xyzw=pose.quat_xyzw)
        rerun.log("map/imu", rerun.Transform3D(translation=pose.position, quaternion=rotation))
        rerun.log("map/imu", rerun.TransformAxes3D(0.5))
        rerun.log("status", rerun.TextLog(odometry.status))


def height_colors(heights: np.ndarray) -> np.ndarray:
    """Blue below, yellow above, repeating every six metres."""
    share = np.abs((heights / 3.0) % 2.0 - 1.0)[:, None]
    return (share * [40, 60, 160] + (1 - share) * [250, 220, 70]).astype(np.uint8)


def watch(
    odometry: bentwing.Odometry, replay: Replay, viewer: Viewer | FoxgloveServer
) -> tuple[list[StampedPose], np.ndarray]:
    """Ask for the pose until nothing more comes.

    Returns poses and for each when it was had, how long the call took, both s, and whether the
    calibration was known.
    """
    poses, calls = [], []
    turn = time.perf_counter()
    while not replay.done.is_set():
        turn = max(turn + 1 / POSE_RATE_HZ, time.perf_counter())
        time.sleep(max(0.0, turn - time.perf_counter()))
        if odometry.status == "waiting":
            continue
        before = time.perf_counter()
        pose = odometry.pose()
        after = time.perf_counter()
        poses.append(pose)
        calls.append((after, after - before, odometry.status != "initializing"))
        viewer.show(odometry, pose)
    return poses, np.array(calls)


def report(poses: list[StampedPose], calls: np.ndarray, fed: list[tuple[float, float]]) -> None:
    """Print the latencies."""
    ages = np.array([pose.predicted for pose in poses])
    registered = np.array([pose.time for pose in poses]) - ages
    stamps, fed_at = np.array(fed).T
    first = np.searchsorted(registered, stamps)
    seen = (first < len(registered)) & (stamps > registered[0])
    print(f"first pose     {poses[0].time:8.2f} s after the first sample")
    print(f"{'':38s}{'p50':>9s}{'p95':>9s}{'p99':>9s}{'max':>9s}")
    print_row("one call of pose()", "ms", calls[:, 1] * 1e3)
    print_row("age of the newest window", "s", ages)
    print_row("from a scan to a pose that has it", "s", calls[first[seen], 0] - fed_at[seen])


def report_error(
    poses: list[StampedPose], learned: np.ndarray, final: Trajectory, truth: Trajectory
) -> None:
    """Print how far the poses were from the truth, and how they stepped at new windows."""
    times, index = np.unique([pose.time for pose in poses], return_index=True)
    known = truth.covers(times)
    times, index = times[known], index[known]
    chosen, learned = [poses[i] for i in index], learned[index]
    positions = np.array([pose.position for pose in chosen])
    alignment = absolute_error(final, truth).alignment
    right, _ = truth.interpolate(times)
    errors = np.linalg.norm(positions @ alignment.R.T + alignment.t - right, axis=1)
    expected = np.array([pose.velocity for pose in chosen])[1:] * np.diff(times)[:, None]
    steps = np.linalg.norm(np.diff(positions, axis=0) - expected, axis=1)
    newer = np.diff(times - [pose.predicted for pose in chosen]) > 1e-3
    for when, some in (("initializing", ~learned), ("afterwards", learned)):
        print_row(f"error of the pose, {when}", "mm", errors[some] * 1e3)
        print_row(f"step at a window, {when}", "mm", steps[newer & some[1:]] * 1e3)


def print_row(name: str, unit: str, values: np.ndarray) -> None:
    """Print percentiles."""
    if not len(values):
        return
    numbers = "".join(f"{v:9.3f}" for v in (*np.percentile(values, [50, 95, 99]), values.max()))
    print(f"{f'{name}, {unit}':38s}{numbers}")


def main() -> None:
    """Replay, and print what it was like."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recording", type=Path)
    parser.add_argument("--payload", type=Path, required=True)
    parser.add_argument("--speed", type=float, default=1.0, help="times as fast as recorded")
    parser.add_argument("--shift", type=float, help="new data per window, s")
    parser.add_argument("--save", type=Path, metavar="OUT.rrd", help="instead of the viewer")
    parser.add_argument("--foxglove", type=int, metavar="PORT", help="instead of the viewer")
    parser.add_argument("--no-viewer", action="store_true")
    parser.add_argument("--reference-trajectory", type=Path, metavar="TUM", help="the truth")
    asked = parser.parse_args()
    payload = bentwing.Payload.load(asked.payload)
    settings = (
        ContinuousSettings() if asked.shift is None else ContinuousSettings(shift=asked.shift)
    )
    with (
        bentwing.Recording(asked.recording, payload) as recording,
        bentwing.Odometry(payload, settings=settings) as odometry,
    ):
        if asked.foxglove is None:
            viewer = Viewer(asked.save, shown=not asked.no_viewer)
        else:
            viewer = FoxgloveServer(asked.foxglove, start_ns=recording.start_ns)
        replay = Replay(recording, odometry, asked.speed)
        replay.start()
        poses, calls = watch(odometry, replay, viewer)
        final = odometry.finish().trajectory
        if not poses:
            raise SystemExit("the recording ended before the start was found")
        report(poses, calls, replay.fed)
        print(f"{len(odometry.map_points())} points in the map; {odometry.counts}")
        if asked.reference_trajectory is not None:
            truth, _ = read_tum(asked.reference_trajectory, recording.clock.start_ns)
            report_error(poses, calls[:, 2] > 0, final, truth)


if __name__ == "__main__":
    main()
