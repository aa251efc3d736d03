"""Slow shear, displacement correlation, equivalent damping and scaling collapse against loops, closed forms, limits."""

import dataclasses

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import quad

import jamlab
from jamlab import ContactDamping, StokesDrag
from jamlab.geometry.contact_network import remove_rattlers
from jamlab.rheology.displacement_correlation import (
    correlation_along_x,
)

OMEGA = np.logspace(-8, 3, 12)


@pytest.fixture(scope="module")
def packing():
    return jamlab.pack(n=64, pressure=1e-4, seed=1)


def test_slow_shear_carries_the_modulus_and_the_viscosity(packing):
    """G_0 A = sum k du_par^2 without pre-stress; A eta_0 at beta = 0 the same (eqs 4 and 6)."""
    slow = jamlab.nonaffine_response(packing, prestress=False)
    s = jamlab.complex_modulus(packing, [1.0], ContactDamping(beta=0.0), prestress=False)
    assert len(slow.normal) == len(slow.tangential) == jamlab.contacts(packing).n_contacts
    assert np.sum(slow.normal**2) / packing.area == pytest.approx(s.g0, rel=1e-9)
    assert np.sum(slow.normal**2) / packing.area == pytest.approx(s.eta0, rel=1e-9)


def test_slow_shear_without_rotation_bounds_the_viscosity(packing):
    """Rotations only lower dissipation: A eta_0 <= sum du_par^2 + du_perp^2 at beta = 1, pre-stress kept."""
    slow = jamlab.nonaffine_response(packing)
    s = jamlab.complex_modulus(packing, [1.0], ContactDamping(beta=1.0))
    assert s.eta0 < np.sum(slow.normal**2 + slow.tangential**2) / packing.area
    stokes = jamlab.complex_modulus(packing, [1.0], StokesDrag(eta_f=0.0))
    assert stokes.eta0 == pytest.approx(np.sum(slow.nonaffine**2) / packing.area, rel=1e-9)


def test_sliding_grows_and_approach_fades_towards_onset():
    """Fig 5, no pre-stress: medians ~ p^(1/4), p^(-1/4), p^(-1/4); two decades of p make factors of about 3."""
    near, far = (
        jamlab.nonaffine_response(jamlab.pack(n=256, pressure=p, seed=1), prestress=False) for p in (1e-4, 1e-2)
    )
    assert near.median_normal < 0.6 * far.median_normal
    assert near.median_tangential > 1.7 * far.median_tangential
    assert near.median_nonaffine > 1.7 * far.median_nonaffine


def test_correlation_against_a_loop_over_pairs():
    """Random sites in a tilted box, also outside it: every pair of one lane, by plain loops."""
    rng = np.random.default_rng(1)
    box = np.array([[12.0, 0.0], [3.0, 10.0]])
    x, values = rng.uniform(-5, 20, (150, 2)), rng.normal(size=150)
    c = correlation_along_x(x, values, box, lane=2.0, width=1.0)
    fraction = x @ np.linalg.inv(box)
    place = x - np.floor(fraction) @ box
    row, column = (place[:, 1] / 2.0).astype(int), np.floor(place[:, 0] % 12.0).astype(int)
    sums, pairs = np.zeros(6), np.zeros(6)
    for i in range(150):
        for j in range(150):
            k = (column[j] - column[i]) % 12
            if i != j and row[i] == row[j] and k < 6:
                sums[k] += values[i] * values[j]
                pairs[k] += 1
    assert c.pairs == pytest.approx(pairs)
    assert c.correlation == pytest.approx(sums / pairs / np.mean(values**2), rel=1e-9)


def test_correlation_of_a_wave():
    """cos(2 pi x/L) correlates as cos(2 pi delta/L) and crosses zero at L/4."""
    rng = np.random.default_rng(2)
    x = rng.uniform(0, 40, (4000, 2))
    c = correlation_along_x(x, np.cos(2 * np.pi * x[:, 0] / 40), 40 * np.eye(2))
    assert c.correlation == pytest.approx(np.cos(2 * np.pi * c.delta / 40), abs=0.05)
    assert c.length == pytest.approx(10.0, abs=0.5)


