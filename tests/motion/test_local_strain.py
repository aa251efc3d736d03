"""Local strain and D2min: plain numpy on ten states, affine motion, images, boxes of one lattice, walls, rattlers."""

from functools import cache

import numpy as np
import pytest
from own_motion import disguised, moved, own_local_strain
from scipy.spatial import Delaunay

import jamlab
from jamlab.motion.between_states import box_gradient
from jamlab.packing.deformation import deformed


def disks(n, tilt=0.0, seed=0, sizes=(0.8, 1.0, 1.3)):
    rng = np.random.default_rng(seed)
    diameters = rng.choice(sizes, n)
    side = np.sqrt(np.pi / 4 * (diameters**2).sum() / 0.9)
    box = side * np.array([[1.1, 0.0], [1.1 * tilt, 1 / 1.1]])
    return jamlab.Packing("sp", box, rng.uniform(-0.3, 1.3, (n, 2)) @ box, {"k": 1.0}, "k", diameters)


def droplets(n, tilt=0.0, seed=0):
    rng, turn = np.random.default_rng(seed), 2 * np.pi * np.arange(7) / 7
    rows = int(np.ceil(np.sqrt(n)))
    places = np.array([(k % rows, k // rows) for k in range(n)]) + 0.5 + 0.05 * rng.normal(size=(n, 2))
    box = rows * np.array([[1.0, 0.0], [tilt, 1.0]])
    rings = [place / rows @ box + 0.35 * np.column_stack([np.cos(turn), np.sin(turn)]) for place in places]
    law = {"gamma": 0.1, "ka": 10.0, "eps": 1.0, "delta": 0.1, "eta": 0.0, "contact": "outline", "a0": np.full(n, 0.4)}
    return jamlab.Packing("dp", box, np.concatenate(rings), law, offsets=7 * np.arange(n + 1))


STRAINED = np.array([[1.02, 0.13], [-0.01, 0.97]])
STATES = {
    "disks": (lambda: disks(20), 1.6),
    "tilted": (lambda: disks(20, 0.45, seed=1), 1.6),
    "leaning far": (lambda: disks(16, 2.7, seed=2), 2.1),
    "beyond the box": (lambda: disks(6, 0.3, seed=3), 3.5),
    "two": (lambda: disks(2, seed=4), 2.2),
    "one": (lambda: disks(1, 0.2, seed=5), 1.9),
    "equal": (lambda: disks(24, seed=6, sizes=(1.0,)), 1.5),
    "droplets": (lambda: droplets(9), 1.6),
    "tilted droplets": (lambda: droplets(16, 0.4, seed=1), 2.1),
    "one droplet": (lambda: droplets(1, seed=2), 1.2),
}


@cache
def pair(name):
    """A state, and the same after a strain of the box and small displacements."""
    before = STATES[name][0]()
    return before, moved(before, STRAINED, 0.05, seed=7)


@pytest.mark.parametrize("name", STATES)
def test_plain_numpy_whatever_box_and_images_the_second_state_has(name):
    (before, after), cutoff = pair(name), STATES[name][1]
    d2min, strain, count = own_local_strain(before, after, cutoff)
    for seen in (after, disguised(after, 1, seed=3), disguised(after, -2, seed=4)):
        found = jamlab.local_strain(before, seen, cutoff)
        np.testing.assert_array_equal(found.neighbors, count)
        scale = max(np.nanmax(d2min, initial=0.0), 1e-6)
        np.testing.assert_allclose(found.d2min, d2min, rtol=1e-10, atol=1e-10 * scale)
        np.testing.assert_allclose(found.strain, strain, rtol=0, atol=1e-10)
        np.testing.assert_allclose(
            found.box_strain, np.linalg.solve(before.box, after.box).T - np.eye(2), rtol=0, atol=1e-12
        )


def test_neighbours_of_cells_are_those_of_the_triangulation():
    """Of equal disks cells are those of Voronoi; images are counted around the box."""
    before, after = pair("equal")
    shifts = np.array([(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1)])
    places = before.centroids - np.floor(before.centroids @ np.linalg.inv(before.box)) @ before.box
    points = (places + (shifts @ before.box)[:, None]).reshape(-1, 2)
    first, around = Delaunay(points).vertex_neighbor_vertices
    own = 4 * before.n + np.arange(before.n)  # of the middle cell
    bonds = [(k, points[m] - points[i]) for k, i in enumerate(own) for m in around[first[i] : first[i + 1]]]
    expected = own_local_strain(before, after, None, bonds)
    found = jamlab.local_strain(before, disguised(after, 1, seed=5))
    np.testing.assert_array_equal(found.neighbors, expected[2])
    np.testing.assert_allclose(found.d2min, expected[0], rtol=1e-9)


@pytest.mark.parametrize("model", ["sp", "dp"])
def test_affine_motion_has_its_strain_and_no_remainder(model):
    before = disks(20, 0.3) if model == "sp" else droplets(9, 0.2)
    after, turn = deformed(before, STRAINED)  # turned so that the box stays along x
    found = jamlab.local_strain(before, after)
    assert np.nanmax(found.d2min) < 1e-25 and found.participation < before.n
    expected = np.broadcast_to(turn @ STRAINED - np.eye(2), found.strain.shape)
    np.testing.assert_allclose(found.strain, expected, atol=1e-12)
    assert np.abs(found.displacements).max() < 1e-12
    still = jamlab.local_strain(before, before)
    assert np.nanmax(still.d2min) < 1e-29 and still.participation == 0.0
    e = turn @ STRAINED
    assert found.shear == pytest.approx(0.5 * np.hypot(e[0, 0] - e[1, 1], e[0, 1] + e[1, 0]), rel=1e-10)


def test_one_particle_that_jumps_is_found_and_the_motion_of_the_whole_is_not():
    before = disks(24, seed=6, sizes=(1.0,))
    positions = before.positions + np.array([3.3, -7.1])
    positions[5] += [0.2, 0.1]
    found = jamlab.local_strain(before, before.with_state(positions=positions))
    assert found.d2min.argmax() == 5 and found.participation < 8
    expected = np.zeros((24, 2))
    expected[5] = [0.2, 0.1]
    np.testing.assert_allclose(found.displacements, expected - expected.mean(axis=0), atol=1e-12)


def test_strain_of_a_run_tells_boxes_of_one_lattice_apart():
    before = disks(12)
    for strain in (0.8, -1.7):
        after, _ = deformed(before, np.array([[1.0, strain], [0.0, 1.0]]))
        box = after.box.copy()
        box[1] -= np.round(box[1, 0] / box[0, 0]) * box[0]
        flipped = after.with_state(box=box, provenance={"flow_strain": strain})
        assert box_gradient(before, flipped)[0, 1] == pytest.approx(strain, abs=1e-12)
        assert np.nanmax(jamlab.local_strain(before, flipped).d2min) < 1e-24
    grown = before.with_state(box=1.5 * before.box, positions=1.5 * before.positions)
    np.testing.assert_allclose(box_gradient(before, grown), 1.5 * np.eye(2), atol=1e-12)


@pytest.mark.parametrize("first", [0.8, 1.0, -1.7])
def test_a_run_that_begins_where_another_ended_counts_its_own_strain(first):
    """Strain counts from the start of each run, so that the difference of two is that of no flow."""
    start = disks(12)
    ends, total = [], 0.0
    for strain in (first, 0.1, 0.05):
        total += strain
        after, _ = deformed(start, np.array([[1.0, total], [0.0, 1.0]]))
        box = after.box.copy()
        box[1] -= np.round(box[1, 0] / box[0, 0]) * box[0]
        marks = {"flow_strain": strain, "flow_time": 2.0}
        ends.append(after.with_state(box=box, provenance=marks))
    for k, strain in ((1, 0.1), (2, 0.15)):
        found = jamlab.local_strain(ends[0], ends[k])
        assert found.box_strain[0, 1] == pytest.approx(strain, abs=1e-12)
        assert np.nanmax(found.d2min) < 1e-24
    relaxed = ends[0].with_state(positions=ends[0].positions + 1e-3)  # what follows a run carries its strain
    assert box_gradient(ends[0], relaxed)[0, 1] == pytest.approx(0.0, abs=1e-12)
    moved = jamlab.mean_square_displacement([start, *ends])
    steps = np.abs([first, 0.1, 0.05])
    np.testing.assert_allclose(moved.strain, np.cumsum(steps)[moved.lag - 1], atol=1e-12)
    np.testing.assert_allclose(moved.time, 2.0 * moved.lag)


@pytest.fixture(scope="module")
def run():
    p = jamlab.pack(n=32, pressure=1e-2, seed=1)
    return jamlab.quasistatic_shear(p, strain=0.03, strain_step=1e-2, snapshot_every=1e-2)


def test_rattlers_have_no_value_between_minima(run):
    rattlers = jamlab.contacts(run.frames[0]).rattlers | jamlab.contacts(run.frames[1]).rattlers
    assert rattlers.any()
    found = jamlab.local_strain(*run.frames[:2], cutoff=2.0)
    np.testing.assert_array_equal(found.undefined == "rattler", rattlers)
    np.testing.assert_array_equal(np.isnan(found.d2min), rattlers)
    everywhere = jamlab.local_strain(*run.frames[:2], cutoff=2.0, rattlers=True)
    assert np.isfinite(everywhere.d2min).all() and (everywhere.undefined == "").all()
    loose = run.frames[0].with_state(diameters=0.9 * run.frames[0].diameters, converged=True)
    assert (jamlab.local_strain(run.frames[0], loose, cutoff=2.0).undefined == "rattler").all()
    moved = run.frames[0].with_state(positions=run.frames[1].positions, box=run.frames[1].box)  # no minimum is known
    np.testing.assert_array_equal(jamlab.local_strain(run.frames[0], moved, 2.0).d2min, everywhere.d2min)


def test_too_few_neighbours_are_said_in_words():
    p = jamlab.Packing("sp", 10 * np.eye(2), [[1, 1], [2, 1], [3, 1], [4, 1], [8, 8]], {"k": 1.0}, "k", np.ones(5))
    found = jamlab.local_strain(p, p, cutoff=3.5)
    assert found.undefined.tolist() == ["neighbors on a line"] * 4 + ["too few neighbors"]
    assert np.isnan(found.d2min).all() and np.isnan(found.strain).all() and found.participation == 0.0


def test_runs_sequences_and_one_state_against_several_agree(run):
    steps = jamlab.local_strain(run)
    assert len(steps) == 3 and steps.states.tolist() == [1, 2, 3]
    np.testing.assert_array_equal(jamlab.local_strain(iter(run.frames)).d2min, steps.d2min)  # as of a sweep
    np.testing.assert_array_equal(jamlab.local_strain(run.frames[1], run.frames[2]).strain, steps[1].strain)
    since = jamlab.local_strain(run.frames[0], run)
    assert since.states.tolist() == [0, 1, 2, 3] and np.nanmax(since[0].d2min) == 0.0
    np.testing.assert_array_equal(since[1].d2min, steps[0].d2min)
    assert since.flow_strain == pytest.approx([0.0, 0.01, 0.02, 0.03])
    table = since.to_dataframe()
    assert table["largest"].tolist() == [np.nanmax(each.d2min) for each in since]
    ax, map_ = since.plot(), steps[0].plot()
    assert ax.get_xlabel() and map_.figure.axes[1].get_ylabel() == "$D^2_{\\mathrm{min}}$  [d²]"


@pytest.mark.parametrize("flat", [False, True])
def test_walls(flat):
    """Rough walls move as rigid bodies and count; flat ones are no particles, and none is a neighbour across them."""
    w = jamlab.with_walls(jamlab.pack(n=96, pressure=1e-2, seed=1), thickness=1.5, flat=flat)
    free, k = ~w.flat_walls[:, None], np.arange(w.n)[:, None]
    w = w.with_state(positions=w.positions + (k % 3 == 0) * w.box[0] + (free & (k % 5 == 0)) * w.box[1])
    cells, x = jamlab.tessellation(w), w.centroids
    apart = x[cells.wall_j] - x[cells.wall_i] + cells.wall_shift @ w.box
    between = ~w.flat_walls[cells.wall_i] & ~w.flat_walls[cells.wall_j]
    assert np.hypot(*apart[between].T).max() < 3.0 and not cells.wall_shift[~between].any()
    state = w.frame.carried(np.array([[1.0, 0.05], [0.0, 1.0]]))
    after = w.with_state(box=w.box @ [[1.0, 0.0], [0.05, 1.0]], positions=state)
    for cutoff in (None, 2.0):
        found = jamlab.local_strain(w, after, cutoff)
        middle = found.undefined == ""
        assert (found.undefined == "flat wall").sum() == 2 * flat
        y = w.centroids[:, 1] % w.box[1, 1]
        deep = middle & (np.abs(y[:, None] - y[w.frame.fixed]) > 2.0).all(axis=1)
        assert found.strain[deep, 0, 1] == pytest.approx(0.05, abs=1e-10) and found.d2min[deep].max() < 1e-24
        if not flat:
            assert found.d2min[w.frame.fixed].max() > 1e-6  # beside the moving slab
    if flat:
        x = np.column_stack([w.centroids[:, 0], y])[:-2]
        images = x + (np.arange(-4, 5)[:, None] * w.box[0])[:, None]
        within = (np.hypot(*np.moveaxis(images[:, None] - x[:, None], -1, 0)) < 3.5).sum(axis=(0, 2)) - 1
        np.testing.assert_array_equal(jamlab.local_strain(w, after, 3.5).neighbors, [*within, 0, 0])


P = disks(8)
BAD = {
    "no second state": (lambda: jamlab.local_strain(P), "after is missing"),
    "other number": (lambda: jamlab.local_strain(P, disks(9)), "particles = 9, the first state 8"),
    "other model": (lambda: jamlab.local_strain(P, droplets(8)), "model = dp, the first state sp"),
    "other unit": (
        lambda: jamlab.local_strain(P, jamlab.Packing("sp", P.box, P.positions, {"eps": 1.0}, "eps", P.diameters)),
        "units = eps, the first state k",
    ),
    "cutoff 0": (lambda: jamlab.local_strain(P, P, 0.0), "cutoff = 0"),
    "cutoff below 0": (lambda: jamlab.local_strain(P, P, -1.0), "cutoff = -1"),
    "cutoff inf": (lambda: jamlab.local_strain(P, P, np.inf), "cutoff = inf"),
    "cutoff of text": (lambda: jamlab.local_strain(P, P, "cells"), "cutoff = 'cells'"),
    "one of a sequence": (lambda: jamlab.local_strain([P]), r"before has 1 packing\(s\): give 2 or more"),
    "two sequences": (lambda: jamlab.local_strain([P, P], P), "give one packing as before"),
    "no packing": (lambda: jamlab.local_strain(P, P.positions), "after = array"),
    "misspelt": (lambda: jamlab.local_strain(P, P, r_cut=1.0), "cutoff"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_named_with_a_remedy(case):
    call, words = BAD[case]
    with pytest.raises(jamlab.JamlabError, match=words) as refused:
        call()
    assert "\n" not in str(refused.value)
