"""PackingAnalysis against `measure`, frame by frame, whatever shares the work."""

import numpy as np
import pytest
from wandering_packings import disks

import jamlab
from jamlab.errors import InputError
from jamlab.measure import QUANTITIES

FREE = [name for name in QUANTITIES if name not in ("g", "g_x", "b")]


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


@pytest.mark.parametrize("workers", [pytest.param(1, marks=pytest.mark.slow), 2])
def test_frames_are_measured_as_one_by_one(long, workers):
    names = ("rho", "phi", "z", "rattlers", "pressure", "voids", "psi_6", "psi_6_overall")
    found = jamlab.PackingAnalysis(long, names).run(
        **({} if workers == 1 else {"backend": "multiprocessing", "n_workers": workers})
    )
    rows = [jamlab.measure(packing, names) for packing in jamlab.from_universe(long)]
    assert len(rows) == found.n_frames == 60
    for name in names:
        assert found.results[name].tobytes() == np.array([row[name] for row in rows]).tobytes()
    assert len(np.unique(found.results.rho)) == 60


@pytest.mark.parametrize("fixture", ["random_disks", "random_polygons"])
def test_every_quantity_is_that_of_measure(fixture, request):
    u = jamlab.universe(request.getfixturevalue(fixture)(tilt=0.3))
    found = jamlab.PackingAnalysis(u, FREE).run().results
    (packing,) = jamlab.from_universe(u)
    whole, order = jamlab.measure(packing), jamlab.orientational_order(packing)
    wanted = whole | {"psi_6": order.mean_local, "psi_6_overall": order.overall}
    for name in FREE:
        np.testing.assert_array_equal(found[name], [wanted[name]])


def test_steps_and_single_quantities(long):
    found = jamlab.PackingAnalysis(long, "rho").run(step=15)
    assert (found.frames.tolist(), found.results.rho.shape) == ([0, 15, 30, 45], (4,))
    assert set(found.results) == {"rho"}
    assert jamlab.PackingAnalysis(long).run(stop=2).results.z.shape == (2,)
    assert jamlab.PackingAnalysis.get_supported_backends() == ("serial", "multiprocessing", "dask")


def test_moduli_of_relaxed_frames_only(sp_jammed):
    u = jamlab.universe([sp_jammed, sp_jammed])
    with pytest.raises(InputError, match="g belongs to an energy minimum"):
        jamlab.PackingAnalysis(u, ("rho", "g"))
    with pytest.raises(InputError, match="unknown quantity 'density'"):
        jamlab.PackingAnalysis(u, ("density",))
    found = jamlab.PackingAnalysis(u, ("g", "z"), relaxed=True)
    found.run(backend="multiprocessing", n_workers=2)
    np.testing.assert_allclose(found.results.g, jamlab.shear_modulus(sp_jammed, average=True), rtol=1e-3)
    assert (found.results.z == jamlab.contacts(sp_jammed).z).all()


def test_a_frame_that_is_no_packing_is_named():
    u = jamlab.universe([disks(0, 0.0), disks(0, 0.0)])
    u.trajectory.dimensions_array[1] = 0
    with pytest.raises(InputError, match="frame 1 has no box"):
        jamlab.PackingAnalysis(u, ("rho",)).run()
