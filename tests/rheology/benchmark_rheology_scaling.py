"""How viscosity depends on damping, drag of the fluid and size, [T] section 4. pytest -m benchmark -s.

Prints tables and one JSON object each; packings without pre-stress, as in the paper's figures on scaling.
"""

import json

import numpy as np
import pytest

import jamlab
from jamlab import ContactDamping, StokesDrag

PRESSURES = (1e-2, 1e-3, 1e-4)
SEEDS = range(1, 7)
ONE = [1.0]  # frequency; only the limits are used


@pytest.fixture(scope="module")
def packings():
    return {p: [jamlab.pack(256, p, seed) for seed in SEEDS] for p in PRESSURES}


def eta0(packings, law):
    return float(np.mean([jamlab.complex_modulus(q, ONE, law, prestress=False).eta0 for q in packings]))


@pytest.mark.benchmark
def test_sliding_friction_takes_over_at_a_beta_proportional_to_pressure(packings):
    """eta_0 = a p^0.5 + b beta p^-0.5: sliding equals approach at beta* ~ p."""
    betas, crossover = np.array([0.0, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0]), []
    print("\n      p   eta_0 at beta = " + "  ".join(f"{b:g}" for b in betas))
    for p, group in packings.items():
        values = np.array([eta0(group, ContactDamping(beta=b)) for b in betas])
        print(f"{p:8.0e}  " + "  ".join(f"{v:.4g}" for v in values))
        crossover.append(float(np.exp(np.interp(2 * values[0], values[1:], np.log(betas[1:])))))
    exponent = float(np.polyfit(np.log(PRESSURES), np.log(crossover), 1)[0])
    print(json.dumps({"beta*": crossover, "exponent": exponent, "expected": 1.0}))


@pytest.mark.benchmark
def test_fluid_viscosity_adds_to_the_loss_modulus(packings):
    """Stokes drag: eta_0(eta_F) - eta_0(0) = eta_F."""
    added = []
    for group in packings.values():
        without = eta0(group, StokesDrag(eta_f=0.0))
        added.append([eta0(group, StokesDrag(eta_f=f)) - without for f in (0.1, 1.0, 10.0)])
        print(f"\neta_0(0) = {without:.4g}, added {np.round(added[-1], 9)}", end="")
    assert np.abs(np.array(added) / [0.1, 1.0, 10.0] - 1).max() < 1e-6
    print()


@pytest.mark.benchmark
@pytest.mark.parametrize("prestress", [False, True])
def test_finite_size(prestress):
    """eta_0/N^a against p N^2, a = 1 (contact) and 1.09 (Stokes): one curve, of slope -1/2 for large p N^2."""
    rows = []
    for n in (32, 64, 128, 256):
        for p in (1e-2, 1e-3, 1e-4, 1e-5):
            stable = [jamlab.pack(n, p, seed, ensemble="shear-stabilized") for seed in SEEDS]
            values = []
            for law, a in ((ContactDamping(), 1.0), (StokesDrag(eta_f=0.0), 1.09)):
                found = [jamlab.complex_modulus(q, ONE, law, prestress=prestress).eta0 for q in stable]
                values.append(float(np.median(found)) / n**a)
            rows.append((p * n**2, n, p, *values))
    print(f"\nprestress = {prestress}\n   p N^2     N        p   contact    Stokes")
    for row in sorted(rows):
        print("{:8.3g} {:5d} {:8.0e} {:9.4g} {:9.4g}".format(*row))
    x, _, _, *curves = np.array(sorted(rows)).T
    window = x > 1
    slopes = [float(np.polyfit(np.log(x[window]), np.log(y[window]), 1)[0]) for y in curves]
    print(json.dumps({"prestress": prestress, "slopes": slopes, "expected": -0.5}))
