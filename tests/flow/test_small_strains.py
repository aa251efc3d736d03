"""Oscillation, creep and relaxation by small strains are what the frequency domain says of the same packing."""

from dataclasses import replace

import numpy as np
import pytest
from creep_of_elements import compliance

import jamlab
from jamlab.flow.oscillate import fit_harmonics


@pytest.fixture(scope="module")
def spectrum(backbone):
    return jamlab.complex_modulus(backbone, [0.1], method="dense").spectrum


@pytest.mark.parametrize(
    "damping",
    [jamlab.ContactDamping(), jamlab.ContactDamping(beta=0.1, tau=2.0), jamlab.StokesDrag(eta_f=0.5)],
    ids=str,
)
def test_oscillation(backbone, damping):
    expected = jamlab.complex_modulus(backbone, [0.3], damping)
    found = jamlab.oscillate(backbone, 0.3, 1e-5, damping, tolerance=3e-4)
    wanted = complex(expected.storage[0], expected.loss[0])
    assert found.state == "periodic" and "periodic" in repr(found)
    assert abs(complex(found.storage, found.loss) - wanted) < 1e-3 * abs(wanted)
    assert found.third_over_first < 1e-3 and found.summary["changing contacts"] == 0
    lost = np.diff(found.dissipated[[-1 - found.points_per_cycle, -1]])[0]
    assert lost == pytest.approx(np.pi * found.loss * 1e-10, rel=2e-3)


def test_harmonics_do_not_see_a_drift():
    """A slow rise looks like a sawtooth in each cycle, whose own sine would lower every G'_k."""
    omega, amplitude = 0.3, 0.02
    time = 100.0 + 2 * np.pi / omega * np.arange(1, 33) / 32
    cycle = amplitude * (3.0 * np.sin(omega * time) + 0.5 * np.cos(omega * time) - 0.2 * np.sin(3 * omega * time))
    found = fit_harmonics(time, 0.7 + 0.01 * time + cycle, omega, amplitude)
    assert found == pytest.approx(np.array([3.0 + 0.5j, 0, -0.2, 0, 0, 0, 0]), abs=1e-9)


def test_relaxation(backbone, spectrum):
    """G(t) = G_0 + sum g_i exp(-lambda_i t), over four decades of time."""
    found = jamlab.relax_stress(backbone, 1e-5, 100.0)
    wanted = spectrum.g0 + np.exp(-np.outer(found.time, spectrum.rates)) @ spectrum.strengths
    assert found.time[0] <= 0.01 and found.time[-1] == pytest.approx(100.0)
    assert np.max(np.abs(found.modulus / wanted - 1)) < 1e-3
    assert found.residual_stress == pytest.approx(-jamlab.evaluate(backbone).stress[0, 1])
    assert found.state == "relaxing" and "RELAXING" in repr(found) and not found.packing.converged


@pytest.mark.parametrize("damping", [jamlab.ContactDamping(), jamlab.StokesDrag(eta_f=0.5)], ids=str)
def test_creep(backbone, damping):
    """Under Stokes drag the fluid carries the stress at first, and disks of a shear against it nothing."""
    spectrum = jamlab.complex_modulus(backbone, [0.1], damping, method="dense").spectrum
    found = jamlab.creep(backbone, 1e-7, 100.0, damping, tolerance=1e-4 if damping == jamlab.ContactDamping() else 1e-3)
    wanted = compliance(spectrum, found.time[1:])
    assert found.viscous_stress[0] == pytest.approx(1e-7, rel=1e-3) and found.rate[0] * spectrum.eta_inf == (
        pytest.approx(1e-7, rel=1e-3)
    )
    late = found.time[1:] > 1.0
    assert np.max(np.abs(found.compliance[1:] / wanted - 1)[late]) < 3e-4
    assert found.stress == pytest.approx(found.residual_stress + 1e-7, abs=1e-12)
    assert (
        found.time[-1] == 100.0
        and found.state in ("rests", "creeps")
        and repr(found).count("CREEPS") == (found.state == "creeps")
    )


def test_a_stress_is_held_while_contacts_open_close_and_rub():
    """What a rubbing contact is held by bears a part of the stress."""
    found = jamlab.creep(jamlab.pack(16, 1e-2, 3), 0.02, 20.0)
    assert found.strain[-1] > 0.3 and np.ptp(found.contacts) > 3
    steady = replace(found, time=np.arange(3.0), strain=2 * np.arange(3.0))
    assert steady.slope == 1 and steady.final_rate == 2
    assert found.stress == pytest.approx(np.full(len(found.time), found.residual_stress + 0.02), abs=1e-7)


@pytest.mark.parametrize(
    ("exponent", "strain", "drag", "state"),
    [
        (0.0, 0.5, 0.0, "rests"),
        (0.0, 0.5, 0.5, "creeps"),
        (0.5, 0.5, 0.0, "creeps"),
        (1.0, 0.5, 1.0, "flows"),
        (1.0, 0.1, 1.0, "creeps"),
    ],
)
def test_what_creep_does_is_told_from_the_last_half_of_the_time(backbone, exponent, strain, drag, state):
    """Strain grows as the square root of time up to 40 % of it, whatever follows; below strain 0.2 nothing flows."""
    found = jamlab.creep(backbone, 1e-7, 1.0)
    time = np.linspace(0, 100, 201)
    grown = np.where(time < 40, np.sqrt(time / 40), (np.maximum(time, 40) / 40) ** exponent)
    grown *= strain / grown[-1]
    found = replace(found, time=time, strain=grown, viscous_stress=drag * found.applied_stress * np.ones(201))
    assert found.slope == pytest.approx(exponent, abs=1e-12) and found.state == state
    if exponent == 1.0:
        assert found.final_rate == pytest.approx(strain / 100)


