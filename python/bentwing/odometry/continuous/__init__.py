# SPDX-License-Identifier: MIT OR Apache-2.0
"""The continuous-time estimator: a sliding window of surfel registration (Kaul 2015)."""
