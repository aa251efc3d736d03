"""Start-up of shear: balances, packings on the way, files, refusals."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import jamlab
from jamlab.flow.overdamped_session import OverdampedSession
from jamlab.flow.shear import stress_drops


@pytest.fixture(scope="module")
def run(disks):
    return jamlab.shear(disks, 0.1, 5.0, rows=250, snapshot_every=0.5)


def test_rows_add_up_and_end_where_asked(run, disks):
    assert run.strain == pytest.approx(np.linspace(0, 5, 251), rel=1e-9)
    assert run.time == pytest.approx(10 * run.strain, rel=1e-9)
    assert run.stress == pytest.approx(run.elastic_stress + run.viscous_stress)
    assert run.elastic_stress[0] == pytest.approx(-jamlab.evaluate(disks).stress[0, 1])
    assert run.viscous_stress[0] == pytest.approx(0.1 * jamlab.complex_modulus(disks, [1.0]).eta_inf, rel=1e-3)


def test_work_is_stored_or_lost_and_steady_flow_loses_stress_times_rate(run):
    stored = run.energy - run.energy[0]
    assert run.work[-1] == pytest.approx(run.dissipated[-1] + stored[-1], rel=0.02)
    kept = run.strain >= 1.0
    lost = np.ptp(run.dissipated[kept]) / np.ptp(run.time[kept])
    change = np.ptp(stored[kept][[0, -1]]) / np.ptp(run.time[kept])
    assert abs(lost - 0.1 * run.steady().stress) <= change + 0.02 * lost


def test_units_of_energy(disks):
    """Stiffness eps over the squared distance of contact; the same as LAMMPS' own disks, before and after."""
    packing = jamlab.Packing("sp", disks.box, disks.positions, {"eps": 2.0}, "eps", disks.diameters)
    found = jamlab.shear(packing, 0.1, 0.1, jamlab.ContactDamping(beta=0.5, tau=0.5), rows=2)
    for k, state in ((0, packing), (-1, found.packing)):
        own = jamlab.evaluate(state)
        assert found.elastic_stress[k] == pytest.approx(-own.stress[0, 1], abs=1e-12)
        assert found.energy[k] * state.area == pytest.approx(own.energy, rel=1e-9)
    assert found.unit == "ε/σ²"


@pytest.mark.parametrize("k", [1, 10])
def test_packings_on_the_way_are_whole_and_their_forces_those_of_plain_loops(run, touching, tmp_path, k):
    """Past flips of the box, at strain 0.5 and 5."""
    packing = run.frames[k]
    assert packing.provenance["flow_strain"] == pytest.approx(0.5 * k, rel=1e-9)
    assert not packing.converged and abs(packing.box[1, 0]) < 0.56 * packing.box[0, 0]
    jamlab.write(tmp_path / "p.h5", packing)
    forces, energy, pressing = np.zeros((packing.n, 2)), 0.0, 0
    inside = packing.positions - np.floor(packing.positions @ np.linalg.inv(packing.box)) @ packing.box
    for i, j, r in touching(packing.with_state(positions=inside)):
        distance = np.hypot(*r)
        overlap = packing.diameters[[i, j]].mean() - distance
        pressing += 1
        energy += 0.5 * packing.params["k"] * overlap**2
        forces[i] -= packing.params["k"] * overlap * r / distance
        forces[j] += packing.params["k"] * overlap * r / distance
    found = jamlab.evaluate(jamlab.read(tmp_path / "p.h5"))
    assert found.forces == pytest.approx(forces, abs=1e-12)
    row = np.argmin(np.abs(run.strain - 0.5 * k))
    assert energy / packing.area == pytest.approx(run.energy[row], rel=1e-9)
    assert run.z_all[row] == jamlab.contacts(packing).z_all == 2 * pressing / packing.n
    assert -found.stress[0, 1] == pytest.approx(run.elastic_stress[row], abs=1e-12)


