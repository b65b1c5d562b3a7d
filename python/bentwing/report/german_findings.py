# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a verdict has found and what to do, in German, by the kind of evidence."""

from __future__ import annotations

_HEAD = "prüfen Sie payload.yaml, Achsen, Einheiten und Uhren mit `bentwing info`"
_AGAIN = "kartieren Sie danach noch einmal"

FINDINGS: dict[str, tuple[str, str]] = {
    "units": ("Einheiten oder Achsen passen nicht (Meldung auf Englisch: {problem})", _AGAIN),
    "set_up": ("der Aufbau passt nicht (Meldung auf Englisch: {problem})", _AGAIN),
    "constant": (
        "ein Sensor der Inertialeinheit gibt immer denselben Wert ({instrument})",
        "schalten Sie ihn im Treiber ein und nehmen Sie noch einmal auf",
    ),
    "repeated": (
        "{percent:.0f} % der Messungen der Inertialeinheit wiederholen nur die vorige",
        "die Inertialeinheit oder ihr Treiber stand; nehmen Sie noch einmal auf",
    ),
    "gyro_limit": (
        "{share:.1f} % der Messungen des Kreisels sind am Ende seines Messbereichs",
        "stellen Sie einen größeren Messbereich ein, oder drehen Sie langsamer",
    ),
    "accelerometer_limit": (
        "{share:.1f} % der Messungen des Beschleunigungsmessers sind am Ende seines Messbereichs",
        "stellen Sie einen größeren Messbereich ein, oder dämpfen Sie den Sensorkopf",
    ),
    "imu_period": (
        "die Inertialeinheit gibt {rate:.0f} Messungen in der Sekunde, zu wenig für ein bewegtes Lidar",
        "stellen Sie sie auf 100 Hz oder mehr",
    ),
    "even_ranges": (
        "alle Echos des Lidars haben fast dieselbe Strecke: es sah keine Umgebung",
        "prüfen Sie das Lidar und seinen Treiber",
    ),
    "scatter": (
        "die Strecken benachbarter Echos hängen nicht zusammen: das Lidar sah keine Flächen",
        "prüfen Sie das Lidar, seinen Treiber, und ob Punkte und Zeiten zusammengehören",
    ),
    "point_order": (
        "die Punkte eines Scans stehen nicht in der Reihenfolge ihrer Zeiten: benachbarte Richtungen zeigen eine "
        "Fläche, aufeinanderfolgende Punkte nicht",
        "lassen Sie den Treiber zu jedem Punkt die Zeit schreiben, zu der er gemessen wurde",
    ),
    "slice": (
        "die Ebene des 2D-Lidars bleibt dieselbe: die Karte ist eine Scheibe der Umgebung",
        "drehen oder nicken Sie das Lidar, oder nehmen Sie ein Programm für 2D-SLAM",
    ),
    "gravity": (
        "die mittlere Kraft am Beschleunigungsmesser weicht um {value:.2f} m/s² von der Schwere ab",
        "prüfen Sie seine Einheit, seinen Maßstab und ob der Treiber die Schwere abzieht",
    ),
    "matches": ("{share:.0f} % der wieder gesehenen Flächen passen nicht zum Weg{when}", _HEAD),
    "lost": ("während {seconds:.0f} s{when} sieht das Lidar nichts, das zum Vorigen passt", _HEAD),
    "unseen": (
        "während {value:.0f} s zeigt die Umgebung zu wenig, um zu sagen, wo das Lidar ist",
        "vergleichen Sie die Karte davor und danach, und fliegen Sie dort mit mehr Umgebung im Blick",
    ),
    "loop": (
        "{percent:.0f} % der Flächen, die in der ganzen Aufnahme mehr als einmal gesehen wurden, passen nicht zusammen",
        _HEAD,
    ),
    "gyro": (
        "der Weg dreht anders, als der Kreisel sagt, um {degrees:.2f} °/s{when}",
        "prüfen Sie T_imu_lidar, Achsen und Maßstab des Kreisels, und die Uhren",
    ),
    "scale": (
        "der Weg ist {times:.2f}-mal so lang, wie der Beschleunigungsmesser sagt: die Strecken des Lidars oder der "
        "Beschleunigungsmesser haben einen falschen Maßstab",
        "prüfen Sie Einheit und Maßstab von beiden",
    ),
    "accelerometer": (
        "der Weg verläuft anders, als der Beschleunigungsmesser sagt, um {force:.2f} m/s²{when}",
        "prüfen Sie Achsen und Maßstab des Beschleunigungsmessers, T_imu_lidar und die Einheit der Strecken",
    ),
    "gyro_noise": (
        "der Kreisel weicht um das {value:.1f}-Fache seines Rauschens von dem ab, was das Lidar sieht{when}",
        "prüfen Sie Achsen und Maßstab des Kreisels, die Uhren, und gyro_noise in payload.yaml",
    ),
    "accelerometer_noise": (
        "der Beschleunigungsmesser weicht um das {value:.1f}-Fache seines Rauschens von dem ab, was das Lidar "
        "sieht{when}",
        "prüfen Sie Achsen und Maßstab des Beschleunigungsmessers, die Einheit der Strecken, und accel_noise in payload.yaml",
    ),
    "clocks": (
        "die Uhren von Lidar und Inertialeinheit laufen um {milliseconds:.2f} ms in der Sekunde auseinander",
        "gleichen Sie sie ab, oder nehmen Sie die Zeitstempel eines Rechners",
    ),
    "calibration": (
        "{name} weicht um {value:.0f} Standardabweichungen von payload.yaml ab",
        "vergleichen Sie die Kalibrierung im Bericht mit der Zeichnung des Sensorkopfs, und berichtigen Sie payload.yaml",
    ),
    "correction": (
        "das Schließen der Schleifen verschob den Weg um {moved:.2f} m, mehr als er sonst driftet",
        "suchen Sie im Bericht nach doppelten Wänden",
    ),
    "revisits": (
        "wieder gesehene Flächen liegen {millimetres:.0f} mm auseinander",
        "suchen Sie im Bericht nach doppelten Wänden",
    ),
    "marks": (
        "{names} liegt {metres:.2f} m neben dem Ort, den die anderen Punkte angeben",
        "prüfen Sie die Koordinaten, und wo der Punkt in der Karte gesehen wurde",
    ),
    "joins": (
        "ein einziger Ort verbindet {runs}, und kein zweiter Ort, keine Schleife von Aufnahmen und keine "
        "GNSS-Positionen bestätigen ihn",
        "prüfen Sie die Karte dort, oder fügen Sie eine Aufnahme hinzu, die beide an einem anderen Ort sieht",
    ),
    "speed": ("der Weg erreicht {value:.0f} m/s bei {at:.1f} s", _HEAD),
    "breaks": (
        "die Aufnahme ist unterbrochen{when}, und wo die Karte weitergeht, ist geraten",
        "fliegen Sie noch einmal über schon Gesehenes, oder kartieren Sie die Teile einzeln",
    ),
}
"""Sentence and advice; the sentence has the value, `percent`, `when` and the facts of the evidence."""
