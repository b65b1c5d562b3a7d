# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing report` and `--project`, as a user calls them."""


def test_a_project_that_cannot_be_used_is_refused_before_the_recording_is_opened(
    bentwing, tmp_path
):
    project = tmp_path / "project.yaml"
    project.write_text("clint: City", encoding="utf-8")
    for words in (("map", "none.bag", "-o", tmp_path / "out"), ("report", tmp_path)):
        done = bentwing(*words, "--project", project)
        assert done.code == 3
        assert "did you mean 'client'?" in done.err
    assert not (tmp_path / "out").exists()


def test_an_empty_folder_has_no_report(bentwing, tmp_path):
    done = bentwing("report", tmp_path)
    assert done.code == 2
    assert "holds no bentwing run" in done.err


def test_the_report_of_a_run_names_a_project_given_later(bentwing, simulated, tmp_path):
    folder, out = simulated("office", 22.0), tmp_path / "run"
    project = tmp_path / "project.yaml"
    project.write_text("name: North wing\nclient: City", encoding="utf-8")
    mapped = bentwing("map", folder / "recording.bag", "-p", folder / "payload.yaml", "-o", out,
                      "--duration", "9")  # fmt: skip
    assert mapped.code == 0, mapped.err
    done = bentwing("report", out, "--project", project)
    assert done.code == 0, done.err
    assert done.out.split() == [str(out / "report.html")]
    text = (out / "report.html").read_text(encoding="utf-8")
    assert "<dt>Client</dt><dd>City</dd>" in text
