# SPDX-License-Identifier: MIT OR Apache-2.0
"""What real sensors do that ideal ones do not: one effect a file, each with its own draw.

Sizes are those of the usual sensor at level 1 and grow in proportion to the level.
`docs/commands/simulate.md` lists all effects with their sizes and sources.
"""
