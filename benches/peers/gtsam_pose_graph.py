# SPDX-License-Identifier: MIT OR Apache-2.0
"""GTSAM on the pose graph of an .npz file: answers each line `file` or `chordal` with cost and time.

Its `BetweenFactor` has the residual `Log(measured⁻¹ · actual)`, rotation first, as ours.
"""

from __future__ import annotations

import json
import math
import sys
import time

import gtsam
import numpy as np

HELD = gtsam.noiseModel.Isotropic.Sigma(6, 1e-3)  # the first node, of which nothing pulls


def pose(position, quat_xyzw):
    x, y, z, w = quat_xyzw
    return gtsam.Pose3(gtsam.Rot3.Quaternion(w, x, y, z), gtsam.Point3(*position))


def load(path):
    arrays = np.load(path)
    graph, initial = gtsam.NonlinearFactorGraph(), gtsam.Values()
    for key, parts in enumerate(zip(arrays["positions"], arrays["quats_xyzw"], strict=True)):
        initial.insert(key, pose(*parts))
    measured = zip(arrays["measured_positions"], arrays["measured_quats_xyzw"], strict=True)
    for (i, j), parts, information in zip(
        arrays["nodes"], measured, arrays["information"], strict=True
    ):
        # An information of less than full rank has no noise model; a trace of rank changes no cost.
        ridge = 1e-9 * information.trace() * np.eye(6)
        noise = gtsam.noiseModel.Gaussian.Information(information + ridge)
        graph.add(gtsam.BetweenFactorPose3(int(i), int(j), pose(*parts), noise))
    graph.add(gtsam.PriorFactorPose3(0, initial.atPose3(0), HELD))
    return graph, initial


def run(graph, initial, start):
    began = time.perf_counter()
    try:
        values = gtsam.InitializePose3.initialize(graph) if start == "chordal" else initial
        values = gtsam.LevenbergMarquardtOptimizer(graph, values).optimize()
    except RuntimeError:  # an indeterminate system, on graphs where the chordal start fails
        return math.inf, time.perf_counter() - began
    return graph.error(values), time.perf_counter() - began


def main():
    graph, initial = load(sys.argv[1])
    print(json.dumps(["file", "chordal"]), flush=True)
    for line in sys.stdin:
        print(json.dumps(run(graph, initial, line.strip())), flush=True)


if __name__ == "__main__":
    main()
