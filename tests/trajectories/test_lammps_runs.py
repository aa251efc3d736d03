"""Trajectories that plain LAMMPS makes: disks under steady shear, read by jamlab and by MDAnalysis."""

import subprocess
import sys
from pathlib import Path

import MDAnalysis
import numpy as np
import pytest
from wandering_packings import disks

import jamlab

RUN = """
units       lj
dimension   2
atom_style  atomic
box         tilt large
read_data   start.data
pair_style  zero 1.0
pair_coeff  * *
velocity    all create 1e-3 1
fix         move all nve
fix         plane all enforce2d
fix         shear all deform 1 xy erate 0.05 remap v
dump        exact all custom 10 exact.lammpstrj id type x y z ix iy
dump_modify exact format float %.17g
dump        scaled all custom 10 scaled.dump id type xs ys zs
dump        default all atom 10 atom.dump
run         190
write_data  end.data nocoeff
write_data  law.data nocoeff
print       "# jamlab model=sp units=k k=$(1/3:%.17g) d1=0.1 d2=0.2 d3=$(0.1+0.2:%.17g) converged=1" append law.data
clear
units       lj
dimension   2
box         tilt large
read_data   law.data
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    start = disks(3, 1 / 3, n=30)
    jamlab.write(folder / "start.data", start)
    (folder / "in.run").write_text(RUN)
    lmp = Path(sys.executable).with_name("lmp")
    subprocess.run([lmp, "-in", "in.run"], cwd=folder, check=True, capture_output=True, timeout=120)
    radii = {str(k): size / 2 for k, size in enumerate(np.unique(start.diameters), start=1)}
    return folder, start, radii


def apart(one, other):
    """Largest distance, whatever the periodic images."""
    steps = (one.positions - other.positions) @ np.linalg.inv(other.box)
    return np.abs((steps - np.rint(steps)) @ other.box).max()


def test_the_dump_begins_where_the_data_file_was(run):
    folder, start, radii = run
    frames = jamlab.read_all(folder / "exact.lammpstrj", radii=radii)
    assert len(frames) == 20 and [p.provenance["step"] for p in frames] == list(range(0, 200, 10))
    np.testing.assert_allclose(frames[0].positions, start.positions, atol=1e-14)
    np.testing.assert_allclose(frames[0].box, start.box, atol=1e-14)
    assert (frames[0].diameters == start.diameters).all() and frames[0].rounding == 0
    assert frames[-1].box[1, 0] - start.box[1, 0] == pytest.approx(0.05 * 0.95 * start.box[1, 1], rel=1e-9)


def test_write_data_ends_where_the_dump_does(run):
    folder, _, radii = run
    last, end = jamlab.read(folder / "exact.lammpstrj", radii=radii), jamlab.read(folder / "end.data", radii=radii)
    np.testing.assert_allclose(end.positions, last.positions, atol=1e-14)
    np.testing.assert_allclose(end.box, last.box, atol=1e-14)
    assert end.difference(last) is None and end.rounding == 0 and not end.converged


def test_a_deck_appends_its_law_to_write_data(run):
    """And LAMMPS has read that file again."""
    folder, _, _ = run
    end = jamlab.read(folder / "law.data")
    assert (end.units, end.params, end.converged) == ("k", {"k": 1 / 3}, True)
    assert np.unique(end.diameters).tolist() == [0.1, 0.2, 0.1 + 0.2]
    assert "assumed" not in end.provenance


@pytest.mark.parametrize("name", ["scaled.dump", "atom.dump"])
def test_six_digits_are_known_to_be_six(run, name):
    folder, _, radii = run
    exact = jamlab.read_all(folder / "exact.lammpstrj", radii=radii)
    for few, all_digits in zip(jamlab.read_all(folder / name, radii=radii), exact, strict=True):
        assert 0 < apart(few, all_digits) < 2 * few.rounding < 1e-4


@pytest.mark.filterwarnings("ignore:Guessed all Masses:UserWarning")
@pytest.mark.filterwarnings("ignore:Reader has no dt:UserWarning")
def test_mdanalysis_reads_the_same(run):
    folder, _, radii = run
    exact = jamlab.read_all(folder / "exact.lammpstrj", radii=radii)
    files, style = [str(folder / name) for name in ("end.data", "exact.lammpstrj")], "id type x y z"
    u = MDAnalysis.Universe(*files, topology_format="DATA", format="LAMMPSDUMP", atom_style=style)
    read = jamlab.from_universe(u, radii)
    for one, other in zip(read, exact, strict=True):
        assert apart(one, other) < one.rounding
        np.testing.assert_allclose(one.box, other.box, atol=2e-6)
        assert (one.diameters == other.diameters).all()
    u.trajectory.close()
