# SPDX-License-Identifier: MIT OR Apache-2.0
"""Recording files and the description of the sensor head in, batches in time order out."""