def test_a_run_goes_on_from_its_file(disks, tmp_path):
    """Interrupted at half its strain; the same call again gives what one run does, and once more the same at once."""
    how = {"snapshot_every": 0.1, "tolerance": 1e-4}
    whole = jamlab.shear(disks, 0.01, 0.4, rows=20, **how)
    path = tmp_path / "run.h5"
    half = jamlab.shear(disks, 0.01, 0.2, rows=10, path=path, **how)
    assert jamlab.read_flow(path).stress == pytest.approx(half.stress, abs=0)
    rest = jamlab.shear(disks, 0.01, 0.4, rows=20, path=path, **how)
    for name in ("time", "strain", "stress", "work", "dissipated"):
        assert getattr(rest, name) == pytest.approx(getattr(whole, name), rel=2e-3), name
    assert [p.provenance["flow_strain"] for p in rest.frames] == pytest.approx([0, 0.1, 0.2, 0.3, 0.4], abs=1e-9)
    assert rest.steps > half.steps
    again = jamlab.shear(disks, 0.01, 0.4, rows=20, path=path, **how)
    assert again.steps == rest.steps and np.array_equal(again.stress, rest.stress)
    assert jamlab.read(path).n == disks.n
    with pytest.warns(jamlab.JamlabWarning, match="reaches strain = 0.4, beyond 0.2"):
        longer = jamlab.shear(disks, 0.01, 0.2, rows=10, path=path, **how)
    assert np.array_equal(longer.stress, rest.stress)


def test_a_file_that_holds_more_than_is_asked_for_says_so(disks, tmp_path):
    shear = partial(jamlab.quasistatic_shear, disks, strain_step=1e-3, path=tmp_path / "q.h5")
    creep = partial(jamlab.creep, disks, 1e-4, path=tmp_path / "c.h5")
    for run, more, less, said in ((shear, 3e-3, 1e-3, "strain = 0.003"), (creep, 2.0, 1.0, "time = 2")):
        whole = run(more)
        with pytest.warns(jamlab.JamlabWarning, match=f"reaches {said}, beyond {less:g}"):
            assert np.array_equal(run(less).strain, whole.strain)


def test_nothing_but_a_part_of_the_same_run_is_replaced(disks, tmp_path):
    """Not another rate, nor another packing, nor a packing, nor text."""
    run, packing, notes = (tmp_path / name for name in ("run.h5", "packing.h5", "notes.txt"))
    jamlab.shear(disks, 0.02, 0.04, rows=2, path=run)
    jamlab.write(packing, disks)
    notes.write_text("work of a week")
    other = jamlab.pack(n=disks.n, pressure=1e-2, seed=77)
    for path, start, rate in ((run, disks, 0.01), (run, other, 0.02), (packing, disks, 0.02), (notes, disks, 0.02)):
        before = path.read_bytes()
        with pytest.raises(jamlab.StorageError):
            jamlab.shear(start, rate, 0.04, rows=2, path=path)
        assert path.read_bytes() == before


def test_stokes_drag_adds_the_stress_of_the_fluid(disks):
    thin, thick = (jamlab.shear(disks, 0.01, 0.1, jamlab.StokesDrag(eta_f=eta), rows=4) for eta in (0.0, 3.0))
    assert thick.stress - thin.stress == pytest.approx(0.03)
    assert thick.dissipated - thin.dissipated == pytest.approx(3e-4 * thin.time)
    stored = thick.energy - thick.energy[0]
    assert thick.work[-1] == pytest.approx(thick.dissipated[-1] + stored[-1], rel=0.02)
    assert thick.dissipation[0] == pytest.approx(3e-4, rel=1e-6)  # at a minimum no disk drifts


