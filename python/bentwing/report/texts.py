# SPDX-License-Identifier: MIT OR Apache-2.0
"""The words of a report that a client reads, in one place, so that they can be said in other languages."""

from __future__ import annotations

from dataclasses import dataclass, field

_REASONS = {
    "no_echo": "without an echo",
    "range": "outside the range of the lidar",
    "self_hits": "on the carrier itself",
    "no_angle": "without an angle of the motor",
    "outside": "before or after the estimated way",
    "mixed": "between two surfaces",
    "moving": "on things that moved",
    "thinned": "thinned, as was asked for",
}


@dataclass(frozen=True, slots=True)
class Texts:
    """Words of the first page and of the evidence; the defaults are English."""

    language: str = "en"
    title: str = "Mapping report"
    project: str = "Project"
    number: str = "Number"
    site: str = "Site"
    client: str = "Client"
    contractor: str = "Contractor"
    operator: str = "Operator"
    instrument: str = "Instrument"
    remarks: str = "Remarks"
    recorded: str = "Recorded"
    recording: str = "Recording"
    unknown_time: str = "the recorder's clock gave no date"
    made: str = "Report of"
    incomplete: str = "Incomplete: this is not a finished map"
    stopped: str = (
        "The run stopped in the stage “{stage}”: {reason}. What was done until then is kept."
    )
    finished: str = "Map finished"
    worth_knowing: str = "Worth knowing:"
    accuracy_none: str = "No accuracy is stated: this kind of result has no error estimate of its own; see the checks below."
    accuracy_checked: str = "Accuracy: {n} check points are off by {rms:.1f} mm root mean square; they are listed below."
    area: str = "area seen from above"
    volume: str = "volume between lowest and highest surface"
    length: str = "length of the way"
    duration: str = "duration of the recording"
    points: str = "points in the map"
    extent: str = "extent"
    plan: str = "Plan"
    plan_note: str = "Height by colour; the line is the way of the sensor, the circle its start."
    plan_north: str = "Grid north is up; the grid has the coordinates of the system below."
    plan_local: str = "The grid is that of the map's own frame, in metres."
    plan_site: str = "The grid is that of the control points, in metres; its y axis points up."
    plan_roof: str = (
        "What is above the sensor is left out, so that the roof does not hide the floor."
    )
    plan_marks: str = "Triangles are control points, squares are check points."
    coordinates: str = "Coordinates"
    local_frame: str = (
        "Local frame of the map, in metres: the origin is at the first pose, z points up, and the heading is "
        "that of the start. It has no EPSG code."
    )
    site_frame: str = "Frame of the control points, in metres, without an EPSG code; z points up."
    system: str = "{name} (EPSG:{epsg}). Heights are {heights}."
    given_system: str = "Those of the given map."
    left_out: str = "Left out of the map"
    left_none: str = "Nothing was left out."
    left_fixes: str = "{n} of {of} GNSS fixes that do not agree with the others"
    left_marks: str = "control points without a flat surface around them: {names}"
    of_returns: str = "Of {n:,} returns of the lidar {written:,} are in the map. Left out:"
    reasons: dict[str, str] = field(default_factory=lambda: dict(_REASONS))
    marks: str = "Control and check points"
    marks_note: str = (
        "A mark is compared with the flat surface that the map has around it, along the direction in which this "
        "faces. Control points hold the map; check points only measure it."
    )
    marks_control: str = (
        "Control points ({n}): {rms:.1f} mm root mean square, {most:.1f} mm at most."
    )
    marks_check: str = "Check points ({n}): {rms:.1f} mm root mean square, {most:.1f} mm at most."
    uses: dict[str, str] = field(default_factory=lambda: {"control": "control", "check": "check"})
    mark: str = "mark"
    use: str = "use"
    across: str = "measured"
    before: str = "before, mm"
    residual: str = "residual, mm"
    picked: str = "seen in the map, off by, mm"
    heights: str = "height"
    sideways: str = "sideways"
    mixed: str = "sloped"
    not_used: str = "not used: no flat surface"
    only_seen: str = "where it was seen"
    contradicts: str = "not used: contradicts the others"
    map: str = "Map"
    no_points: str = "No points were mapped."
    no_map: str = "No map was asked for."
    nothing_refined: str = "No point was moved: there is no surface that enough passes have seen."
    refined: str = (
        "{share:.0f} % of the points were moved along their beams to the surface that they measured "
        "together, by {move:.1f} mm in the median; one standard deviation along the beam was "
        "{before:.1f} mm and is {after:.1f} mm. The pictures and the accuracy below show the points "
        "as measured."
    )
    oblique: str = "Oblique view"
    oblique_note: str = "coloured by height"
    by_time: str = "Plan by time"
    by_time_note: str = "Colours that differ strongly side by side are places seen again later; doubled walls there would be drift."
    side: str = "Side view"
    side_note: str = "along the longer extent of the map"
    section: str = "Section"
    section_note: str = "{slab:g} m thick, through the middle of the way"
    coverage: str = "Coverage"
    density: str = "Density"
    density_note: str = "Points per m² of plan on a logarithmic scale, in squares of {cell:.2f} m; {median:,.0f} per m² in the median."
    visits: str = "Visits"
    visits_note: str = (
        "Times each square was seen, ten seconds or more apart; of {area:,.0f} m² seen from above, {again:.0f} % "
        "were seen more than once."
    )
    visited_again: str = "Places seen again"
    agreement: str = "Agreement of the map with itself"
    localization: str = "Place in the given map"
    changes: str = "What has changed since the map"
    changes_note: str = (
        "Something has appeared where the map was seen to be empty, and has disappeared where the recording "
        "looked through it. What neither of them saw counts as neither."
    )
    unchanged: str = "Nothing has changed that is larger than 0.1 m² seen from above."
    change: str = "change"
    kinds: dict[str, str] = field(
        default_factory=lambda: {"appeared": "appeared", "disappeared": "disappeared"}
    )
    changes_plan: str = "Plan of changes"
    changes_plan_note: str = "Numbers as in the table. Orange has appeared, blue has disappeared, grey is the map of this recording."
    engineering: str = "Engineering details"
    engineering_note: str = (
        "Motion, estimate, calibration, settings and versions, for those who check the method."
    )
    engineering_print: str = (
        "Motion, estimate, calibration, settings and versions are in report.html and run.json."
    )


ENGLISH = Texts()
