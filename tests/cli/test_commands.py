"""The command line as a user meets it: exit codes, one-line errors, nothing half-written."""

import json
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
from commands import call

import jamlab
from jamlab.cli.console import print_packings
from jamlab.cli.main import app
from jamlab.packing.hdf5 import read_observables
from studies.reference_data import example_file

MODULE = [sys.executable, "-m", "jamlab"]
SCRIPT = [Path(sys.executable).with_name("jamlab")]


def start(folder, program, *words):
    """Run a command as a process of its own."""
    return subprocess.run([*program, *words], cwd=folder, capture_output=True, text=True, timeout=300, check=False)


@pytest.fixture(scope="module")
def packed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("packed")
    done = call(folder, "pack", "--n", "32", "--pressure", "0.02", "--seed", "3", "--json")
    assert done.exit_code == 0, done.stderr
    return folder / "packing.h5", json.loads(done.stdout)


def test_pack_writes_what_it_prints(packed):
    path, printed = packed
    packing = jamlab.read(path)
    assert abs(printed["pressure"][0] / 0.02 - 1) < 1e-6
    assert printed["rho"][0] == jamlab.packing_fraction(packing)
    assert printed["converged"] == [True]
    with h5py.File(path) as file:
        described = {name: file["observables"][name].attrs["description"] for name in ("g", "g_x")}
    assert "mean over directions" in described["g"] and "along x" in described["g_x"]
    assert described.items() <= printed["labels"].items()


def test_analyze_reads_lammps_files_as_its_own(packed, tmp_path):
    path, _ = packed
    packing = jamlab.read(path)
    jamlab.write(tmp_path / "p.data", packing)
    jamlab.write(tmp_path / "p.dump", [packing])
    own = call(tmp_path, "analyze", str(path), "--json")
    for name in ("p.data", "p.dump"):
        done = call(tmp_path, "analyze", name, "--json")
        assert (done.exit_code, done.stderr) == (0, "")
        read, wanted = json.loads(done.stdout), json.loads(own.stdout)
        assert read["converged"] == [True]
        for column in ("rho", "z", "g", "pressure"):
            assert read[column] == pytest.approx(wanted[column], rel=1e-9)


def test_analyze_names_what_a_foreign_file_lacks(packed, tmp_path):
    jamlab.write(tmp_path / "p.data", jamlab.read(packed[0]))
    lines = (tmp_path / "p.data").read_text().splitlines()
    (tmp_path / "p.data").write_text("\n".join(["foreign", *lines[1:]]))
    done = call(tmp_path, "analyze", "p.data")
    assert done.exit_code == 1 and all(word in done.stderr for word in ("p.data", "radii")), done.stderr


def test_gstar_explains_a_modulus_below_zero(tmp_path):
    done = call(tmp_path, "gstar", example_file("sp"), "--frame", "6", "--points", "3")
    assert done.exit_code == 0 and "G = -" in done.stdout and "shear-stabilized" in done.stderr


def test_gstar_of_several_files_is_their_mean(packed, tmp_path):
    """Two files give a mean and a picture; --n and --pressure make the packing; every solver gives the same."""
    path, _ = packed
    assert call(tmp_path, "pack", "--n", "32", "--pressure", "0.02", "--seed", "4", "--json").exit_code == 0
    options = ("--points", "3", "--json")
    done = call(tmp_path, "gstar", str(path), "packing.h5", "--out", "both.png", *options)
    assert done.exit_code == 0 and (tmp_path / "both.png").read_bytes()[:4] == b"\x89PNG"
    printed = json.loads(done.stdout)
    first, _ = printed["packings"]
    assert printed["storage"][0] == pytest.approx(printed["g0"], rel=1e-6)
    assert printed["loss"] == pytest.approx([sum(p["loss"][k] for p in printed["packings"]) / 2 for k in range(3)])
    made = json.loads(call(tmp_path, "gstar", "--n", "32", "--pressure", "0.02", "--seed", "3", *options).stdout)
    direct = json.loads(call(tmp_path, "gstar", str(path), "--method", "direct", *options).stdout)
    assert made["g0"] == pytest.approx(first["g0"], rel=1e-9)
    assert direct["method"] == "direct" and direct["loss"] == pytest.approx(first["loss"], rel=1e-8)


