"""Inertia: M, G* and damped vibrations, against dense plain numpy, closed forms and limits."""

import warnings
from pathlib import Path

import numpy as np
import pytest
from features_of_packings import FEATURES
from scipy import optimize

import jamlab
from jamlab.rheology import damped_vibrations as module
from jamlab.rheology import slow_and_fast_limits

OMEGA = np.logspace(-4, 4, 9)
NAMED = (
    *("disks", "leaning", "rattlers", "exponent 2.5", "lognormal", "eps, leaning", "other units", "sticky, p > 0"),
    *("fixed some", "N = 4", "droplets", "droplets, fixed"),
)
QUICK = ("rattlers", "fixed some", "droplets")  # the others with -m slow
STATES = [pytest.param(each, marks=[pytest.mark.slow] * (each not in QUICK)) for each in NAMED]
ONSET = Path(__file__).parents[1] / "states" / "droplets_at_onset.h5"
LAWS = (jamlab.ContactDamping(), jamlab.ContactDamping(beta=0.0), jamlab.StokesDrag(eta_f=0.3))


def state(name):
    p = FEATURES[name]()
    return p, np.abs(jamlab.hessian(p)).max() * np.random.default_rng(4).uniform(0.5, 2.0, p.n)


def mass_matrix(p, masses):
    """(m,) masses of all coordinates but gamma, by a loop over particles."""
    fixed, count = np.zeros(p.n, bool) if p.fixed is None else p.fixed, np.bincount(p.particle)
    sites = [0.0 if fixed[i] else masses[i] / count[i] for i in p.particle]
    spins = (
        [0.0 if fixed[i] else masses[i] * (p.diameters[i] / 2) ** 2 / 2 for i in range(p.n)] if p.model == "sp" else []
    )
    return np.concatenate([np.repeat(sites, 2), spins])


def moving(p, b, rattlers=True):
    """Coordinates that move: no fixed particles, spins that drag turns, and perhaps no rattlers."""
    still = np.zeros(p.n, bool) if p.fixed is None else p.fixed.copy()
    if not rattlers:
        still |= jamlab.contacts(p).rattlers
    sites = 2 * len(p.positions)
    free = np.repeat(~still[p.particle], 2)
    spins = ~still & (b.diagonal()[sites:-1] > 0) if p.model == "sp" else np.zeros(0, bool)
    return np.flatnonzero(np.concatenate([free, spins]))


def dense_modulus(p, law, masses, omega):
    """G* = (M_gg + M_gq q)/A by least squares, which leave out what nothing resists."""
    k, b = (each.toarray() for each in jamlab.dynamical_matrices(p, law))
    kept, mass, found = moving(p, b, rattlers=False), mass_matrix(p, masses), []
    for w in omega:
        z = k + 1j * w * b
        inner = z[np.ix_(kept, kept)] - w**2 * np.diag(mass[kept])
        scale = 1 / np.sqrt(np.abs(inner.diagonal()))
        q = scale * np.linalg.lstsq(scale[:, None] * inner * scale, -scale * z[kept, -1], rcond=1e-14)[0]
        found.append((z[-1, -1] + z[-1, kept] @ q) / p.area)
    return np.array(found)


@pytest.mark.parametrize("name", STATES)
def test_the_modulus_is_that_of_the_dense_equation(name):
    p, masses = state(name)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", jamlab.JamlabWarning)
        for law in LAWS[:: 2 if p.model == "sp" else 1]:
            exact = dense_modulus(p, law, masses, OMEGA)
            s = jamlab.complex_modulus(p, OMEGA, law, masses=masses)
            assert s.storage + 1j * s.loss == pytest.approx(exact, rel=1e-10)
            assert (s.loss > 0).all() and s.method == "direct"
            slow = jamlab.complex_modulus(p, OMEGA, law)
            assert (s.g0, s.eta0) == (slow.g0, slow.eta0)
            _, b, m = jamlab.dynamical_matrices(p, law, masses=masses)
            assert s.eta_inf == pytest.approx(b[-1, -1] / p.area, rel=1e-12)
            assert m.toarray() == pytest.approx(np.diag(np.append(mass_matrix(p, masses), 0.0)), rel=1e-14)


def test_light_particles_answer_as_overdamped_ones():
    p = FEATURES["disks"]()
    omega = np.logspace(-3, 2, 6)
    plain = jamlab.complex_modulus(p, omega, method="direct", prestress=False)
    off = []
    for mass in (1e-6, 1e-7):
        light = jamlab.complex_modulus(p, omega, masses=mass, prestress=False)
        off.append(np.abs(light.storage + 1j * light.loss - plain.storage - 1j * plain.loss).max())
    assert off[0] < 1e-2 and off[1] == pytest.approx(off[0] / 10, rel=0.05)  # linear in the mass


