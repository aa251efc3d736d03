"""A packing refuses what is none and derives what is known in closed form."""

import copy
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import jamlab
from jamlab.errors import InputError
from jamlab.models.droplets import free_area, free_polygon_area, regular_polygon
from jamlab.packing.deformation import at_positions
from jamlab.packing.packing import Packing

BOX = np.array([[8.0, 0.0], [0.5, 6.0]])
LAW = {"gamma": 0.1, "ka": 50.0, "eps": 1.0, "delta": 0.25, "eta": 0.0, "contact": "outline"}
SQUARE = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
L_SHAPE = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 3], [0, 3]]) + np.array([3.0, 2.0])  # area 4, perimeter 10


def disks(**changes):
    values = {"model": "sp", "box": BOX, "positions": [[1.0, 1.0], [4.0, 3.0]], "params": {"eps": 1.0}}
    return Packing(**values | {"diameters": [1.0, 1.4]} | changes)


def polygons(*rings, law=LAW, **changes):
    rings = rings or (SQUARE, L_SHAPE)
    offsets = np.cumsum([0, *(len(ring) for ring in rings)])
    values = {"model": "dp", "box": BOX, "positions": np.concatenate(rings), "offsets": offsets}
    return Packing(**values | {"params": law | {"a0": np.ones(len(rings))}} | changes)


def without(name, values=LAW):
    return {key: value for key, value in values.items() if key != name}


@pytest.mark.parametrize(
    ("make", "changes", "named"),
    [
        (disks, {"model": "foam"}, "'foam'"),
        (disks, {"units": "SI"}, "'SI'"),
        (disks, {"units": "k"}, "'eps'"),
        (disks, {"params": {}}, "'eps'"),
        *((disks, {"params": {"eps": value}}, str(value)) for value in (0.0, 1e308, np.nan)),
        (disks, {"positions": [[1.0, np.nan], [4.0, 3.0]]}, "positions[0, 1]"),
        (disks, {"positions": [1.0, 2.0]}, "positions"),
        (disks, {"positions": [[1.0, 1.0, 0.0], [4.0, 3.0, 0.0]]}, "positions"),
        *((disks, {"diameters": value}, "diameters") for value in (None, [1.0])),
        *((disks, {"diameters": [1.0, value]}, "diameters[1]") for value in (0.0, -1.0)),
        (disks, {"offsets": [0, 2]}, "offsets"),
        *((disks, {"box": box}, "box") for box in (np.zeros((2, 2)), [[8.0, 0.0], [0.5, -6.0]], [8.0, 6.0])),
        (disks, {"box": [[8.0, 0.1], [0.5, 6.0]]}, "box[0, 1]"),
        (disks, {"rounding": -1.0}, "rounding"),
        (polygons, {"units": "k"}, "'k'"),
        (polygons, {"diameters": [1.0, 1.0]}, "diameters"),
        *((polygons, {"offsets": value}, "offsets") for value in (None, [0, 4, 9], [1, 4, 10])),
        (polygons, {"offsets": [0, 2, 10]}, "polygon 0"),
        (polygons, {"params": LAW}, "'a0'"),
        *((polygons, {"params": LAW | {"a0": value}}, "params['a0']") for value in (np.ones(3), [1.0, -1.0])),
        (polygons, {"params": LAW | {"a0": [1.0, 1.0], "contact": "sphere"}}, "'sphere'"),
        *((polygons, {"params": LAW | {"a0": [1.0, 1.0], name: -1.0}}, f"'{name}'") for name in ("ka", "gamma")),
        *((polygons, {"params": without(name) | {"a0": [1.0, 1.0]}}, f"'{name}'") for name in LAW),
    ],
)
def test_what_is_no_packing_is_refused(make, changes, named):
    with pytest.raises(jamlab.InputError) as caught:
        make(**changes)
    assert named in str(caught.value)


def test_polygons_that_run_clockwise_or_cross_themselves_are_refused():
    """A pentagon with a bow tie has a positive area still; also far from the origin."""
    with pytest.raises(jamlab.InputError, match=r"polygon 1 .*-4"):
        polygons(SQUARE, L_SHAPE[::-1])
    for far in (0.0, 1000.0):
        bow = np.array([[0, 0], [2, 0], [2, 2], [1.0, -0.5], [0, 2]]) + far
        with pytest.raises(jamlab.InputError, match="polygon 1"):
            polygons(SQUARE, bow)