@pytest.mark.parametrize("strain", [[0, 1e-9, 2e-8, -3e-7, -1e-6], [0, -1e-9, -1e-8, -1e-7, -2e-6], [0, 2e-6], [0]])
def test_creep_against_the_stress_and_of_few_rows_has_no_exponent(backbone, strain):
    """No growth is none that rests: a packing of negative G runs away against the stress."""
    few = slice(len(strain))
    found = jamlab.creep(backbone, 1e-7, 1.0)
    found = replace(found, time=np.arange(5.0)[few], strain=np.array(strain), viscous_stress=np.zeros(5)[few])
    assert np.isnan(found.slope) and found.state == "creeps"
    assert np.isnan(found.final_rate) == (len(strain) < 3)


def test_they_go_on_from_their_files(backbone, tmp_path):
    for name, call in {
        "creep.h5": lambda time, out: jamlab.creep(backbone, 1e-5, time, path=out),
        "relax.h5": lambda time, out: jamlab.relax_stress(backbone, 1e-4, time, path=out),
    }.items():
        whole = call(20.0, None)
        half = call(7.0, tmp_path / name)
        rest = call(20.0, tmp_path / name)
        assert rest.time[-1] == pytest.approx(20.0) and rest.steps > half.steps
        assert np.array_equal(rest.stress[: len(half.time)], half.stress)
        assert rest.strain[-1] == pytest.approx(whole.strain[-1], rel=2e-3)
        assert rest.stress[-1] == pytest.approx(whole.stress[-1], rel=2e-3)
    first = jamlab.oscillate(backbone, 0.5, 1e-3, cycles=2, tolerance=1e-6, path=tmp_path / "o.h5")
    more = jamlab.oscillate(backbone, 0.5, 1e-3, cycles=3, tolerance=1e-6, path=tmp_path / "o.h5")
    assert (first.cycles, more.cycles) == (2, 3) and more.state == "not periodic"
    assert np.array_equal(more.cycle_harmonics[:2], first.cycle_harmonics)
    read = jamlab.read_flow(tmp_path / "o.h5")
    assert read.storage == more.storage and read.damping == more.damping and read.omega == 0.5


def test_large_amplitudes_are_not_linear(backbone):
    found = jamlab.oscillate(backbone, 0.1, 0.3, cycles=2, tolerance=1e-2)
    assert found.summary["changing contacts"] > 0
    assert found.third_over_first > 0.01 and found.harmonics.shape == (7,)
    assert found.storage < 0.5 * jamlab.complex_modulus(backbone, [0.1]).storage[0]


def test_the_third_harmonic_is_the_third(backbone):
    found = jamlab.oscillate(backbone, 1.0, 1e-5, cycles=2)
    last = np.array([[3 + 4j, 0.7, 0.3j, 0.2, 0, 0, 0]])
    assert replace(found, cycle_harmonics=last, finished=True).third_over_first == pytest.approx(0.3 / 5)


@pytest.mark.parametrize(
    "call",
    [
        lambda p: jamlab.oscillate(p, 0.1, 0.1),
        lambda p: jamlab.creep(p, 1e-3, 1.0),
        lambda p: jamlab.relax_stress(p, 1e-3, 1.0),
    ],
)
def test_disks_that_do_not_touch_are_refused(disks, call):
    loose = disks.with_state(box=3 * disks.box, positions=3 * disks.positions)
    with pytest.raises(jamlab.InputError, match=f"{loose.phi:.4g}"):
        call(loose)


@pytest.mark.parametrize(
    ("named", "call"),
    [
        ("omega = 0.0", lambda p: jamlab.oscillate(p, 0.0, 0.1)),
        ("cycles = 1", lambda p: jamlab.oscillate(p, 1.0, 0.1, cycles=1)),
        ("cycles = -52", lambda p: jamlab.oscillate(p, 1.0, 0.1, cycles=-52)),
        ("points_per_cycle = 4", lambda p: jamlab.oscillate(p, 1.0, 0.1, points_per_cycle=4)),
        ("stress = -1.0", lambda p: jamlab.creep(p, -1.0, 1.0)),
        ("η_F = 0", lambda p: jamlab.creep(p, 1.0, 1.0, jamlab.StokesDrag(eta_f=0.0))),
        ("duration = 0.01", lambda p: jamlab.relax_stress(p, 1e-3, 0.01)),
        ("alpha = 0.5", lambda p: jamlab.complex_modulus(p, [1.0], jamlab.ContactDamping(alpha=0.5))),
        ("alpha = 0.3", lambda p: jamlab.ContactDamping(alpha=0.3)),
    ],
)
def test_refused(backbone, named, call):
    with pytest.raises(jamlab.InputError, match=named):
        call(backbone)