def test_modulus_with_masses_needs_no_fast_limit_of_drag(monkeypatch):
    """Inertia makes the fast motion affine: drag whose fast limit is lost to rounding is none the less solved."""
    p, law = FEATURES["disks"](), jamlab.ContactDamping(beta=0.0)
    masses = np.linspace(1.0, 2.0, p.n)
    expected = jamlab.complex_modulus(p, [0.3, 3.0], law, masses=masses)

    def lost(*_):
        raise jamlab.ConvergenceError("the fast limit is lost")

    monkeypatch.setattr(slow_and_fast_limits, "_solve_fast", lost)
    found = jamlab.complex_modulus(p, [0.3, 3.0], law, masses=masses)
    assert np.array_equal(found.storage, expected.storage) and found.eta_inf == expected.eta_inf
    matrices = jamlab.dynamical_matrices(jamlab.remove_rattlers(p), law)
    assert found.eta_inf == pytest.approx(matrices[1].toarray()[-1, -1] / p.area)


def test_storage_and_loss_obey_kramers_and_kronig():
    """G'(w) - G_0 = (2 w^2/pi) P int (G''(x)/x - eta_inf) dx/(w^2 - x^2), through resonances."""
    p, law = jamlab.pack(8, 3e-2, 2, ensemble="shear-stabilized"), jamlab.StokesDrag(eta_f=0.2)
    x = np.geomspace(1e-3, 1e3, 361)
    s = jamlab.complex_modulus(p, x, law, masses=3.0)
    part = s.loss / x - s.eta_inf
    for at in (75, 165, 180, 195):
        w, others = x[at], np.arange(len(x)) != at
        rest = (part - part[at])[others] / (w**2 - x[others] ** 2) * x[others]
        found = 2 * w**2 / np.pi * np.trapezoid(rest, np.log(x[others]))
        assert found == pytest.approx(s.storage[at] - s.g0, abs=2e-3 * np.ptp(s.storage))
    affine = jamlab.dynamical_matrices(p, law)[0][-1, -1] / p.area
    assert s.storage[-1] == pytest.approx(affine, rel=1e-4)  # this drag has no column of gamma


def test_free_droplets_in_a_fluid_have_inertia():
    """Two droplets of twelve touch nothing: all coordinates at once, which the fluid drags, give the same G*."""
    p = jamlab.read(ONSET)
    assert jamlab.contacts(p).rattlers.sum() == 2
    law, masses = jamlab.StokesDrag(eta_f=0.3), np.linspace(1.0, 2.0, p.n)
    k, b, m = (each.toarray() for each in jamlab.dynamical_matrices(p, law, masses=masses))
    s = jamlab.complex_modulus(p, OMEGA[2:7], law, masses=masses)
    for w, storage, loss in zip(OMEGA[2:7], s.storage, s.loss, strict=True):
        z = k + 1j * w * b - w**2 * m
        q = np.linalg.solve(z[:-1, :-1], -z[:-1, -1])
        exact = (z[-1, -1] + z[-1, :-1] @ q) / p.area
        assert storage + 1j * loss == pytest.approx(exact, rel=1e-9)


def two_disks(law, mass):
    p = jamlab.Packing("sp", 10 * np.eye(2), [[1.0, 1], [1.9, 1]], {"k": 2.0}, "k", [1.0, 1.0])
    return jamlab.damped_vibrations(p, law, masses=mass, prestress=False)


@pytest.mark.parametrize("mass", [0.4, 30.0])
def test_two_disks_are_a_damped_oscillator(mass):
    """mu s^2 + k tau s + k = 0 with half of the mass, both sides of critical damping."""
    found = two_disks(jamlab.ContactDamping(beta=0.0, tau=0.7), mass)
    s = np.roots([mass / 2, 2.0 * 0.7, 2.0])
    assert found.free == 3
    assert np.sort_complex(found.eigenvalues) == pytest.approx(np.sort_complex(s[s.imag >= 0]), rel=1e-12)
    if found.oscillating.any():
        assert found.damping_ratio == pytest.approx([0.7 * np.sqrt(2.0 / (mass / 2)) / 2])
        assert found.participation == pytest.approx([1.0])


def test_a_fluid_damps_each_undamped_mode_by_itself():
    """s^2 m + s k tau + lambda = 0; the translations coast until the fluid stops them."""
    p = FEATURES["disks"]()
    still = jamlab.lowest_modes(p, None, masses=5.0)
    found = jamlab.damped_vibrations(p, jamlab.StokesDrag(), masses=5.0)
    drag = jamlab.dynamical_matrices(p, jamlab.StokesDrag())[1].diagonal()[0]
    wanted = np.concatenate([np.roots([1.0, drag / 5, value if not zero else 0.0]) for value, zero in
                             zip(still.eigenvalues, still.zero, strict=True)])  # fmt: skip
    _compare(found, wanted, 1e-9)
    assert found.free == 0


def _compare(found, wanted, tolerance):
    own = np.concatenate([found.eigenvalues, found.eigenvalues[found.oscillating].conj(), np.zeros(2 * found.free)])
    assert len(own) == len(wanted)
    off = np.abs(own[:, None] - wanted)
    i, j = optimize.linear_sum_assignment(off)
    assert off[i, j].max() < tolerance * np.abs(wanted).max()


