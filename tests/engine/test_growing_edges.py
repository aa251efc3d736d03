"""Edges that outgrow the neighbor lists of a run: contacts are found all the same."""

import resource

import numpy as np
import pytest

from jamlab.packing.law_parameters import CONTACT_FORMS

from .test_plugin_on_ranks import columns, run

START = """
clear
units lj
dimension 2
atom_style molecular
atom_modify map array sort 0 0.0
read_data growing.data
special_bonds lj/coul 1.0 1.0 1.0
bond_style line/tension
bond_coeff * 0.0
pair_style circuloline 0.25 2.5 contact {form}
pair_coeff * * {eps}
neighbor 0.1 bin
neigh_modify delay 0 every 1 check yes
"""
GROW = """
fix move all nve
timestep 0.01
run 190
write_data grown.data nocoeff
"""
END = """
run 0
write_dump all custom {name}.dump id fx fy modify sort id format float %.17g
print "state-{name} $(pe:%.17g) $(pxx:%.17g) $(pyy:%.17g)"
"""


def growing():
    """A square whose right side runs away, and a small one beside the middle of the edge that is drawn out."""
    corners = np.array([[0, 0], [0.4, 0], [0.4, 0.4], [0, 0.4]])
    x = np.vstack([corners + 3.0, corners * 0.5 + [3.9, 3.6], corners * 0.5 + [3.9, 2.6]])
    v = np.zeros((12, 2))
    v[[1, 2], 0] = 1.0
    lines = ["growing", "", "12 atoms", "12 bonds", "1 atom types", "1 bond types"]
    lines += ["0 8 xlo xhi", "0 8 ylo yhi", "-0.5 0.5 zlo zhi", "", "Masses", "", "1 1e9", "", "Atoms", ""]
    lines += [f"{k + 1} {k // 4 + 1} 1 {x[k, 0]} {x[k, 1]} 0" for k in range(12)]
    lines += ["", "Velocities", "", *(f"{k + 1} {v[k, 0]} {v[k, 1]} 0" for k in range(12))]
    lines += ["", "Bonds", "", *(f"{k + 1} 1 {k + 1} {k - 2 if k % 4 == 3 else k + 2}" for k in range(12))]
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.slow)])
@pytest.mark.parametrize("form", CONTACT_FORMS)
def test_contacts_of_edges_that_grew(tmp_path, form, ranks):
    """0.4 long at the start, 2.3 at the end of the run: energy and forces as in a run that starts there."""
    (tmp_path / "growing.data").write_text(growing())
    start = START.format(form=form, eps=1.0)
    last = "run 0 pre no" if ranks == 1 else ""
    deck = start + GROW + END.format(name="grown").replace("run 0", last, 1)
    deck += start.replace("growing.data", "grown.data") + END.format(name="fresh")
    values = run(tmp_path, deck, ranks)
    assert values["state-fresh"][0] > 0.005
    assert values["state-grown"] == pytest.approx(values["state-fresh"], rel=1e-12)
    forces = [columns(tmp_path / f"{name}.dump", 9) for name in ("grown", "fresh")]
    assert np.abs(forces[0] - forces[1]).max() < 1e-12


SWELL = """
fix swell all nve
timestep 0.005
run 85
print "state-{rings} $(pe:%.17g)"
"""


def swelling(across, size=20):
    """Small rings on a square lattice, every vertex on its way outwards: they grow to nine times their radius."""
    turns = 2 * np.pi * np.arange(size) / size
    ring = np.column_stack([np.cos(turns), np.sin(turns)])
    centres = 0.5 + np.stack(np.meshgrid(*2 * [np.arange(across)]), axis=-1).reshape(-1, 1, 2)
    x, count = (centres + 0.05 * ring).reshape(-1, 2), across**2 * size
    lines = ["swelling", "", f"{count} atoms", f"{count} bonds", "1 atom types", "1 bond types"]
    lines += [
        f"0 {across} xlo xhi",
        f"0 {across} ylo yhi",
        "-0.5 0.5 zlo zhi",
        "",
        "Masses",
        "",
        "1 1e9",
        "",
        "Atoms",
        "",
    ]
    lines += [f"{k + 1} {k // size + 1} 1 {x[k, 0]} {x[k, 1]} 0" for k in range(count)]
    lines += ["", "Velocities", "", *(f"{k + 1} {ring[k % size, 0]} {ring[k % size, 1]} 0" for k in range(count))]
    lines += ["", "Bonds", "", *(f"{k + 1} 1 {k + 1} {k // size * size + (k + 1) % size + 1}" for k in range(count))]
    return "\n".join(lines) + "\n"


@pytest.mark.benchmark
def test_edges_that_grow_cost_in_proportion_to_their_number(tmp_path):
    """CPU time of nine times as many rings: 13 times at most; all edges tried with all would take 81 times."""
    seconds = []
    for across in (10, 30):
        (tmp_path / "growing.data").write_text(swelling(across))
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        run(
            tmp_path,
            START.format(form="outline", eps=1.0).replace("0.25 2.5", "0.1 1.0") + SWELL.format(rings=across),
            1,
        )
        seconds.append(resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before)
    print(f"\n100 and 900 growing rings: {seconds[0]:.2f} and {seconds[1]:.2f} s")
    assert seconds[1] < 13 * seconds[0]
