# SPDX-License-Identifier: MIT OR Apache-2.0
"""Live use: batches as the sensors deliver them in, the pose now and the map so far out."""