def test_pack_analyze_and_gstar_give_the_same_two_moduli(packed, tmp_path):
    path, printed = packed
    curve = json.loads(call(tmp_path, "gstar", str(path), "--points", "3", "--json").stdout)
    assert curve["g"] == pytest.approx(printed["g"][0], rel=1e-9)
    assert curve["g0"] == pytest.approx(printed["g_x"][0], rel=1e-7)
    assert "G_xy" in call(tmp_path, "analyze", str(path)).stdout


def test_sizes_and_droplets_from_the_command_line(tmp_path):
    sizes = ("--n", "10", "--size-ratio", "1.2", "--fraction-large", "0.3", "--json")
    assert call(tmp_path, "pack", "--pressure", "0.05", *sizes).exit_code == 0
    diameters = jamlab.read(tmp_path / "packing.h5").diameters
    assert np.sum(diameters > 1) == 3 and diameters.max() / diameters.min() == pytest.approx(1.2)
    law = ("--law", "gamma=0.1", "--law", "ka=50", "--law", "delta=0.2")
    done = call(tmp_path, "jam", "--model", "dp", "--n", "5", "--fraction-large", "0.4", *law, "--json")
    assert done.exit_code == 0, done.stderr
    packing = jamlab.read(tmp_path / "onset.h5")
    assert [packing.params[name] for name in ("gamma", "ka", "delta")] == [0.1, 50.0, 0.2]
    assert np.diff(packing.offsets).tolist() == [12, 12, 12, 17, 17]


def test_version_completion_and_lists_of_commands(tmp_path):
    for words in ((), ("campaign",)):
        done = call(tmp_path, *words, "--help")
        assert done.exit_code == 0 and "..." not in done.stdout.partition("--help")[2], done.stdout
    assert call(tmp_path, "--version").stdout == f"jamlab {jamlab.__version__}\n"
    assert "--install-completion" in call(tmp_path, "--help").stdout


def test_a_new_campaign_file_can_be_planned_and_is_never_replaced(tmp_path):
    assert call(tmp_path, "campaign", "new", "c.toml").exit_code == 0
    assert json.loads(call(tmp_path, "campaign", "plan", "c.toml", "--json").stdout)["tasks"] == 12
    (tmp_path / "c.toml").write_text("mine")
    done = call(tmp_path, "campaign", "new", "c.toml")
    assert done.exit_code == 1 and "c.toml exists" in done.stderr and (tmp_path / "c.toml").read_text() == "mine"


def test_compress_and_analyze_agree(packed, tmp_path):
    path, _ = packed
    done = call(tmp_path, "compress", str(path), "--to", "0.9", "--step", "0.02", "--out", "sweep.h5", "--json")
    assert done.exit_code == 0, done.stderr
    printed = json.loads(done.stdout)
    assert abs(printed["rho"][-1] - 0.9) < 1e-6
    again = json.loads(call(tmp_path, "analyze", "sweep.h5", "--json").stdout)
    assert again["z"] == printed["z"] and again["rho"] == printed["rho"]
    assert "NO" not in call(tmp_path, "analyze", "sweep.h5").stdout


BAD = [  # one for each way in which words are wrong; values are tested where they are checked
    (("jam", "--n", "7"), "--n 7: half"),
    (("jam", "--n", "few"), "few"),
    (("jam", "--model", "foam"), "foam"),
    (("jam", "--n", "8", "--law", "gamma"), "gamma"),
    (("jam", "--n", "8", "--out", "nowhere[bold]/[/x].h5"), "nowhere[bold]/[/x].h5"),
    (("jam", "--n", "8", "--out", "x" * 300 + ".h5"), "x" * 300),
    (("compress", "{packed}", "--to", "0.9", "--by", "mass"), "mass"),
    (("compress", "[red]:smile:[/].h5", "--to", "0.9"), "[red]:smile:[/].h5"),
    (("gstar",), "give FILES, or --n and --pressure"),
    (("gstar", "{packed}", "--n", "8", "--pressure", "0.1"), "--n is used only without FILES"),
    (("gstar", "{packed}", "--out", "s.txt"), "s.txt"),
    (("gstar", "{packed}", "--points", "1000000000000"), "--points 1000000000000"),
    (("gstar", "{packed}", "--omega-max", "inf"), "inf"),
    (("analyze", "foreign.h5"), "foreign.h5"),
    (("analyze", "{packed}", "--memory", "2"), "--memory"),
    (("analyze", "7000.png"), "7000.png is (7000, 7000): cut it"),
    (("analyze", "100000.png"), "100000.png"),
    (("demo", "--to", "2"), "--to 2.0"),
    (("demo", "--n", "8", "--folder", "foreign.h5"), "foreign.h5"),
]


