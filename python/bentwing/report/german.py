# SPDX-License-Identifier: MIT OR Apache-2.0
"""The words of a report in German."""

from __future__ import annotations

from bentwing.report.german_findings import FINDINGS
from bentwing.report.texts import Texts

_REASONS = {
    "no_echo": "ohne Echo",
    "range": "außerhalb der Reichweite des Lidars",
    "self_hits": "auf dem Träger selbst",
    "no_angle": "ohne Winkel des Motors",
    "outside": "vor oder nach dem geschätzten Weg",
    "mixed": "zwischen zwei Flächen",
    "moving": "auf Dingen, die sich bewegten",
    "thinned": "ausgedünnt, wie gewünscht",
}
_HEADLINES = {
    "good": "Gut: alles, was geprüft wurde, stimmt überein",
    "doubtful": "Zweifelhaft: prüfen Sie diese Karte, bevor Sie sie verwenden",
    "failed": "Misslungen: diese Karte ist falsch, verwenden Sie sie nicht",
}
_SCENE = {
    "colour": "Farbe",
    "height": "Höhe",
    "time": "Zeit",
    "sigma": "Streuung",
    "intensity": "Intensität",
    "incidence": "Auftreffwinkel",
    "view": "Ansicht",
    "oblique": "Schräg",
    "top": "Oben",
    "front": "Vorn",
    "side": "Seite",
    "distance": "Abstand",
    "measure": "Messen",
    "clicked": "Angeklickt",
    "points": "Punkte speichern",
    "loop": "Schleife speichern",
    "cut": "Schnitt in der Höhe",
    "box": "Ausschnitt",
    "unknown": "grau: nicht bekannt",
    "first": "Klicken Sie einen Punkt der Karte an.",
    "second": "Klicken Sie einen zweiten Punkt an.",
    "apart": "{whole} m Abstand; {level} m waagrecht, {up} m nach oben.",
    "none": "Drücken Sie zuerst „Messen“ und klicken Sie Punkte der Karte an.",
}
_LEGENDS = {
    "height": "Höhe, m",
    "time": "Zeit, s",
    "sigma": "Standardabweichung längs des Strahls, mm",
    "intensity": "Intensität, wie das Lidar sie angibt",
    "incidence": "Winkel zwischen Strahl und Normale, °",
}
_PHRASES = {
    "above the ellipsoid": "über dem Ellipsoid",
    "those of the system": "die des Systems",
    "those of": "die von",
    "thickness of flat surfaces, first visits, one standard deviation": "Dicke ebener Flächen, erste Besuche, eine Standardabweichung",
    "thickness of flat surfaces, later visits, one standard deviation": "Dicke ebener Flächen, spätere Besuche, eine Standardabweichung",
    "95 % below {p95:.1f} mm, {n:,} patches": "95 % unter {p95:.1f} mm, {n:,} Flächenstücke",
    "offset between two visits, standard deviation": "Versatz zwischen zwei Besuchen, Standardabweichung",
    "measure": "Maß",
    "median": "Median",
    "spread": "Streuung",
    "middle half {p25:.1f} to {p75:.1f} mm, {n:,} patches of {edge:g} m": "mittlere Hälfte {p25:.1f} bis {p75:.1f} mm, {n:,} Flächenstücke von {edge:g} m",
    "No flat surface was seen in two visits.": "Keine ebene Fläche wurde bei zwei Besuchen gesehen.",
    "agrees": "stimmt überein",
    "does not agree": "stimmt nicht überein",
    "No two stretches share enough flat surface.": "Keine zwei Abschnitte haben genug ebene Fläche gemeinsam.",
    "seen at": "gesehen",
    "seen again at": "wieder gesehen",
    "patches": "Flächenstücke",
    "median offset": "Versatz im Median",
    "within {limit:.0f} mm": "innerhalb {limit:.0f} mm",
    "{good} of {n} loops agree; those with most patches are listed.": "{good} von {n} Schleifen stimmen überein; aufgeführt sind die mit den meisten Flächenstücken.",
    "Place on the Earth": "Lage auf der Erde",
    "Place in the frame of the control points": "Lage im System der Passpunkte",
    "GNSS fixes of the runs": "GNSS-Positionen der Aufnahmen",
    "Places seen by more than one": "Orte, die mehrere gesehen haben",
    "Accepted ({n})": "Angenommen ({n})",
    "Rejected ({n}), with the reason": "Abgelehnt ({n}), mit dem Grund",
    "Beams of the lidar": "Strahlen des Lidars",
    "Angles of the beams": "Winkel der Strahlen",
    "Ranges and heights of the beams": "Strecken und Höhen der Strahlen",
    "Calibration of the sensor head": "Kalibrierung des Sensorkopfs",
    "Motion": "Bewegung",
    "Position": "Ort",
    "of the IMU in the map": "der Inertialeinheit in der Karte",
    "Speed": "Geschwindigkeit",
    "Rate of turn": "Drehrate",
    "of the sensor head; where it stalls, the scanner sees one plane only": "des Sensorkopfs; wo er stillsteht, sieht der Scanner nur eine Ebene",
    "Estimate, window by window": "Schätzung, Fenster für Fenster",
    "Matches": "Zuordnungen",
    "Inliers": "Anteil stimmiger Zuordnungen",
    "Residual": "Restabweichung",
    "Surfels": "Flächenstücke",
    "Loops": "Schleifen",
    "Record": "Protokoll",
    "Counts": "Anzahlen",
    "Clocks": "Uhren",
    "Time and memory": "Zeit und Speicher",
    "Versions": "Versionen",
    "Settings": "Einstellungen",
    "Inputs": "Eingaben",
}  # fmt: skip