def test_linear_drag_is_the_limit_of_the_power_law(disks):
    """Another way through the solver, which finds drag coefficients again in every step."""
    runs = [
        jamlab.shear(disks, 0.01, 0.02, jamlab.ContactDamping(alpha=a), rows=4, tolerance=1e-7)
        for a in (1.0, 1 - 1e-12)
    ]
    assert runs[0].stress == pytest.approx(runs[1].stress, rel=1e-8)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"rate": -1e9}, "rate = -1000000000.0"),
        ({"rate": 1e-300}, "rate = 1e-300"),
        ({"rate": [(1, 2, 3)]}, r"\[1, 2, 3\]"),
        ({"rate": []}, r"rate = \[\]"),
        ({"rate": [(0.0, 0.1)]}, "rate = 0.0"),
        ({"rate": [(1.0, -0.1)]}, "strain = -0.1"),
        ({"rate": [(1.0, 0.1)], "strain": 1.0}, "strain = 1.0"),
        ({"strain": 0.0}, "strain = 0.0"),
        ({"rows": 0}, "rows = 0"),
        ({"snapshot_every": 0.3}, "snapshot_every = 0.3"),
        ({"tolerance": 0.5}, "tolerance = 0.5"),
        ({"background_drag": -1.0}, "background_drag = -1.0"),
        ({"background_drag": 1e4}, "background_drag = 10000.0"),
        ({"background_drag": 0.1, "damping": jamlab.StokesDrag()}, "background_drag = 0.1"),
        ({"damping": jamlab.ContactDamping(beta=1e6)}, r"beta = 1e\+06"),
    ],
)
def test_refused(disks, changes, named):
    with pytest.raises(jamlab.InputError, match=named):
        jamlab.shear(**{"packing": disks, "rate": 1.0} | changes)


def test_drops_of_a_stress():
    strain = np.arange(8.0)
    found = stress_drops(strain, np.array([0.0, 2.0, 1.0, 0.5, 3.0, 2.9, 3.5, 3.0]), least=0.2)
    assert found.strain.tolist() == [1.0, 6.0] and found.size.tolist() == [1.5, 0.5]
    assert len(stress_drops(strain, strain).size) == 0
    assert stress_drops(strain, -strain).size.tolist() == [7.0]


@pytest.mark.parametrize("least", [1e-300, 1e-20, 9e-13])
@pytest.mark.parametrize(
    ("drive", "name", "others"),
    [
        (jamlab.shear, "strain", {"rate": 0.1}),
        (jamlab.oscillate, "amplitude", {"omega": 1.0}),
        (jamlab.creep, "stress", {"duration": 1.0}),
        (jamlab.creep, "duration", {"stress": 1e-4}),
        (jamlab.relax_stress, "strain", {"duration": 1.0}),
        (jamlab.relax_stress, "duration", {"strain": 1e-4}),
    ],
)
def test_motion_that_rounding_hides_is_refused(disks, drive, name, others, least):
    """Below, energy balances to 1e4 % and worse, and a modulus is a number of 200 digits."""
    with pytest.raises(jamlab.InputError, match=f"{name} = {least}: "):
        drive(disks, **{name: least}, **others)


@pytest.mark.parametrize(("dip", "end", "found"), [(0.9, 0.995, True), (0.99, 0.985, False), (0.9, 0.5, True)])
def test_an_overshoot_is_a_peak_from_which_the_stress_falls_wherever_it_ends(disks, dip, end, found):
    run = jamlab.shear(disks, 1.0, 0.2, rows=40)
    stress = np.interp(np.arange(41), [0, 10, 20, 40], [0.0, 1.0, dip, end])
    assert replace(run, stress=stress).peak == ((run.strain[10], 1.0) if found else None)
    run = replace(run, stress=stress, elastic_stress=stress)
    back = replace(run, shear_rate=-1.0, strain=-run.strain, stress=-stress, elastic_stress=-stress)
    assert back.peak == ((-run.strain[10], -1.0) if found else None)
    assert back.drops.size == pytest.approx(run.drops.size) and run.plastic_events == back.plastic_events > 0
    turned = 20.0 - np.abs(np.arange(41) - 20.0)  # to and fro: elastic all the way
    assert replace(run, strain=turned, elastic_stress=turned).plastic_events == 0


def test_what_lammps_loses_is_a_flow_without_an_answer():
    with OverdampedSession(jamlab.pack(16, 1e-2, 3), jamlab.ContactDamping(), 1e-2, 1e-4) as flow:
        flow.drive("rate 0.1", 1.0)
        flow._session._lmp.numpy.extract_atom("x")[2, 0] = np.nan
        with pytest.raises(jamlab.ConvergenceError):
            flow.advance()
