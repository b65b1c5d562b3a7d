# SPDX-License-Identifier: MIT OR Apache-2.0
"""The compiled core.

Arrays must be C-contiguous and must not be modified during a call; the GIL is released meanwhile.
A wrong shape, a value that is not finite or a time that decreases is a ValueError that names the
argument and the row. Times are seconds since the recording's start, lengths metres, angles
radians, quaternions x y z w; `threads` 0 means one per core, and no result depends on it.
"""

from collections.abc import Sequence
from os import PathLike
from typing import Any, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from bentwing.closing.global_registration.matching import MatchingPlan
from bentwing.closing.pose_graph.graph import GravityTerms, Links
from bentwing.closing.pose_graph.solve import SolveSettings
from bentwing.odometry.continuous.core_settings import CoreSettings
from bentwing.odometry.continuous.settings import SurfelSettings
from bentwing.odometry.kalman.core import FilterSettings, FilterState

__all__ = [
    "FixedView",
    "GlobalRegistration",
    "Globals",
    "Imu",
    "KalmanFilter",
    "KalmanSweep",
    "LazCompressor",
    "MapCells",
    "MapSurvey",
    "NdtReference",
    "NdtRegistration",
    "Piece",
    "PoseGraphSolution",
    "RangeNoise",
    "Registration",
    "Samples",
    "Scene",
    "SurfaceSample",
    "Surfels",
    "__version__",
    "extract_surfels",
    "las_records",
    "register_globally",
    "register_window",
    "shot_words",
    "solve_pose_graph",
    "thin_points",
]

__version__: str

_Vector: TypeAlias = Sequence[float] | NDArray[np.float64]
_Matrix: TypeAlias = Sequence[_Vector] | NDArray[np.float64]
_Rows: TypeAlias = list[list[float]]
_Transform: TypeAlias = tuple[_Vector, _Vector]
"""Translation (3,) m and unit quaternion (4,)."""
_Returned: TypeAlias = tuple[list[float], list[float]]
"""The same as it is returned."""
_Poses: TypeAlias = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]

def las_records(
    points: NDArray[np.float64],
    *,
    times: NDArray[np.float64],
    ranges: NDArray[np.float32],
    intensity: NDArray[np.float32] | None,
    ring: NDArray[np.uint16] | None,
    incidence: NDArray[np.float32] | None,
    thickness: NDArray[np.float32] | None,
    shift: NDArray[np.float32] | None,
    sigma: NDArray[np.float32] | None,
    run_id: NDArray[np.uint16] | None,
    stored: Sequence[str],
    offsets: tuple[float, float, float],
    step: float,
    gps_origin: float,
    intensity_scale: float,
    threads: int = 0,
) -> NDArray[np.uint8]:
    """Return points as the records of a LAS 1.4 file, point format 6, one behind the other.

    Angles are rounded to an eighth of a degree, short lengths to 1/8192 m: further digits mean nothing, and
    would be most of what a compressed point takes. Intensities that are no numbers are 0.

    Parameters
    ----------
    points : (N, 3) m
    times : (N,) s
    ranges : (N,) m, the first extra bytes
    intensity, ring, incidence, thickness, run_id : (N,), angles in rad, thickness in m; None is stored as 0
    stored : names of `ring`, `incidence`, `thickness` and `run_id` that follow as extra bytes
    offsets : taken off the points, m
    step : of the coordinates, m
    gps_origin : added to the times, s
    intensity_scale : by which intensities are multiplied, rounded and held within 16 bits

    Raises
    ------
    EstimationError
        If a point is too far from the offsets for 32 bits.
    """

@final
class LazCompressor:
    """Appends compressed points to a LAZ file whose header is written already.

    Parameters
    ----------
    point_format : of the LAS specification; 6
    n_extra_bytes : size of the extra dimensions of a point
    own_chunks : whether chunks are as large as `compress_chunks` says, else all are of one size
    """

    def __new__(
        cls, point_format: int, n_extra_bytes: int, *, own_chunks: bool = False
    ) -> LazCompressor: ...
    def record_data(self) -> bytes:
        """Return the record that the header of the file must announce."""

    def begin(self, path: str | PathLike[str], offset: int) -> None:
        """Begin behind the first `offset` bytes of the file."""

    def compress(self, points: NDArray[np.uint8], *, threads: int = 0) -> None:
        """Append points, record after record as LAS has them (N · size of a point,)."""

    def compress_chunks(
        self, points: NDArray[np.uint8], counts: Sequence[int], *, threads: int = 0
    ) -> None:
        """Append points as one chunk for each of `counts`, none of which is 0."""

    def finish(self, *, threads: int = 0) -> None:
        """Write what is held back and the table of chunks."""