def png_header(side):
    """The beginning of a picture of side x side pixels; the pixels are missing."""
    header = b"IHDR" + struct.pack(">IIBBBBB", side, side, 8, 0, 0, 0, 0)
    checksum = struct.pack(">I", zlib.crc32(header))
    return b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + header + checksum + b"\0\0\0\0IDAT"


@pytest.mark.parametrize(("arguments", "named"), BAD, ids=[" ".join(a) for a, _ in BAD])
def test_bad_input_names_the_value_and_writes_nothing(packed, tmp_path, arguments, named):
    with h5py.File(tmp_path / "foreign.h5", "w") as file:
        file["x"] = 1
    for side in (7000, 100_000):
        (tmp_path / f"{side}.png").write_bytes(png_header(side))
    before = sorted(tmp_path.iterdir())
    done = call(tmp_path, *(a.format(packed=packed[0]) for a in arguments))
    assert done.exit_code != 0
    errors = [line for line in done.stderr.splitlines() if line.lower().startswith("error")]
    assert len(errors) == 1 and named in errors[0]
    assert done.stdout == ""
    assert sorted(tmp_path.iterdir()) == before


def test_installed_script_finds_this_installation_right(tmp_path):
    done = start(tmp_path, SCRIPT, "doctor", "--json")
    findings = json.loads(done.stdout)
    assert done.returncode == 0, findings
    assert {"LAMMPS", "plugin", "MPI run"} <= set(findings)


def test_module_is_the_command_and_separates_results_from_errors(tmp_path):
    done = call(tmp_path, "jam", "--n", "8", "--seed", "1", "--json")
    assert done.exit_code == 0, done.stderr
    assert json.loads(done.stdout)["phi_J"] == jamlab.read(tmp_path / "onset.h5").phi_J
    done = call(tmp_path, "analyze", "absent.h5")
    assert (done.exit_code, done.stdout) == (1, "")
    assert done.stderr.startswith("error:") and "absent.h5" in done.stderr and done.stderr.count("\n") == 1
    done = start(tmp_path, MODULE, "analyze", "--debug", "absent.h5")
    assert (done.returncode, done.stdout) == (1, "")
    assert "Traceback" in done.stderr and "StorageError" in done.stderr.splitlines()[-1]


def test_help_lists_every_command_in_a_group_and_each_shows_an_example(tmp_path):
    said = call(tmp_path, "--help").stdout
    for command in app.registered_commands:
        assert f"\n  {command.name} " in said.partition("Make packings:")[2]
        assert f"Example: jamlab {command.name}" in call(tmp_path, command.name, "--help").stdout


def test_demo_small(tmp_path):
    """The main job on few particles: all files there, page self-contained, every state converged."""
    done = call(tmp_path, "demo", "--n", "8", "--to", "0.88")
    assert done.exit_code == 0, done.stderr
    out = tmp_path / "jamlab-demo"
    assert {p.name for p in out.iterdir()} == {"sp.h5", "dp.h5", "index.html"}
    page = (out / "index.html").read_text()
    assert page.count("<canvas") == 2 and 'src="http' not in page
    for model, limit in (("sp", 1e-12), ("dp", 1e-8)):
        packings = jamlab.read_all(out / f"{model}.h5")
        assert abs(jamlab.packing_fraction(packings[-1]) - 0.88) < 1e-6
        assert all(p.max_force <= limit for p in packings)
        assert f"{read_observables(out / f'{model}.h5')['z'][-1]:.4f}" in done.stdout


def test_a_long_table_shows_every_tenth_state_and_the_last(packed, tmp_path, capsys):
    """All of them stand in the file."""
    packing = jamlab.read(packed[0])
    print_packings([packing] * 25, tmp_path / "all.h5", False, quantities=["phi"], workers=1, step=10)
    printed = capsys.readouterr()
    assert printed.out.count(" yes\n") == 4 and len(jamlab.read_all(tmp_path / "all.h5")) == 25
    assert f"4 of 25 states; all of them: jamlab analyze {tmp_path / 'all.h5'}" in printed.err + printed.out


