"""Packings as a Universe of MDAnalysis and back, Universes that others made."""

import pickle

import MDAnalysis
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from wandering_packings import assert_same, disks, polygons

import jamlab
from jamlab.errors import ConvergenceError, InputError, StorageError
from jamlab.packing.lammps_files import types

TILTS = [0.0, 1 / 3, -1.1, 16 / 3]
FLOAT32 = 6.5  # digits
WARNINGS = [
    pytest.mark.filterwarnings(f"ignore:{text}")
    for text in ("Guessed all Masses", "Reader has no dt", "No dimensions set", "Failed to guess", "Unknown masses")
]


def noisy(test):
    for mark in WARNINGS:
        test = mark(test)
    return test


@pytest.mark.parametrize("make", [disks, lambda seed, tilt: disks(seed, tilt, "k"), polygons])
@given(seed=st.integers(0, 10**6), tilts=st.lists(st.sampled_from(TILTS), min_size=1, max_size=3))
def test_a_universe_gives_the_packings_back(make, seed, tilts):
    written = [make(seed, 0.0).with_state(box=[[10 / 3, 0.0], [tilt, 29 / 9.9]]) for tilt in tilts]
    read = jamlab.from_universe(jamlab.universe(written))
    assert len(read) == len(written)
    for k, (back, packing) in enumerate(zip(read, written, strict=True)):
        assert_same(back, packing, FLOAT32)
        off = max(np.abs(back.positions - packing.positions).max(), np.abs(back.box - packing.box).max())
        assert off < back.rounding < 3e-6 * max(np.abs(packing.positions).max(), np.abs(packing.box).sum())
        assert (back.converged, back.max_force) == (False, None)
        assert back.provenance == {"source": "memory", "frame": k, "precision": "float32"}


@pytest.mark.parametrize("tilt", TILTS)
@pytest.mark.parametrize("make", [disks, polygons])
def test_what_a_universe_says(make, tilt):
    packing = make(2, tilt)
    u = jamlab.universe([packing, packing])
    assert len(u.trajectory) == 2
    assert (u.residues.n_residues, len(u.atoms)) == (packing.n, len(packing.positions))
    assert (u.atoms.resindices == packing.particle).all() and (u.atoms.resids == packing.particle + 1).all()
    assert (u.atoms.types == types(packing).types[packing.particle].astype(str)).all()
    np.testing.assert_allclose(u.trajectory.ts.triclinic_dimensions[:2, :2], packing.box, atol=2e-6)
    if make is disks:
        assert (u.atoms.radii == packing.diameters / 2).all()
        assert not hasattr(u.atoms, "bonds")
    else:
        assert (u.atoms.radii == packing.params["delta"] / 2).all()
        bonds = {tuple(sorted(pair)) for pair in u.bonds.indices.tolist()}
        assert bonds == {tuple(sorted(pair)) for pair in enumerate(packing.polygons.successor.tolist())}
        assert (u.residues.rest_areas == packing.params["a0"]).all()
    again = pickle.loads(pickle.dumps(u))
    assert_same(jamlab.from_universe(again)[1], packing, FLOAT32)


def test_a_part_of_a_universe():
    packing = polygons(5, 0.0)
    u = jamlab.universe(packing)
    part = packing.select(np.array([True, False, True, True, False]))
    assert_same(jamlab.from_universe(u.select_atoms("resid 1 3 4"))[0], part, FLOAT32)
    with pytest.raises(InputError):
        jamlab.from_universe(u.atoms[1:])
    with pytest.raises(InputError):
        jamlab.from_universe(u.select_atoms("resid 99"))