def test_displacements_solve_the_dense_equation_at_unit_stress(packing):
    """(K + i omega B) Q = A e_gamma, the real part at peak stress; rotations take no part under Stokes drag."""
    omega, law = 1e-2, StokesDrag(eta_f=0.3)
    backbone, u = jamlab.displacement_response(packing, omega, law)
    k, b = (matrix.toarray() for matrix in jamlab.dynamical_matrices(backbone, law))
    kept = np.r_[0 : 2 * backbone.n, 3 * backbone.n]
    load = np.zeros(len(kept))
    load[-1] = backbone.area
    wanted = np.linalg.solve((k + 1j * omega * b)[np.ix_(kept, kept)], load)[:-1].reshape(-1, 2)
    wanted -= wanted.mean(axis=0)
    assert np.abs(u - wanted).max() < 1e-7 * np.abs(wanted).max()
    assert np.abs(wanted.imag).max() > 0.01 * np.abs(wanted).max()


def test_impossible_correlations_are_refused(packing):
    with pytest.raises(jamlab.InputError, match=r"omega = -1\.0"):
        jamlab.displacement_correlation(packing, -1.0)
    network = remove_rattlers(packing)
    with pytest.raises(jamlab.InputError, match="lane = 0"):
        correlation_along_x(network.positions, np.ones(network.n), packing.box, lane=0)
    flat = correlation_along_x(network.positions, np.ones(network.n), packing.box)
    with pytest.raises(jamlab.ConvergenceError):
        _ = flat.length


@pytest.mark.parametrize("alpha", [0.5, 2 / 3, 1.0, 1.5])
def test_equivalent_drag_dissipates_as_much_in_a_cycle(alpha):
    """Eq 25 from its definition: int |v|^(1 + alpha) dt = tau int v^2 dt over a cycle of amplitude u_0, eq 24."""
    for w, tau in zip(OMEGA, jamlab.effective_relaxation_time(OMEGA, 1e-3, alpha), strict=True):
        u0 = 1e-3 / np.hypot(1, w * tau)
        nonlinear = quad(lambda t, v=u0 * w: np.abs(v * np.cos(t)) ** (1 + alpha), 0, np.pi / 2)[0]
        assert tau * np.pi / 4 * (u0 * w) ** 2 == pytest.approx(nonlinear, rel=1e-8)


def test_equivalent_time_has_the_limits_of_eq_26():
    """tau ~ omega^(alpha - 1) F^(alpha - 1) when slow, ~ F^((alpha - 1)/alpha) when fast; 1 when linear."""
    assert jamlab.effective_relaxation_time(OMEGA, 1e-3, 1.0) == pytest.approx(1.0, rel=1e-12)
    for alpha in (0.5, 2 / 3):
        tau = jamlab.effective_relaxation_time([1e-12, 1e-11, 1e9, 1e10], 1e-3, alpha)
        other = jamlab.effective_relaxation_time([1e-12, 1e10], 1e-4, alpha)
        assert np.log10(tau[1] / tau[0]) == pytest.approx(alpha - 1, abs=1e-3)
        assert tau[3] == pytest.approx(tau[2], rel=1e-3)
        assert np.log10(other[0] / tau[0]) == pytest.approx(1 - alpha, abs=1e-3)
        assert np.log10(other[1] / tau[3]) == pytest.approx((1 - alpha) / alpha, abs=1e-3)


