# SPDX-License-Identifier: MIT OR Apache-2.0
"""A scenario in, a recording with its truth out; it enters the house by the front door."""