def test_edges_of_zero_length_are_accepted():
    """Edges shrink to nothing at Plateau borders: exactly, or to rounding size that makes a tiny loop."""
    square = np.insert(SQUARE, 2, SQUARE[1], axis=0)
    p = polygons(square, L_SHAPE)
    assert p.polygons.areas[0] == pytest.approx(4.0)
    assert np.hypot(*p.polygons.edges.T)[1] == 0
    nearly = np.insert(SQUARE, [2, 2], [[2.0 + 1e-15, 1e-15], [2.0, -1e-15]], axis=0)
    assert polygons(nearly, L_SHAPE).polygons.areas[0] == pytest.approx(4.0)


def test_phi_of_one_disk():
    """pi d^2/4 over the cell, whatever the shear."""
    p = disks(positions=[[0.0, 0.0]], diameters=[2.0])
    assert p.phi == pytest.approx(np.pi / 48, rel=1e-15)
    assert p.area == 48.0 and p.n == 1


def test_phi_of_polygons_counts_the_rims_of_free_droplets():
    """It is nominal: it does not change with the shape."""
    p = polygons()
    wanted = free_area(np.array([4, 6]), p.params).sum() / 48
    assert p.phi == pytest.approx(wanted, rel=1e-14)
    assert polygons(1.1 * SQUARE, L_SHAPE).phi == p.phi
    # without tension the free droplet has its rest area: a regular polygon grown by delta/2
    soft = polygons(law=LAW | {"gamma": 0.0, "eta": 0.0})  # the other parameters must be positive
    grown = [1 + np.sqrt(4 * n * np.tan(np.pi / n)) * 0.125 + np.pi * 0.125**2 for n in (4, 6)]
    assert soft.phi == pytest.approx(sum(grown) / 48, rel=1e-12)


def test_areas_perimeters_and_centroids_of_known_polygons():
    """A square, an L and a regular heptagon, away from the origin."""
    heptagon = regular_polygon(7, 2.5, 0.3) + np.array([50.0, -20.0])
    p = polygons(SQUARE + 100.0, L_SHAPE, heptagon)
    assert p.polygons.areas == pytest.approx([4.0, 4.0, 2.5], rel=1e-13)
    assert p.polygons.perimeters == pytest.approx([8.0, 10.0, np.sqrt(4 * 7 * np.tan(np.pi / 7) * 2.5)], rel=1e-13)
    l_centre = [(2 * 1.0 + 2 * 0.5) / 4 + 3, (2 * 0.5 + 2 * 2.0) / 4 + 2]
    assert p.centroids == pytest.approx(np.array([[101.0, 101.0], l_centre, [50.0, -20.0]]), rel=1e-13)


def test_particle_and_successor_close_every_outline():
    """Edges of one polygon sum to zero."""
    p = polygons()
    assert p.particle.tolist() == [0] * 4 + [1] * 6
    assert p.polygons.successor.tolist() == [1, 2, 3, 0, 5, 6, 7, 8, 9, 4]
    assert np.abs(np.add.reduceat(p.polygons.edges, [0, 4])).max() == 0
    assert p.polygons.edges[3].tolist() == [0.0, -2.0]
    assert disks().particle.tolist() == [0, 1]
    assert disks().centroids is not None and np.array_equal(disks().centroids, disks().positions)


def test_with_state_merges_provenance_and_clears_what_was_known_of_another_state(tmp_path):
    """Later entries win, earlier ones stay; the original is untouched; files keep what is known."""
    p = disks(provenance={"seed": 1, "step": 2})
    q = p.with_state(provenance={"step": 3}, phi_J=0.84)
    assert (q.provenance, p.provenance, p.phi_J) == ({"seed": 1, "step": 3}, {"seed": 1, "step": 2}, None)
    known = {"max_force": 1e-13, "converged": True, "force_tolerance": 1e-12, "on_target": False, "on_rattlers": True}
    known |= {"ensemble": "shear-stabilized", "rounding": 1e-9}
    q = q._trusted(params={"eps": 2.0}, **known)
    jamlab.write(tmp_path / "q.h5", q)
    for same in (q, jamlab.read(tmp_path / "q.h5"), q.with_state(phi_J=0.8), pickle.loads(pickle.dumps(q))):
        assert same.known == known and same.provenance == q.provenance
    assert q.with_state(params={"eps": 3.0}).known == {"ensemble": "shear-stabilized", "rounding": 1e-9}


@pytest.mark.parametrize("packing", [disks(converged=True), polygons(converged=True)], ids=["sp", "dp"])
def test_the_short_way_to_other_positions_is_that_of_with_state(packing):
    there = packing.positions + np.array([0.25, 0.5])
    moved = at_positions(packing, there.copy())
    assert moved == packing.with_state(positions=there) and moved.known == {} and not moved.positions.flags.writeable
    there[1, 0] = np.inf
    with pytest.raises(jamlab.InputError, match=r"positions\[1, 0\]"):
        at_positions(packing, there)


