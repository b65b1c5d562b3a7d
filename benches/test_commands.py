# SPDX-License-Identifier: MIT OR Apache-2.0
"""Every bench is listed with what it measures, and the documentation names benches that exist."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from benches.__main__ import benches, criterion, main, summary

ROOT = Path(__file__).resolve().parents[1]
PAGES = [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("benches/**/*.md")]


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "benches", *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


def test_one_line_for_each_bench_says_what_it_measures() -> None:
    lines = run().stdout.splitlines()
    assert len(lines) == len(benches()) + len(criterion())
    for path in [*benches().values(), *criterion().values()]:
        assert summary(path).endswith("."), f"{path}: its first line is no sentence"
        assert sum(line.endswith(summary(path)) for line in lines) == 1


@pytest.mark.parametrize("name", benches())
def test_a_bench_shows_its_options(name, monkeypatch, capsys) -> None:
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        monkeypatch.setenv(variable, "1")  # as the kernels do, and for this test alone
    monkeypatch.setattr(sys, "argv", ["benches", name, "--help"])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 0
    assert f"usage: python -m benches {name} " in capsys.readouterr().out


def test_an_unknown_bench_is_refused_with_the_names_of_all() -> None:
    refused = run("nothing")
    assert refused.returncode == 1
    assert "pipeline" in refused.stderr


def test_the_documentation_names_benches_that_exist() -> None:
    text = "\n".join(page.read_text(encoding="utf-8") for page in PAGES)
    named = set(re.findall(r"python -m benches (\w+)", text))
    assert named <= {*benches(), "NAME"}
    assert len(named) > 10
    assert not re.search(r"benches/\w+\.py", text)
