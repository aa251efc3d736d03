"""Contact forms of polygons on jammed states, with own images, and along paths: forces, Hessians, smoothness."""

import contact_paths
import numpy as np
import pytest
import reference

import jamlab
from jamlab.mechanics.stiffness import forces, stress
from jamlab.packing.law_parameters import CONTACT_FORMS
from jamlab.protocols.relaxation import relax

FORMS = list(CONTACT_FORMS)


def differ(got, wanted):
    """Largest difference relative to the largest value."""
    return np.abs(np.subtract(got, wanted)).max() / np.abs(wanted).max()


def slope(function, positions, step=1e-6):
    """Central differences of a function of all positions, one row per coordinate."""
    rows = []
    for k in range(positions.size):
        moved = [positions.copy(), positions.copy()]
        moved[0].flat[k] += step
        moved[1].flat[k] -= step
        rows.append(np.subtract(function(moved[0]), function(moved[1])) / (2 * step))
    return np.array(rows)


@pytest.fixture(scope="module")
def relaxed(dp_dense):
    """Dense droplets relaxed in each form; eq 8 has no minimum without a kink, so its state is moved off one."""

    def relax_in(form):
        p = dp_dense.with_state(params=dp_dense.params | {"contact": form})
        if form == "segment":
            noise = np.random.default_rng(1).normal(0, 1e-2, p.positions.shape)
            return p.with_state(positions=p.positions + noise)
        with jamlab.Session(p) as session:
            found = relax(session)
            assert found.converged
            return session.packing()

    return {form: relax_in(form) for form in FORMS}


@pytest.mark.parametrize("form", FORMS)
def test_jammed_states_equal_the_reference_to_rounding(relaxed, form):
    """LAMMPS, the numpy terms and plain loops; forces against the size of those that balance, eps/delta."""
    p = relaxed[form]
    e, wanted, scale = jamlab.evaluate(p), reference.evaluate(p), p.params["eps"] / p.params["delta"]
    assert e.energy == pytest.approx(wanted.energy, rel=1e-13)
    assert e.contact_energy == pytest.approx(wanted.contact_energy, rel=1e-12)
    for found in (e.forces, forces(p)):
        assert np.abs(found - wanted.forces).max() < 1e-13 * scale
    for found in (e.stress, stress(p)):
        assert differ(found, wanted.stress) < 1e-12


def test_a_vertex_beside_a_flat_side_has_one_contact_and_beside_a_corner_two(wedge):
    """The energy of segment/smooth by hand: a tip above the middle of an edge, and outside the corner of a square."""
    delta, eps = 0.4, 1.0
    square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    for tip, contacts in (([1.0, 2.3], 1), ([2.18, 2.24], 2)):
        other = np.array(tip) + np.array([[0.0, 0.0], [0.4, 3.0], [-0.4, 3.0]])
        law = {"gamma": 0.1, "ka": 1.0, "eps": eps, "delta": delta, "eta": 0.0, "a0": [4.0, 1.2]}
        found = {}
        for form in FORMS:
            p = jamlab.Packing(
                "dp", 9 * np.eye(2), np.vstack([square, other]), law | {"contact": form}, offsets=[0, 4, 7]
            )
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
        assert e.energy == pytest.approx(wanted.energy, rel=1e-13)
        assert e.contact_energy == pytest.approx(wanted.contact_energy, rel=1e-12)
        assert differ(e.forces, wanted.forces) < 1e-12
        assert differ(e.stress, wanted.stress) < 1e-12
        assert differ(forces(p), wanted.forces) < 1e-12
        assert differ(stress(p), wanted.stress) < 1e-12
        found = -slope(lambda x: session.forces_at(x)[0], p.positions).reshape(-1, 2)
        assert differ(found, e.forces) < 1e-6
        stiffness = -slope(lambda x: session.forces_at(x)[1], p.positions).reshape(2 * len(p.positions), -1)
    assert differ(jamlab.hessian(p).toarray(), stiffness) < 1e-6


@pytest.mark.parametrize("form", FORMS)
def test_own_images_equal_another_polygon_in_the_same_place(spanning, form):
    """The box twice as long holds two copies of everything: twice the energy, the same forces and stress."""
    p = spanning(form, 0.5)
    twice = p.with_state(
        box=p.box * [[2.0, 1.0], [1.0, 1.0]],
        positions=np.vstack([p.positions, p.positions + p.box[0]]),
        offsets=np.concatenate([p.offsets, p.offsets[1:] + p.offsets[-1]]),
        params=p.params | {"a0": np.tile(p.params["a0"], 2)},
    )
    one, two = jamlab.evaluate(p), jamlab.evaluate(twice)
    assert two.contact_energy == pytest.approx(2 * one.contact_energy, rel=1e-12)
    assert differ(two.forces, np.tile(one.forces, (2, 1))) < 1e-12
    assert differ(two.stress, one.stress) < 1e-12
    assert jamlab.contacts(twice).z == pytest.approx(jamlab.contacts(p).z)


@pytest.mark.parametrize("form", FORMS)
def test_an_edge_that_meets_its_own_image_counts_once(form):
    """Rims wider than half the box: the lower edge of a hexagon ends close to where its image begins."""
    turn = np.pi / 3 * np.arange(6) + 0.02 * np.sin(np.arange(6))
    hexagon = 0.5 * np.column_stack([np.cos(turn), np.sin(turn)])
    law = {"gamma": 0.1, "ka": 1.0, "eps": 1.0, "delta": 0.68, "eta": 0.0, "contact": form, "a0": [0.6, 0.6]}
    box = [[1.15, 0.0], [0.1, 2.1]]
    p = jamlab.Packing("dp", box, np.vstack([hexagon, hexagon + np.array([0.2, 1.02])]), law, offsets=[0, 6, 12])
    e, wanted = jamlab.evaluate(p), reference.evaluate(p)
    assert e.contact_energy == pytest.approx(wanted.contact_energy, rel=1e-12)
    assert differ(e.forces, wanted.forces) < 1e-12
    assert differ(forces(p), wanted.forces) < 1e-12


def test_only_segment_smooth_has_continuous_forces_everywhere():
    """Measured along paths of two polygons. No energy jumps; eq 8 has force jumps where sides are parallel, the outline
    form only where a vertex changes sides inside a dent."""
    found = {(form, shape, path): s.name for form, shape, path, s in contact_paths.table(FORMS)}
    rough = {("segment", "convex", "sliding"), ("segment", "convex", "rolling"), ("outline", "dented", "sliding")}
    assert found == {key: "C0" if key in rough else "C1" for key in found}
