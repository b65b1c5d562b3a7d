# SPDX-License-Identifier: MIT OR Apache-2.0
"""Batches in, trajectory and calibration out; nothing downstream knows which estimator ran."""
