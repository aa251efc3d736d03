"""LAMMPS against plain loops, its own energy, jamlab.hessian and symmetry; contact forms, jammed and along paths."""

import ctypes
import shutil
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
import reference
from outlines import FORMS

import jamlab
from jamlab.engine.atom_exchange import AtomExchange
from jamlab.installed_files import installed
from jamlab.mechanics.stiffness import forces, stress
from jamlab.packing.deformation import sheared

KINDS = ["eps", "k", *FORMS]  # units of disks, contact forms of polygons in LAMMPS


@pytest.fixture
def make(random_disks, random_polygons):
    """Random state of one of KINDS."""

    def state(kind, tilt=0.0, seed=0, **options):
        if kind in ("eps", "k"):
            return random_disks(tilt, kind, seed, **options)
        return random_polygons(tilt, kind, seed, **options)

    return state


def differ(got, wanted):
    """Largest difference relative to the largest value."""
    return np.abs(np.subtract(got, wanted)).max() / np.abs(wanted).max()


def assert_same(got, wanted, tolerance=1e-10):
    """Two evaluations agree; the forces against the size of the largest one."""
    assert wanted.contact_energy > 0
    for name in ("energy", "contact_energy", "forces", "stress"):
        assert differ(getattr(got, name), getattr(wanted, name)) < tolerance, name


def crossing(p):
    """How many particles have a position outside the box."""
    fraction = p.positions @ np.linalg.inv(p.box)
    return len(np.unique(p.particle[((fraction < 0) | (fraction >= 1)).any(axis=1)]))


def slope(function, positions, step=1e-6):
    """Central differences of a function of all positions, one row per coordinate."""
    rows = []
    for k in range(positions.size):
        moved = np.zeros(positions.shape)
        moved.flat[k] = step
        rows.append(np.subtract(function(positions + moved), function(positions - moved)) / (2 * step))
    return np.array(rows)


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2))])
@pytest.mark.parametrize("tilt", [0.0, 0.3, 0.7, -0.45])
@pytest.mark.parametrize("kind", [*KINDS, "segment"])
def test_random_states_equal_the_reference(make, kind, tilt, seed):
    """Energy, forces and stress of LAMMPS, in square and sheared boxes, particles across the boundary."""
    p = make(kind, tilt, seed)
    assert crossing(p) >= 1
    e = jamlab.evaluate(p)
    assert_same(e, reference.evaluate(p))
    assert e.pressure == pytest.approx(np.trace(e.stress) / 2)
    assert e.max_force == pytest.approx(np.hypot(*e.forces.T).max())


@pytest.mark.parametrize(
    "place",
    [{"width": 0.9, "gap": 1.1, "delta": 0.65}, {"width": 2.5, "gap": 0.3, "delta": 0.25}],
    ids=["narrow", "wider than half the box"],
)
def test_a_vertex_between_two_images_of_one_polygon(wedge, place):
    """It meets both of them, also where its nearest image need not belong to the same image of the polygon."""
    p = wedge(**place)
    wanted = reference.evaluate(p)
    assert_same(jamlab.evaluate(p), wanted)
    assert differ(forces(p), wanted.forces) < 1e-10


@pytest.mark.parametrize("contact", [*FORMS, "segment"])
@pytest.mark.parametrize("eta", [0.0, 0.2])
def test_edges_of_zero_length(random_polygons, contact, eta):
    """Plateau borders shrink edges to nothing: eta smooths the tension, without it they pull nowhere."""
    p = random_polygons(0.0, contact, eta=eta)
    x = p.positions.copy()
    x[[4, 20]] = x[[3, 19]]
    p = p.with_state(positions=x)
    assert_same(jamlab.evaluate(p), reference.evaluate(p))


@pytest.mark.parametrize("tilt", [0.0, 0.3])
@pytest.mark.parametrize("kind", KINDS)
def test_forces_and_hessian_are_slopes_of_the_energy(make, kind, tilt):
    """Central differences of LAMMPS energies and forces; forces and stress of numpy are those of LAMMPS."""
    p = make(kind, tilt, 6)
    with jamlab.Session(p) as session:
        e = session.evaluate()
        pull = slope(lambda x: session.forces_at(x)[0], p.positions).reshape(-1, 2)
        stiffness = -slope(lambda x: session.forces_at(x)[1], p.positions).reshape(2 * len(p.positions), -1)
    assert differ(-pull, e.forces) < 1e-6
    assert differ(forces(p), e.forces) < 1e-10
    assert differ(stress(p), e.stress) < 1e-10
    assert differ(jamlab.hessian(p).toarray(), stiffness) < 1e-6


