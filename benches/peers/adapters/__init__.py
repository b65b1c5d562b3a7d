# SPDX-License-Identifier: MIT OR Apache-2.0
"""One adapter per interface: `run(feed, engine)` yields (stamp in ns, pose (4, 4) of the body)."""
