# SPDX-License-Identifier: MIT OR Apache-2.0
"""How long the registration of one scan takes: `ndt` beside VGICP of small_gicp, on one thread.

Both get the same scans of a simulated VLP-16 without motion in them, voxels of the same edge filled from
the same true poses, and a start that is off by 5 cm and 0.5°. small_gicp (`pip install small_gicp`) is
the yardstick because it is known to be several times faster than PCL's NDT.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

from benches.support import tables
from bentwing import _core
from bentwing.base import geometry
from bentwing.base.mount import Pose
from bentwing.base.trajectory import read_tum
from bentwing.evaluate.simulated import true_calibration
from bentwing.odometry.buffer import BatchBuffer
from bentwing.odometry.core_states import core_globals, core_samples
from bentwing.odometry.ndt.keyframes import ROUGHNESS
from bentwing.odometry.ndt.matching import (
    INDEPENDENCE,
    ROTATION_SIGMA,
    SPACING,
    TRANSLATION_SIGMA,
)
from bentwing.odometry.ndt.settings import NdtSettings
from bentwing.recording import Payload, Recording
from bentwing.recording.preprocess import preprocess
from bentwing.simulate import Scenario, simulate

# s: length of a scan, where they begin, how long they make the map
SCAN, FIRST, MAPPED = 0.1, 10.0, 2.0
NEIGHBOURS = 10
COLUMNS = ("engine", "prepare, ms", "register, ms", "both, ms", "error, mm", "error, °")


def scans(folder: Path, seconds: float) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Points in the IMU frame at the middle of each scan, and the true position and attitude there."""
    payload = Payload.load(folder / "payload.yaml")
    head = core_globals(true_calibration(folder))
    buffer, found = BatchBuffer(), []
    with Recording(folder / "recording.bag", payload) as recording:
        truth, _ = read_tum(folder / "truth_trajectory.txt", recording.clock.start_ns)
        for batch in preprocess(recording.batches(), payload, Counter()):
            buffer.add(batch)
    samples = core_samples(truth)
    for start in np.arange(FIRST, FIRST + seconds - SCAN, SCAN):
        part = buffer.lidar(start, start + SCAN)
        p, q = (v[0] for v in truth.interpolate(np.array([start + SCAN / 2])))
        in_map = samples.place(part.points, part.times, part.angles, head, threads=1)
        found.append((geometry.rotate(geometry.inverse(q), in_map - p), p, q))
    return found


def main() -> None:
    """Print medians per scan, and errors."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", default="courtyard")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--voxel", type=float, default=NdtSettings().voxel_size, help="m")
    options = parser.parse_args()
    import small_gicp

    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "flight"
        simulate(
            Scenario(scene=options.scene, head="vlp16-fixed", duration=24.0, seed=options.seed),
            folder,
        )
        found = scans(folder, MAPPED + 3.0)
        sigma = Payload.load(folder / "payload.yaml").lidar.range_sigma
    n_mapped = round(MAPPED / SCAN)
    settings = NdtSettings(voxel_size=options.voxel)
    ours = _core.NdtReference(
        voxel_size=options.voxel, n_levels=settings.n_levels, sigma=sigma, roughness=ROUGHNESS
    )
    theirs = small_gicp.GaussianVoxelMap(options.voxel)
    for points, p, q in found[:n_mapped]:
        ours.insert(points, (p.tolist(), q.tolist()), lidar=p.tolist(), threads=1)
        theirs.insert(
            small_gicp.preprocess_points(points, SPACING, NEIGHBOURS, 1)[0], Pose(p, q).matrix
        )
    rng = np.random.default_rng(options.seed)
    rows: dict[str, list[tuple[float, float, float, float]]] = {"ndt": [], "small_gicp VGICP": []}
    for points, p, q in found[n_mapped:]:
        start_p = p + 0.05 * _direction(rng)
        start_q = geometry.multiply(geometry.exp(np.radians(0.5) * _direction(rng)), q)
        began = time.process_time()
        chosen = points[_core.thin_points(points, spacing=SPACING, most=settings.max_points)]
        thinned = time.process_time()
        fit = ours.register(
            chosen, (start_p.tolist(), start_q.tolist()), rotation_sigma=ROTATION_SIGMA,
            translation_sigma=TRANSLATION_SIGMA, independence=INDEPENDENCE, threads=1,
        )  # fmt: skip
        done = time.process_time()
        rows["ndt"].append(
            (thinned - began, done - thinned, *_errors(fit.translation, fit.quat_xyzw, p, q))
        )
        began = time.process_time()
        cloud, _ = small_gicp.preprocess_points(points, SPACING, NEIGHBOURS, 1)
        thinned = time.process_time()
        T = small_gicp.align(
            theirs, cloud, Pose(start_p, start_q).matrix, num_threads=1
        ).T_target_source
        done = time.process_time()
        turned = geometry.from_matrices(T[:3, :3])
        rows["small_gicp VGICP"].append(
            (thinned - began, done - thinned, *_errors(T[:3, 3], turned, p, q))
        )
    print(tables.head(COLUMNS))
    for name, values in rows.items():
        prepare, register, shift, turn = np.median(np.array(values), axis=0)
        times = [f"{1e3 * t:.1f}" for t in (prepare, register, prepare + register)]
        print(tables.line([name, *times, f"{1e3 * shift:.1f}", f"{np.degrees(turn):.3f}"]))


def _direction(rng: np.random.Generator) -> np.ndarray:
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def _errors(
    p: np.ndarray, q: np.ndarray, true_p: np.ndarray, true_q: np.ndarray
) -> tuple[float, float]:
    turn = geometry.log(geometry.multiply(q, geometry.inverse(true_q)))
    return float(np.linalg.norm(p - true_p)), float(np.linalg.norm(turn))
