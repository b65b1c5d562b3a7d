# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest

from bentwing.simulate.beams import Beams
from bentwing.simulate.events import GAP, LEAD, STALL, Losses, Person
from bentwing.simulate.imu import ImuErrors
from bentwing.simulate.records import ImuRecord, ScanRecord
from bentwing.simulate.scenario import Scenario
from bentwing.simulate.scenes import SCENES, World
from bentwing.simulate.simulation import prepare


def prepared(*events, head="hokuyo-spin"):
    return prepare(Scenario(scene="courtyard", head=head, duration=40.0, events=events))


def test_a_stalled_payload_does_not_turn_for_seconds():
    setup = prepared("spin-stall")
    times = np.arange(0.0, 40.0, 0.05)
    spin = setup.rig.imu(times).omega[:, 2] - setup.rig.carrier.motion(times).omega[:, 2]
    middle = 0.55 * 40.0 + STALL / 2
    stalled = abs(times - middle) < STALL / 2 - 0.8
    assert abs(spin[stalled]).max() < 0.02
    assert abs(spin[abs(times - 18.0) < 1.0]).min() > np.radians(150.0)


def test_gusts_push_the_carrier_harder():
    times = np.arange(12.0, 34.0, 0.02)
    calm, gusty = (prepared(*e).rig.carrier.motion(times).a for e in ((), ("gusts",)))
    assert np.linalg.norm(gusty, axis=1).max() > np.linalg.norm(calm, axis=1).max()


def test_a_recording_can_start_in_motion():
    setup = prepared("motion-start")
    assert (setup.first, setup.last) == (LEAD, LEAD + 40.0)
    motion = setup.rig.imu(np.array([setup.first]))
    assert np.linalg.norm(motion.omega) > 1.0


def test_strong_biases_are_stronger():
    biases = [prepared(*e).sensors.imu.biases for e in ((), ("strong-bias",))]
    np.testing.assert_allclose(biases[1], 4 * biases[0])
    assert abs(biases[0][:3]).max() <= ImuErrors().gyro_bias


def test_nothing_is_recorded_during_a_gap(rng):
    records = [ImuRecord(t, t, np.zeros(3), np.zeros(3)) for t in np.arange(0.0, 10.0, 0.01)]
    kept = Losses(rng, gap=(4.0, 4.0 + GAP)).remaining(records)
    stamps = np.array([record.stamp for record in kept])
    assert np.diff(stamps).max() == pytest.approx(GAP + 0.01)


def test_dropped_packets_lose_scans_in_bursts(rng):
    empty = np.zeros(0, dtype=np.float32)
    scans = [
        ScanRecord(t, t, 0.0, 0.01, 1e-5, 0.01, empty, empty, 0.1, 30.0)
        for t in np.arange(0.0, 60.0, 0.01)
    ]
    kept = Losses(rng, bursts=True).remaining(scans)
    assert 0.85 < len(kept) / len(scans) < 0.97
    assert np.diff([scan.stamp for scan in kept]).max() > 0.05


def test_a_person_walks_freely_and_is_seen(rng):
    world = World(SCENES["courtyard"](rng))
    person = Person(world, rng, np.array([14.0, 9.0, 2.5]))
    feet = person.positions(np.arange(0.0, 30.0, 0.1))
    speed = np.linalg.norm(np.diff(feet, axis=0), axis=1) / 0.1
    assert 0.3 < speed.max() < 1.5
    assert world.clearance(feet + np.array([0.0, 0.0, 1.0])).min() > 0.3
    down = np.array([[0.0, 0.0, -1.0]])
    times = np.array([[3.0]])
    above = person.positions(times.ravel()) + np.array([0.0, 0.0, 3.0])
    beam = Beams(times, down[None], sweep_axis=1)
    ranges, cosines = person.cast(beam, above, down)
    assert ranges[0] == pytest.approx(3.0 - 1.78, abs=0.01)
    assert cosines[0] > 0.9
