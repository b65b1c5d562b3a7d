# SPDX-License-Identifier: MIT OR Apache-2.0
"""Each effect of real sensors does what it says, against the truth, and none acts unasked."""

import numpy as np
import pytest
import yaml
from pydantic import ValidationError

from bentwing._core import Scene
from bentwing.base.calibration import STANDARD_GRAVITY
from bentwing.evaluate.simulated import Truth
from bentwing.simulate import Scenario, simulate
from bentwing.simulate.beams import Beams
from bentwing.simulate.kinematics import Motion
from bentwing.simulate.names import RealismGroup
from bentwing.simulate.ranging import Shots, Surfaces
from bentwing.simulate.realism.beams import draw_beams
from bentwing.simulate.realism.divergence import reported
from bentwing.simulate.realism.effect import about
from bentwing.simulate.realism.glass import FRONT, draw_glass
from bentwing.simulate.realism.inertial import WARMING, InertialResponse, draw_response
from bentwing.simulate.realism.motor import AskewEncoder, EncoderErrors, draw_wobble
from bentwing.simulate.realism.mount import draw_mount
from bentwing.simulate.realism.ranges import (
    BEAM_WIDTH,
    COOLING,
    LARGEST_GRAZING,
    N_MATERIALS,
    PATCH,
    Clutter,
    FarNoise,
    Grazing,
    Patches,
    Reading,
)
from bentwing.simulate.realism.shocks import draw_shocks
from bentwing.simulate.realism.stamps import HostClock, draw_host
from bentwing.simulate.realism.wind import draw_wind
from bentwing.simulate.records import ImuRecord, ScanRecord
from bentwing.simulate.rig import Encoder
from bentwing.simulate.scenes.mesh import FOLIAGE, GLASS, SOLID, box, merge, quad
from bentwing.simulate.scenes.parts import facade, tree
from bentwing.simulate.scenes.world import face_normals
from bentwing.simulate.simulation import prepare
from bentwing.simulate.splines import Spline

GROUPS = RealismGroup.__args__


def scans(n, period=0.01):
    """Records of a scanner that starts a sweep every `period` s."""
    none = np.zeros(1, np.float32)
    return [
        ScanRecord(k * period, k * period + 0.012, 0.0, 0.1, 0.0, period, none, none, 0.1, 30.0)
        for k in range(n)
    ]


def shots(ranges, cosines=1.0, times=0.0, n_beams=1):
    """Shots along x from the origin, in one column of `n_beams`."""
    grid = np.reshape(np.asarray(ranges, dtype=np.float64), (-1, n_beams))
    directions = np.tile([1.0, 0.0, 0.0], (*grid.shape, 1))
    beams = Beams(np.full(grid.shape, times), directions, sweep_axis=0)
    return Shots(beams, np.zeros_like(directions), directions, grid, np.full(grid.shape, cosines))


# --- stamps ---


def clock(rng, **values):
    exact = {"jitter": 0.0, "mean": 0.0, "late": 0.0, "latest": 0.0, "step": 0.0}
    return HostClock(**{**exact, "drift": 0.0, "lost": 0.0, "rng": rng, **values})


def test_a_perfect_host_leaves_the_stamps_alone(rng):
    assert clock(rng).stamped(scans(100)) == scans(100)


def test_delays_have_their_mean_and_standard_deviation_and_are_never_negative(rng):
    host = clock(rng, jitter=1e-3, mean=2e-3)
    host.stamped(scans(20_000, period=0.1))
    assert np.mean(host.shifts) == pytest.approx(2e-3, abs=3e-5)
    assert np.std(host.shifts) == pytest.approx(1e-3, rel=0.05)
    # A Gamma distribution of shape 4 has its mean at two standard deviations.
    assert min(host.shifts) >= 0.0


def test_late_messages_make_those_after_them_wait_and_none_overtakes(rng):
    host = clock(rng, late=0.03, latest=0.024)
    stamps = np.array([r.stamp for r in host.stamped(scans(20_000))])
    assert (np.diff(stamps) > 0).all()
    shifts = np.array(host.shifts)
    assert 0.022 < shifts.max() <= 0.024
    # Half of the late ones, and they delay one or two of the next, 10 ms apart.
    assert 0.03 < (shifts > 1e-6).mean() < 0.08


