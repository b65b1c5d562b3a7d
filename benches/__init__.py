# SPDX-License-Identifier: MIT OR Apache-2.0
"""Benches: what bentwing reaches and costs, each by one command (`python -m benches`)."""