@pytest.mark.parametrize("kind", [*KINDS, "segment"])
def test_stress_is_minus_the_slope_of_the_energy_in_strain(make, kind):
    """Box and positions strained together: -(1/A) dE/dE_kl for each of the four gradients."""
    p, step = make(kind, 0.3, 4), 1e-6
    wanted = jamlab.evaluate(p).stress

    def energy(k, m, h):
        strain = np.eye(2)
        strain[m, k] += h  # row vectors: x_k gains h x_m
        box = p.box @ strain
        if box[0, 1]:  # LAMMPS wants the first lattice vector along x: turn everything back
            c, s = box[0] / np.hypot(*box[0])
            strain = strain @ np.array([[c, -s], [s, c]])
            box = p.box @ strain
            box[0, 1] = 0.0
        return jamlab.evaluate(p.with_state(box=box, positions=p.positions @ strain)).energy

    found = [[-(energy(k, m, step) - energy(k, m, -step)) / (2 * step * p.area) for m in (0, 1)] for k in (0, 1)]
    assert differ(found, wanted) < 1e-6


@pytest.mark.parametrize("kind", KINDS)
def test_forces_without_a_setup(make, kind):
    """Also once neighbours have changed."""
    p = make(kind, 0.3, 5)
    apart = np.random.default_rng(5).uniform(-1, 1, (p.n, 2))[p.particle]
    with jamlab.Session(p) as session, jamlab.Session(p) as full:
        session.evaluate()
        for far in (1e-3, 0.1, 0.7):
            full.set_positions(p.positions + far * apart)
            wanted, before = full.evaluate(), session.steps()
            energy, forces = session.forces_at(p.positions + far * apart)
            assert energy == pytest.approx(wanted.energy, rel=1e-12)
            assert differ(forces, wanted.forces) < 1e-10
            assert session.contact_energy() == pytest.approx(wanted.contact_energy, rel=1e-11)
            assert session.steps() == before + 1
        session.load(p, anew=True)
        assert session.steps() == before + 1


@pytest.mark.parametrize("kind", KINDS)
def test_a_reused_session_equals_a_fresh_one(make, kind):
    """Other positions, box, tilt, law, sizes and number of particles, in one session."""
    other = {"eps": "k", "k": "eps", "outline": "segment/smooth"}.get(kind, "outline")
    sizes = {"n": 14} if kind in ("eps", "k") else {"sizes": (6, 12, 8, 10)}
    first = make(kind, 0.3, 0)
    moved = first.with_state(positions=first.positions + 0.01 * np.sin(np.arange(first.positions.size)).reshape(-1, 2))
    box = first.with_state(box=1.01 * first.box, positions=1.01 * first.positions)
    states = [first, moved, sheared(first, 0.02), box, make(other, 0.2, 1), make(kind, 0.1, 2, **sizes)]
    with jamlab.Session(states[-1]) as session:
        for p in [*states, first]:
            session.load(p)
            e, fresh = session.evaluate(), jamlab.evaluate(p)
            assert_same(e, fresh, 1e-13)
            assert np.array_equal(session.packing().box, p.box)
            assert np.allclose(session.positions(), p.positions, rtol=0, atol=1e-13 * p.box[0, 0])


def test_a_session_takes_edges_longer_than_it_was_built_for(random_polygons):
    """The neighbour cutoff follows the longest edge; within one run an edge that outgrows it is refused."""
    p = random_polygons(0.0, "outline", 1)
    x = p.positions.copy()
    x[1] += 1.6 * (x[1] - x.mean(axis=0)) / np.hypot(*(x[1] - x.mean(axis=0)))  # a spike out of the box
    spiked = p.with_state(positions=x, box=6.0 * np.eye(2))
    with jamlab.Session(p.with_state(box=spiked.box)) as session:
        session.evaluate()
        with pytest.raises(jamlab.EngineError, match=r"1\.5"):
            session.forces_at(x)
        session.load(spiked)
        assert_same(session.evaluate(), jamlab.evaluate(spiked))