def test_stamps_drift_and_come_in_steps(rng):
    host = clock(rng, drift=9e-5, step=7.5e-4)
    stamps = np.array([r.stamp for r in host.stamped(scans(10_000))])
    np.testing.assert_allclose(stamps / 7.5e-4, np.round(stamps / 7.5e-4), atol=1e-6)
    slope = np.polyfit(0.01 * np.arange(10_000), host.shifts, 1)[0]
    assert slope == pytest.approx(9e-5, rel=0.02)


def test_messages_get_lost_by_their_share(rng):
    kept = clock(rng, lost=0.01).stamped(scans(20_000))
    assert len(kept) == pytest.approx(19_800, abs=60)


def test_nothing_is_recorded_in_a_gap_and_the_latency_is_what_the_stamps_have(rng):
    host = draw_host(rng, 3.0, 40.0)
    imu = [ImuRecord(0.005 * k, 0.005 * k, np.zeros(3), np.zeros(3)) for k in range(8000)]
    kept = host.recorded([*imu, *scans(4000)])
    assert len(host.gaps) == 1
    (first, last), arrivals = host.gaps[0], [r.arrival for r in kept]
    assert 0.06 <= last - first <= 0.18
    assert not any(first <= t < last for t in arrivals)
    # In the middle of 40 s: the mean delay and half of the drift.
    expected = host.lidar.mean + 20.0 * host.lidar.drift
    assert host.latency() == pytest.approx(expected, abs=4e-4)


# --- ranges ---


def test_readings_are_off_scaled_and_warm_up():
    reading = Reading(offset=0.01, scale=5e-4, cold=0.02, age=100.0)
    found = reading.apply(shots([10.0, np.inf], times=50.0)).ranges[:, 0]
    warm_up = 0.02 * np.exp(-150.0 / COOLING)
    assert found[0] == pytest.approx(10.0 * 1.0005 + 0.01 + warm_up)
    assert np.isinf(found[1])


def test_grazing_ranges_are_too_long_but_never_by_more_than_20_cm():
    grazing = Grazing(0.3)
    square, slanted = (grazing.apply(shots([10.0], c)).ranges[0, 0] for c in (1.0, 0.5))
    assert square == 10.0
    assert slanted - 10.0 == pytest.approx(0.3 * 10.0 * BEAM_WIDTH * np.sqrt(3.0))
    assert grazing.apply(shots([100.0], 0.001)).ranges[0, 0] == 100.0 + LARGEST_GRAZING


def test_far_ranges_scatter_more(rng):
    noise = FarNoise(2e-3, rng)
    near, far, very_far = (noise.apply(shots(np.full(20_000, r))).ranges for r in (9.0, 20.0, 90.0))
    assert (near == 9.0).all()
    assert far.std() == pytest.approx(0.02, rel=0.05)
    assert very_far.std() == pytest.approx(noise.most, rel=0.05)


def test_a_patch_has_one_offset_and_one_reflectivity(rng):
    patches = Patches.draw(rng, 1.0)
    one = patches.material(np.array([[0.2, 0.2, 0.2], [0.9, 0.9, 0.9]]) * PATCH + patches.corner)
    assert one[0] == one[1]
    everywhere = patches.material(rng.uniform(-50.0, 50.0, (20_000, 3)))
    counts = np.bincount(everywhere, minlength=N_MATERIALS) / 20_000
    assert len(counts) == N_MATERIALS
    assert counts.max() < 3.0 / N_MATERIALS
    spoiled = patches.apply(shots([3.3, np.inf]))
    material = patches.material(np.array([3.3, 0.0, 0.0]))
    halo = patches.retro == material
    assert spoiled.ranges[0, 0] == pytest.approx(3.3 + patches.offsets[material])
    assert np.isinf(spoiled.ranges[1, 0]) or halo
    assert spoiled.cosines[0, 0] == pytest.approx(patches.reflectivities[material])


def test_a_retro_reflector_is_seen_by_the_shots_beside_it():
    patches = Patches(np.zeros(N_MATERIALS), np.ones(N_MATERIALS), 0, np.zeros(3))
    ranges = np.arange(1.0, 400.0, 1.0)
    bright = ranges[patches.material(np.outer(ranges, [1.0, 0.0, 0.0])) == 0][0]
    found = patches.apply(shots([900.0, bright, 900.0, 900.0, 900.0])).ranges[:, 0]
    assert found[0] == found[1] == found[2] == bright


