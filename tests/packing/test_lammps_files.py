"""Data files against LAMMPS itself, dumps against MDAnalysis."""

import os
from dataclasses import replace

import numpy as np
import pytest
from wandering_packings import disks, polygons

import jamlab
from jamlab.engine.installation import start_lammps
from jamlab.errors import InputError
from jamlab.packing.facts import STATE
from jamlab.packing.lammps_files import described, title_of, types, write_data, write_dump
from jamlab.packing.packing import Packing

TILTS = [0.0, 1 / 3, -1.1, 16 / 3]


@pytest.fixture(scope="module")
def lmp():
    lammps = start_lammps()
    yield lammps
    lammps.close()


def load(lmp, path, model):
    """Read a data file as the decks do, and run zero steps on it; arrays of what LAMMPS then holds, sorted by id."""
    lines = ["clear", "units lj", "dimension 2", "boundary p p p", "atom_modify map array sort 0 0.0", "box tilt large"]
    if model == "dp":
        lines += ["atom_style molecular", "fix d_a0 all property/atom d_a0", f"read_data {path} fix d_a0 NULL d_a0"]
        lines += ["bond_style zero", "bond_coeff *", "special_bonds lj/coul 1.0 1.0 1.0"]
    else:
        lines += ["atom_style atomic", f"read_data {path}"]
    for line in [*lines, "pair_style zero 1.0", "pair_coeff * *"]:
        lmp.command(line)
    as_read = held(lmp, model)
    lmp.command("run 0 post no")
    return as_read, held(lmp, model)


def held(lmp, model):
    count = lmp.get_natoms()
    order = np.argsort(lmp.numpy.extract_atom("id")[:count])
    names = ("x", "type", "molecule", "d_a0") if model == "dp" else ("x", "type")
    state = {name: lmp.numpy.extract_atom(name)[:count][order].copy() for name in names}
    state["image"] = np.array(lmp.gather_atoms("image", 0, 3)).reshape(-1, 3)
    if model == "dp":
        number, bonds = lmp.gather_bonds()
        state["bonds"] = np.array(bonds).reshape(number, 3)
    return state


def atoms_in(path, columns):
    """Numbers of the Atoms section."""
    section = path.read_text().split("\nAtoms # ")[1].split("\n\n")[1]
    return np.array([line.split()[columns] for line in section.splitlines()], dtype=np.float64)


@pytest.mark.parametrize("tilt", TILTS)
@pytest.mark.parametrize("make", [disks, polygons])
def test_lammps_holds_what_was_written(tmp_path, lmp, make, tilt):
    packing = make(1, tilt)
    table = write_data(tmp_path / "p.data", packing)
    for state in load(lmp, tmp_path / "p.data", packing.model):
        low, high, xy, yz, xz, periodic, _ = lmp.extract_box()
        assert (low[:2], high[:2], xy, yz, xz) == ([0, 0], packing.box.diagonal().tolist(), tilt, 0, 0)
        assert periodic == [1, 1, 1]
        whole = state["x"][:, :2] + state["image"][:, :2] @ packing.box
        np.testing.assert_allclose(whole, packing.positions, rtol=0, atol=2e-14)
        assert np.abs(state["image"][:, :2]).max() > 1 and not state["image"][:, 2].any()
        assert (state["type"] == table.types[packing.particle]).all()
        if packing.model == "dp":
            assert (state["molecule"] == packing.particle + 1).all()
            assert (state["d_a0"] == packing.params["a0"][packing.particle]).all()
            bonds = {(kind, *sorted(pair)) for kind, *pair in state["bonds"].tolist()}
            assert bonds == {(1, *sorted((i + 1, j + 1))) for i, j in enumerate(packing.polygons.successor.tolist())}


def test_lammps_holds_every_bit_where_its_own_arithmetic_is_exact(tmp_path, lmp):
    positions = np.random.default_rng(1).uniform(0, 4, (100, 2))
    packing = Packing("sp", [[4.0, 0.0], [0.0, 4.0]], positions, {"eps": 1.0}, diameters=np.ones(100))
    write_data(tmp_path / "p.data", packing)
    for state in load(lmp, tmp_path / "p.data", "sp"):
        assert state["x"][:, :2].tobytes() == positions.tobytes()
        assert not state["image"].any()


