# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing reproduce kaul2015` as a user runs it, with bounds that a regression would break."""

import json

import pytest

pytestmark = pytest.mark.slow

FIGURES = {
    "fig03a", "fig03b", "fig03c", "fig08", "fig13a", "fig13b", "fig19a", "fig19b", "fig19c",
    "fig19d", "fig20_compound", "fig20_forest", "fig21b", "fig21c", "fig21d", "fig22", "fig23",
    "fig24a", "fig24b", "fig24c", "fig24d", "fig25",
}  # fmt: skip


def test_the_maps_of_kaul_are_made_again(bentwing, tmp_path):
    out = tmp_path / "out"
    result = bentwing("reproduce", "kaul2015", "--part", "mapping", "--quick", "-o", out)
    assert result.code == 0, result.err
    assert {path.stem for path in out.glob("*.svg")} == FIGURES
    assert "terrestrial scans" in result.out
    page = (out / "report.html").read_text()
    assert page.count("<figure>") == len(FIGURES)
    numbers = json.loads((out / "mapping.json").read_text())
    compound, forest = numbers["compound"], numbers["forest"]
    assert compound["map"]["robust_std"] < 0.012
    assert compound["true_map_std_m"] < 0.014
    assert compound["map"]["std"] < 1.1 * compound["best_map_std_m"]
    assert abs(compound["map"]["mean"]) < 0.003
    for flight in (compound, forest):
        assert flight["rmse_m"] < 0.01
        boxes = flight["drift_against_closed_loop"]["5 m"]
        widths = {name: box[3] - box[1] for name, box in boxes.items()}
        assert widths["horizontal"] < 1.0  # mm/m
        assert widths["vertical"] < 0.2
        assert widths["heading"] < 0.02  # °/m
        # a target that is measured while it moves: the faster, the farther off
        assert flight["trajectory"]["error_over_speed"]["slope"] > 0.01