def test_clutter_ends_its_share_of_the_shots_early(rng):
    found = Clutter(0.01, rng).apply(shots(np.full(50_000, 20.0))).ranges
    assert (found < 20.0).mean() == pytest.approx(0.01, rel=0.15)
    assert found.min() > 0.5
    assert found[found < 20.0].max() < 5.0


def test_beams_point_and_measure_wrongly_each_in_its_way(rng):
    rings = (0, 2, 1)
    errors = draw_beams(rng, 1.0, rings, np.radians(0.05))
    stated = np.radians([-10.0, 3.0, 12.0])
    stated = np.column_stack([np.cos(stated), 0 * stated, np.sin(stated)])[None]
    true = errors.actual(Beams(np.zeros((1, 3)), stated, 0)).directions[0]
    elevations = np.arcsin(true[:, 2]) - np.arcsin(stated[0, :, 2])
    np.testing.assert_allclose(elevations, errors.elevations[list(rings)], atol=1e-12)
    np.testing.assert_allclose(np.arctan2(true[:, 1], true[:, 0]), errors.azimuths[list(rings)])
    longer = errors.apply(shots([5.0, 5.0, 5.0], n_beams=3)).ranges[0] - 5.0
    np.testing.assert_allclose(longer, errors.offsets[list(rings)], atol=1e-12)


def test_beams_of_many_draws_scatter_by_the_lidars_own_figure():
    rngs = [np.random.default_rng(k) for k in range(40)]
    drawn = [draw_beams(r, 3.0, range(64), np.radians(0.2)) for r in rngs]
    assert np.std([d.elevations for d in drawn]) == pytest.approx(np.radians(0.6), rel=0.05)
    assert np.std([d.offsets for d in drawn]) == pytest.approx(0.024, rel=0.05)


@pytest.mark.parametrize(
    ("echo", "expected"), [("first", 4.0), ("strongest", 9.0), ("blended", 4.1)]
)
def test_a_beam_on_an_edge_reports_one_of_its_echoes(echo, expected):
    echoes = np.array([9.0, 4.0, 4.2, 9.0, 9.0, np.inf, np.inf])[:, None]
    assert reported(echoes, echo)[0] == pytest.approx(expected)


@pytest.mark.parametrize("echo", ["first", "strongest", "blended"])
def test_a_beam_into_nothing_reports_nothing(echo):
    assert np.isinf(reported(np.full((7, 2), np.inf), echo)).all()


# --- the scene ---


def test_windows_are_of_glass_and_crowns_of_foliage_through_all_moves(rng):
    wall = facade(6.0, 3.0, [(1.0, 2.0, 0.0, 2.0), (3.0, 4.0, 1.0, 2.0)], 0.2)
    assert wall.of(GLASS).sum() == 2
    scene = merge([box((0, 0, 0), (1, 1, 1)), wall.moved((5, 0, 0), 0.3), tree(rng, 5.0)])
    assert scene.of(GLASS).sum() == 2
    assert scene.of(FOLIAGE).sum() > 100
    assert scene.of(SOLID).sum() + scene.of(GLASS).sum() + scene.of(FOLIAGE).sum() == len(
        scene.triangles
    )
    assert box((0, 0, 0), (1, 1, 1)).of(SOLID).all()


def pane_and_wall():
    """A pane at x = 2 before a wall at x = 5, and a wall behind the lidar at x = −4."""
    parts = [quad([(x, -9, -9), (x, 9, -9), (x, 9, 9), (x, -9, 9)]) for x in (2.0, 5.0, -4.0)]
    return merge([parts[0].made_of(GLASS), *parts[1:]])


