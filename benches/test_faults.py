# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the bench of faults calls right, repaired, told and silently wrong."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import pytest

from benches.accuracy import faults
from benches.support.fault_outcomes import Told, is_wrong, names, outcome, told
from bentwing.evaluate.simulated import WorldError
from bentwing.simulate.faults import FAULTS

GOOD = WorldError(path=0.01, map=0.02, astray=0.0, clock=0.0, covered=1.0)
BAD = replace(GOOD, path=1.0)
CAUSE = "gyro.*deg"
NAMED = ("the gyro is in deg/s",)
OTHER = ("the lidar was covered",)


@pytest.mark.parametrize(
    ("said", "error", "expected"),
    [
        (Told("good"), GOOD, "right"),
        (Told("good"), replace(GOOD, path=0.029), "right"),
        (Told("doubtful", OTHER), GOOD, "right"),
        (Told("good", repairs=NAMED), replace(GOOD, path=0.019), "repaired"),
        (Told("good", repairs=NAMED), replace(GOOD, path=0.025), "repaired roughly"),
        (Told("good", repairs=NAMED), BAD, "silently wrong"),
        (Told("good"), BAD, "silently wrong"),
        (Told("good"), None, "silently wrong"),
        (Told("doubtful", NAMED), BAD, "right reason"),
        (Told("doubtful", OTHER), BAD, "another reason"),
        (Told("doubtful", OTHER, NAMED), BAD, "right reason"),
        (Told("failed", NAMED), BAD, "right reason"),
        (Told("failed", OTHER), GOOD, "another reason"),
        (Told("refused", NAMED), None, "right reason"),
    ],
)
def test_an_outcome_follows_from_the_error_and_from_what_was_told(said, error, expected) -> None:
    assert outcome(said, error, GOOD, CAUSE) == expected


@pytest.mark.parametrize(
    ("error", "expected"),
    [
        (replace(GOOD, path=0.031), True),  # three times as far off
        (replace(GOOD, map=0.061), True),
        (replace(GOOD, covered=0.8), True),  # a fifth of the flight is missing
        (replace(GOOD, path=0.03, map=0.06), False),
    ],
)
def test_a_map_is_wrong_that_is_much_farther_off_than_the_good_one(error, expected) -> None:
    assert is_wrong(error, GOOD) is expected


def test_a_map_is_wrong_that_is_five_centimetres_farther_off_than_a_bad_one() -> None:
    poor = replace(GOOD, path=0.1)
    assert not is_wrong(replace(poor, path=0.149), poor)
    assert is_wrong(replace(poor, path=0.151), poor)


def test_a_path_that_is_off_by_less_than_ranges_resolve_is_right() -> None:
    exact = replace(GOOD, path=0.0005)
    assert not is_wrong(replace(exact, path=0.014), exact)
    assert is_wrong(replace(exact, path=0.016), exact)


def test_a_sentence_that_suspects_everything_names_no_cause() -> None:
    assert names(CAUSE, ["the gyro is in deg/s"])
    assert not names(
        CAUSE, ["check the mount, the gyro (rad/s, not deg/s), the accelerometer and the clocks"]
    )


def test_what_was_told_is_read_from_the_exit_code_the_record_and_the_output() -> None:
    assert told(0, {}, "") == Told("good")
    assert told(3, None, "error: in g\n") == Told("refused", ("error: in g",))
    verdict = {"state": "doubtful", "reasons": [{"kind": "clock", "sentence": "late"}]}
    record = {"verdict": verdict, "set_up": [{"what": "mount", "sentence": "turned"}]}
    assert told(0, record, "") == Told("doubtful", ("late",), ("turned",))
    assert told(4, record, "check all") == Told("failed", ("late",), ("turned",))
    assert told(4, {}, "diverged") == Told("failed", ("diverged",))


def options(**given) -> argparse.Namespace:
    chosen = {"heads": list(faults.HEADS), "scenes": list(faults.SCENES), "seeds": [7], "good": 0}
    return argparse.Namespace(
        **{"faults": [], "duration": 24.0, "trust_payload": False, **chosen, **given}
    )


def test_good_flights_go_through_heads_scenes_and_events() -> None:
    found = [flight.scenario for flight, _ in faults.flights(options(good=48), Path())]
    assert {one.head for one in found} == set(faults.HEADS)
    assert {one.scene for one in found} == set(faults.SCENES)
    spun = [one for one in found if one.head == "hokuyo-spin"]
    assert {name for one in spun for name in one.events} >= {"spin-stall", "person", "gusts"}
    assert {one.spin for one in spun} == {"steady", "plant"}
    assert len({(one.scene, one.head, one.seed, one.events) for one in found}) == 48


def test_a_fault_is_put_into_heads_that_can_have_it() -> None:
    chosen = options(faults=["encoder-late", "gyro-zero"], scenes=["office"])
    pairs = {flight.scenario.head: names for flight, names in faults.flights(chosen, Path())}
    assert pairs["vlp16-motor"] == ["encoder-late", "gyro-zero"]
    assert pairs["hokuyo-spin"] == pairs["hokuyo-nod"] == ["gyro-zero"]


def test_the_table_counts_outcomes_and_the_summary_shares() -> None:
    rows = [
        {"fault": "gyro-zero", "repair": "none", "payload": "given", "outcome": ends}
        for ends in ("silently wrong", "right reason", "another reason")
    ]
    rows.append({"fault": None, "payload": "given", "state": "doubtful", "outcome": None})
    assert "| gyro-zero | none |  |  |  | 1 | 1 | 1 |" in faults.table(rows)
    said = faults.summary(rows)
    assert "silently wrong: 1 of 3" in said
    assert "refusals that name the cause: 1 of 2" in said
    assert "good recordings called otherwise: 1 of 1" in said


def test_every_fault_can_be_named_by_a_sentence_on_its_cause() -> None:
    """The patterns find plain sentences, and not those on another sensor."""
    told_of = {
        "mount-90-x": "the mount in the payload is turned by 90° against the one found",
        "gyro-negated": "the gyro's axes are x, y and z negated",
        "gyro-saturated": "the gyro is clipped at 125 deg/s",
        "accel-g": "the accelerations are in g (median length 0.999)",
        "accel-no-gravity": "the accelerations lack gravity: the driver has removed it",
        "lidar-late-0.5": "the lidar's clock is 0.50 s late",
        "lidar-mirrored": "the scans are mirrored: the lidar turns clockwise",
        "ranges-millimetres": "the ranges are in millimetres",
        "lidar-level": "a 2D lidar whose scan plane stays level sees one slice",
        "encoder-degrees": "the encoder is in degrees",
        "encoder-second": "the lidar is turned by joint 'motor', the second of the JointState",
    }
    for name, sentence in told_of.items():
        assert names(FAULTS[name].cause, [sentence]), name
        assert not names(FAULTS[name].cause, ["too few points were measured"]), name
