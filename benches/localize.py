# SPDX-License-Identifier: MIT OR Apache-2.0
"""A flight localized in the map of another one, against the truth of both.

    python benches/localize.py courtyard office --seeds 871 872

Errors are those in the frame that the first flight's map has against its truth, nothing is aligned again.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scoring import in_flight, mapped_points, read_scene

from bentwing.base import geometry
from bentwing.base.trajectory import read_tum
from bentwing.evaluate.map import surface_error
from bentwing.evaluate.trajectory import absolute_error
from bentwing.run.pipeline import map_recording
from bentwing.simulate import Scenario, simulate


def main() -> None:
    args = parsed()
    print("| scene, seed | map given | across the spin axis | along it | map | appeared | time |")
    print("|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for scene in args.scenes:
            for seed in args.seeds:
                compare(scene, seed, Path(folder) / f"{scene}-{seed}", args.duration)


def compare(scene: str, seed: int, folder: Path, duration: float) -> None:
    """Map one flight, localize another one in it, and print a row for the run and for its cloud."""
    recordings = [folder / f"flight{n}" for n in (1, 2)]
    for n, out in enumerate(recordings, 1):
        simulate(Scenario(scene=scene, seed=seed, flight_seed=n, duration=duration), out)
    site = folder / "site"
    map_recording(recordings[0] / "recording.bag", recordings[0] / "payload.yaml", site)
    for prior in (site, site / "map.laz"):
        out, started = folder / f"in-{prior.stem}", time.perf_counter()
        payload = recordings[1] / "payload.yaml"
        map_recording(recordings[1] / "recording.bag", payload, out, prior_map=prior)
        elapsed = time.perf_counter() - started
        found = errors(out, recordings[1], site, recordings[0])
        record = json.loads((out / "run.json").read_text())["localization"]
        print(
            f"| {scene}, {seed} | {'run' if prior == site else 'cloud'} "
            f"| {100 * found.across:.2f} cm | {100 * found.along:.2f} cm "
            f"| {100 * found.std:.2f} cm "
            f"| {record['appeared']} | {elapsed:.0f} s |",
            flush=True,
        )


@dataclass(frozen=True, slots=True)
class Errors:
    """Of the IMU's positions in flight (root mean square), and of the map's points (standard deviation), m."""

    across: float
    along: float
    std: float


def errors(localized: Path, recording: Path, site: Path, surveyed: Path) -> Errors:
    """Compare a localized run with its truth, in the frame of the site."""
    T = alignment(site, surveyed)
    truth, origin_ns = read_tum(recording / "truth_trajectory.txt")
    found, _ = read_tum(localized / "trajectory.txt", origin_ns)
    flight = in_flight(truth)
    kept = truth.covers(found.times) & (found.times >= flight[0]) & (found.times <= flight[1])
    positions, quats = truth.interpolate(found.times[kept])
    off = found.positions[kept] @ T.R.T + T.t - positions
    axis = geometry.rotate(quats, np.tile([0.0, 0.0, 1.0], (len(quats), 1)))
    along = (off * axis).sum(axis=1)
    across = np.linalg.norm(off - along[:, None] * axis, axis=1)
    points = mapped_points(localized / "map.laz", origin_ns, flight) @ T.R.T + T.t
    scene = read_scene(recording / "truth_scene.ply")
    surface = surface_error(scene.distance(np.ascontiguousarray(points))[0])
    return Errors(rms(across), rms(along), surface.std)


def alignment(run: Path, recording: Path):
    """Where a run's frame is in that of its truth."""
    truth, origin_ns = read_tum(recording / "truth_trajectory.txt")
    found, _ = read_tum(run / "trajectory.txt", origin_ns)
    return absolute_error(found, truth, during=in_flight(truth)).alignment


def rms(values) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", default=["courtyard", "office", "forest", "cave"])
    parser.add_argument("--seeds", nargs="+", type=int, default=[1])
    parser.add_argument("--duration", type=float, default=40.0)
    return parser.parse_args()


if __name__ == "__main__":
    main()