def test_glass_is_passed_or_mirrors_and_is_seen_only_from_the_front(rng):
    mesh = pane_and_wall()
    scene, normals = Scene(mesh.vertices, mesh.triangles), face_normals(mesh)
    glass = draw_glass(rng, 3.0, (scene, normals), mesh.of(GLASS), 30.0)
    assert glass.clear == 1.0
    cosine = np.cos(np.radians(30.0))
    n = 4000
    slanted = np.tile([cosine, np.sin(np.radians(30.0)), 0.0], (n, 1))
    beams = Beams(np.zeros((n, 1)), slanted[:, None], 0)
    ranges, cosines = glass.cast(beams, np.zeros((n, 3)), slanted)
    # Through it to the wall, off it back to the wall behind, or the pane itself.
    for depth, share in ((5.0, glass.passing), (2.0 + 6.0, glass.mirrored)):
        assert (abs(ranges * cosine - depth) < 0.01).mean() == pytest.approx(share, abs=0.03)
    np.testing.assert_allclose(cosines, cosine, atol=1e-9)
    ahead = np.tile([1.0, 0.0, 0.0], (n, 1))
    assert FRONT < 1.0
    np.testing.assert_allclose(glass.cast(beams, np.zeros((n, 3)), ahead)[0], 2.0)


def test_a_third_of_the_panes_is_of_clear_glass_as_usual(rng):
    panes = merge([quad([(0, 0, k), (1, 0, k), (1, 1, k), (0, 1, k)]) for k in range(600)])
    is_pane = panes.made_of(GLASS).of(GLASS)
    surfaces = Scene(panes.vertices, panes.triangles), face_normals(panes)
    clear = draw_glass(rng, 1.0, surfaces, is_pane, 30.0).is_glass
    assert clear.mean() == pytest.approx(1 / 3, abs=0.06)
    np.testing.assert_array_equal(clear[::2], clear[1::2])


def test_foliage_sways_where_the_wind_says(rng):
    leaf = merge([quad([(3, -9, -9), (3, 9, -9), (3, 9, 9), (3, -9, 9)])])
    wind = draw_wind(rng, 3.0, leaf, 30.0)
    times = np.linspace(0.0, 60.0, 3000)
    ahead = np.tile([1.0, 0.0, 0.0], (3000, 1))
    ranges, _ = wind.cast(Beams(times[:, None], ahead[:, None], 0), np.zeros((3000, 3)), ahead)
    np.testing.assert_allclose(ranges, 3.0 + wind.shifts(times)[:, 0], atol=1e-9)
    assert 0.04 < np.ptp(ranges) / 2 < 0.2


# --- the inertial unit ---


def test_rates_and_forces_are_scaled_misaligned_and_mixed():
    gyro, accel = np.diag([1.01, 1.0, 1.0]), np.eye(3)
    accel[0, 1] = 0.01
    feeling = np.zeros((3, 3))
    feeling[2, 2] = 1e-3
    heated = np.array([0, 0, 0, 0.1, 0, 0])
    response = InertialResponse(gyro, accel, feeling, heated)
    ideal = np.array([[1.0, 2.0, 3.0, 4.0, 5.0, 9.8]])
    felt = response.felt(np.array([WARMING]), ideal)[0]
    warm = 0.1 * (1 - np.exp(-1.0))
    np.testing.assert_allclose(felt, [1.01, 2.0, 3.0098, 4.05 + warm, 5.0, 9.8])


def test_units_are_off_by_what_their_level_says():
    drawn = [draw_response(np.random.default_rng(k), 3.0) for k in range(200)]
    scales = np.array([abs(np.diag(d.gyro) - 1.0) for d in drawn])
    assert 0.006 < scales.min() < scales.max() < 0.012
    leans = [np.linalg.norm(d.accel[0, 1:]) for d in drawn]
    assert np.degrees(np.mean(leans)) == pytest.approx(0.45, rel=0.05)
    per_g = np.std([d.g_sensitivity for d in drawn]) * STANDARD_GRAVITY
    assert np.degrees(per_g) == pytest.approx(0.15, rel=0.05)


def test_blows_are_clipped_and_vibration_shifts_the_mean(rng):
    shocks = draw_shocks(rng, 3.0, 60.0)
    assert len(shocks.times) == 3
    times = np.arange(0.0, 60.0, 1e-3)
    still = np.zeros((len(times), 6))
    felt = shocks.felt(times, still, np.ones(len(times)))[:, 3:]
    assert abs(felt).max() <= shocks.accel_limit
    blown = (abs(felt - shocks.rectified) > 1e-9).any(axis=1)
    assert blown.sum() * 1e-3 == pytest.approx(shocks.lasting.sum(), rel=0.1)
    np.testing.assert_allclose(np.median(felt, axis=0), shocks.rectified)