@pytest.mark.parametrize("far", [-512.5, 512.5])
def test_a_position_too_far_for_the_image_flags_is_refused(tmp_path, far):
    packing = Packing("sp", np.eye(2), [[0.5, 0.5], [0.5, far]], {"eps": 1.0}, diameters=np.ones(2))
    with pytest.raises(InputError, match=rf"positions\[1\].*{abs(np.floor(far)):.0f}"):
        write_data(tmp_path / "p.data", packing)
    assert os.listdir(tmp_path) == []
    write_data(tmp_path / "p.data", packing.with_state(positions=[[0.5, 0.5], [511.5, -511.5]]))
    assert atoms_in(tmp_path / "p.data", slice(-3, -1)).tolist() == [[0, 0], [511, -512]]


@pytest.mark.parametrize("make", [disks, polygons])
def test_types_rank_the_sizes(make):
    packing = make(1, 0.0)
    sizes = packing.diameters if make is disks else packing.params["a0"]
    table = types(packing)
    assert (table.values == np.unique(sizes)).all() and (table.values[table.types - 1] == sizes).all()


def test_beyond_64_sizes_types_are_classes_and_files_hold_the_diameter_of_each_disk(tmp_path):
    def packing(n):
        positions = np.random.default_rng(1).random((n, 2))
        return Packing("sp", 9 * np.eye(2), positions, {"eps": 1.0}, diameters=np.linspace(1, 2, n)[::-1])

    assert types(packing(64)).ntypes == 64
    given = packing(65)
    table = types(given)
    assert table.classes and table.ntypes == 8
    assert (given.diameters <= table.values[table.types - 1]).all()
    assert (table.types[np.argsort(given.diameters)] == np.sort(table.types)).all()
    assert [given.diameters[table.types == k + 1].max() for k in range(8)] == table.values.tolist()
    write_data(tmp_path / "p.data", given)
    write_dump(tmp_path / "p.dump", [given])
    for name in ("p.data", "p.dump"):
        assert (jamlab.read(tmp_path / name).diameters == given.diameters).all()


def test_dump_frames_have_one_size(tmp_path):
    with pytest.raises(InputError):
        write_dump(tmp_path / "run.dump", [])
    with pytest.raises(InputError, match="frame 1"):
        write_dump(tmp_path / "run.dump", [disks(1, 0.0), polygons(1, 0.0)])
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("make", [disks, polygons])
def test_the_comment_of_a_data_file_holds_the_force_law(tmp_path, make):
    packing = make(1, 0.37)
    packing = replace(packing, phi_J=1 / 3, ensemble="shear-stabilized", max_force=1e-13 / 3, converged=True)
    write_data(tmp_path / "p.data", packing)
    lines = (tmp_path / "p.data").read_text().splitlines()
    assert lines[0] == title_of(packing)
    entries = described([*lines[1:], lines[0]])  # wherever it stands
    for name in ("model", "units", *STATE):
        assert entries.pop(name, None) == getattr(packing, name)
    if make is disks:
        assert [entries.pop(f"d{k}") for k in (1, 2, 3)] == types(packing).values.tolist()
    assert entries == {name: value for name, value in packing.params.items() if name != "a0"}


def test_a_comment_that_is_no_list_of_numbers_is_refused():
    assert described(["LAMMPS data file via write_data"]) == {}
    assert described(["# jamlab units=k k=1", "Atoms", "# jamlab units=k k=2"])["k"] == 2.0  # a deck appends its own
    with pytest.raises(InputError, match="'gamma=much'"):
        described(["# jamlab model=dp gamma=much"])
    with pytest.raises(InputError, match=r"params\['note'\]"):
        title_of(disks(1, 0.0).with_state(params={"eps": 1.0, "note": [1]}))


@pytest.mark.parametrize("name", ["p.csv", "p.dump.gz", "p.txt", "p.html"])
def test_files_for_lammps_do_not_get_a_name_of_another_format(tmp_path, name):
    packing = disks(1, 0.0)
    with pytest.raises(InputError, match=name):
        jamlab.write(tmp_path / name, packing)
    with pytest.raises(InputError, match="fixed"):
        jamlab.write(tmp_path / "p.xyz", packing.with_state(fixed=np.ones(packing.n, dtype=bool)))
    assert not list(tmp_path.iterdir())
    jamlab.write(tmp_path / "data.droplets", packing)  # as LAMMPS users name them
    jamlab.write(tmp_path / "dump.1", [packing])
    for own in ("data.droplets", "dump.1"):
        assert jamlab.read(tmp_path / own).n == packing.n