def test_nonlinear_modulus(packing):
    """alpha = 1 is linear; alpha < 1: G'' ~ omega^alpha when slow, and it falls with the stress (eq 27)."""
    linear = jamlab.complex_modulus(packing, OMEGA)
    same = jamlab.nonlinear_modulus(packing, OMEGA, jamlab.ContactDamping(), stress=1e-6)
    assert same.storage == pytest.approx(linear.storage, rel=1e-9)
    assert same.loss == pytest.approx(linear.loss, rel=1e-9)
    slow, film = [1e-18, 1e-17], jamlab.ContactDamping(alpha=0.5)
    weak, strong = (jamlab.nonlinear_modulus(packing, slow, film, stress=stress) for stress in (1e-6, 1e-4))
    assert np.log10(weak.loss[1] / weak.loss[0]) == pytest.approx(0.5, abs=1e-2)
    assert strong.loss[0] / weak.loss[0] == pytest.approx(0.1, rel=1e-2)


def test_impossible_drag_is_refused(packing):
    for arguments, message in (((1.0, 1e-3, 0.0), "alpha = 0"), ((1.0, 0.0, 0.5), "force = 0"), ((-1, 1, 1), "omega")):
        with pytest.raises(jamlab.InputError, match=message):
            jamlab.effective_relaxation_time(*arguments)


def made_up(p, mu, lam, noise):
    """G* = p^mu (1 + (i omega/p^lam)^(mu/lam)): scaling by construction, Kelvin-Voigt when slow."""
    omega = np.logspace(-9, 0, 91)
    x = omega / p**lam
    g = p**mu * noise * np.sqrt(1 + 1j * x) if mu / lam == 0.5 else p**mu * noise * (1 + 1j * x) ** (mu / lam)
    return jamlab.results.ComplexModulus(omega, g.real, g.imag, p**mu, p ** (mu - lam) / 2, 0.0, "made up", 0 * omega)


@pytest.mark.parametrize(("mu", "lam"), [(0.5, 1.0), (0.6, 0.9)])
def test_collapse_finds_the_exponents_of_a_scaling_function(mu, lam):
    """Delta = mu/lambda follows; a scatter of 5 % makes intervals that hold the truth."""
    rng = np.random.default_rng(1)
    pressures = [1e-2, 1e-3, 1e-4, 1e-5]
    clean = jamlab.scaling_collapse(pressures, [[made_up(p, mu, lam, 1.0)] for p in pressures], resamples=0)
    assert (clean.mu, clean.lambda_) == pytest.approx((mu, lam), abs=1e-3)
    assert clean.delta == pytest.approx(mu / lam, abs=0.02) and clean.spread < 1e-3
    noisy = [[made_up(p, mu, lam, 1 + 0.05 * rng.normal()) for _ in range(6)] for p in pressures]
    fit = jamlab.scaling_collapse(pressures, noisy, resamples=20)
    assert abs(fit.mu - mu) < 3 * fit.mu_ci95 < 0.1


def test_impossible_collapses_are_refused(packing):
    s = jamlab.complex_modulus(packing, [1e-3, 1.0])
    with pytest.raises(jamlab.InputError):
        jamlab.scaling_collapse([1e-3], [[s]])
    other = jamlab.complex_modulus(packing, [1e-4, 1.0])
    with pytest.raises(jamlab.InputError):
        jamlab.scaling_collapse([1e-3, 1e-4, 1e-5], [[s], [s], [other]])
    negative = jamlab.results.ComplexModulus(
        s.omega, -s.storage, s.loss, -s.g0, s.eta0, s.eta_inf, s.method, s.error_bound
    )
    with pytest.raises(jamlab.InputError, match="1e-05"):
        jamlab.scaling_collapse([1e-3, 1e-4, 1e-5], [[s], [s], [negative]])


@pytest.mark.parametrize("resamples", [0, 20])
def test_a_collapse_without_critical_regime_keeps_the_other_exponents(resamples):
    """30 p^lambda leaves no frequency below 0.1: Delta is nan, with a warning."""
    rng, pressures = np.random.default_rng(1), [4e-2, 2e-2, 1e-2]
    noisy = [[made_up(p, 0.5, 1.0, 1 + 0.05 * rng.normal()) for _ in range(3)] for p in pressures]
    with pytest.warns(jamlab.JamlabWarning):
        fit = jamlab.scaling_collapse(pressures, noisy, resamples=resamples)
    assert abs(fit.mu - 0.5) < 0.1 and abs(fit.lambda_ - 1) < 0.2 and np.isnan([fit.delta, fit.delta_ci95]).all()
    assert (fit.mu_ci95 > 0) == (fit.lambda_ci95 > 0) == (resamples > 0)
    assert "nan" in str(fit) and fit.plot() is not None