# --- mount and motor ---


class Hovering:
    """A carrier that hangs in the air, its rotors on from 10 s on."""

    def motion(self, times):
        none = np.zeros((len(times), 3))
        return Motion(np.tile(np.eye(3), (len(times), 1, 1)), none, none, none, none, none)

    def activity(self, times):
        return (times > 10.0).astype(float)


def test_an_elastic_mount_rings_at_its_frequency_while_the_rotors_work(rng):
    mount = draw_mount(rng, 3.0, Hovering(), 60.0)
    times = np.arange(12.0, 58.0, 0.002)
    angles = np.hstack([angle(times) for angle in mount.angles])
    rms = np.sqrt((angles**2).sum(axis=1).mean())
    assert np.degrees(rms) == pytest.approx(0.06, rel=0.15)
    power = (abs(np.fft.rfft(angles, axis=0)) ** 2).sum(axis=1)
    frequencies = np.fft.rfftfreq(len(times), 0.002)
    assert (frequencies * power).sum() / power.sum() == pytest.approx(mount.frequency, rel=0.2)
    before = np.hstack([angle(np.arange(0.0, 9.0, 0.01)) for angle in mount.angles])
    assert (before == 0.0).all()


def test_an_encoder_reads_askew_late_and_with_play():
    turns = Spline(0.1, (0.1 * np.arange(400.0))[:, None])
    errors = EncoderErrors(0.002, 0.3, 0.004, 0.0, n_steps=10**9)
    encoder = AskewEncoder.of(Encoder(turns, zero=0.1, sigma=0.0), errors)
    times = np.linspace(2.0, 30.0, 5000)
    true = turns(times)[:, 0]
    expected = true - 0.1 + 0.002 * np.sin(true + 0.3) - 0.002
    np.testing.assert_allclose(encoder.read(times), expected, atol=1e-8)
    back = AskewEncoder.of(Encoder(Spline(0.1, -turns.controls), 0.1, 0.0), errors)
    forth = -true - 0.1 + 0.002 * np.sin(-true + 0.3) + 0.002
    np.testing.assert_allclose(back.read(times), forth, atol=1e-8)


def test_a_shaft_wobbles_once_and_twice_a_turn(rng):
    rate = 2.0
    angle = Spline(0.1, (rate * 0.1 * np.arange(800.0))[:, None])
    wobble = draw_wobble(rng, 3.0, angle, 60.0)
    times = np.arange(5.0, 5.0 + 8 * np.pi, 0.01)
    turned = angle(times)[:, 0]
    for axis, tilt in enumerate(wobble.tilts):
        found = tilt(times)[:, 0]
        for k in (1, 2):
            size = 2 * abs(np.mean(found * np.exp(-1j * k * turned)))
            assert size == pytest.approx(wobble.sizes[axis, k - 1], rel=0.03)


def test_numbers_of_about_a_size_have_either_sign(rng):
    drawn = about(rng, 2.0, 4000)
    assert 1.4 < abs(drawn).min() < abs(drawn).max() < 2.6
    assert abs(drawn.mean()) < 0.1


# --- whole recordings ---


def drawn(**choices):
    """What is drawn for a recording, and its setup."""
    scenario = Scenario(**{"scene": "courtyard", "duration": 24.0, **choices})
    setup = prepare(scenario)
    return setup.realism.draws, setup


@pytest.mark.parametrize("group", GROUPS)
def test_a_group_alone_draws_nothing_of_another(group):
    draws, _ = drawn(realism=1.0, realism_only=(group,), head="vlp16-motor")
    # A payload that is further off leaves its truth in the calibration.
    assert set(draws) == (set() if group == "payload" else {group})


def test_all_groups_together_draw_the_same_as_each_alone():
    draws, _ = drawn(realism=3.0, head="vlp16-motor")
    assert set(draws) == set(GROUPS) - {"payload"}
    for group in ("stamps", "ranges", "imu", "motor"):
        alone, _ = drawn(realism=3.0, realism_only=(group,), head="vlp16-motor")
        assert alone[group] == draws[group]