@final
class MapSurvey:
    """What the points of a map say about each other, chunk by chunk.

    Parameters
    ----------
    edge : m, of the cells
    max_cells : more are joined eight to one
    start, step : s, first time and length of the 256 steps of time
    max_rays : more beams are thinned by half
    margin : m, a beam says nothing about what is closer to its end
    """

    def __new__(
        cls,
        *,
        edge: float,
        max_cells: int,
        start: float,
        step: float,
        max_rays: int,
        margin: float,
    ) -> MapSurvey: ...
    def add(
        self,
        points: NDArray[np.float64],
        *,
        beams: NDArray[np.float32],
        ranges: NDArray[np.float32],
        times: NDArray[np.float64],
        doubtful: NDArray[np.bool_],
        threads: int = 0,
    ) -> None:
        """Add points (N, 3) with the unit directions (N, 3), lengths and times of their beams."""

    def finish(self, *, threads: int = 0) -> MapCells:
        """Follow the beams; ends the survey."""

@final
class MapCells:
    """Cells of a complete survey."""

    @property
    def edge(self) -> float:
        """Edge of the cells, m: that asked for, or larger if there were too many."""

    @property
    def n_cells(self) -> int:
        """Number of cells."""

    @property
    def n_moving(self) -> int:
        """Number of cells whose content moved."""

    @property
    def n_rays(self) -> int:
        """Number of beams that were followed."""

    def describe(
        self,
        points: NDArray[np.float64],
        *,
        beams: NDArray[np.float32],
        threads: int = 0,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], NDArray[np.bool_]]:
        """Return of each point incidence (rad), thickness (m), whether it moved and is supported.

        Incidence and thickness are NaN where there is no surface; a point is supported where other
        points say that there is something.
        """

