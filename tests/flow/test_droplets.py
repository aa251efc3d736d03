"""Droplets in time: against the frequency domain, native forces and the decks' own units."""

from pathlib import Path

import numpy as np
import pytest
from creep_of_elements import compliance
from droplet_drag import drag_rates

import jamlab
from jamlab.geometry.vertex_contacts import vertex_contacts

STATES = Path(__file__).parents[1] / "states"


@pytest.fixture(scope="module")
def droplets():
    """Eight droplets of the default law at rho = 0.92, stable under shear: `jam(8, "dp", 3)`, shear-stabilized."""
    return jamlab.read(STATES / "stable_droplets.h5")


@pytest.fixture(scope="module")
def few():
    """Four droplets of that law at rho = 0.93, stable under shear as well."""
    return jamlab.read(STATES / "few_droplets.h5")


@pytest.mark.parametrize("law", [jamlab.StokesDrag(eta_f=0.5), jamlab.ContactDamping(beta=0.3, tau=2.0)])
def test_small_oscillations_have_the_modulus_of_the_frequency_domain(few, law):
    found = jamlab.oscillate(few, omega=1.0, amplitude=1e-5, damping=law)
    exact = jamlab.complex_modulus(few, [1.0], law)
    expected = complex(exact.storage[0], exact.loss[0])
    assert abs(complex(found.storage, found.loss) - expected) < 1e-3 * abs(expected)


def test_a_small_step_relaxes_to_the_modulus_at_rest(few):
    found = jamlab.relax_stress(few, strain=1e-5, duration=1e5)
    assert found.modulus[-1] == pytest.approx(jamlab.shear_modulus(few, direction="simple"), rel=1e-3)
    assert np.all(np.diff(found.modulus) < 1e-3 * found.modulus[:-1])  # its tolerance


@pytest.mark.parametrize(
    "law",
    [pytest.param(jamlab.StokesDrag(eta_f=0.5), marks=pytest.mark.slow), jamlab.ContactDamping(beta=0.3)],
    ids=str,
)
def test_creep_from_the_first_steps_on_has_the_compliance_of_the_frequency_domain(droplets, law):
    """Steps look ahead along a rate that is one of the unknowns."""
    found = jamlab.creep(droplets, 1e-6, 3.0, law, tolerance=1e-4)
    spectrum = jamlab.complex_modulus(droplets, [0.1], law, method="dense").spectrum
    assert found.compliance[1:] == pytest.approx(compliance(spectrum, found.time[1:]), rel=5e-4)


def test_outlines_that_cross_do_not_flow(droplets):
    a, b, c = droplets.offsets[:3]
    placed = droplets.positions.copy()
    placed[a:b] += placed[b:c].mean(axis=0) - placed[a:b].mean(axis=0) + [0.5, 0.0]
    with pytest.raises(jamlab.InputError):
        jamlab.shear(droplets.with_state(positions=placed), 0.1, 0.01, jamlab.StokesDrag(), rows=1)


def test_a_row_has_the_stress_of_its_packing(droplets):
    """Forces of the step's prediction are those of a moment before."""
    run = jamlab.shear(droplets, 0.1, 0.02, jamlab.StokesDrag(), rows=4, snapshot_every=0.005)
    assert run.stress == pytest.approx(run.elastic_stress + run.viscous_stress, rel=1e-12)
    states = [jamlab.evaluate(packing) for packing in run.frames]
    assert run.elastic_stress == pytest.approx([-state.stress[0, 1] for state in states], abs=1e-9)
    assert run.energy == pytest.approx([state.energy / droplets.area for state in states], rel=1e-7)