@pytest.mark.parametrize("packing", [disks(), polygons()], ids=["sp", "dp"])
@pytest.mark.parametrize("copied", [lambda p: p, copy.deepcopy, lambda p: pickle.loads(pickle.dumps(p))])
def test_arrays_are_its_own_and_read_only(packing, copied):
    packing = copied(packing)
    arrays = [packing.box, packing.positions]
    arrays += [packing.diameters] if packing.model == "sp" else [packing.offsets, packing.params["a0"]]
    for array in arrays:
        with pytest.raises(ValueError, match="read-only"):
            array[0] += 1
    given = np.array([[1.0, 1.0], [4.0, 3.0]])
    disks(positions=given)
    given[0] += 1.0  # what the packing was made from stays writable


@pytest.mark.parametrize("layout", [np.asfortranarray, lambda a: np.repeat(a, 2, axis=0)[::2], lambda a: a.tolist()])
def test_any_memory_layout_is_taken(layout):
    packing, wanted = disks(positions=layout(np.array([[1.0, 1.0], [4.0, 3.0]])), box=layout(BOX)), disks()
    assert jamlab.packing_fraction(packing) == jamlab.packing_fraction(wanted)
    np.testing.assert_array_equal(jamlab.voids(packing).area, jamlab.voids(wanted).area)


def test_params_and_provenance_do_not_change_and_are_not_shared():
    params, history = {"k": 1.0}, {"seed": 1, "handover": {"z": 4.0}}
    p = Packing("sp", np.eye(2) * 3, [[0.5, 0.5]], params, "k", [1.0], provenance=history)
    params["k"], history["seed"], history["handover"]["z"] = 2.0, 2, 5.0
    assert p.params == {"k": 1.0} and p.provenance == {"seed": 1, "handover": {"z": 4.0}}
    for entries in (p.params, p.provenance, p.provenance["handover"], p.with_state(phi_J=0.8).params):
        for change in (
            lambda e: e.__setitem__("k", 2.0),
            lambda e: e.update(k=2.0),
            lambda e: e.pop("k", None),
            lambda e: e.setdefault("new", 1),
            lambda e: e.clear(),
            lambda e: e.__ior__({"k": 2.0}),
            lambda e: e.__delitem__(next(iter(e))),
            lambda e: e.popitem(),
        ):
            with pytest.raises(jamlab.InputError):
                change(entries)
    assert type({**p.params}) is dict and p.with_state(params={**p.params, "k": 2.0}).params["k"] == 2.0
    for back in (pickle.loads(pickle.dumps(p)), copy.deepcopy(p)):
        assert back.params == p.params and back.provenance == p.provenance
        with pytest.raises(jamlab.InputError):
            back.params["k"] = 2.0


def bearing(part, ka, a0, nv):
    """Line tension as a part of the largest that a droplet bears."""
    largest = 2 * (a0 / 3) ** 1.5 / np.sqrt(nv * np.tan(np.pi / nv))
    return {"gamma": part * ka * largest, "ka": ka, "a0": np.array([a0]), "delta": 0.2}


@given(st.integers(3, 40), st.floats(0.0, 0.999), st.floats(0.1, 1e3), st.floats(0.1, 10.0))
def test_energy_of_a_free_droplet_is_least(nv, part, ka, a0):
    """E(a) = gamma p + (ka/2)(a - a0)^2, among regular polygons a little smaller and larger."""
    params = bearing(part, ka, a0, nv)
    a = float(free_polygon_area([nv], params)[0])

    def energy(area):
        ring = regular_polygon(nv, area)
        perimeter = np.hypot(*(np.roll(ring, -1, axis=0) - ring).T).sum()
        return params["gamma"] * perimeter + 0.5 * ka * (area - a0) ** 2

    step = 1e-3 * (a - a0 / 3)  # the barrier to collapse is at a0/3 or below
    assert energy(a) < min(energy(a - step), energy(a + step)) and 0 < a <= a0 * (1 + 1e-12)
    half = 0.1
    rim = free_area([nv], params)[0] - a
    assert rim == pytest.approx(half * 2 * np.sqrt(nv * np.tan(np.pi / nv) * a) + np.pi * half**2, rel=1e-12)


@pytest.mark.parametrize("nv", [3, 12, 17])
def test_line_tension_that_no_area_bears_is_refused(nv):
    params = bearing(1.001, 2.0, 1.3, nv)
    with pytest.raises(InputError, match=f"{params['gamma']:g}"):
        free_polygon_area([nv], params)