def test_draws_grow_with_the_level():
    one, three = (drawn(realism=level)[0] for level in (1.0, 3.0))
    for name in ("offset", "scale", "cold"):
        found, usual = three["ranges"]["reading"][name], one["ranges"]["reading"][name]
        assert found == pytest.approx(3 * usual, abs=1e-8)
    assert three["stamps"]["lidar"]["jitter"] == pytest.approx(1.2e-3)
    assert abs(three["stamps"]["lidar"]["drift"]) == pytest.approx(9e-5, rel=0.31)


def test_ideal_sensors_draw_nothing_and_leave_no_file(tmp_path):
    scenario = Scenario(scene="office", head="hokuyo-nod", duration=11.0)
    files = simulate(scenario, tmp_path / "out")
    assert sorted(path.name for path in files.recording.parent.glob("truth*")) == [
        "truth_calibration.yaml",
        "truth_scene.ply",
        "truth_trajectory.txt",
    ]


def test_a_payload_is_three_times_as_far_off():
    def off(level):
        _, setup = drawn(realism=level, realism_only=("payload",))
        head = setup.rig.head
        nominal = np.array(head.payload["T_imu_lidar"]["translation"])
        shift = np.linalg.norm(nominal - head.truth["T_imu_lidar"]["translation"])
        return shift, setup.sensors.clock.latency

    (shift, latency), (far, late) = off(1.0), off(3.0)
    assert far == pytest.approx(3 * shift, rel=1e-6)
    assert late == pytest.approx(3 * latency)


def test_every_draw_stands_beside_the_truth_and_the_best_map_lies_on_the_scene(tmp_path):
    scenario = Scenario(
        scene="courtyard", duration=22.0, realism=3.0, realism_only=("stamps", "mount"), seed=3
    )
    files = simulate(scenario, tmp_path / "out")
    truth = yaml.safe_load((tmp_path / "out" / "truth_realism.yaml").read_text())
    assert truth["level"] == 3.0
    assert set(truth["stamps"]) == {"lidar", "imu", "encoder", "gaps"}
    assert set(truth["mount"]["elastic_mount"]) == {"frequency", "damping", "size", "pivot"}
    best = Truth(files.recording.parent)
    distances = best.distances(best.best_points)
    # Neither stamps nor mount blur what is placed by the truth: 10 mm of noise are left.
    assert 1.4826 * np.median(abs(distances)) < 0.012
    true = yaml.safe_load(files.calibration.read_text())
    assert 1e-3 < abs(true["latency"]) < 1.5e-2


def test_groups_without_a_size_are_refused():
    with pytest.raises(ValidationError, match="give realism as well"):
        Scenario(scene="office", realism_only=("stamps",))


def test_levels_beyond_three_and_unknown_groups_are_refused():
    with pytest.raises(ValidationError, match="realism"):
        Scenario(scene="office", realism=4.0)
    with pytest.raises(ValidationError, match="realism_only"):
        Scenario(scene="office", realism=1.0, realism_only=("luck",))


def test_a_cast_without_effects_is_that_of_the_scene():
    mesh = pane_and_wall()
    scene = Scene(mesh.vertices, mesh.triangles)
    surfaces = Surfaces(scene, face_normals(mesh), 30.0)
    ahead = np.array([[1.0, 0.0, 0.0]])
    ranges, cosines = surfaces.cast(Beams(np.zeros((1, 1)), ahead[:, None], 0), 0 * ahead, ahead)
    assert ranges[0] == scene.cast(0 * ahead, ahead, 30.0)[0][0]
    assert cosines[0] == 1.0


@pytest.mark.parametrize("head", ["hokuyo-spin", "vlp16-motor"])
def test_ideal_sensors_are_as_they_were_without_effects(head):
    _, setup = drawn(head=head)
    sensors, ranger = setup.sensors, setup.sensors.ranger
    assert (sensors.host, sensors.samples, sensors.imu.response, sensors.imu.shocks) == (None,) * 4
    assert (ranger.aim, list(ranger.effects)) == (None, [])
    assert isinstance(ranger.bodies[0], Surfaces)
    assert ranger.bodies[0].scene is setup.world.scene
    assert ranger.errors.mixing > 0.0
    assert not isinstance(setup.rig.head.encoder, AskewEncoder)
    assert len(setup.rig.head.to_lidar) == (3 if head == "vlp16-motor" else 1)