PRESSURES = [1e-4, 1e-3, 1e-2]


@pytest.fixture(scope="module")
def spectra():
    """Three noisy packings at each pressure."""
    rng = np.random.default_rng(3)
    return [[made_up(p, 0.5, 1.0, 1 + 0.05 * rng.normal()) for _ in range(3)] for p in PRESSURES]


@pytest.fixture
def rows(spectra):
    """The same as a campaign has them, in another order."""
    parts = []
    for pressure, group in zip(PRESSURES, spectra, strict=True):
        for seed, s in enumerate(group):
            who = {"task": f"t{seed}", "model": "sp", "n": 64, "seed": seed, "ensemble": "fixed-box", "state": 0}
            who |= {"pressure": pressure * (1 + 1e-7 * seed), "target_pressure": pressure, "damping": "contact"}
            found = {"omega": s.omega, "storage": s.storage, "loss": s.loss, "error_bound": s.error_bound}
            found |= {"g0": s.g0, "eta0": s.eta0, "eta_inf": s.eta_inf, "converged": True, "prestress": False}
            parts.append(pd.DataFrame(who | found))
    return pd.concat(parts[::-1]).sort_values("seed", kind="stable")


def test_a_table_collapses_as_its_spectra_do(rows, spectra):
    by_hand = jamlab.scaling_collapse(PRESSURES, spectra, resamples=5)
    found = jamlab.scaling_collapse(rows, resamples=5)
    assert found.pressure.tolist() == PRESSURES
    for name in ("mu", "lambda_", "delta", "mu_ci95", "lambda_ci95", "delta_ci95", "spread"):
        assert getattr(found, name) == getattr(by_hand, name) and getattr(found, name) > 0
    assert np.array_equal(found.storage, by_hand.storage) and np.array_equal(found.loss, by_hand.loss)


@pytest.mark.parametrize(
    ("column", "value"), [("n", 32), ("ensemble", "shear-stabilized"), ("prestress", True), ("damping", "stokes")]
)
def test_kinds_of_a_table_are_chosen_by_name(rows, column, value):
    wanted = rows[column].iloc[0]
    both = pd.concat([rows, rows.assign(**{column: value, "task": "other", "storage": 1.0})])
    with pytest.raises(jamlab.InputError, match=f"several kinds: {column} = .*select="):
        jamlab.scaling_collapse(both, resamples=0)
    chosen = jamlab.scaling_collapse(both, select={column: wanted}, resamples=0)
    assert chosen.mu == jamlab.scaling_collapse(rows, resamples=0).mu
    with pytest.raises(jamlab.InputError, match=f"no row has {column}"):
        jamlab.scaling_collapse(both, select={column: "none"})


def test_packings_of_a_table_that_did_not_converge_are_left_out(rows, spectra):
    missed = (rows.seed == 1) & (rows.target_pressure == 1e-3)
    bad = rows.assign(converged=~(missed & (rows.omega > 0.1)))
    with pytest.warns(jamlab.JamlabWarning, match=r"left out .* 1 of 9 packings.*1 at 0\.001"):
        found = jamlab.scaling_collapse(bad, resamples=0)
    fewer = [spectra[0], [spectra[1][0], spectra[1][2]], spectra[2]]
    assert found.mu == jamlab.scaling_collapse(PRESSURES, fewer, resamples=0).mu


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (lambda rows: rows[rows.target_pressure > 5e-4], "three pressures or more, got 2: 0.001, 0.01"),
        (lambda rows: rows.assign(target_pressure=np.nan), "no target pressure"),
        (lambda rows: rows.assign(storage=rows.storage * np.where(rows.seed == 2, -1, 1)), "1 of 3 packings"),
        (lambda rows: pd.concat([rows, rows]), "a frequency twice"),
        (lambda rows: pd.concat([rows, rows.assign(task="of another sweep")]), "seed 0 has 2 tasks"),
        (lambda rows: rows[rows.omega < rows.seed + 0.5], "same frequencies"),
        (lambda rows: rows.drop(columns="loss"), "no column 'loss'"),
        (lambda rows: rows[:0], "no rows"),
    ],
)
@pytest.mark.filterwarnings("ignore::jamlab.JamlabWarning")
def test_impossible_tables_are_refused(rows, change, named):
    with pytest.raises(jamlab.InputError, match=named):
        jamlab.scaling_collapse(change(rows), resamples=0)