@pytest.mark.parametrize(
    ("law", "rate"),
    [(jamlab.StokesDrag(eta_f=0.5), 0.1), pytest.param(jamlab.ContactDamping(), 0.01, marks=pytest.mark.slow)],
)
def test_flow_over_a_flip_gives_a_packing(droplets, law, rate, tmp_path):
    """Work is stored or lost; the last state is whole, with the energy and the stress that the run says."""
    found = jamlab.shear(droplets, rate, strain=0.6, damping=law, rows=6, path=tmp_path / "run.h5")
    state = jamlab.read(tmp_path / "run.h5")
    assert state.box[1, 0] < 0.5 * state.box[0, 0] and not state.converged
    network, native = jamlab.contacts(state), jamlab.evaluate(state)
    assert found.z_all[-1] == network.z_all < 2 * len(vertex_contacts(state).vertex) / state.n
    assert found.energy[-1] * state.area == pytest.approx(native.energy, rel=1e-3)
    assert found.elastic_stress[-1] == pytest.approx(-native.stress[0, 1], rel=1e-3)
    stored = found.energy[-1] - found.energy[0]
    assert found.work[-1] == pytest.approx(found.dissipated[-1] + stored, rel=0.02)


def test_quasistatic_shear_of_droplets(droplets):
    found = jamlab.quasistatic_shear(droplets, strain=2e-3, strain_step=5e-4)
    assert found.converged.all()
    modulus = jamlab.shear_modulus(droplets, direction="simple")
    assert found.stress[-1] - found.stress[0] == pytest.approx(2e-3 * modulus, rel=0.05)


def test_without_background_droplets_that_slip_are_refused(droplets):
    with pytest.raises(jamlab.ConvergenceError):
        jamlab.shear(droplets, rate=0.1, strain=0.6, background_drag=0.0, rows=2)


@pytest.mark.parametrize("model", ["sp", "dp"])
def test_a_flow_goes_on_where_image_flags_would_end(model, disks, droplets):
    """LAMMPS counts 511 boxes; half way there whole particles move back, when neighbors are found."""
    packing = disks if model == "sp" else droplets
    far = packing.with_state(positions=packing.positions + 505 * packing.box[0] - 300 * packing.box[1])
    near, moved = (jamlab.shear(p, 1.0, 0.1, rows=2, tolerance=0.05) for p in (packing, far))
    assert moved.stress == pytest.approx(near.stress, rel=1e-4)
    boxes = (moved.packing.positions - near.packing.positions) @ np.linalg.inv(near.packing.box)
    assert boxes == pytest.approx(np.round(boxes), abs=1e-4) and np.abs(boxes).max() < 3


def test_drag_on_fixed_droplets_does_the_work_of_a_compression_that_keeps_their_areas(droplets):
    """The viscous part of the pressure: power of the drag over the rate of the area, by a plain sum over contacts, in
    which vertices of fixed droplets move beside the flow."""
    fixed = droplets.with_state(fixed=np.arange(8) % 3 == 1, converged=True, max_force=droplets.max_force)
    run = jamlab.shear(fixed, 0.3, 4e-3, jamlab.ContactDamping(beta=0.3), rows=4, snapshot_every=1e-3)
    (before, after), dt = run.frames[-2:], np.diff(run.time)[-1]
    place = 0.5 * (before.positions + after.positions)
    moved = after.positions - before.positions
    moved[:, 0] -= 1e-3 * place[:, 1]
    middle = before.with_state(positions=place, box=0.5 * (before.box + after.box))
    assert np.all(moved[middle.frame.fixed_sites] == pytest.approx(0.0, abs=1e-12))
    kept = -0.5 * (place - middle.centroids[middle.particle]) * middle.frame.fixed_sites[:, None]
    grown = drag_rates(middle, kept, 0.5 * np.eye(2), 0.3)
    viscous = -grown @ drag_rates(middle, moved / dt, np.array([[0.0, 0.3], [0.0, 0.0]]), 0.3) / middle.area
    found = run.pressure[-2:].mean() - jamlab.evaluate(middle).pressure
    assert abs(viscous) > 0.05 * run.pressure[-1]
    assert found == pytest.approx(viscous, rel=2e-3)
