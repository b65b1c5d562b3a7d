# SPDX-License-Identifier: MIT OR Apache-2.0
"""Changes of the bytes of sound files, and what their readers make of them.

The changes are the same in every run, unless `HYPOTHESIS_EXAMPLES` says how many others are tried for each
reader.
"""

from __future__ import annotations

import os

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from bentwing.base.errors import BentwingError

NUMBERS = (0, 1, 255, 2**15, 2**31 - 1, 2**32 - 1, 2**63 - 1, 2**64 - 1)
ASKED = os.environ.get("HYPOTHESIS_EXAMPLES")
SHARED = settings(
    max_examples=int(ASKED or 60),
    derandomize=ASKED is None,
    print_blob=True,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
EDITS = st.lists(
    st.tuples(
        st.sampled_from(["flip", "number", "lost", "repeated", "cut", "zeros", "text"]),
        st.floats(0, 1, exclude_max=True),
        st.integers(0, 2**16),
    ),
    min_size=1,
    max_size=4,
)
TEXTS = (
    b"nan",
    b"1e999",
    b"-1",
    b"9" * 40,
    b"\n",
    b",",
    b"\xff",
    b"[" * 60,
    b"*a",
    b"\0",
    b"{",
    b"'",
    b'"',
    b"!!int ",
    b"!!timestamp ",
    b"2024-13-45 ",
    b"0x_ ",
    b"[",
    b"]",
)


def outcome(read, path):
    """None where a file is read, else what its reader raises: any error of ours is one."""
    try:
        read(path)
    except BentwingError:
        return BentwingError
    except Exception as error:
        return error
    return None


def changed(content, edits):
    """Bytes with changes at shares of their length."""
    data = bytearray(content)
    for kind, share, value in edits:
        at = int(share * len(data))
        if kind == "flip" and data:
            data[at] ^= 1 << value % 8
        elif kind == "number":
            size = (2, 4, 8)[value % 3]
            number = NUMBERS[value // 3 % len(NUMBERS)] & (2 ** (8 * size) - 1)
            data[at : at + size] = number.to_bytes(size, "little")
        elif kind == "lost":
            del data[at : at + 1 + value % 9]
        elif kind == "repeated":
            data[at:at] = data[at : at + 1 + value % 99]
        elif kind == "cut":
            del data[at:]
        elif kind == "zeros":
            data[at : at + value % 200] = bytes(len(data[at : at + value % 200]))
        else:
            data[at:at] = TEXTS[value % len(TEXTS)]
    return bytes(data)