@pytest.mark.parametrize("tilt", [0.0, 3.0, 9.0])  # of one lattice
def test_an_edge_of_half_the_box_is_refused(tilt):
    """Two images of its end are equally near: LAMMPS takes either."""
    ring = np.array([[0.0, 0.0], [1.5, 0.0], [1.5, 0.7], [0.0, 0.7]])
    law = {"gamma": 0.1, "ka": 50.0, "eps": 1.0, "delta": 0.2, "eta": 0.0, "contact": "outline", "a0": [1.05, 1.05]}
    p = jamlab.Packing("dp", [[3.0, 0], [tilt, 6]], np.vstack([ring, ring + 2.0]), law, "eps", offsets=[0, 4, 8])
    with pytest.raises(jamlab.EngineError):
        jamlab.evaluate(p)
    jamlab.evaluate(p.with_state(box=[[3.001, 0], [tilt, 6]]))


@pytest.mark.parametrize("name", ["my päckings dir", 'it\'s "so"', "中 $x"])
def test_parts_are_found_in_a_folder_of_any_name(tmp_path, monkeypatch, name, random_disks, random_polygons):
    shutil.copytree(installed("lammps_inputs") / "parts", tmp_path / name / "parts")
    wanted = [jamlab.evaluate(p).energy for p in (random_disks(), random_polygons())]
    for model in ("disks", "droplets"):
        monkeypatch.setattr(f"jamlab.models.{model}.installed_file", lambda _, part: tmp_path / name / part)
    assert [jamlab.evaluate(p).energy for p in (random_disks(), random_polygons())] == wanted


def test_a_message_of_lammps_is_kept_though_it_cuts_a_letter_in_two(random_disks):
    with jamlab.Session(random_disks()) as session:
        with pytest.raises(jamlab.EngineError, match=r"LAMMPS stopped at .*: ERROR"):
            session.command('include "/nowhere/my päckings dir/parts"')


def test_disks_in_one_place_are_refused():
    p = jamlab.Packing("sp", [[3.0, 0], [0, 3.0]], [[1.0, 1.0], [1.0, 1.0]], {"k": 1.0}, "k", [1.0, 1.0])
    for act in (jamlab.evaluate, jamlab.relax, lambda p: list(jamlab.compress(p, to=0.8, step=0.1))):
        with pytest.raises(jamlab.EngineError, match="disks 0 and 1"):
            act(p)


def test_a_vertex_beside_a_flat_side_has_one_contact_and_beside_a_corner_two():
    """The energy of segment/smooth by hand: a tip above the middle of an edge, and outside the corner of a square."""
    delta, eps = 0.4, 1.0
    square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    for tip, contacts in (([1.0, 2.3], 1), ([2.18, 2.24], 2)):
        other = np.array(tip) + np.array([[0.0, 0.0], [0.4, 3.0], [-0.4, 3.0]])
        law = {"gamma": 0.1, "ka": 1.0, "eps": eps, "delta": delta, "eta": 0.0, "a0": [4.0, 1.2]}
        found = {}
        for form in FORMS:
            rings = np.vstack([square, other])
            p = jamlab.Packing("dp", 9 * np.eye(2), rings, law | {"contact": form}, offsets=[0, 4, 7])
            found[form] = jamlab.evaluate(p).contact_energy
        one = eps / 2 * (1 - 0.3 / delta) ** 2
        assert found["outline"] == pytest.approx(one * contacts)  # at the corner: the tip, and the corner against it
        assert found["segment/smooth"] == pytest.approx(one * (1 if contacts == 1 else 4))


@pytest.mark.parametrize("tilt", [0.0, 0.5, -0.9])
@pytest.mark.parametrize("form", FORMS)
def test_polygons_that_span_the_box_meet_their_own_images(spanning, form, tilt):
    """LAMMPS, numpy terms and plain loops; forces and Hessian as slopes; each polygon has contacts with itself."""
    p = spanning(form, tilt)
    assert (np.ptp(p.positions[p.offsets[0] : p.offsets[1]], axis=0)[0] > 0.5 * p.box[0, 0]).all()
    wanted = reference.evaluate(p)
    pairs = jamlab.contacts(p).pairs
    assert {(m, m) for m in range(3)} <= set(map(tuple, pairs.tolist()))
    with jamlab.Session(p) as session:
        e = session.evaluate()
        assert_same(e, wanted, 1e-12)
        assert e.energy == pytest.approx(wanted.energy, rel=1e-13)
        assert differ(forces(p), wanted.forces) < 1e-12
        assert differ(stress(p), wanted.stress) < 1e-12
        found = -slope(lambda x: session.forces_at(x)[0], p.positions).reshape(-1, 2)
        assert differ(found, e.forces) < 1e-6
        stiffness = -slope(lambda x: session.forces_at(x)[1], p.positions).reshape(2 * len(p.positions), -1)
    assert differ(jamlab.hessian(p).toarray(), stiffness) < 1e-6


