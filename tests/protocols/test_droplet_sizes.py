"""Droplets of any sizes and numbers of vertices: against plain loops, doubled, handed over, traced, in campaigns."""

import numpy as np
import pytest
from campaigns import read_campaign_file, written

import jamlab
from jamlab.campaign.states import make_states
from jamlab.campaign.tasks import Parameters, batches
from jamlab.protocols.random_start import droplet_params
from tests.support.reference import evaluate as plain_sums
from tests.support.tiled_packings import tiled

ONE_TO_TEN = np.geomspace(0.2, 2.0, 10)


@pytest.fixture(scope="module")
def many():
    onset = jamlab.jam(model="dp", n=10, seed=1, sizes=ONE_TO_TEN)
    *_, pressed = jamlab.compress(onset, onset.phi + 0.02, 0.02, by="phi")
    return pressed


def test_droplets_of_one_to_ten_are_those_of_plain_loops(many):
    own = ONE_TO_TEN / ONE_TO_TEN.mean()
    assert many.converged and many.params["a0"] == pytest.approx(own**2, rel=1e-12)
    assert np.diff(many.offsets).tolist() == np.maximum(3, np.rint(14.5 * own)).tolist()
    found, expected = jamlab.evaluate(many), plain_sums(many)
    assert found.pressure > 1e-4 and found.energy == pytest.approx(expected.energy, rel=1e-12)
    assert np.abs(found.forces - expected.forces).max() < 1e-12
    assert np.abs(found.stress - expected.stress).max() < 1e-12
    voids, rho = jamlab.voids(many), jamlab.packing_fraction(many)
    assert voids.area.sum() == pytest.approx((1 - rho) * many.area, rel=1e-9)
    assert jamlab.tessellation(many).area.sum() == pytest.approx(many.area, rel=1e-9)


def test_doubling_the_cell_changes_nothing(many):
    four = tiled(many, 2)
    first, second = jamlab.evaluate(many), jamlab.evaluate(four)
    assert second.energy == pytest.approx(4 * first.energy, rel=1e-10)
    assert np.abs(second.stress - first.stress).max() < 1e-10
    assert jamlab.contacts(four).z == pytest.approx(jamlab.contacts(many).z, rel=1e-10)
    assert jamlab.packing_fraction(four) == pytest.approx(jamlab.packing_fraction(many), rel=1e-10)


@pytest.mark.parametrize("vertices", [9, [8, 9, 20]])
def test_vertices_are_given_for_all_or_for_each(vertices):
    p = jamlab.jam(model="dp", n=3, seed=2, sizes=[3.0, 4.0, 5.0], vertices=vertices)
    assert np.diff(p.offsets).tolist() == np.broadcast_to(vertices, 3).tolist()
    assert np.sqrt(p.params["a0"]) == pytest.approx([0.75, 1.0, 1.25], rel=1e-12)
    assert p.converged and p.provenance["sizes"]["width"] == pytest.approx(np.std([0.75, 1, 1.25]), rel=1e-12)


def test_sizes_of_the_decks_are_the_default():
    nv, params = droplet_params(4)
    again, same = droplet_params(4, 0.5, np.array([12.0, 12, 17, 17]))
    assert nv.tolist() == again.tolist() == [12, 12, 17, 17]
    assert params["a0"] == pytest.approx(same["a0"], rel=1e-15)


def test_disks_of_one_to_ten_are_handed_over():
    disks = jamlab.pack(n=10, pressure=1e-2, seed=1, sizes=ONE_TO_TEN)
    droplets = jamlab.to_polygons(disks, delta=0.1)
    assert droplets.converged and droplets.n == 10
    assert jamlab.packing_fraction(droplets) == pytest.approx(jamlab.packing_fraction(disks), abs=2e-6)
    assert np.diff(jamlab.to_polygons(disks, delta=0.1, vertices=12).offsets).tolist() == [12] * 10


def test_outlines_make_the_droplets_that_they_came_from(many):
    """In another unit, wrapped into the box, and some of them clockwise."""
    shapes = np.split(3.0 * many.positions, many.offsets[1:-1])
    box = 3.0 * many.box
    shapes = [shape - np.floor(shape @ np.linalg.inv(box)) @ box for shape in shapes]
    shapes = [shape[::-1] if m % 2 else shape for m, shape in enumerate(shapes)]
    law = {name: value for name, value in many.params.items() if name != "a0"}
    p = jamlab.from_outlines(shapes, box, rest_areas=9.0 * many.params["a0"], **law)
    assert p.params["a0"] == pytest.approx(many.params["a0"], rel=1e-12)
    assert p.polygon_areas == pytest.approx(many.polygon_areas, rel=1e-10)
    assert jamlab.evaluate(p).energy == pytest.approx(jamlab.evaluate(many).energy, rel=1e-9)
    assert jamlab.from_outlines(shapes, box, **law).params["a0"].shape == (10,)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: jamlab.jam("dp", 3, sizes="lognormal:0.3", vertices=[8, 9]), r"vertices hold 2 numbers for n = 3"),
        (lambda: jamlab.jam("dp", 3, sizes="lognormal:0.3", vertices=2), r"cannot have 2 vertices: vertices are whole"),
        (lambda: jamlab.jam("dp", 3, sizes="lognormal:0.3", vertices=8.5), r"cannot have 8\.5 vertices"),
        (lambda: jamlab.jam("dp", 3, sizes=[1.0, 1.0]), r"sizes hold 2 diameters for n = 3"),
        (lambda: jamlab.jam("dp", 2, sizes=[1.0, 40.0]), r"line tension shrinks a free droplet to a point"),
        (lambda: jamlab.from_outlines([], [4.0, 4.0]), r"outlines: give one or more"),
        (lambda: jamlab.from_outlines([[[0, 0], [1, 0]]], [4.0, 4.0]), r"each of three vertices or more"),
        (lambda: jamlab.from_outlines([[[0, 0], [1, np.nan], [1, 1]]], [4.0, 4.0]), r"outlines\[0\]\[1, 1\] is nan"),
        (lambda: jamlab.from_outlines([[[0, 0], [1, 0], [2, 0]]], [9.0, 9.0]), r"rest_areas\[0\] is 0"),
        (lambda: jamlab.from_outlines([np.eye(3, 2)], [9.0, 9.0], weight=1.0), r"no parameter 'weight'"),
    ],
)
def test_what_is_no_droplet_is_one_line(call, message):
    with pytest.raises(jamlab.InputError, match=message) as caught:
        call()
    assert "\n" not in str(caught.value)


def test_a_campaign_of_droplets_of_any_sizes(tmp_path):
    file = written(tmp_path / "c.toml", model="dp", n=3, seeds=1, compress=None, onset=True, sizes=[1.0, 1.5, 2.0])
    (batch,) = batches(read_campaign_file(file))
    (packing,) = make_states(Parameters.from_record(batch.parameters.record())).packings
    assert np.sqrt(packing.params["a0"]) == pytest.approx([2 / 3, 1.0, 4 / 3], rel=1e-12)
    assert packing.phi == jamlab.jam("dp", 3, 1, sizes=[1.0, 1.5, 2.0]).phi
    written(file, model="dp", n=3, seeds=1, compress=None, onset=True, force_law={"vertices": 12})
    with pytest.raises(jamlab.InputError, match=r"vertices are those of one packing: give nv_small and nv_large"):
        jamlab.open_campaign(file)
