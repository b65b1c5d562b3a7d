# SPDX-License-Identifier: MIT OR Apache-2.0
"""`make campaign RUNS=1000 FIRST_SEED=1`: the table of docs/reliability.md."""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections import Counter, defaultdict
from contextlib import suppress
from pathlib import Path

from campaign.campaign import Ground, Outcome, tried
from campaign.faults import KINDS


def main() -> int:
    """Run the campaign, print its table, and return whether something was found."""
    parser = argparse.ArgumentParser(prog="make campaign", description=__doc__)
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--kinds", nargs="*", default=[*KINDS], choices=[*KINDS])
    asked = parser.parse_args()
    outcomes = defaultdict[str, list[Outcome]](list)
    started = time.monotonic()
    with tempfile.TemporaryDirectory() as folder, suppress(KeyboardInterrupt):
        ground = Ground.made(Path(folder))
        for seed in range(asked.first_seed, asked.first_seed + asked.runs):
            outcome = tried(seed, ground, tuple(asked.kinds))
            outcomes[outcome.kind].append(outcome)
            for one in outcome.findings:
                print(f"seed {one.seed} ({one.kind}): {one.what}\n  {one.command}\n  {one.said}")
            sys.stdout.flush()
    n = sum(map(len, outcomes.values()))
    minutes = (time.monotonic() - started) / 60
    print(table(outcomes))
    print(f"\n{n} runs, seeds from {asked.first_seed} on, {minutes:.0f} minutes")
    return int(any(o.findings for found in outcomes.values() for o in found))


def table(outcomes: dict[str, list[Outcome]]) -> str:
    """Return a row for each kind of fault."""
    rows = [
        "| fault | runs | exit codes | longest, s | peak, MB | findings |",
        "|---|---|---|---|---|---|",
    ]
    for kind, found in sorted(outcomes.items()):
        codes = Counter(str(o.ended.code) for o in found)
        said = ", ".join(f"{code}: {n}" for code, n in sorted(codes.items()))
        longest = max(o.ended.seconds for o in found)
        peak = max(o.ended.peak_mb for o in found)
        n = sum(len(o.findings) for o in found)
        rows.append(f"| {kind} | {len(found)} | {said} | {longest:.0f} | {peak:.0f} | {n} |")
    return "\n".join(rows)


if __name__ == "__main__":
    sys.exit(main())
