"""LAMMPS and compiled code evaluate the law of the analysis, and one that evaluates another is refused."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from laws_of_others import Wca

import jamlab
from jamlab.engine import agreement, disk_fire
from jamlab.laws.pair_law import PairStyle
from jamlab.laws.power import PowerLaw
from jamlab.laws.rim import RimLaw
from jamlab.laws.sticky import StickyLaw
from jamlab.mechanics.stiffness import energy_terms, forces, stress
from jamlab.models.droplets import Droplets


@pytest.fixture(autouse=True)
def nothing_is_compared():
    """No carrier has been compared before a test, and none that a test changed counts as compared behind it."""
    agreement.forget()
    yield
    agreement.forget()


def squeezed(units="eps", sizes=None, **law):
    """Disks that overlap, at rest by another law."""
    p = jamlab.pack(16 if sizes is None else len(sizes), phi=0.95, seed=1, sizes=sizes)
    return jamlab.Packing("sp", p.box, p.positions, {units: 1.3, **law}, units, p.diameters)


def plain(p, energy, force):
    """Energy, forces and stress pair by pair; `energy`, `force` of a pair at s and r, of strength 1."""
    total, found, work = 0.0, np.zeros((p.n, 2)), np.zeros((2, 2))
    for i, j, m, n in product(range(p.n), range(p.n), (-1, 0, 1), (-1, 0, 1)):
        r = p.positions[j] - p.positions[i] + np.array([m, n]) @ p.box
        s, d = (p.diameters[i] + p.diameters[j]) / 2, np.hypot(*r)
        if 0 < d < s:
            eps = p.params["eps"] if p.units == "eps" else p.params["k"] * s**2
            total, push = total + 0.5 * eps * energy(s, d), eps * force(s, d)
            found[i] -= push * r / d
            work += 0.5 * push / d * np.outer(r, r)
    return total, found, work / p.area


def of_wca(s, r):
    """4 e [(sigma/r)^12 - (sigma/r)^6] + e with the minimum 2^(1/6) sigma at s, as the paper has it."""
    return 4 * ((s / 2 ** (1 / 6) / r) ** 12 - (s / 2 ** (1 / 6) / r) ** 6) + 1


def push_of_wca(s, r):
    """The force that goes with it."""
    sigma = s / 2 ** (1 / 6)
    return (48 * (sigma / r) ** 12 - 24 * (sigma / r) ** 6) / r


@pytest.mark.parametrize(
    ("units", "sizes"),
    [("eps", None), ("k", None), pytest.param("k", np.linspace(0.8, 1.3, 70), marks=pytest.mark.slow)],
    ids=["eps", "k", "70 sizes"],
)
def test_lammps_and_numpy_evaluate_wca_as_plain_loops_do(units, sizes):
    p = squeezed(units, sizes, law="wca_here")
    energy, force, work = plain(p, of_wca, push_of_wca)
    e = jamlab.evaluate(p)
    np.testing.assert_allclose([e.energy, sum(t.energy.sum() for t in energy_terms(p))], energy, rtol=1e-12)
    for found in (e.forces, forces(p)):
        np.testing.assert_allclose(found, force, rtol=0, atol=1e-12 * np.abs(push_of_wca(1.0, 0.9)))
    for found in (e.stress, stress(p)):
        np.testing.assert_allclose(found, work, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("form", ["square", "cube"])
def test_a_text_chooses_the_pair_style(form):
    p = squeezed(law="ramp", form=form, weight=0.7)
    power = {"square": 2, "cube": 3}[form]
    energy, force, _ = plain(
        p, lambda s, r: 0.7 * (1 - r / s) ** power, lambda s, r: 0.7 * power * (1 - r / s) ** (power - 1) / s
    )
    e = jamlab.evaluate(p)
    assert e.energy == pytest.approx(energy, rel=1e-12)
    np.testing.assert_allclose(e.forces, force, rtol=0, atol=1e-12)


def test_protocols_take_a_law_of_others():
    p = jamlab.pack(16, 0.5, seed=1, law="wca_here", ensemble="shear-stabilized")
    assert p.units == "k" and p.converged and jamlab.evaluate(p).pressure == pytest.approx(0.5, rel=1e-6)
    assert p.provenance["pressure"] == pytest.approx(0.5, rel=1e-6)
    assert jamlab.shear_modulus(p, "finite-strain") == pytest.approx(jamlab.shear_modulus(p), rel=1e-6)
    low = jamlab.decompress(p, 1e-2)
    assert jamlab.evaluate(low).pressure == pytest.approx(1e-2, rel=1e-6) and low.phi < p.phi
    assert jamlab.evaluate(jamlab.relax(low)).max_force < 1e-10
    ramp = jamlab.pack(16, 1e-3, seed=1, law={"law": "ramp", "weight": 0.7})
    assert ramp.units == "eps" and jamlab.evaluate(ramp).pressure == pytest.approx(1e-3, rel=1e-6)


@pytest.mark.slow
def test_onset_and_compression_of_a_law_of_others():
    onset = jamlab.jam(16, seed=5, law="wca_here")
    assert onset.converged and jamlab.contacts(onset).n_contacts == jamlab.contacts(onset).isostatic
    states = list(jamlab.compress(onset, to=onset.phi + 0.03, step=0.015))
    pressures = [jamlab.evaluate(state).pressure for state in states]
    assert all(state.converged for state in states) and np.all(np.diff(pressures) > 0)
    bulk = (pressures[-1] - pressures[-2]) / np.log(states[-1].phi / states[-2].phi)
    assert bulk == pytest.approx(jamlab.bulk_modulus(states[-1]), rel=0.3)


@pytest.mark.parametrize("law", [{"law": "wca_here"}, {}], ids=["wca_here", "springs"])
def test_rough_walls(law):
    walled = jamlab.with_walls(jamlab.pack(36, phi=0.9, seed=1, law=law), 1.5)
    moved = walled.with_state(positions=walled.positions + 1e-3 * np.sin(7 * walled.positions))
    np.testing.assert_allclose(jamlab.evaluate(moved).forces, forces(moved), rtol=0, atol=1e-11)


# a user's own pair style in a session -------------------------------------------------------------------------------


def hertz(session, sizes):
    session.command("pair_style lepton 1.5")
    for (i, a), (j, b) in product(enumerate(sizes, 1), repeat=2):
        if i <= j:
            session.command(f'pair_coeff {i} {j} "0.4*(1-r/{(a + b) / 2:.17g})^2.5" {(a + b) / 2:.17g}')


def test_a_pair_style_of_ones_own_is_minimised_by_lammps():
    p = jamlab.pack(n=32, pressure=1e-2, seed=1)
    with jamlab.Session(p) as session:
        hertz(session, np.unique(p.diameters))
        found = session.minimize(1e-9, minimizer="fire", steps=20_000)
        q = session.packing()
        assert found.max_force <= 1e-9 and session.evaluate().max_force <= 1e-9
        with pytest.raises(jamlab.InputError, match="without your commands that change forces"):
            session.load(jamlab.pack(n=16, pressure=1e-2, seed=1))
    assert np.abs(q.positions - p.positions).max() > 1e-3
    by_law = jamlab.Packing("sp", q.box, q.positions, {"eps": 1.0, "exponent": 2.5}, "eps", q.diameters)
    assert jamlab.evaluate(by_law).max_force < 1e-9


def test_a_pair_style_that_is_the_law_keeps_the_compiled_loop():
    p = jamlab.pack(n=32, phi=0.9, seed=1)
    moved = p.with_state(positions=p.positions + 1e-2 * np.sin(7 * p.positions))
    with jamlab.Session(moved) as session:
        session.command("pair_style harmonic/cut")
        for (i, a), (j, b) in product(enumerate(np.unique(p.diameters), 1), repeat=2):
            if i <= j:
                session.command(f"pair_coeff {i} {j} 0.5 {(a + b) / 2:.17g}")
        session.minimize(1e-8, minimizer="fire", steps=20_000)
        assert session._steps_elsewhere > 0  # not taken by LAMMPS


# mutants: one carrier evaluates another law --------------------------------------------------------------------------


def arguments_times(factor, place):
    """The arguments of the kernel, one of them changed."""

    def changed(self):
        given = list(KERNEL(self))
        given[place] = given[place] * factor if place != 1 else 1 - given[place]
        return tuple(given)

    return changed


KERNEL, DECK, STICKY_DECK = PowerLaw.kernel_arguments, PowerLaw.lammps_variables, StickyLaw.lammps_variables
STICKY_CALL = StickyLaw.__call__
POWER_CALL, RIM_CALL, WCA_CALL = PowerLaw.__call__, RimLaw.__call__, Wca.__call__
DROPLETS_DECK = Droplets.lammps_variables


def energies(call, of_energy=1.0, of_force=1.0, reach=1.0):
    def changed(self, contact, distance):
        u, du, ddu = call(self, contact * reach, distance)
        return of_energy * u, of_force * du, of_force * ddu

    return changed


def styled(*coefficients, modify="shift yes", style="lj/cut 1.0"):
    return (Wca, "pair_style", PairStyle(style, coefficients, modify))


MUTANTS = {
    # pair style of a law: prefactor, sign, distance, cutoff, shift of the energy, exponents
    "style: prefactor": ("wca_here", styled("v_eps*(1+1e-6)", "v_s/2^(1/6)", "v_s")),
    "style: sign": ("wca_here", styled("-v_eps", "v_s/2^(1/6)", "v_s")),
    "style: distance": ("wca_here", styled("v_eps", "v_s", "v_s")),
    "style: cutoff, longer": ("wca_here", styled("v_eps", "v_s/2^(1/6)", "1.2*v_s")),
    "style: cutoff, shorter": ("wca_here", styled("v_eps", "v_s/2^(1/6)", "0.98*v_s")),
    "style: no shift": ("wca_here", styled("v_eps", "v_s/2^(1/6)", "v_s", modify="")),
    "style: exponents": ("wca_here", styled("v_eps", "v_s/2^(1/6)", "v_s", style="lj96/cut 1.0")),
    # part of the decks: prefactor, exponent, units, sign, width of the shell
    "deck: prefactor": ("power", (PowerLaw, "lammps_variables", lambda law: DECK(law) | {"k": 1.3 * (1 + 1e-6)})),
    "deck: exponent": ("hertz", (PowerLaw, "lammps_variables", lambda law: DECK(law) | {"exponent": 2.5 + 1e-6})),
    "deck: units": ("power", (PowerLaw, "lammps_variables", lambda law: DECK(law) | {"units": "eps", "eps": 1.3})),
    "deck: sign": ("power", (PowerLaw, "lammps_variables", lambda law: DECK(law) | {"k": -1.3})),
    "deck: shell": (
        "sticky",
        (StickyLaw, "lammps_variables", lambda law: STICKY_DECK(law) | {"shell": 1.01 * law.shell}),
    ),
    # kernel: prefactor, units, exponent, sign
    "kernel: prefactor": ("kernel", (PowerLaw, "kernel_arguments", arguments_times(1 + 1e-6, 0))),
    "kernel: units": ("kernel", (PowerLaw, "kernel_arguments", arguments_times(None, 1))),
    "kernel: exponent": ("kernel", (PowerLaw, "kernel_arguments", arguments_times(1 + 1e-6, 2))),
    "kernel: sign": ("kernel", (PowerLaw, "kernel_arguments", arguments_times(-1, 0))),
    # analysis: energy alone, force alone, both, exponent, sign, cutoff
    "analysis: energy": ("power", (PowerLaw, "__call__", energies(POWER_CALL, 1 + 1e-6, 1))),
    "analysis: force": ("power", (PowerLaw, "__call__", energies(POWER_CALL, 1, 1 + 1e-6))),
    "analysis: both": ("wca_here", (Wca, "__call__", energies(WCA_CALL, 1 - 1e-6, 1 - 1e-6))),
    "analysis: sign": ("power", (PowerLaw, "__call__", energies(POWER_CALL, 1, -1))),
    "analysis: exponent": (
        "hertz",
        (PowerLaw, "__call__", lambda law, s, r: POWER_CALL(replace(law, exponent=2.6), s, r)),
    ),
    "analysis: reach": ("wca_here", (Wca, "range", 0.3)),
    # droplets
    "rims: prefactor": (
        "droplets",
        (Droplets, "lammps_variables", lambda m, p: DROPLETS_DECK(m, p) | {"eps": 1 + 1e-6}),
    ),
    "rims: width": ("droplets", (Droplets, "lammps_variables", lambda m, p: DROPLETS_DECK(m, p) | {"delta": 0.2499})),
    "rims: form": (
        "droplets",
        (Droplets, "lammps_variables", lambda m, p: DROPLETS_DECK(m, p) | {"contact": "segment/smooth"}),
    ),
    "rims: tension": (
        "droplets",
        (Droplets, "lammps_variables", lambda m, p: DROPLETS_DECK(m, p) | {"gamma": 0.4 * (1 + 1e-6)}),
    ),
    "rims: analysis": ("droplets", (RimLaw, "__call__", energies(RIM_CALL, 1, 1 + 1e-6))),
}


@pytest.fixture(scope="module")
def states():
    onset = jamlab.jam(6, "dp", seed=1)
    droplets = next(p for p in jamlab.compress(onset, onset.phi + 0.06, step=0.06) if p.phi > onset.phi + 0.05)
    return {
        "power": squeezed("k"),
        "kernel": squeezed("k", np.linspace(0.9, 1.1, 40), exponent=2.5),
        "hertz": squeezed("k", exponent=2.5),
        "sticky": squeezed("k", stickiness=0.03),
        "wca_here": squeezed(law="wca_here"),
        "droplets": droplets,
    }


def run(name, packing):
    if name != "kernel":
        jamlab.evaluate(packing)
        return
    with jamlab.Session(packing) as session:
        session.minimize(1e-6, minimizer="fire", steps=200)


@pytest.mark.parametrize("name", MUTANTS)
def test_no_mutant_passes(states, monkeypatch, name):
    of, (owner, attribute, changed) = MUTANTS[name]
    packing = states[of].with_state(positions=states[of].positions.copy())  # with nothing computed of it
    run(of, packing)
    agreement.forget()
    monkeypatch.setattr(owner, attribute, changed)
    with pytest.raises(jamlab.JamlabError) as caught:
        run(of, packing.with_state(positions=packing.positions.copy()))
    carrier = "kernel" if of == "kernel" else "deck"
    said = str(caught.value)
    other = f"the {carrier}" in said and "evaluates another law than the analysis" in said
    assert other or (name.startswith("analysis") and "check the derivatives of" in said)


def test_a_state_without_contacts_proves_nothing(monkeypatch):
    loose, tight = jamlab.pack(16, phi=0.3, seed=1), squeezed("k")
    loose = loose.with_state(params=tight.params)
    monkeypatch.setattr(PowerLaw, "lammps_variables", lambda law: DECK(law) | {"k": 2.0})
    jamlab.evaluate(loose)
    with pytest.raises(jamlab.EngineError, match="energy"):
        jamlab.evaluate(tight)


def two_disks(sizes=(5 / 6, 7 / 6), overlap=0.05, **law):
    """Two disks that meet once, at a distance of contact of 1."""
    at = np.array([[1.0, 1.0], [2.0 - overlap, 1.0]])
    return jamlab.Packing("sp", 5 * np.eye(2), at, {"k": 1.3, **law}, "k", np.array(sizes))


@pytest.mark.parametrize("sizes", [(1.0, 1.0), (5 / 6, 7 / 6)], ids=["one size", "two sizes"])
def test_sizes_that_did_not_meet_are_compared_where_they_do(monkeypatch, sizes):
    """Of a contact at 1 no power of the distance of contact is wrong."""
    monkeypatch.setattr(
        Wca, "pair_style", PairStyle("lj/cut 1.0", ("v_eps*v_s^0.01", "v_s/2^(1/6)", "v_s"), "shift yes")
    )
    jamlab.evaluate(two_disks(sizes, law="wca_here"))
    with pytest.raises(jamlab.EngineError, match="evaluates another law"):
        jamlab.evaluate(squeezed("k", law="wca_here"))


def test_pulls_are_compared_where_disks_only_pushed(monkeypatch):
    def steeper(self, contact, distance):
        found, far = STICKY_CALL(self, contact, distance), contact - distance < -self.shell
        return tuple(np.where(far, 1.001 * each, each) for each in found)

    pushing, all_sizes = two_disks(stickiness=0.03), squeezed("k", stickiness=0.03)
    monkeypatch.setattr(StickyLaw, "__call__", steeper)
    jamlab.evaluate(pushing)
    with pytest.raises(jamlab.EngineError, match="evaluates another law"):
        jamlab.evaluate(all_sizes)


@pytest.mark.parametrize("of", ["power", "hertz", "sticky", "wca_here", "droplets"])
def test_a_stiffness_that_is_no_derivative_is_refused(states, monkeypatch, of):
    """No carrier has it, but moduli are made of it."""
    law = type(states[of].law)
    kept = law.__call__

    def stiffer(self, contact, distance):
        *others, stiffness = kept(self, contact, distance)
        return *others, (1 + 3e-6) * stiffness

    jamlab.evaluate(states[of])
    agreement.forget()
    monkeypatch.setattr(law, "__call__", stiffer)
    with pytest.raises(jamlab.InputError, match=r"its U'' is .*, but U' changes with r by .* check the derivatives"):
        jamlab.evaluate(states[of].with_state(positions=states[of].positions.copy()))


def test_a_weak_state_does_not_stand_for_strong_ones(monkeypatch):
    """Overlaps of 1e-8 tell six digits of a law."""
    weak = jamlab.pack(16, 1e-8, seed=1)
    agreement.forget()
    monkeypatch.setattr(PowerLaw, "lammps_variables", lambda law: DECK(law) | {"k": 1 + 3e-7})
    jamlab.evaluate(weak)
    with pytest.raises(jamlab.EngineError, match="evaluates another law"):
        jamlab.evaluate(weak.with_state(positions=weak.positions + 1e-2 * np.sin(7 * weak.positions)))


def test_a_law_that_softens_at_contact_is_refused_by_name(monkeypatch):
    monkeypatch.setattr(Wca, "__call__", energies(WCA_CALL, 1, -1))
    with pytest.raises(jamlab.InputError, match=r"its U' is .* check the derivatives of WcaLaw"):
        jamlab.relax(squeezed(law="wca_here"))


@pytest.mark.parametrize("tilt", [-0.9, 0.4])
def test_rounding_in_any_view_is_no_other_law(tilt):
    """A tilted box, and positions many boxes away."""
    p = squeezed("k")
    box = p.box + np.array([[0, 0], [tilt * p.box[0, 0], 0]])
    for far in (0, 300):
        jamlab.evaluate(p.with_state(box=box, positions=p.positions + far * box[1]))
        agreement.forget()


def test_each_law_is_compared_once():
    states = [squeezed("k"), squeezed("k", exponent=2.5), squeezed(law="wca_here")]
    agreement.forget()
    for packing in states:
        jamlab.evaluate(packing)
        jamlab.evaluate(packing)
    assert sum(known.agrees for known in agreement._known.values()) == 3


def test_forces_of_the_kernel_are_the_moves_of_its_first_step():
    p = squeezed("k", np.append(np.full(160, 0.8), [2.2, 2.4]), exponent=2.5)  # two heavy ones
    np.testing.assert_allclose(disk_fire.fire_forces(p), forces(p), rtol=0, atol=1e-13)


def test_a_coefficient_that_is_no_number_is_refused():
    with pytest.raises(jamlab.InputError, match=r"coefficient '0\.5\*\(r-v_s\)\^2' contains the distance r"):
        PairStyle("lepton 2.0", ("0.5*(r-v_s)^2", "v_s"))
    PairStyle("lepton 2.0", ("0.5*(r-$(v_s:%.17g))^2", "v_s"))
