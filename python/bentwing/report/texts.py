# SPDX-License-Identifier: MIT OR Apache-2.0
"""The words of a report that a client reads, in one place, so that they can be said in other languages."""

from __future__ import annotations

from dataclasses import dataclass, field
from string import Formatter
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

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
_HEADLINES = {
    "good": "Good: all that was checked agrees",
    "doubtful": "Doubtful: check this map before using it",
    "failed": "Failed: this map is wrong, do not use it",
}
_SCENE = {
    "colour": "Colour",
    "height": "Height",
    "time": "Time",
    "sigma": "Deviation",
    "intensity": "Intensity",
    "incidence": "Incidence",
    "view": "View",
    "oblique": "Oblique",
    "top": "Top",
    "front": "Front",
    "side": "Side",
    "distance": "Distance",
    "measure": "Measure",
    "clicked": "Clicked",
    "points": "Save points",
    "loop": "Save loop",
    "cut": "Cut at height",
    "box": "Clip box",
    "unknown": "grey: not known",
    "first": "Click a point of the map.",
    "second": "Click another point.",
    "apart": "{whole} m apart; {level} m level, {up} m up.",
    "none": "Press Measure and click points of the map first.",
}
_LEGENDS = {
    "height": "height, m",
    "time": "time, s",
    "sigma": "standard deviation along the beam, mm",
    "intensity": "intensity as the lidar gives it",
    "incidence": "angle between beam and normal, °",
}


@dataclass(frozen=True, slots=True)
class Texts:
    """Words of the first page and of the evidence; the defaults are English.

    Attributes
    ----------
    language : of the page, as HTML names it
    decimal, thousands : what stands before decimals, and between groups of three digits
    date : of `strftime`
    findings : what a verdict has found and what to do, by the kind of evidence; of none as run.json has it
    phrases : of what has no name here, by its English words
    """

    language: str = "en"
    decimal: str = "."
    thousands: str = ","
    date: str = "%Y-%m-%d"
    phrases: Mapping[str, str] = field(default_factory=dict)
    title: str = "Mapping report"
    project: str = "Project"
    number_of: str = "Number"
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
    findings: dict[str, tuple[str, str]] = field(default_factory=dict)
    headlines: dict[str, str] = field(default_factory=lambda: dict(_HEADLINES))
    set_up: str = (
        "The recording shows of the sensor head what no payload told, or told otherwise, and was mapped "
        "with it. Write into payload.yaml:"
    )
    accuracy: str = (
        "Expected accuracy (68 %): over the whole path {whole}; over ten metres of it {short}"
    )
    accuracy_of: str = (
        "{horizontal} horizontally, {vertical} vertically and {heading:.2g}° in heading"
    )
    accuracy_map: str = "surfaces as measured scatter by {mm:.0f} mm"
    accuracy_none: str = "No accuracy is stated: this kind of result has no error estimate of its own; see the checks below."
    accuracy_checked: str = "Accuracy: {n} check points are off by {rms:.1f} mm root mean square; they are listed below."
    area: str = "area seen from above"
    volume: str = "volume between lowest and highest surface"
    length: str = "length of the way"
    duration: str = "duration of the recording"
    points: str = "points in the map"
    million: str = "M"
    extent: str = "extent"
    seen_all: str = "Every direction of motion was seen all the time."
    seen_not: str = (
        "Red: for {total:.0f} s the surroundings left a direction of motion unseen ({spans}); inertial data and "
        "smoothness carried it there."
    )
    span: str = "from {first:.1f} to {last:.1f} s"
    shorter: str = "{n} shorter times"
    conjunction: str = "and"
    below: str = "below {share:.1f} %"
    height_legend: str = "height, m"
    time_legend: str = "time, s"
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
    system: str = "{name} (EPSG:{epsg:d}). Heights are {heights}."
    given_system: str = "Those of the given map."
    left_out: str = "Left out of the map"
    left_none: str = "Nothing was left out."
    left_fixes: str = "{n} of {of} GNSS fixes that do not agree with the others"
    left_marks: str = "control points of which no flat surface or sphere was found: {names}"
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
    spheres_note: str = (
        "Of a sphere, the centre is fitted to its points: residual is the distance of the centres."
    )
    sphere: str = "sphere"
    no_sphere: str = "not used: no sphere found"
    sigma: str = "standard deviation, mm"
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
    scene: str = "In three dimensions"
    scene_note: str = (
        "Without perspective, so that the scale bar is true everywhere. Drag to turn, right or shift drag to "
        "shift, two fingers to shift and zoom. The wheel zooms after a click, or with Ctrl. Keys: arrows turn, "
        "shift and arrows shift, + and \N{MINUS SIGN} zoom, Enter picks the point in the middle. What was clicked "
        "is saved as a file of control points, or the last two as a loop. The way of the sensor is dark, and red "
        "where a direction was not seen."
    )
    scene_keys: str = "The map in three dimensions; arrow keys turn it"
    scene_off: str = "This browser shows no WebGL; the pictures below say the same."
    scene_sides: tuple[str, ...] = ("x from", "x to", "y from", "y to", "height from")
    scene_words: dict[str, str] = field(default_factory=lambda: dict(_SCENE))
    scene_legends: dict[str, str] = field(default_factory=lambda: dict(_LEGENDS))
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
    density_legend: str = "points per m²"
    density_note: str = "Points per m² of plan on a logarithmic scale, in squares of {cell:.2f} m; {median:,.0f} per m² in the median."
    visits: str = "Visits"
    visits_legend: str = "visits"
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

    def say(self, template: str, **values: Any) -> str:  # noqa: ANN401 - what a template takes
        """Fill in a template, numbers as the language writes them."""
        return _Localized(self).vformat(template, (), values)

    def phrase(self, english: str, **values: Any) -> str:  # noqa: ANN401 - what a template takes
        """Say what has no name here, by its English words."""
        return self.say(self.phrases.get(english, english), **values)

    def number(self, value: float, spec: str) -> str:
        """Write a number, of the format `spec`, as the language does."""
        signs = {".": self.decimal, ",": self.thousands, "-": "\N{MINUS SIGN}"}
        return "".join(signs.get(sign, sign) for sign in format(value, spec))


class _Localized(Formatter):
    """Formats numbers as a language writes them."""

    def __init__(self, texts: Texts) -> None:
        self._texts = texts

    def format_field(self, value: Any, format_spec: str) -> str:  # noqa: ANN401 - as its base class
        """Format one value."""
        if isinstance(value, (int, float)):
            return self._texts.number(value, format_spec)
        return str(super().format_field(value, format_spec))


ENGLISH = Texts()
