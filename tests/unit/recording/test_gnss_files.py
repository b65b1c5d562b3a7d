# SPDX-License-Identifier: MIT OR Apache-2.0
"""Fixes from files of RTKLIB and of receivers, whose every number is known."""

from datetime import datetime, timezone

import numpy as np
import pytest

from bentwing.base.clock import Clock
from bentwing.base.errors import InputError
from bentwing.base.gps_time import leap_seconds, utc_of_gps_ns
from bentwing.recording.gnss_files.read import read_fix_file

START_NS = 1_700_000_000 * 10**9  # 2023-11-14 22:13:20 UTC
ALL = (0.0, 60.0)
HEAD = (
    "% program   : RTKPOST ver.2.4.3\n"
    "%  GPST                  latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)"
    "  sdne(m)  sdeu(m)  sdun(m) age(s)  ratio\n"
)


def date_of(stamp_ns):
    return datetime.fromtimestamp(stamp_ns // 10**9, timezone.utc)


def row(second, quality=1, stated="0.010 0.020 0.030 0.005 -0.006 0.007", leap=18):
    """A row of RTKLIB, whose clock is ahead of UTC by 18 s since 2017."""
    when = date_of(START_NS + (second + leap) * 10**9)
    return f"{when:%Y/%m/%d %H:%M:%S}.250 47.1 11.2 600.5 {quality} 12 {stated} 0.00 3.1\n"


def sentence(body):
    total = 0
    for letter in body.encode():
        total ^= letter
    return f"${body}*{total:02X}\r\n"


def gga(second, quality=4, *, height="552.3,M,48.2,M", day=0):
    when = date_of(START_NS + second * 10**9 + day * 86_400 * 10**9)
    return sentence(f"GNGGA,{when:%H%M%S}.25,4706.0,N,01112.0,E,{quality},12,0.8,{height},1.0,0001")


def gst(second):
    when = date_of(START_NS + second * 10**9)
    return sentence(f"GNGST,{when:%H%M%S}.25,0.1,,,,0.01,0.02,0.03")


def rmc(second, days=0):
    when = date_of(START_NS + second * 10**9 + days * 86_400 * 10**9)
    return sentence(f"GNRMC,{when:%H%M%S}.25,A,4706.0,N,01112.0,E,0.1,0.0,{when:%d%m%y},,,A")


@pytest.fixture
def read(tmp_path):
    def read(text, seconds=ALL, **options):
        (tmp_path / "fixes").write_text(text)
        return read_fix_file(tmp_path / "fixes", Clock(START_NS), seconds, **options)

    return read


def test_a_solution_of_rtklib_is_on_utc_with_its_covariances(read):
    """Off the diagonal it has roots with a sign, and north stands before east."""
    found = read(HEAD + row(1) + row(2))
    assert found.times.tolist() == [1.25, 2.25]
    assert found.places.tolist() == [[11.2, 47.1, 600.5]] * 2
    expected = [[4e-4, 2.5e-5, -3.6e-5], [2.5e-5, 1e-4, 4.9e-5], [-3.6e-5, 4.9e-5, 9e-4]]
    assert found.covariances[0] == pytest.approx(np.array(expected))
    assert found.counts["leap_seconds"] == 18
    assert found.counts["of_quality_fixed"] == 2


def test_weeks_and_seconds_are_gps_time_whatever_the_header_says(read):
    gps = START_NS // 10**9 + 18 - 315_964_800 + 5
    line = f"{gps // 604_800} {gps % 604_800}.500 47.1 11.2 600.5 1 12\n"
    for head in (HEAD, HEAD.replace("GPST", " UTC")):
        assert read(head + line).times.tolist() == [5.5]


def test_dates_of_utc_have_no_leap_seconds(read):
    found = read(HEAD.replace("GPST", " UTC") + row(1, leap=0))
    assert found.times.tolist() == [1.25]
    assert found.counts["leap_seconds"] == 0
    assert read(HEAD + row(1, leap=0), scale="utc").times.tolist() == [1.25]


def test_a_header_without_a_time_scale_must_be_told_one(read):
    head = HEAD.replace("GPST", "    ")
    with pytest.raises(InputError, match="--gnss-time"):
        read(head + row(1))
    assert read(head + row(1), scale="gps").times.tolist() == [1.25]


@pytest.mark.parametrize(
    ("quality", "kind", "level"),
    [(1, "fixed", 0.02), (2, "float", 0.3), (4, "differential", 0.7), (5, "single", 3.0), (6, "ppp", 0.1)],
)  # fmt: skip
def test_a_fix_counts_by_its_quality_where_nothing_else_is_said(read, quality, kind, level):
    found = read(HEAD + row(1, quality, ""))
    assert found.counts[f"of_quality_{kind}"] == 1
    assert np.sqrt(found.covariances[0, 0, 0]) == pytest.approx(level, abs=1e-3)


def test_floating_ambiguities_are_not_believed_to_the_centimetre(read):
    assert np.sqrt(read(HEAD + row(1, 2)).covariances[0, 1, 1]) > 0.09


def test_other_coordinates_of_rtklib_are_refused_with_the_setting_to_change(read):
    with pytest.raises(InputError, match="out-solformat"):
        read("%  GPST          x-ecef(m)      y-ecef(m)   z-ecef(m)   Q\n" + row(1))


def test_a_log_of_a_receiver_has_heights_above_the_ellipsoid_and_its_accuracies(read):
    found = read(rmc(1) + gga(1) + gst(1) + gga(2, 5))
    assert found.times.tolist() == [1.25, 2.25]
    assert found.places[0] == pytest.approx([11.2, 47.1, 600.5])
    assert np.sqrt(np.diag(found.covariances[0])) == pytest.approx([0.02, 0.01, 0.03], abs=2e-3)
    assert np.sqrt(found.covariances[1, 0, 0]) == pytest.approx(0.3, abs=1e-3)
    assert found.counts["of_quality_fixed"] == found.counts["of_quality_float"] == 1


def test_south_and_west_are_negative(read):
    body = "GPGGA,221321.25,4706.0,S,01112.0,W,1,12,0.8,552.3,M,48.2,M,,"
    assert read(sentence(body)).places[0] == pytest.approx([-11.2, -47.1, 600.5])


def test_the_date_of_a_log_counts_and_without_one_the_day_of_the_recording(read):
    assert read(gga(3)).times.tolist() == [3.25]
    assert read(rmc(3) + gga(3)).times.tolist() == [3.25]
    with pytest.raises(InputError, match="2023-11-12 22:13:23"):
        read(rmc(3, days=-2) + gga(3))


def test_a_log_goes_on_after_midnight(read):
    """The date is told before midnight only; the recording goes on for three hours."""
    to_midnight = 6400  # s from 22:13:20
    text = rmc(to_midnight - 2) + gga(to_midnight - 2) + gga(to_midnight + 5)
    assert read(text, (0.0, 1e4)).times.tolist() == [to_midnight - 1.75, to_midnight + 5.25]


@pytest.mark.parametrize(
    ("line", "counted"),
    [
        (gga(2, 0), "no_fix"),
        (gga(2, 6), "no_fix"),
        (gga(2, 8), "no_fix"),
        (gga(2, height="552.3,M,,"), "no_geoid_separation"),
        (gga(2).replace("4706", "4707"), "broken_messages"),
        (gga(1), "repeated"),
    ],
)
def test_what_is_no_fix_is_left_out_and_counted(read, line, counted):
    found = read(gga(1) + line)
    assert len(found.times) == 1
    assert found.counts[counted] == 1


def test_fixes_of_another_time_say_when_both_were(read):
    with pytest.raises(InputError, match=r"2023-11-14 22:15:20 .* begins at 2023-11-14 22:13:20"):
        read(HEAD + row(120))


@pytest.mark.parametrize("text", ["", "hello\n", "{}", "a,b\n1,2\n"])
def test_another_kind_of_file_is_refused(read, text):
    with pytest.raises(InputError, match="neither"):
        read(text)


@pytest.mark.parametrize("whole", [HEAD + row(1) + row(2), rmc(1) + gga(1) + gst(1) + gga(2)])
def test_damage_ends_in_fewer_fixes_or_a_refusal(read, whole):
    rng = np.random.default_rng(100)
    for _ in range(300):
        text = list(whole[: rng.integers(1, len(whole) + 1)])
        for at in rng.integers(0, len(text), 3):
            text[at] = chr(rng.integers(32, 127))
        try:
            found = read("".join(text))
        except InputError:
            continue
        assert len(found.times) <= 2
        assert np.isfinite(found.covariances).all()


@pytest.mark.parametrize(
    ("day", "leap"), [("2016-12-31 23:59:59", 17), ("2017-01-01 00:00:00", 18), ("1980-01-07", 0)]
)
def test_gps_time_is_ahead_of_utc_by_the_leap_seconds_until_then(day, leap):
    utc = int(datetime.fromisoformat(day).replace(tzinfo=timezone.utc).timestamp()) * 10**9
    assert leap_seconds(utc) == leap
    assert utc_of_gps_ns(utc + (leap - 315_964_800) * 10**9) == utc


def test_a_line_without_end_is_left_out_and_the_next_one_read(read):
    assert read(HEAD + row(1) + 10_000 * "7" + "\n" + row(2)).times.tolist() == [1.25, 2.25]
