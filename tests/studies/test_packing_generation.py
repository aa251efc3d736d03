"""What a packing costs: runs of other codes, by programs that stand for them, and the page of the table."""

import sys

import numpy as np
import pandas as pd
import pytest

import jamlab
from jamlab.protocols.random_start import random_disks
from studies.other_codes import packing_generation
from studies.other_codes.packing_generation import NAME, drop, in_jaxdem, onset_in_dpm, onsets, row
from studies.other_codes.page import PAGE, costs, draw, made, page
from studies.reference_data import open_tables
from studies.tables import measure, read_manifest, read_table

COMPILED, BEGUN = "compiling 4 s more", 'print(\'{"version": "1.2", "compiling": 4.2}\')'


def stand_in(tmp_path, lines):
    """A program that runs these lines of Python, whatever its arguments are."""
    program = tmp_path / "program"
    program.write_text(f"#!{sys.executable} -S\n" + "\n".join(lines) + "\n")
    program.chmod(0o755)
    return str(program)


def test_onsets_are_those_of_jam():
    (found,) = onsets("sp", 8, 2)
    both = [jamlab.jam(8, "sp", seed) for seed in (1, 2)]
    assert found["phi"] == np.mean([p.phi for p in both]) and found["force"] == max(p.max_force for p in both)
    assert found["seconds"] > 0 and found["version"] == jamlab.__version__ and found["date"] > "2026"


def test_what_jaxdem_says_is_a_row(tmp_path):
    said = [
        'print(\'{"version": "1.2", "compiling": 4.2}\')',
        'print(\'{"seconds": 2.5, "phi": 0.84, "force": 1e-13}\')',
    ]
    found = in_jaxdem(stand_in(tmp_path, said), "onset", random_disks(8, 1, phi=0.2), 10.0, step=2e-3)
    assert (found["seconds"], found["phi"], found["force"], found["note"]) == (2.5, 0.84, 1e-13, COMPILED)
    assert found["version"].endswith("jax 1.2") and (found["code"], found["n"]) == ("JaxDEM", 8)


def test_what_a_limit_cuts_off_has_no_seconds_and_says_how_far_it_came(tmp_path, monkeypatch):
    monkeypatch.setattr(packing_generation, "COMPILING", 0.0)
    said = [
        'print(\'{"version": "1.2", "compiling": 4.2}\')',
        "print('Step: 7 -  phi=0.5, PE=0 after 9 steps', flush=True)",
    ]
    found = in_jaxdem(
        stand_in(tmp_path, [*said, "while True: pass"]), "onset", random_disks(8, 1, phi=0.2), 1.0, step=2e-3
    )
    assert np.isnan(found["seconds"]) and found["limit"] == 1.0
    assert found["note"] == f"cut off at φ = 0.5000; {COMPILED}"


def test_a_python_without_jaxdem_is_named(tmp_path):
    program = stand_in(tmp_path, ["raise SystemExit('No module named jax')"])
    with pytest.raises(jamlab.EngineError, match=r"cannot run jaxdem_program\.py: No module named jax"):
        in_jaxdem(program, "onset", random_disks(8, 1, phi=0.2), 1.0, step=2e-3)


def test_dpm_has_ten_times_the_time(tmp_path, monkeypatch):
    monkeypatch.setattr(packing_generation, "ours_of", lambda model, n: 0.1)
    lines = ["print('fireit = 5000')", "print('fireit = 0')", "print('fireit = 1000', flush=True)", "while True: pass"]
    ours, found = onset_in_dpm(stand_in(tmp_path, lines))
    assert ours["work"] == "onset beside dpm" and np.isnan(found["seconds"]) and found["limit"] == pytest.approx(1.0)
    assert found["note"].startswith("cut off; ") and 3000 < float(found["note"].split()[2]) < 12000


@pytest.fixture
def tables(tmp_path):
    """Two sizes of jamlab, two runs of JaxDEM, one of them twice as long, and dpm, which is cut off."""
    rows = {
        "a": [row("onset", "jamlab", "sp", 64, 0.5, seeds=10), row("minimum", "LAMMPS fire", "dp", 64, 1.0)],
        "b": [row("onset", "jamlab", "sp", 256, 2.0, force=3e-13)],
        "JaxDEM": [row("onset beside JaxDEM", "jamlab", "sp", 64, 1.0), row("onset", "JaxDEM", "sp", 64, 10.0)],
        "dpm": [row("onset beside dpm", "jamlab", "dp", 64, 0.4), row("onset", "dpm", "dp", 64, np.nan, limit=4.0)],
    }
    rows["JaxDEM"].append(row("onset", "JaxDEM", "sp", 64, 20.0))
    measure(tmp_path, NAME, {name: lambda each=each: each for name, each in rows.items()})
    return open_tables(tmp_path)


def test_ratios_are_to_the_run_beside(tables):
    found = costs(tables).set_index(["work", "code", "n"])
    assert found.loc[("onset", "JaxDEM", 64), ["seconds", "ratio", "seeds"]].tolist() == [15.0, 15.0, 2]
    assert found.loc[("onset", "dpm", 64), ["seconds", "ratio", "bound"]].tolist() == [4.0, pytest.approx(10.0), True]
    assert not found["bound"][("onset", "jamlab", 256)] and len(found) == 5
    drawn = draw(tables)
    assert len(drawn.figure.axes) == 2 and ["onset of droplets", "64", "dpm", "> 4", "> 10"] in [
        list(row[:5]) for row in drawn.text[0].rows
    ]


def test_parts_are_measured_anew_when_they_are_dropped(tables, tmp_path):
    drop(tmp_path, ["JaxDEM", "dpm"])
    assert set(read_table(tmp_path, NAME)["task"]) == {"a", "b"}
    drop(tmp_path, ["a", "b"])
    assert not read_manifest(tmp_path)
    drop(tmp_path, ["a"])


def test_the_page_is_made_of_what_ships():
    text = PAGE.read_text(encoding="utf-8")
    parts = made(open_tables())
    assert page(text, parts) == text, "python -m studies.other_codes.page"
    assert {name for name in parts if f"<!-- made: {name} -->" in text} == set(parts)
    assert pd.read_csv(PAGE.parents[2] / "studies" / "data" / f"{NAME}.csv")["seconds"].notna().any()