def test_a_group_that_is_updated_has_other_particles_in_each_frame():
    """From own sums over the disks of the left half; a group keeps its disks otherwise."""
    rng, box = np.random.default_rng(3), 9.0 * np.eye(2)
    sizes = rng.choice([1.0, 1.4], 12)
    frames = [
        jamlab.Packing("sp", box, rng.random((12, 2)) * 9, {"k": 1.0}, "k", sizes, fixed=np.arange(12) < 5)
        for _ in range(3)
    ]
    u = jamlab.universe(frames)
    updated, kept = (u.select_atoms("prop x < 4.5", updating=each) for each in (True, False))
    inside = [np.flatnonzero(p.positions[:, 0] < 4.5) for p in frames]
    assert len({tuple(each) for each in inside}) > 1
    for p, q, own in zip(frames, jamlab.from_universe(updated), inside, strict=True):
        assert np.allclose(q.positions, p.positions[own], atol=1e-5)
        assert (q.fixed == p.fixed[own]).all() and np.allclose(q.diameters, sizes[own])
    right = [
        jamlab.measure(p.select(np.isin(np.arange(12), o)), "rho")["rho"] for p, o in zip(frames, inside, strict=True)
    ]
    phi = jamlab.PackingAnalysis(updated, "rho").run().results.rho
    assert np.allclose(phi, right, rtol=1e-4)
    assert all((q.diameters == sizes[inside[0]]).all() for q in jamlab.from_universe(kept))
    with pytest.raises(jamlab.InputError, match="atom 0 twice"):
        jamlab.from_universe(u.atoms + u.atoms[:2])


def test_a_ring_around_the_box_is_no_droplet():
    u = bare([[0, 0.5, 0], [1, 0.5, 0], [2, 0.5, 0]], [3, 3, 1, 90, 90, 90])
    u.add_TopologyAttr("bonds", [(0, 1), (1, 2), (2, 0)])
    with pytest.raises(InputError):
        jamlab.from_universe(u, law={"a0": 1.0})


def bare(positions, dimensions=(4, 4, 1, 90, 90, 90)):
    u = MDAnalysis.Universe.empty(len(positions), trajectory=True)
    u.atoms.positions = positions
    u.dimensions = dimensions
    return u


@noisy
def test_what_a_universe_lacks_is_asked_for():
    flat = [[0, 0, 0], [1, 2, 0]]
    with pytest.raises(InputError):
        jamlab.from_universe(bare(flat))
    with pytest.raises(InputError):
        jamlab.from_universe(bare(flat, None), 0.5)
    with pytest.raises(InputError):
        jamlab.from_universe(bare([[0, 0, 0], [1, 2, 0.1]]), 0.5)
    with pytest.raises(InputError):
        jamlab.from_universe(bare(flat, (4, 4, 1, 90, 80, 90)), 0.5)
    with pytest.raises(InputError):
        jamlab.from_universe([1, 2], 0.5)
    (read,) = jamlab.from_universe(bare(flat, None), [0.5, 0.7], box=[[4, 0], [0.1, 5]])
    assert (read.diameters.tolist(), read.box[1].tolist()) == ([1.0, 1.4], [0.1, 5.0])
    assert read.provenance["assumed"] == ["eps"]
    named = bare(flat)
    named.add_TopologyAttr("names", ["large", "small"])
    assert jamlab.from_universe(named, {"large": 0.7, "small": 0.5})[0].diameters.tolist() == [1.4, 1.0]


@pytest.mark.parametrize("fixture", ["sp_jammed", "dp_dense"])
def test_what_needs_a_minimum_is_refused_until_relaxed(fixture, request):
    packing = request.getfixturevalue(fixture)
    u = jamlab.universe(packing)
    (rounded,) = jamlab.from_universe(u)
    for call in (jamlab.shear_modulus, jamlab.bulk_modulus, lambda p: jamlab.complex_modulus(p, [1.0])):
        with pytest.raises(ConvergenceError):
            call(rounded)
    assert np.isnan(jamlab.measure(rounded)["g"])
    (relaxed,) = jamlab.from_universe(u, relaxed=True)
    assert relaxed.converged and relaxed.rounding == 0 and relaxed.provenance["precision"] == "float64"
    assert relaxed.provenance["moved"] < 1e-5
    moduli = [jamlab.shear_modulus(p, direction="simple") for p in (relaxed, packing)]
    np.testing.assert_allclose(*moduli, rtol=1e-3)
    assert jamlab.contacts(relaxed).z == jamlab.contacts(packing).z