GERMAN = Texts(
    language="de",
    decimal=",",
    thousands="\N{NARROW NO-BREAK SPACE}",
    date="%d.%m.%Y",
    phrases=_PHRASES,
    findings=FINDINGS,
    headlines=_HEADLINES,
    title="Bericht der Kartierung",
    project="Projekt",
    number_of="Nummer",
    site="Ort",
    client="Auftraggeber",
    contractor="Auftragnehmer",
    operator="Bearbeitung",
    instrument="Instrument",
    remarks="Bemerkungen",
    recorded="Aufgenommen",
    recording="Aufnahme",
    unknown_time="die Uhr des Rekorders kannte kein Datum",
    made="Bericht vom",
    incomplete="Unvollständig: dies ist keine fertige Karte",
    stopped="Der Lauf endete im Schritt „{stage}“: {reason}. Was bis dahin entstand, ist erhalten.",
    finished="Karte fertig",
    worth_knowing="Wissenswert (Meldungen des Programms, englisch):",
    set_up=(
        "Die Aufnahme zeigt vom Sensorkopf, was keine payload.yaml sagte oder was sie anders sagte; damit wurde "
        "kartiert. Schreiben Sie in payload.yaml:"
    ),
    accuracy="Erwartete Genauigkeit (68 %): über den ganzen Weg {whole}; über zehn Meter davon {short}",
    accuracy_of="{horizontal} in der Lage, {vertical} in der Höhe und {heading:.2g}° in der Richtung",
    accuracy_map="gemessene Flächen streuen um {mm:.0f} mm",
    accuracy_none=(
        "Keine Genauigkeit angegeben: Ergebnisse dieser Art haben keine eigene Fehlerrechnung; siehe die Prüfungen unten."
    ),
    accuracy_checked="Genauigkeit: {n} Prüfpunkte weichen im quadratischen Mittel um {rms:.1f} mm ab; sie stehen unten.",
    area="von oben gesehene Fläche",
    volume="Raum zwischen tiefster und höchster Fläche",
    length="Länge des Wegs",
    duration="Dauer der Aufnahme",
    points="Punkte in der Karte",
    million="Mio.",
    extent="Ausdehnung",
    seen_all="Jede Richtung der Bewegung war immer zu sehen.",
    seen_not=(
        "Rot: während {total:.0f} s ließ die Umgebung eine Richtung der Bewegung offen ({spans}); Inertialdaten und "
        "Stetigkeit trugen dort die Schätzung."
    ),
    span="von {first:.1f} bis {last:.1f} s",
    shorter="{n} kürzere",
    conjunction="und",
    below="unter {share:.1f} %",
    height_legend="Höhe, m",
    time_legend="Zeit, s",
    plan="Grundriss",
    plan_note="Die Farbe zeigt die Höhe; die Linie ist der Weg des Sensors, der Kreis sein Anfang.",
    plan_north="Gitternord ist oben; das Gitter hat die Koordinaten des unten genannten Systems.",
    plan_local="Das Gitter ist das des Systems der Karte selbst, in Metern.",
    plan_site="Das Gitter ist das der Passpunkte, in Metern; seine y-Achse zeigt nach oben.",
    plan_roof="Was über dem Sensor liegt, ist weggelassen, damit das Dach den Boden nicht verdeckt.",
    plan_marks="Dreiecke sind Passpunkte, Quadrate sind Prüfpunkte.",
    coordinates="Koordinaten",
    local_frame=(
        "Eigenes System der Karte, in Metern: der Ursprung liegt in der ersten Pose, z zeigt nach oben, die Richtung "
        "ist die des Starts. Es hat keinen EPSG-Code."
    ),
    site_frame="System der Passpunkte, in Metern, ohne EPSG-Code; z zeigt nach oben.",
    system="{name} (EPSG:{epsg:d}). Höhen: {heights}.",
    given_system="Die der gegebenen Karte.",
    left_out="Nicht in der Karte",
    left_none="Nichts wurde weggelassen.",
    left_fixes="{n} von {of} GNSS-Positionen, die nicht zu den anderen passen",
    left_marks="Passpunkte, bei denen weder ebene Fläche noch Kugel gefunden wurde: {names}",
    of_returns="Von {n:,} Echos des Lidars sind {written:,} in der Karte. Weggelassen:",
    reasons=_REASONS,
    marks="Pass- und Prüfpunkte",
    marks_note=(
        "Ein Punkt wird mit der ebenen Fläche verglichen, die die Karte um ihn hat, in der Richtung, in die diese "
        "zeigt. Passpunkte halten die Karte; Prüfpunkte messen sie nur."
    ),
    marks_control="Passpunkte ({n}): {rms:.1f} mm im quadratischen Mittel, höchstens {most:.1f} mm.",
    marks_check="Prüfpunkte ({n}): {rms:.1f} mm im quadratischen Mittel, höchstens {most:.1f} mm.",
    uses={"control": "Passpunkt", "check": "Prüfpunkt"},
    mark="Punkt",
    use="Art",
    across="gemessen",
    before="vorher, mm",
    residual="Abweichung, mm",
    picked="gesehen in der Karte, daneben um, mm",
    heights="Höhe",
    sideways="seitlich",
    mixed="schräg",
    spheres_note="Bei Kugeln wird der Mittelpunkt in ihre Punkte eingepasst: die Abweichung ist der Abstand der Mittelpunkte.",
    sphere="Kugel",
    no_sphere="nicht benutzt: keine Kugel gefunden",
    sigma="Standardabweichung, mm",
    not_used="nicht benutzt: keine ebene Fläche",
    only_seen="wo er gesehen wurde",
    contradicts="nicht benutzt: widerspricht den anderen",
    map="Karte",
    no_points="Es wurden keine Punkte kartiert.",
    no_map="Es war keine Karte verlangt.",
    nothing_refined="Kein Punkt wurde verschoben: keine Fläche wurde oft genug gesehen.",
    refined=(
        "{share:.0f} % der Punkte wurden längs ihrer Strahlen auf die Fläche verschoben, die sie gemeinsam gemessen "
        "haben, im Median um {move:.1f} mm; die Standardabweichung längs des Strahls war {before:.1f} mm und ist "
        "{after:.1f} mm. Die Bilder und die Genauigkeit unten zeigen die Punkte wie gemessen."
    ),
    scene="In drei Dimensionen",
    scene_note=(
        "Ohne Perspektive, so dass der Maßstab überall gilt. Ziehen dreht, Ziehen mit rechter Taste oder Umschalttaste "
        "verschiebt, zwei Finger verschieben und vergrößern. Das Rad vergrößert nach einem Klick oder mit Strg. Tasten: "
        "Pfeile drehen, Umschalttaste und Pfeile verschieben, + und \N{MINUS SIGN} vergrößern, die Eingabetaste nimmt "
        "den Punkt in der Mitte. Was angeklickt wurde, wird als Datei von Passpunkten gespeichert, die letzten zwei "
        "auch als Schleife. Der Weg des Sensors ist dunkel, und rot, wo eine Richtung nicht zu sehen war."
    ),
    scene_keys="Die Karte in drei Dimensionen; die Pfeiltasten drehen sie",
    scene_off="Dieser Browser zeigt kein WebGL; die Bilder unten sagen dasselbe.",
    scene_sides=("x von", "x bis", "y von", "y bis", "Höhe von"),
    scene_words=_SCENE,
    scene_legends=_LEGENDS,
    oblique="Schrägansicht",
    oblique_note="Farbe nach Höhe",
    by_time="Grundriss nach Zeit",
    by_time_note=(
        "Sehr verschiedene Farben nebeneinander sind Orte, die später wieder gesehen wurden; doppelte Wände wären dort Drift."
    ),
    side="Seitenansicht",
    side_note="längs der größeren Ausdehnung der Karte",
    section="Schnitt",
    section_note="{slab:g} m dick, durch die Mitte des Wegs",
    coverage="Abdeckung",
    density="Dichte",
    density_legend="Punkte je m²",
    density_note="Punkte je m² Grundriss auf logarithmischer Skala, in Quadraten von {cell:.2f} m; {median:,.0f} je m² im Median.",
    visits="Besuche",
    visits_legend="Besuche je Quadrat",
    visits_note=(
        "Wie oft jedes Quadrat gesehen wurde, zehn Sekunden oder mehr auseinander; von {area:,.0f} m², von oben gesehen, "
        "wurden {again:.0f} % mehr als einmal gesehen."
    ),
    visited_again="Wieder gesehene Orte",
    agreement="Übereinstimmung der Karte mit sich selbst",
    localization="Ort in der gegebenen Karte",
    changes="Was sich seit der Karte geändert hat",
    changes_note=(
        "Erschienen ist etwas, wo die Karte leer gesehen wurde; verschwunden ist es, wo die Aufnahme hindurchsah. Was "
        "nur eine von beiden sah, zählt nicht."
    ),
    unchanged="Nichts hat sich geändert, das größer ist als 0,1 m² von oben gesehen.",
    change="Änderung",
    kinds={"appeared": "erschienen", "disappeared": "verschwunden"},
    changes_plan="Plan der Änderungen",
    changes_plan_note="Nummern wie in der Tabelle. Orange ist erschienen, Blau verschwunden, Grau die Karte dieser Aufnahme.",
    engineering="Technische Einzelheiten",
    engineering_note="Bewegung, Schätzung, Kalibrierung, Einstellungen und Versionen, für die Prüfung des Verfahrens; auf Englisch.",
    engineering_print="Bewegung, Schätzung, Kalibrierung, Einstellungen und Versionen stehen in report.html und run.json.",
)