@pytest.mark.parametrize("name", STATES)
def test_damped_vibrations_are_those_of_the_dense_pencil(name):
    """Every pair solves (s^2 M + s B + K) u = 0, and none is missing: they are as many, and their sum is -tr B/M."""
    p, masses = state(name)
    for law in LAWS[: 1 if p.model == "dp" else 3]:
        k, b = (each.toarray()[:-1, :-1] for each in jamlab.dynamical_matrices(p, law))
        kept = moving(p, np.pad(b, (0, 1)))
        k, b, m = k[np.ix_(kept, kept)], b[np.ix_(kept, kept)], mass_matrix(p, masses)[kept]
        found = jamlab.damped_vibrations(p, law, masses=masses)
        s, waves = found.eigenvalues, found.oscillating
        assert waves.sum() * 2 + (~waves).sum() + 2 * found.free == 2 * len(kept)
        u = np.concatenate([found.vectors.reshape(len(s), -1), found.rotations], axis=1)[:, kept].T
        left = np.abs(s**2 * (m[:, None] * u) + s * (b @ u) + k @ u).max(axis=0)
        size = np.abs(s) ** 2 * m.max() + np.abs(s) * np.abs(b).max() + np.abs(k).max()
        assert (left < 1e-10 * size * np.abs(u).max(axis=0)).all()
        assert (s.sum() + s[waves].conj().sum()).real == pytest.approx(-(b.diagonal() / m).sum(), rel=1e-10)
        assert np.einsum("im,i,im->m", u.conj(), m, u).real == pytest.approx(np.ones(len(s)), rel=1e-10)
        assert (found.attenuation > -1e-8 * np.abs(s).max()).all()


def test_resonances_of_the_modulus_lie_at_damped_vibrations():
    """G* less what is affine has its poles there: it is a sum over them, here of one frequency."""
    p, law = jamlab.pack(8, 3e-2, 2), jamlab.StokesDrag()
    found = jamlab.damped_vibrations(p, law, masses=50.0)
    k, b, m = (each.toarray() for each in jamlab.dynamical_matrices(p, law, masses=50.0))
    at = found.eigenvalues[found.oscillating][-1]
    inner = k[:-1, :-1] + at * b[:-1, :-1] + at**2 * m[:-1, :-1]
    sites = 2 * p.n
    assert np.abs(np.linalg.eigvals(inner[:sites, :sites])).min() < 1e-10 * np.abs(inner).max()


BAD = {
    "dense": (lambda p: jamlab.complex_modulus(p, 1.0, masses=1.0, method="dense"), "use method='direct'"),
    "reduced": (
        lambda p: jamlab.complex_modulus(p, 1.0, masses=1.0, method="reduced"),
        "method = 'reduced' with masses",
    ),
    "walls": (lambda p: jamlab.complex_modulus(FEATURES["rough"](), 1.0, masses=1.0), "leave out masses, or remove"),
    "negative": (lambda p: jamlab.complex_modulus(p, 1.0, masses=-1.0), "must be positive"),
    "few": (lambda p: jamlab.complex_modulus(p, 1.0, masses=[1.0, 2.0]), "2 numbers for 16 particles"),
    "matrices": (lambda p: jamlab.dynamical_matrices(p, masses=0.0), "must be positive"),
    "nonlinear": (lambda p: jamlab.nonlinear_modulus(p, 1.0, stress=1e-4, masses=1.0), "masses"),
    "mean": (lambda p: jamlab.mean_spectra([p], [1.0], masses=1.0), "masses"),
    "film": (lambda p: jamlab.damped_vibrations(p, jamlab.ContactDamping(alpha=0.5)), "alpha = 0.5"),
    "none": (lambda p: jamlab.damped_vibrations(p, masses=None), "masses = None"),
    "droplets": (lambda p: jamlab.damped_vibrations(FEATURES["droplets"](), prestress=False), "line tension"),
    "unjammed": (lambda p: jamlab.complex_modulus(_apart(), 1.0, masses=1.0), "unjammed"),
}


def _apart():
    return jamlab.Packing("sp", 9 * np.eye(2), [[1.0, 1], [4, 4]], {"k": 1.0}, "k", [1.0, 1.0])


@pytest.mark.parametrize("name", BAD)
def test_what_inertia_does_not_go_with_is_refused(name):
    call, words = BAD[name]
    with pytest.raises((jamlab.JamlabError, TypeError), match=words):
        call(FEATURES["disks"]())


def test_too_many_coordinates_for_the_dense_solver(monkeypatch):
    monkeypatch.setattr(module, "DAMPED", module.DampedSpectra(most=20))
    with pytest.raises(jamlab.InputError, match="48 coordinates: the dense solver takes at most 20"):
        jamlab.damped_vibrations(FEATURES["disks"]())


def test_disks_that_do_not_touch_are_free():
    found = jamlab.damped_vibrations(_apart())
    assert found.free == 4 and len(found.eigenvalues) == 0 and found.vectors.shape == (0, 2, 2)
    assert jamlab.damped_vibrations(FEATURES["N = 1"](), jamlab.StokesDrag(), masses=2.0).free == 0