def test_analyze_does_not_call_unknown_unconverged(packed, tmp_path):
    """A state of which no minimisation is known, as in the dumps of decks, is not one that failed to converge."""
    p = jamlab.read(packed[0])
    unknown = p.with_state(positions=p.positions)
    jamlab.write(tmp_path / "mixed.h5", [p, unknown, unknown.with_state(max_force=1e-3, converged=False)])
    found = json.loads(call(tmp_path, "analyze", "mixed.h5", "--json").stdout)
    assert found["converged"] == [True, None, False]
    assert "converged -" in call(tmp_path, "analyze", "mixed.h5").stdout


@pytest.mark.parametrize("name", ["nothere.png", "x.toml", "disks.csv"])
def test_a_file_that_is_not_there_one_of_no_kind_and_disks_without_a_box_are_named(tmp_path, name):
    (tmp_path / "x.toml").write_text("a = 1")
    (tmp_path / "disks.csv").write_text("x,y,radius\n0.5,0.5,0.5\n1.4,0.5,0.5\n")
    done = call(tmp_path, "analyze", name)
    assert done.exit_code == 1 and name in done.stderr and "Errno" not in done.stderr


@pytest.mark.parametrize(
    ("first", "idle"),
    [
        ("import jamlab", "numpy scipy h5py pandas matplotlib lammps typer"),
        ("import jamlab.cli.main", "numpy scipy h5py pandas matplotlib lammps shapely"),
        ("import jamlab; jamlab.pack, jamlab.jam", "scipy.optimize scipy.special scipy.spatial pandas typer"),
    ],
)
def test_nothing_loads_that_is_not_used(first: str, idle: str) -> None:
    """Start-up is waited for at every command: what it takes is what its imports take."""
    asked = f"import sys; {first}; print(*(set({idle.split()}) & set(sys.modules)))"
    loaded = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True)
    assert not loaded.stdout.split()


def test_words_from_habit(packed, tmp_path):
    path, printed = packed
    assert call(tmp_path, "-h").stdout == call(tmp_path, "--help").stdout
    assert call(tmp_path, "help", "jam").stdout == call(tmp_path, "jam", "--help").stdout
    assert call(tmp_path, "version").stdout == call(tmp_path, "-V").stdout == f"jamlab {jamlab.__version__}\n"
    assert call(tmp_path, "jam", "-n", "8", "-o", "small.h5").exit_code == 0
    assert call(tmp_path, "analyze", str(path), "--csv", "p.csv").exit_code == 0
    assert pd.read_csv(tmp_path / "p.csv")["rho"].tolist() == printed["rho"]
    for name in ("p.dump", "p.xyz", "p.data", "p.h5"):
        assert call(tmp_path, "convert", str(path), name).exit_code == 0
        assert jamlab.read(tmp_path / name, **({"units": "k"} if name == "p.xyz" else {})).phi == pytest.approx(
            jamlab.read(path).phi, rel=1e-12
        )
    done = call(tmp_path, "relax", "p.xyz", "--units", "k", "-o", "again.h5")
    assert done.exit_code == 0 and jamlab.read(tmp_path / "again.h5").converged


def test_estimate_says_what_python_says(tmp_path):
    """The plan, and the mean with its interval; an error that was not met is said."""
    done = call(tmp_path, "estimate", "rho_J", "--error", "0.03", "--dry-run", "--json")
    plan, wanted = json.loads(done.stdout), jamlab.estimate_cost("rho_J", None, 0.03)
    assert (plan["packings"], plan["error"], plan["way"]) == (wanted.packings, wanted.bound["rho_J"], str(wanted.way))
    assert [row["why"] for row in plan["options"]] == list(wanted.options["why"])
    table = call(tmp_path, "estimate", "rho_J", "--error", "0.03", "--dry-run").stdout
    assert "taken" in table and f"{wanted.packings} packings of {wanted.way}" in table


def test_estimate_prints_mean_and_interval(tmp_path, monkeypatch):
    choice = jamlab.estimate_cost("z", 0.9, 0.1)
    found = jamlab.results.Estimate(5.25, 0.3, False, 2, 1, 4.0, choice, np.array([5.0, 5.5]), np.arange(2))
    monkeypatch.setattr("jamlab.estimates.estimate.estimate", lambda *_, **__: found)
    line = ("estimate", "z", "--rho", "0.9", "--error", "0.1")
    said = call(tmp_path, *line).stdout
    assert "z = 5.25, within 0.3 (95 %)" in said and "NOT MET" in said and "1 left out" in said
    printed = json.loads(call(tmp_path, *line, "--json").stdout)
    assert (printed["value"], printed["met"], printed["values"]) == (5.25, False, [5.0, 5.5])
