"""A sweep measured in several processes: the rows of one process, in order, whatever happens."""

import importlib

import numpy as np
import pytest
from executors import InThisProcess

import jamlab
from jamlab.errors import InputError
from jamlab.processes.cores import cores_given
from studies.reference_data import example_file

MODULE = importlib.import_module("jamlab.measure")  # the package has a function of that name


@pytest.fixture(scope="module")
def sweep():
    return [state for model in ("sp", "dp") for state in jamlab.read_all(example_file(model))[::3]]


@pytest.fixture
def at_once(monkeypatch):
    """Let new processes start after the first state, however short the work."""
    monkeypatch.setattr(MODULE, "TIMES", MODULE.MeasureTimes(0.0, 0.0))


def test_short_work_and_a_worker_stay_in_one_process(sweep, monkeypatch):
    monkeypatch.setattr(MODULE, "run_side_by_side", lambda *_, **__: pytest.fail("a process was started"))
    assert len(jamlab.measure(sweep, ["rho", "phi"])["phi"]) == len(sweep)
    monkeypatch.setattr(MODULE, "TIMES", MODULE.MeasureTimes(0.0, 0.0))
    jamlab.measure(sweep[:3], ["phi"])
    with cores_given(1):
        jamlab.measure(sweep[:3], ["phi"], workers=None)
    assert jamlab.measure([])["rho"].shape == (0,)


def test_an_error_names_its_state(sweep, at_once):
    with pytest.raises(InputError, match="workers = 0"):
        jamlab.measure(sweep, workers=0)
    with pytest.raises(InputError, match="weight"):
        jamlab.measure(sweep, ["weight"])
    piled = sweep[2].with_state(positions=np.broadcast_to(sweep[2].positions[0], sweep[2].positions.shape))
    with pytest.raises(InputError, match="state 2"):
        jamlab.measure([sweep[0], sweep[1], piled, sweep[3]], workers=2)


def test_an_executor_gets_groups_of_states(sweep, monkeypatch):
    """And the functions of its user, where it can be sent those."""
    shares, calls = [], []

    class Counting(InThisProcess):
        def submit(self, function, /, *arguments):
            calls.append(function)
            return super().submit(function, *arguments)

    monkeypatch.setattr(MODULE, "TIMES", MODULE.MeasureTimes(calls=4))
    how = {"workers": Counting(), "progress": lambda share, text: shares.append(share)}
    found = jamlab.measure(sweep, ["rho", "z", jamlab.bulk_modulus], **how)
    assert len(calls) <= 4 < len(sweep) and shares == pytest.approx(np.arange(1, len(sweep) + 1) / len(sweep))
    for name, values in jamlab.measure(sweep, ["rho", "z", jamlab.bulk_modulus]).items():
        assert values.tobytes() == found[name].tobytes()
    assert jamlab.measure([], workers=Counting())["rho"].shape == (0,)


def test_one_name_is_one_quantity(sweep):
    assert jamlab.measure(sweep[0], "rho") == jamlab.measure(sweep[0], ["rho"])
    assert list(jamlab.measure(sweep, "z")) == ["z"]
    with pytest.raises(jamlab.InputError, match="zz"):
        jamlab.measure(sweep[0], "zz")


def test_a_packing_names_the_function_that_measures_what_it_does_not_hold(sweep):
    assert {name for name in MODULE.QUANTITIES if hasattr(sweep[0], name)} == {"area", "max_force", "phi"}
    with pytest.raises(AttributeError, match="contacts"):
        _ = sweep[0].z
    with pytest.raises(AttributeError, match="measure"):
        _ = sweep[0].void_sides
    with pytest.raises(AttributeError, match="zz"):
        _ = sweep[0].zz
    assert not hasattr(sweep[0], "_repr_svg_")


def test_every_quantity_is_that_of_its_function(sweep):
    """Of the densest disks and droplets, and beside an empty strip, whose void percolates and is in no mean."""
    onset = sweep[0]
    beside = onset.select((onset.positions @ np.linalg.inv(onset.box))[:, 1] % 1 > 0.3)
    for packing in (sweep[len(sweep) // 2 - 1], sweep[-1], beside):
        found = jamlab.measure(packing, MODULE.QUANTITIES)
        e, v, network = jamlab.evaluate(packing), jamlab.voids(packing), jamlab.contacts(packing)
        order, closed, droplets = jamlab.hexatic_order(packing), v.percolating == 0, packing.model == "dp"
        edges = np.hypot(*packing.polygons.edges.T) if droplets else np.full(1, np.nan)
        wanted = {
            "rho": jamlab.packing_fraction(packing),
            "phi": packing.phi,
            "z": network.z,
            "z_all": network.z_all,
            "rattlers": network.rattlers.sum(),
            "pressure": e.pressure,
            "energy": e.energy,
            "contact_energy": e.contact_energy / len(packing.positions),
            "shape_factor": np.nanmean(jamlab.shape_factors(packing)),
            "shape_factor_rim": np.nanmean(jamlab.shape_factors(packing, rim=True)),
            "area": jamlab.relative_areas(packing).mean(),
            "contact_length": jamlab.contact_lengths(packing).length.mean() if droplets else np.nan,
            "shortest_edge": edges.min(),
            "longest_edge": edges.max(),
            "voids": len(v.area),
            **{f"void_{name}": getattr(v, name)[closed].mean() for name in ("sides", "area", "shape_factor")},
            "psi_6": order.mean_local,
            "psi_6_global": order.global_order,
        }
        assert closed.all() == (packing is not beside)
        wanted |= dict.fromkeys(("g", "g_x", "b"), np.nan)
        if packing is not beside:
            wanted |= {"g": jamlab.shear_modulus(packing), "g_x": jamlab.shear_modulus(packing, direction="simple")}
            wanted["b"] = jamlab.bulk_modulus(packing)
        wanted["max_force"] = np.hypot(*e.forces.T).max()
        assert wanted.keys() == found.keys()
        for name, value in wanted.items():
            assert found[name] == pytest.approx(value, rel=1e-9, abs=1e-13, nan_ok=True), name