def test_z_is_given_only_where_rounding_cannot_change_it(sp_jammed):
    (rounded,) = jamlab.from_universe(jamlab.universe(sp_jammed))
    assert jamlab.measure(rounded, ["z"])["z"] == jamlab.contacts(sp_jammed).z
    pair = [[0.5, 0.5], [1.5, 0.5]]
    for gap, certain in ((1e-7, False), (-1e-7, False), (1e-3, True), (-1e-3, True)):
        packing = jamlab.Packing("sp", 4 * np.eye(2), pair, {"eps": 1.0}, diameters=[1 - gap, 1 - gap])
        (rounded,) = jamlab.from_universe(jamlab.universe(packing))
        assert np.isnan(jamlab.measure(rounded, ["rattlers"])["rattlers"]) != certain


def write_gsd(path, packings):
    """As HOOMD does: positions around the origin, wrapped; tilt factors; float32."""
    hoomd = pytest.importorskip("gsd.hoomd")
    with hoomd.open(path, "w") as file:
        for packing in packings:
            frame, count = hoomd.Frame(), len(packing.positions)
            inside = packing.positions @ np.linalg.inv(packing.box)
            inside = (inside - np.floor(inside) - 0.5) @ packing.box
            frame.particles.N, frame.particles.position = count, np.column_stack([inside, np.zeros(count)])
            frame.particles.types, frame.particles.typeid = ["A"], [0] * count
            if packing.model == "sp":
                frame.particles.diameter = packing.diameters
            else:
                frame.bonds.N, frame.bonds.types, frame.bonds.typeid = count, ["edge"], [0] * count
                frame.bonds.group = np.column_stack([np.arange(count), packing.polygons.successor])
            (lx, _), (xy, ly) = packing.box
            frame.configuration.box, frame.configuration.dimensions = [lx, ly, 1, xy / ly, 0, 0], 2
            file.append(frame)


@pytest.mark.parametrize("make", [disks, polygons])
def test_gsd_with_square_and_sheared_boxes(tmp_path, make):
    written = [make(1, 0.0).with_state(box=[[10 / 3, 0.0], [tilt, 29 / 9.9]]) for tilt in TILTS]
    write_gsd(tmp_path / "p.gsd", written)
    params = None if make is disks else written[0].params
    read = jamlab.read_all(tmp_path / "p.gsd", law=params)
    for back, packing in zip(read, written, strict=True):
        np.testing.assert_allclose(back.box, packing.box, atol=2e-6)
        apart = (back.positions - packing.positions + 0.5 * packing.box.sum(axis=0)) @ np.linalg.inv(packing.box)
        np.testing.assert_allclose(apart, np.rint(apart), atol=3e-6)
        if make is disks:
            np.testing.assert_allclose(back.diameters, packing.diameters, rtol=1e-7)
        else:
            np.testing.assert_allclose(back.polygons.edges, packing.polygons.edges, atol=2e-6)
    assert jamlab.read(tmp_path / "p.gsd", 1, law=params).box.tolist() == read[1].box.tolist()
    with pytest.raises(StorageError):
        jamlab.read(tmp_path / "p.gsd", 4, law=params)


def moving_disks(count):
    """Disks that drift apart in a box that is sheared."""
    first = disks(1, 0.0, n=24)
    rng = np.random.default_rng(2)
    drift = rng.normal(0, 0.003, first.positions.shape)
    boxes = [first.box + np.array([[0, 0], [0.01 * k, 0]]) for k in range(count)]
    return [first.with_state(box=box, positions=first.positions + k * drift) for k, box in enumerate(boxes)]


@pytest.fixture(scope="module")
def long():
    return jamlab.universe(moving_disks(60))