def squares(form, shift):
    """Energy of the contacts of two squares; their width is 0.1."""
    law = {"gamma": 0.1, "ka": 1.0, "eps": 1.0, "delta": 0.1, "eta": 0.0, "contact": form, "a0": [1.0, 1.0]}
    square = np.array([[1.0, 1.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0]])
    corners = np.concatenate([square, square + np.array(shift)])
    packing = jamlab.Packing("dp", 5 * np.eye(2), corners, law, offsets=np.array([0, 4, 8]))
    return jamlab.evaluate(packing).contact_energy


@pytest.mark.parametrize("form", [*FORMS, "segment"])
def test_contacts_end_where_rims_part(form):
    assert squares(form, (1.1 - 1e-6, 0.4)) > 0 == squares(form, (1.1 + 1e-6, 0.4))


@pytest.mark.parametrize("act", [jamlab.Session, jamlab.relax, partial(jamlab.shear, rate=0.1, strain=0.1)])
def test_form_segment_is_only_evaluated(random_polygons, act):
    """LAMMPS does not have it, since it has no minima."""
    with pytest.raises(jamlab.InputError, match="segment"):
        act(random_polygons(0.0, "segment"))


NOTCH, TIP = [[-1, -1], [1, -1], [1, 1], [0, 0], [-1, 1]], [[0.0, 0.2], [0.3, 1.5], [-0.3, 1.5]]
SIDE = [[-1, -1], [1, -1], [1, 1], [-1, 1]]


@pytest.mark.parametrize(
    ("one", "other", "way", "rough"),
    [(NOTCH, TIP, [[1.0, 0], [0, 0], [0, 0]], "outline"),  # past the middle of a dent
     (SIDE, np.add(SIDE, [0, 2.1]), [[0, -1.0], [0, 1.0], [0, 1.0], [0, -1.0]], "segment")],  # parallel on the way
)  # fmt: skip
@pytest.mark.parametrize("form", [*FORMS, "segment"])
def test_forces_jump_only_where_the_closest_point_does(form, one, other, way, rough):
    law = {"gamma": 0.1, "ka": 1.0, "eps": 1.0, "delta": 0.25, "eta": 0.0, "contact": form, "a0": [3.0, 1.0]}
    x, offsets = np.vstack([one, other]) + 4.0, [0, len(one), len(one) + len(other)]
    packing = jamlab.Packing("dp", 9 * np.eye(2), x, law, offsets=offsets)
    moved = (x + step * np.pad(way, [(len(one), 0), (0, 0)]) for step in (-1e-8, 1e-8))
    before, after = (jamlab.evaluate(packing.with_state(positions=at)) for at in moved)
    assert before.energy == pytest.approx(after.energy, rel=1e-5)
    assert (np.abs(after.forces - before.forces).max() > 0.1) == (form == rough)


@pytest.mark.parametrize(("wide", "dtype", "bits"), [(0, np.int32, 10), (1, np.int64, 21)])
def test_atoms_are_exchanged_in_both_sizes_of_integers(wide, dtype, bits):
    """Ids and image flags of LAMMPS have 32 bits or 64: positions there and back."""
    rng = np.random.default_rng(3)
    n, box = 5, np.array([[3.0, 0.0], [0.7, 2.0]])
    ids, inside = rng.permutation(n).astype(dtype) + 1, rng.uniform(0, 1, (n, 2)) @ box
    flags = rng.integers(-(2 ** (bits - 1)), 2 ** (bits - 1), (n, 2))
    images, x = np.zeros(n, dtype), np.zeros((n, 3))
    rows = (ctypes.c_void_p * n)(*(x[i].ctypes.data for i in range(n)))
    exchange = AtomExchange.__new__(AtomExchange)
    exchange._lmp, exchange._wide = SimpleNamespace(lmp=None), bool(wide)
    held = {b"id": ids.ctypes.data, b"image": images.ctypes.data, b"x": ctypes.addressof(rows)}
    exchange._array = lambda _, name: held[name]
    exchange.put_inside(inside, flags)
    assert exchange.positions(n, box) == pytest.approx(inside + flags @ box, rel=1e-15)
    x[:] = 0.0
    exchange.set_positions(inside + flags @ box, box)
    assert x[np.argsort(ids), :2] == pytest.approx(inside, abs=1e-9)
    ids[0] = n + 1
    with pytest.raises(jamlab.EngineError, match=str(n)):
        exchange.positions(n, box)