@final
class RangeNoise:
    """How noisy the ranges of a map are, as its smooth surfaces show it."""

    def sigmas(self, ranges: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the standard deviations of ranges, m."""

@final
class SurfaceSample:
    """Takes the points of a part of a map.

    Parameters
    ----------
    edge : m, of the smallest cells
    n_levels : sizes of cells, each twice as large as the one before
    enough : points around the middle of a cell that make it large enough
    fewest_passes : effective number that must have seen a surface
    most_noise : m, of a range
    """

    def __new__(
        cls,
        *,
        edge: float,
        n_levels: int,
        enough: int,
        fewest_passes: float,
        most_noise: float,
    ) -> SurfaceSample: ...
    def add(self, words: NDArray[np.uint32], *, own: NDArray[np.bool_]) -> None:
        """Add points (N, 5) as `shot_words` returns them, made for the same edge.

        Parameters
        ----------
        own : whether each is to be refined, or only tells where others are
        """

    def refine(
        self, *, noise: RangeNoise | None = None, threads: int = 0
    ) -> tuple[RangeNoise, NDArray[np.float32], NDArray[np.float32]] | None:
        """Find the surfaces and where the points to be refined most probably are; ends the sample.

        Parameters
        ----------
        noise : of the ranges; default: that which the smooth surfaces show

        Returns
        -------
        The noise; and of the points to be refined, in their order, the moves along the beams (m, away
        from the lidar; 0 where a point stays) and the standard deviations that are left along them (m).
        None where there is no smooth surface.
        """

@final
class Scene:
    """Triangles that can be asked for the first hit along a ray and the nearest point.

    Parameters
    ----------
    vertices : (V, 3) float64, m
    triangles : (T, 3) uint32, vertices of each, counter-clockwise seen from outside
    """

    def __new__(cls, vertices: NDArray[np.float64], triangles: NDArray[np.uint32]) -> Scene: ...
    @property
    def n_triangles(self) -> int:
        """Number of triangles."""

    def cast(
        self, origins: NDArray[np.float64], directions: NDArray[np.float64], max_range: float
    ) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
        """Find the first surface along each ray.

        Parameters
        ----------
        origins, directions : (N, 3) float64, m and unit vectors
        max_range : m

        Returns
        -------
        ranges : (N,) float64, m, infinity where there is none
        triangles : (N,) int32, -1 where there is none
        """

    def distance(
        self, points: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
        """Find the nearest surface of each point.

        Parameters
        ----------
        points : (N, 3) float64, m

        Returns
        -------
        distances : (N,) float64, m, negative behind the surface
        triangles : (N,) int32
        """

@final
class Imu:
    """Inertial samples in time order.

    Parameters
    ----------
    stamps : (M,) float64, s, IMU clock, non-decreasing
    gyro, accel : (M, 3) float64, rad/s and m/s² (specific force), imu frame
    at_limit : (M, 6) bool, which axes of both are at the end of their range; None: none is
    """

    def __new__(
        cls,
        stamps: NDArray[np.float64],
        gyro: NDArray[np.float64],
        accel: NDArray[np.float64],
        at_limit: NDArray[np.bool_] | None = None,
    ) -> Imu: ...
    @property
    def forces(self) -> NDArray[np.float64]:
        """Forces (M, 3), m/s², without blows to the housing."""

    def __len__(self) -> int: ...

@final
class Globals:
    """The slow states: latency, extrinsics, motor, inertial unit, gravity.

    Parameters
    ----------
    T_imu_base : pose of the lidar, or of the motor that turns it, in the imu frame
    latency : s, lidar stamps minus IMU clock
    gyro_bias, accel_bias : (3,) rad/s and m/s², imu frame
    gravity : (3,) m/s², map frame, pointing up
    unit : how the IMU answers beside its biases, see `unit`; default: without further errors
    motor_axis : (3,) motor frame; only for motor-turned lidars, with `T_motor_lidar`
    encoder_zero : rad, added to every encoder angle
    T_motor_lidar : pose of the lidar in the rotating motor frame
    motor_errors : how the motor turns otherwise than its encoder reads, see `motor_errors`
    ranges : (2,) by how much ranges are too long, see `ranges`
    """

    def __new__(
        cls,
        T_imu_base: _Transform,
        *,
        latency: float,
        gyro_bias: _Vector,
        accel_bias: _Vector,
        gravity: _Vector,
        unit: tuple[_Matrix, _Matrix, _Matrix, _Vector, int] | None = None,
        motor_axis: _Vector | None = None,
        encoder_zero: float = 0.0,
        T_motor_lidar: _Transform | None = None,
        motor_errors: tuple[Sequence[float], Sequence[Sequence[float]]] | None = None,
        latency_rate: float = 0.0,
        latency_epoch: float = 0.0,
        ranges: Sequence[float] = ...,
    ) -> Globals: ...
    def __getnewargs_ex__(self) -> tuple[tuple[_Transform], dict[str, Any]]: ...
    @property
    def latency(self) -> float:
        """Lidar stamps minus IMU clock at `latency_epoch`, s."""

    @property
    def latency_rate(self) -> float:
        """How much faster than the IMU's clock the lidar's runs, s/s."""

    @property
    def latency_epoch(self) -> float:
        """The stamp at which the latency is `latency`, s."""

    def latency_at(self, stamp: float) -> float:
        """Return by how much a stamp of the lidar is late, s."""

    @property
    def base_translation(self) -> NDArray[np.float64]:
        """Translation (3,) of the lidar (or motor) in the imu frame, m."""

    @property
    def base_quat_xyzw(self) -> NDArray[np.float64]:
        """Rotation (4,) of the lidar (or motor) in the imu frame."""

    @property
    def gyro_bias(self) -> NDArray[np.float64]:
        """Gyro bias (3,), rad/s, imu frame."""

    @property
    def accel_bias(self) -> NDArray[np.float64]:
        """Accelerometer bias (3,), m/s², imu frame."""

    @property
    def unit(self) -> tuple[_Rows, _Rows, _Rows, list[float], int]:
        """`gyro`, `g_sensitivity` and `accel` by rows, `reference` and `main_axis` of an `InertialUnit`."""

    @property
    def ranges(self) -> list[float]:
        """By how much ranges are too long (2,): m, and per `r tan θ`, rad."""

    @property
    def gravity(self) -> NDArray[np.float64]:
        """Gravity (3,), m/s², map frame, pointing up."""

    @property
    def encoder_zero(self) -> float:
        """Added to every encoder angle, rad; zero without a motor."""

    @property
    def motor_errors(self) -> tuple[list[float], list[list[float]]] | None:
        """`eccentricity` (2,) and `wobble` (2, 4) of `MotorErrors`, rad; None without a motor."""

    @property
    def motor_lidar_translation(self) -> NDArray[np.float64] | None:
        """Translation (3,) of the lidar in the rotating motor frame, m; None without a motor."""

    @property
    def motor_lidar_quat_xyzw(self) -> NDArray[np.float64] | None:
        """Rotation (4,) of the lidar in the rotating motor frame; None without a motor."""

    def moved_from(self, earlier: Globals) -> list[float]:
        """Return the correction (57,) that leads from `earlier` to these."""

    def levelled(self) -> Globals:
        """Return the same states with gravity straight up."""

@final
class Samples:
    """Poses `T_map_imu` at a uniform rate; between them p is linear and R is slerped.

    Parameters
    ----------
    start : s, time of the first sample
    dt : s, interval of the samples
    positions : (N, 3) float64, m, map frame, at least two
    quats_xyzw : (N, 4) float64, unit
    responses : (K, 6, 57) float64, how the first K follow the slow states, see `responses_at`
    """

    def __new__(
        cls,
        start: float,
        dt: float,
        positions: NDArray[np.float64],
        quats_xyzw: NDArray[np.float64],
        responses: NDArray[np.float64] | None = None,
    ) -> Samples: ...
    def __len__(self) -> int: ...
    @property
    def start(self) -> float:
        """Time of the first sample, s."""

    @property
    def end(self) -> float:
        """Time of the last sample, s."""

    @property
    def positions(self) -> NDArray[np.float64]:
        """Positions (N, 3), m, map frame."""

    @property
    def quats_xyzw(self) -> NDArray[np.float64]:
        """Rotations (N, 4)."""

    def slice(self, first: int, last: int) -> Samples:
        """Return the samples `first` to `last`, both included."""

    def position_at(self, time: float) -> NDArray[np.float64]:
        """Return the position (3,), m, map frame; beyond the ends that of the first or last sample."""

    def replaced(self, first: int, newer: Samples) -> Samples:
        """Return these samples with those from `first` on replaced by `newer`."""

    def following(self, correction: Sequence[float]) -> Samples:
        """Return these samples where a correction (57,) of the slow states moves them."""

    def responses_at(self, samples: Sequence[int]) -> NDArray[np.float64]:
        """How samples follow the slow states (K, 6, 57): `[δr, δt]`, rad and m, map frame, by each."""

    def extended(self, imu: Imu | None, globals: Globals, until: float) -> tuple[Samples, int]:
        """Extend by the IMU, or at constant velocity without one.

        Returns
        -------
        samples : up to the first at or after `until`, s
        n_blind : number of new samples for which the IMU had a gap
        """

    def place(
        self,
        points: NDArray[np.float64],
        stamps: NDArray[np.float64],
        angles: NDArray[np.float64] | None,
        globals: Globals,
        *,
        threads: int = 0,
    ) -> NDArray[np.float64]:
        """Place lidar points in the map (Kaul 2015, eq. 1 and 2).

        Parameters
        ----------
        points : (N, 3) float64, m, lidar frame
        stamps : (N,) float64, s, lidar clock, non-decreasing
        angles : (N,) float64, rad, encoder angle at each point; None without a motor
        globals : latency and mount of the lidar

        Returns
        -------
        (N, 3) float64, m, map frame; times beyond the samples take the first or last pose
        """

    def place_shots(
        self,
        points: NDArray[np.float64],
        stamps: NDArray[np.float64],
        angles: NDArray[np.float64] | None,
        globals: Globals,
        *,
        threads: int = 0,
    ) -> tuple[NDArray[np.float64], NDArray[np.float32], NDArray[np.float64]]:
        """Place lidar points in the map, with the beams that measured them.

        Parameters
        ----------
        points, stamps, angles, globals : as of `place`

        Returns
        -------
        points : (N, 3) float64, m, map frame
        beams : (N, 3) float32, unit directions from the lidar, map frame
        lengths : (N,) float64, m
        """

@final
class Surfels:
    """Surfels of a stretch of time, in the lidar frame at their mean stamps.

    Parameters
    ----------
    voxel_sizes : of each level, m, finest first
    level_starts : the surfels of level l are the rows `level_starts[l]` up to `level_starts[l + 1]`
    means : (N, 3) float64, m
    covariances : (N, 9) float64, m², of the points
    normals : (N, 3) float64, unit, towards the sensor
    stamps : (N,) float64, s, lidar clock
    angles : (N,) float64, rad, of the encoder; zero for heads without motor
    n_points : (N,) uint32
    """

    def __new__(
        cls,
        voxel_sizes: Sequence[float],
        level_starts: Sequence[int],
        means: NDArray[np.float64],
        covariances: NDArray[np.float64],
        normals: NDArray[np.float64],
        stamps: NDArray[np.float64],
        angles: NDArray[np.float64],
        n_points: NDArray[np.uint32],
    ) -> Surfels: ...
    def __len__(self) -> int: ...
    @property
    def stamps(self) -> NDArray[np.float64]:
        """Mean stamps (N,), s, lidar clock."""

    @property
    def means(self) -> NDArray[np.float64]:
        """Means (N, 3), m, lidar frame."""

    @property
    def normals(self) -> NDArray[np.float64]:
        """Unit normals (N, 3) towards the sensor, lidar frame."""

    @property
    def angles(self) -> NDArray[np.float64]:
        """Mean encoder angles (N,), rad; zero for heads without motor."""

    @property
    def voxel_sizes(self) -> NDArray[np.float64]:
        """Voxel size (N,) of each surfel's level, m."""

def extract_surfels(
    points: NDArray[np.float64],
    stamps: NDArray[np.float64],
    angles: NDArray[np.float64] | None,
    samples: Samples,
    globals: Globals,
    *,
    settings: SurfelSettings,
    range_sigma: float,
    threads: int = 0,
) -> Surfels:
    """Extract surfels from lidar points placed with `samples` (Kaul 2015, section 2.1).

    Parameters
    ----------
    points, stamps, angles, globals : as in `Samples.place`
    range_sigma : m, of one range; its part is taken out of the surfels' covariances
    """

@final
class FixedView:
    """Immovable surfels in the map.

    Parameters
    ----------
    sets : surfels to choose from
    start, stop : s, those with stamps in `[start, stop)` are frozen where `samples` puts them
    """

    def __new__(
        cls, sets: Sequence[Surfels], start: float, stop: float, samples: Samples, globals: Globals
    ) -> FixedView: ...
    def __len__(self) -> int: ...

@final
class Registration:
    """Result of a registration."""

    @property
    def samples(self) -> Samples:
        """Corrected trajectory."""

    @property
    def globals(self) -> Globals:
        """Corrected slow states."""

    @property
    def covariance(self) -> NDArray[np.float64]:
        """Covariance (57, 57) of the slow states; zero where frozen."""

    def sample_covariances(self) -> NDArray[np.float64]:
        """Compute the covariances (N, 6, 6) of the correction of each sample, rotation first.

        In rad and m, perturbed on the left in the map frame; zero where the past stays.
        """

    def covariance_at(self, time: float) -> NDArray[np.float64]:
        """Covariance (6, 6) of the correction at `time`, as of `sample_covariances`."""

    @property
    def offset(self) -> list[float]:
        """Correction (57,) that leads from the prior's mean to `globals`."""

    @property
    def n_surfels(self) -> int:
        """Surfels that took part."""

    @property
    def n_matches(self) -> int:
        """Matches within the window."""

    @property
    def n_fixed_matches(self) -> int:
        """Matches with fixed views."""

    @property
    def inlier_share(self) -> float:
        """Share of the matches with a residual below two standard deviations."""

    @property
    def residual_rms(self) -> float:
        """Weighted root mean square of the matches' residuals in standard deviations."""

    @property
    def translation_eigenvalues(self) -> list[float]:
        """Eigenvalues (3) of the mean outer product of the matches' normals, increasing."""

    @property
    def rotation_eigenvalues(self) -> list[float]:
        """Eigenvalues (3) of the mean outer product of the rotations the matches see, increasing."""

    @property
    def weakest_direction(self) -> list[float]:
        """Direction (3) in the map in which the matches say least about the translation."""

    @property
    def gyro_rms(self) -> float | None:
        """Residuals of the gyro over a second, root mean square over what its noise leaves to expect."""

    @property
    def accel_rms(self) -> float | None:
        """The same of the accelerometer."""

    @property
    def gyro_correlation(self) -> float | None:
        """Correlation of neighbouring residuals of the gyro beyond what is expected."""

    @property
    def accel_correlation(self) -> float | None:
        """The same of the accelerometer."""

    @property
    def n_outer(self) -> int:
        """Outer iterations."""

    @property
    def converged(self) -> bool:
        """Whether the last step was below the thresholds."""

    @property
    def n_blind(self) -> int:
        """Samples of the trajectory without inertial data."""

@final
class Piece:
    """A trajectory without a break, with what was measured along it.

    Parameters
    ----------
    samples : trajectory to start from
    surfels : of consecutive stretches of some seconds, in order of time
    imu : its inertial samples, less the history of their biases; None for a lidar alone
    information : (57, 57) float64 about the prior's mean of the slow states
    offset : (57,) correction that leads from that mean to `globals`
    frozen : (57) slow states that are not estimated
    optional : (57) those that stay as they are unless the recording shows that they are others
    doubted : (57) those that stay as they are but are not known exactly, so that the others are the less
        certain for it
    shown_noise : times, s, and how large the noise of gyro and accelerometer shows itself then, as
        standard deviations over the stated ones; without any as stated. Weights stay as stated.
    """

    def __new__(
        cls,
        samples: Samples,
        surfels: Sequence[Surfels],
        imu: Imu | None,
        globals: Globals,
        *,
        information: NDArray[np.float64],
        offset: Sequence[float],
        frozen: Sequence[bool],
        optional: Sequence[bool],
        doubted: Sequence[bool],
        shown_noise: tuple[list[float], list[tuple[float, float]]],
    ) -> Piece: ...

@final
class GlobalRegistration:
    """Result of a global registration; lists are in the order of the pieces."""

    @property
    def samples(self) -> list[Samples]:
        """Corrected trajectories."""

    @property
    def globals(self) -> list[Globals]:
        """Corrected slow states."""

    @property
    def covariances(self) -> list[NDArray[np.float64]]:
        """Covariances (57, 57) of the slow states; zero where frozen."""

    @property
    def iterations(self) -> list[tuple[int, int, float, float, float, float]]:
        """What the matches of each iteration said before its step, and the step.

        Matches, those between stretches that do not follow each other, share of inliers, weighted
        root mean square in standard deviations, largest rotation, rad, and translation, m.
        """

    @property
    def fit(self) -> tuple[float, float]:
        """Share of inliers and weighted root mean square of the final matches."""

    @property
    def dispersion(self) -> float:
        """How much matches scatter beside what their weights say: their variance over the stated one."""

    def pose_covariances(self, piece: int, times: list[float]) -> NDArray[np.float64]:
        """Covariances (K, 6, 6) of the corrections of a piece at `times`, as their rows scatter."""

    def relative_covariances(self, piece: int, pairs: list[list[float]]) -> NDArray[np.float64]:
        """Those of a pose at the second of two times each, as seen from the pose at the first one."""

    @property
    def counts(self) -> tuple[int, int, int, int]:
        """Unknowns, pairs of stretches, those that do not follow each other, surfels."""

    @property
    def converged(self) -> bool:
        """Whether the last step was below the thresholds."""

    @property
    def n_blind(self) -> int:
        """Samples of the trajectories without inertial data."""

def register_globally(
    pieces: Sequence[Piece],
    *,
    settings: CoreSettings,
    plan: MatchingPlan,
    threads: int = 0,
) -> GlobalRegistration:
    """Correct whole trajectories and their slow states by everything that was seen more than once.

    The first piece defines the map: its first position and heading stay, and without an IMU its
    first attitude.

    Parameters
    ----------
    pieces : roughly aligned with each other
    plan : which stretches are matched with which

    Raises
    ------
    SingularSystemError, DivergedError

    References
    ----------
    Kaul 2015, section 2.2
    """

def register_window(
    samples: Samples,
    surfels: Sequence[Surfels],
    views: Sequence[FixedView],
    imu: Imu | None,
    globals: Globals,
    *,
    information: NDArray[np.float64],
    offset: Sequence[float],
    frozen: Sequence[bool],
    joined: bool,
    settings: CoreSettings,
    threads: int = 0,
) -> Registration:
    """Correct a trajectory and the slow states by surfel matches and inertial samples.

    Parameters
    ----------
    information : (57, 57) float64 about the prior's mean of the slow states
    offset : (57,) correction that leads from that mean to `globals`
    frozen : (57) slow states that are not estimated
    joined : whether the start continues a past that is final (its first three control points follow
        the slow states as `samples` do); otherwise only the first pose stays

    Raises
    ------
    SingularSystemError, DivergedError

    References
    ----------
    Kaul 2015, section 2.1
    """

@final
class PoseGraphSolution:
    """The best poses of a graph."""

    @property
    def positions(self) -> NDArray[np.float64]:
        """Positions (N, 3), m, map frame."""

    @property
    def quats_xyzw(self) -> NDArray[np.float64]:
        """Rotations (N, 4)."""

    @property
    def weights(self) -> NDArray[np.float64]:
        """Weight (L,) of each link: 1 believed, 0 rejected."""

    @property
    def chi2(self) -> NDArray[np.float64]:
        """Squared residual (L,) of each link in units of its variance."""

    @property
    def cost(self) -> float:
        """Half the sum of the weighted squared residuals of links and gravity."""

    @property
    def initial_cost(self) -> float:
        """The same at the given poses, with all links."""

    @property
    def n_iterations(self) -> int:
        """Linearizations in all."""

    @property
    def converged(self) -> bool:
        """Whether the last step promised too little to go on."""

def shot_words(
    points: NDArray[np.float64],
    *,
    beams: NDArray[np.float32],
    ranges: NDArray[np.float32],
    times: NDArray[np.float64],
    edge: float,
    pass_length: float,
) -> NDArray[np.uint32]:
    """Return points (N, 3) m, map frame, as `SurfaceSample` takes them, (N, 5): few bytes for what waits.

    Parameters
    ----------
    beams, ranges, times : unit directions, lengths (m) and times (s) of their beams
    edge : m, of the smallest cells
    pass_length : s, what is measured within it shares the error of the trajectory
    """

def solve_pose_graph(
    positions: NDArray[np.float64],
    quats_xyzw: NDArray[np.float64],
    fixed: NDArray[np.bool_],
    *,
    links: Links,
    gravity: GravityTerms,
    settings: SolveSettings,
) -> PoseGraphSolution:
    """Find the poses that agree best with links and gravity, and the links that are false.

    Parameters
    ----------
    positions : (N, 3) float64, m, map frame
    quats_xyzw : (N, 4) float64, unit
    fixed : (N,) bool, nodes that stay

    Raises
    ------
    SingularSystemError, DivergedError
    """

@final
class KalmanFilter:
    """Error-state iterated Kalman filter with a local map (Fu 2023); runs on the caller's thread.

    The order of the tangent, by which the covariance is read: attitude, position, velocity, biases of
    gyro and accelerometer (3 each), gravity (2), rotation and translation of the motor in the IMU
    frame and of the lidar behind it (3 each), latency, encoder delay.

    Parameters
    ----------
    time : s, of the state
    covariance : (31, 31), zeros for what is known exactly
    """

    def __new__(
        cls,
        settings: FilterSettings,
        *,
        time: float,
        state: FilterState,
        covariance: NDArray[np.float64],
    ) -> KalmanFilter: ...
    def propagate(
        self,
        times: NDArray[np.float64],
        gyro: NDArray[np.float64],
        accel: NDArray[np.float64],
        *,
        until: float,
    ) -> None:
        """Carry the state on to `until` by samples around that time; beyond the last its values go on.

        Parameters
        ----------
        times, gyro, accel : (M,) s, (M, 3) rad/s and m/s², imu frame
        """

    def update(
        self,
        points: NDArray[np.float64],
        times: NDArray[np.float64],
        *,
        rings: NDArray[np.uint16] | None = None,
        angles: NDArray[np.float64] | None = None,
    ) -> KalmanSweep:
        """Correct the state by a sweep that ends about now, and add the sweep to the map.

        Parameters
        ----------
        points : (N, 3) float64, m, lidar frame
        times : (N,) float64, s, lidar clock
        rings : (N,) beam numbers; without them each point is a feature
        angles : (N,) rad, of the motor

        Raises
        ------
        DivergedError
        """

    def release(self) -> None:
        """Hand out the poses since the last update without a correction."""

    def rest(self, sigma: float) -> bool:
        """Correct the state by a velocity of zero; return whether the carrier can be at rest.

        Parameters
        ----------
        sigma : m/s, of that velocity
        """

    def take_poses(self) -> _Poses:
        """Return times (N,), positions (N, 3) and quaternions (N, 4) that were not returned before."""

    def take_odometry(self) -> tuple[_Poses, _Poses]:
        """Return the same of the high-rate odometry, raw and smoothed."""

    @property
    def time(self) -> float:
        """Of the state, s."""

    @property
    def pose(self) -> _Returned:
        """Of the IMU in the map."""

    @property
    def velocity(self) -> list[float]:
        """(3,) m/s, map frame."""

    @property
    def gyro_bias(self) -> list[float]:
        """(3,) rad/s."""

    @property
    def accel_bias(self) -> list[float]:
        """(3,) m/s²."""

    @property
    def gravity(self) -> list[float]:
        """(3,) m/s², map frame, upwards."""

    @property
    def base(self) -> _Returned:
        """Of the motor in the IMU frame, or of the lidar that is fixed."""

    @property
    def lidar(self) -> _Returned:
        """Of the lidar in the frame that the motor turns."""

    @property
    def latency(self) -> float:
        """Lidar stamps minus IMU clock, s."""

    @property
    def encoder_delay(self) -> float:
        """The encoder's angle at a stamp of the lidar is that of this much earlier, s."""

    @property
    def covariance(self) -> NDArray[np.float64]:
        """(31, 31), the map taken as exact."""

    @property
    def pose_covariance(self) -> NDArray[np.float64]:
        """(6, 6) of attitude and position, with that of the map they are in."""

@final
class KalmanSweep:
    """What became of a sweep."""

    @property
    def matched(self) -> bool:
        """Whether enough of it matched the map to correct the state."""

    @property
    def n_features(self) -> list[int]:
        """Planar features and edges."""

    @property
    def n_planes(self) -> int:
        """In the map, on all levels."""

    @property
    def new_share(self) -> float:
        """Share of the planar features in voxels without a plane."""

    @property
    def blind(self) -> float:
        """Seconds since the last sweep without inertial samples."""

    @property
    def n_matches(self) -> list[int]:
        """Features with a plane or a line, and of these with a line."""

    @property
    def inlier_share(self) -> float:
        """Share of the matches within two standard deviations."""

    @property
    def residual_rms(self) -> float:
        """Weighted root mean square of the residuals in standard deviations."""

    @property
    def rmse(self) -> float:
        """Weighted root mean square of the residuals, m."""

    @property
    def n_iterations(self) -> int:
        """Solutions of the update."""

    @property
    def converged(self) -> bool:
        """Whether the last step was short enough."""

    @property
    def eigenvalues(self) -> list[list[float]]:
        """Of the information about translation and rotation, (3,) each, shares of their sum, increasing."""

@final
class NdtReference:
    """The surfaces that keyframes have seen, as normal distributions of voxels on several levels.

    Parameters
    ----------
    voxel_size : m, of the finest level; each further level doubles
    n_levels : 1 to 16
    sigma : m, least standard deviation of a surface: the noise of a range
    roughness : the same in voxels of each level (the eigenvalue floor)
    """

    def __new__(
        cls, *, voxel_size: float, n_levels: int, sigma: float, roughness: float
    ) -> NdtReference: ...
    def __len__(self) -> int: ...
    def insert(
        self,
        points: NDArray[np.float64],
        pose: _Transform,
        *,
        lidar: _Vector,
        threads: int = 0,
    ) -> None:
        """Add the points of a keyframe.

        Parameters
        ----------
        points : (N, 3) float64, m, in a frame of which `pose` is the place in the map
        lidar : (3,) m, map frame, from where they were seen
        """

    def keep_within(self, centre: _Vector, radius: float, *, threads: int = 0) -> None:
        """Forget what is farther than `radius`, m, from `centre` (3,), m, map frame."""

    def register(
        self,
        points: NDArray[np.float64],
        expected: _Transform,
        *,
        rotation_sigma: float,
        translation_sigma: float,
        independence: float,
        coarse: bool = True,
        threads: int = 0,
    ) -> NdtRegistration:
        """Find the pose at which a scan fits what the keyframes saw.

        Parameters
        ----------
        points : (N, 3) float64, m, frame of the scan
        expected : its pose in the map, from which the search begins
        rotation_sigma, translation_sigma : rad and m, how well that is known
        independence : information of a point relative to that of an independent one
        coarse : whether to begin on the coarsest level, or to use the finest only

        Raises
        ------
        NotEnoughDataError, SingularSystemError, DivergedError
        """

@final
class NdtRegistration:
    """Result of a registration to a reference."""

    @property
    def translation(self) -> NDArray[np.float64]:
        """Position (3,) of the scan, m, map frame."""

    @property
    def quat_xyzw(self) -> NDArray[np.float64]:
        """Rotation (4,) of the scan."""

    @property
    def n_matched(self) -> int:
        """Points in voxels with a distribution."""

    @property
    def inlier_share(self) -> float:
        """Share of the matched points within two standard deviations."""

    @property
    def residual_rms(self) -> float:
        """Weighted root mean square of the distances in standard deviations."""

    @property
    def rmse(self) -> float:
        """Weighted root mean square of the distances, m."""

    @property
    def translation_eigenvalues(self) -> list[float]:
        """Eigenvalues (3) of the information about the translation, shares of their sum, increasing."""

    @property
    def rotation_eigenvalues(self) -> list[float]:
        """Eigenvalues (3) of the information about the rotation, shares of their sum, increasing."""

    @property
    def n_iterations(self) -> int:
        """Evaluations of the score."""

    @property
    def converged(self) -> bool:
        """Whether the last step was short enough."""

def thin_points(points: NDArray[np.float64], *, spacing: float, most: int) -> NDArray[np.uint64]:
    """Choose the first of the points (N, 3), m, in each voxel of edge `spacing`, m.

    Where they are more than `most`, evenly chosen ones of them; returns increasing row numbers.
    """