@pytest.mark.parametrize(
    ("pressures", "named"),
    [
        ([1e-2, 1e-3, np.inf], "0.01, 0.001, inf: must be finite numbers above 0"),
        ([1e-2, 1e-3, 0.0], "must be finite numbers above 0"),
        ([1e-2, 1e-3, 1e-3], "0.01, 0.001, 0.001: give each pressure once"),
        ([1e-3, 1e-3], "got 2: 0.001, 0.001"),
        ([], "got 0"),
    ],
)
def test_impossible_pressures_are_refused(spectra, pressures, named):
    with pytest.raises(jamlab.InputError, match=named):
        jamlab.scaling_collapse(pressures, spectra[: len(pressures)], resamples=0)


@pytest.mark.parametrize(("name", "values"), [("unit", ("k", "eps")), ("direction", ("pure", "simple"))])
def test_spectra_of_two_units_or_directions_do_not_collapse(spectra, name, values):
    two = [[dataclasses.replace(each, **{name: values[k > 0]}) for each in group] for k, group in enumerate(spectra)]
    with pytest.raises(jamlab.InputError, match=f"spectra of one {name}, got {', '.join(values)}"):
        jamlab.scaling_collapse(PRESSURES, two, resamples=0)


def test_what_a_table_has_is_not_given_twice(rows, spectra):
    for pressures, how in (
        (rows, {"spectra": spectra}),
        (PRESSURES, {}),
        (PRESSURES, {"spectra": spectra, "select": {"n": 1}}),
    ):
        with pytest.raises(jamlab.InputError, match="spectra"):
            jamlab.scaling_collapse(pressures, **how)


def test_a_table_has_the_means_of_its_spectra(rows, spectra):
    """A mean for each pressure, with the drag law of its rows."""
    found = jamlab.mean_spectra(rows.assign(beta=0.5))
    assert [mean.kind for mean in found] == ["disks, p = 0.0001", "disks, p = 0.001", "disks, p = 0.01"]
    assert found.damping == ContactDamping(beta=0.5)
    for mean, group in zip(found, spectra, strict=True):
        values = np.array([s.loss for s in group])
        assert mean.loss == pytest.approx(values.mean(axis=0), rel=1e-14) and len(mean.spectra) == 3
        assert mean.loss_stderr == pytest.approx(values.std(axis=0, ddof=1) / 3**0.5, rel=1e-12)
        assert mean.packings["g0"].tolist() == [s.g0 for s in group] and mean.packings["g"].isna().all()
    stokes = jamlab.mean_spectra(rows.assign(damping="stokes", beta=np.nan, eta_f=2.0))
    assert stokes.damping == StokesDrag(eta_f=2.0) and stokes.plot() is not None


def test_impossible_means_of_spectra_are_refused(rows, packing):
    for given, how, named in (
        (rows, {"omega": [1.0]}, "a campaign has its spectra"),
        (rows, {"prestress": False}, "a campaign has its spectra"),
        (packing, {}, "omega is missing"),
        (packing, {"omega": [1.0], "select": {"n": 1}}, "select"),
    ):
        with pytest.raises(jamlab.InputError, match=named):
            jamlab.mean_spectra(given, **how)