def test_frames_are_measured_as_one_by_one(long):
    names = ("rho", "phi", "z", "rattlers", "pressure", "voids", "psi_6", "psi_6_global")
    found = jamlab.PackingAnalysis(long, names).run()
    rows = [jamlab.measure(packing, names) for packing in jamlab.from_universe(long)]
    assert len(rows) == found.n_frames == 60
    for name in names:
        assert found.results[name].tobytes() == np.array([row[name] for row in rows]).tobytes()
    assert len(np.unique(found.results.rho)) == 60


def test_steps_and_single_quantities(long):
    found = jamlab.PackingAnalysis(long, "rho").run(step=15)
    assert (found.frames.tolist(), found.results.rho.shape) == ([0, 15, 30, 45], (4,))
    assert set(found.results) == {"rho"}
    assert jamlab.PackingAnalysis(long).run(stop=2).results.z.shape == (2,)


def test_frames_are_those_of_the_trajectory(long):
    """Slices and numbers, from either end, as `u.trajectory[frames]` takes them."""
    every = [q.positions.tobytes() for q in jamlab.from_universe(long)]
    for frames in (slice(3, 30, 9), slice(None, None, -20), slice(90, 100), [0, 5, -1], (7,), np.array([7, 3, 3]), []):
        wanted = [every[k] for k in np.arange(60)[frames if isinstance(frames, slice) else np.array(frames, dtype=int)]]
        assert [q.positions.tobytes() for q in jamlab.from_universe(long, frames=frames)] == wanted
    for frames in (slice(0, 9, 0), slice("a"), 3, [60], [-61], [[1, 2]], [1.0], "all"):
        with pytest.raises(InputError, match="frames"):
            jamlab.from_universe(long, frames=frames)


def test_a_law_is_given_by_its_name_or_by_parameters(tmp_path):
    u = MDAnalysis.Universe.empty(2, trajectory=True)
    u.atoms.positions, u.dimensions = [[0, 0, 0], [1, 0, 0]], [4, 4, 1, 90, 90, 90]
    for law, exponent in (("hertz", 2.5), ("harmonic", 2.0), ({"exponent": 2.2}, 2.2)):
        (p,) = jamlab.from_universe(u, radii=0.5, units="k", law=law)
        assert p.params["exponent"] == exponent and p.params["k"] == 1.0
    (tmp_path / "p.csv").write_text("x,y,radius\n0,0,0.5\n1,0,0.5\n")
    how = {"box": [4, 4], "units": "k", "law": "hertz"}
    assert jamlab.read(tmp_path / "p.csv", **how).params["exponent"] == 2.5
    assert jamlab.from_universe(jamlab.universe(tmp_path / "p.csv", **how))[0].params["exponent"] == 2.5
    jamlab.PackingAnalysis(u, "rho", radii=0.5, units="k", law="hertz").run()
    for wrong in ("lennard-jones", {"law": "hertz", "exponent": 2.0}, {"gamma": 1.0}):
        with pytest.raises(InputError):
            jamlab.from_universe(u, radii=0.5, units="k", law=wrong)
    with pytest.raises(InputError, match="law"):
        jamlab.universe(p, law="hertz")


def test_moduli_of_relaxed_frames_only(sp_jammed):
    u = jamlab.universe([sp_jammed, sp_jammed])
    with pytest.raises(InputError):
        jamlab.PackingAnalysis(u, ("rho", "g"))
    with pytest.raises(InputError):
        jamlab.PackingAnalysis(u, ("density",))
    found = jamlab.PackingAnalysis(u, ("g", "z"), relaxed=True)
    found.run()
    np.testing.assert_allclose(found.results.g, jamlab.shear_modulus(sp_jammed), rtol=1e-3)
    assert (found.results.z == jamlab.contacts(sp_jammed).z).all()


def test_a_frame_that_is_no_packing_is_named():
    u = jamlab.universe([disks(0, 0.0), disks(0, 0.0)])
    u.trajectory.dimensions_array[1] = 0
    with pytest.raises(InputError):
        jamlab.PackingAnalysis(u, ("rho",)).run()
