"""Drag laws say of themselves what others need to know, and know nothing of how a packing is turned."""

from pathlib import Path

import numpy as np
import pytest

import jamlab
from jamlab import ContactDamping
from jamlab.mechanics.force_network import force_network
from jamlab.rheology.drag_law import contact_velocities, law_of_record, slips

LAWS = (
    jamlab.ContactDamping(beta=0.3, tau=2.0, alpha=0.5, lever_arms="contact"),
    jamlab.ContactDamping(),
    jamlab.StokesDrag(eta_f=0.5, tau=3.0),
)


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_a_record_is_read_back_as_the_same_law(law):
    assert law_of_record(law.record()) == law and law.record()["law"] == type(law).__name__


@pytest.mark.parametrize("arms", ["radius", "contact", "none"])
@pytest.mark.parametrize("model", ["sp", "dp"])
def test_slips_are_those_of_the_sparse_matrices(model, arms):
    packing = jamlab.jam(8, model, 1)
    approach, slide, stiffness = contact_velocities(packing, "simple", arms)
    rates = np.random.default_rng(1).standard_normal(approach.shape[1])
    found = slips(packing, rates, arms)
    np.testing.assert_allclose(found[0], approach @ rates, atol=1e-12)
    np.testing.assert_allclose(found[1], slide @ rates, atol=1e-11)
    np.testing.assert_array_equal(found[2], stiffness)


def test_linear_laws_keep_all_but_the_exponent():
    assert LAWS[0].linear() == jamlab.ContactDamping(beta=0.3, tau=2.0, lever_arms="contact")
    assert LAWS[2].linear() is LAWS[2] and LAWS[2].alpha == 1.0


def test_nonlinear_modulus_at_a_strain_is_that_at_its_stress():
    packing = jamlab.pack(32, 1e-2, 1)
    film = jamlab.ContactDamping(beta=0.5, tau=2.0, alpha=0.5)
    found = jamlab.nonlinear_modulus(packing, [0.3], film, amplitude=1e-3)
    stress = 1e-3 * float(np.hypot(found.storage[0], found.loss[0]))
    same = jamlab.nonlinear_modulus(packing, [0.3], film, stress=stress)
    assert same.tau == pytest.approx(found.tau, rel=1e-3) and same.loss == pytest.approx(found.loss, rel=1e-3)


@pytest.mark.parametrize("given", [{}, {"stress": 1e-5, "amplitude": 1e-3}, {"damping": LAWS[0]}])
def test_two_amplitudes_or_none_are_refused(given):
    packing = jamlab.pack(8, 1e-2, 1)
    with pytest.raises(jamlab.InputError):
        jamlab.nonlinear_modulus(packing, [1.0], **given)
    for amplitude in (0.0, -1.0, np.nan):
        with pytest.raises(jamlab.InputError, match="amplitude"):
            jamlab.nonlinear_modulus(packing, [1.0], amplitude=amplitude)


def test_time_of_a_film_is_measured_in_its_own_tau():
    packing = jamlab.pack(32, 1e-2, 1)
    slow, fast = (jamlab.ContactDamping(tau=tau, alpha=0.5) for tau in (2.0, 1.0))
    found = jamlab.nonlinear_modulus(packing, [0.3], slow, amplitude=1e-3)
    same = jamlab.nonlinear_modulus(packing, [0.6], fast, amplitude=1e-3)
    assert found.storage == pytest.approx(same.storage, rel=1e-6) and found.tau == pytest.approx(same.tau, rel=1e-6)


@pytest.mark.parametrize("arms", ["radius", "contact"])
def test_disks_whose_loops_are_all_even_turn_like_gears(arms):
    """No drag resists that, and none drives it: G* is that of the pseudo-inverse, whatever rounding does."""
    omega, law = np.array([1e-3, 1.0, 1e3]), jamlab.ContactDamping(lever_arms=arms)
    for seed in (2, 5, 11):
        packing = jamlab.pack(2, 1e-2, seed)
        k, b = (m.toarray() for m in jamlab.dynamical_matrices(packing, law))
        assert len(law.gears(packing)) == 1
        m = k + 1j * omega[:, None, None] * b
        inner = np.linalg.pinv(m[:, :-1, :-1], rcond=1e-10)
        expected = (m[:, -1, -1] - np.einsum("fi,fij,fj->f", m[:, -1, :-1], inner, m[:, :-1, -1])) / packing.area
        for method in ("dense", "direct", "reduced"):
            found = jamlab.complex_modulus(packing, omega, law, method=method)
            assert found.storage + 1j * found.loss == pytest.approx(expected, rel=1e-9)


def test_odd_loops_hold_gears():
    bare = jamlab.remove_rattlers(jamlab.pack(32, 1e-2, 1))
    assert jamlab.ContactDamping().gears(bare) == []


LAW = ContactDamping(beta=50.0, lever_arms="contact")


def pair_of_disks():
    """Two that overlap, in a box so wide that they meet no image."""
    places = np.array([[3.0, 3.0], [3.7, 3.5]])
    return jamlab.Packing("sp", 10 * np.eye(2), places, {"k": 1.7}, "k", np.array([0.8, 1.1]))


def pair_of_droplets(contact, slide):
    """Two polygons whose flats face each other: vertices meet edges, and corners at the ends."""
    turn = 2 * np.pi * (np.arange(7) + 0.5) / 7  # a flat to the right
    ring = np.column_stack([np.cos(turn), np.sin(turn)])
    gap = 2 * np.cos(np.pi / 7) + 0.1
    places = np.concatenate([ring, [gap, slide] - ring]) + 5.0
    law = {"gamma": 0.1, "ka": 1.0, "eps": 1.3, "delta": 0.3, "eta": 0.0, "contact": contact, "a0": [2.7, 2.7]}
    return jamlab.Packing("dp", 15 * np.eye(2), places, law, offsets=[0, 7, 14])


PAIRS = {"disks": pair_of_disks()} | {
    f"{form} {slide}": pair_of_droplets(form, slide)
    for form in ("outline", "segment", "segment/smooth")
    for slide in (0.0, 0.33)
}


def rigid_rotation(packing):
    """Rates of all coordinates in a rotation about a point outside."""
    x = packing.positions - [0.3, -0.7]
    spins = np.ones(packing.n if packing.model == "sp" else 0)
    return np.concatenate([np.column_stack([-x[:, 1], x[:, 0]]).ravel(), spins, [0.0]])


@pytest.mark.parametrize("packing", PAIRS.values(), ids=PAIRS.keys())
def test_a_pair_that_rotates_dissipates_nothing(packing):
    """While the same pair sheared does, and disks with the radii of the paper for arms do in a rotation."""
    drag = LAW.matrix(packing, packing, "simple")
    rates = rigid_rotation(packing)
    shear = np.eye(len(rates))[-1]
    assert np.abs(drag @ rates).max() < 1e-13 * abs(drag).max()
    assert shear @ drag @ shear > 1e-3
    if packing.model == "sp":
        printed = ContactDamping().matrix(packing, packing, "simple")
        assert rates @ printed @ rates > 1e-3


@pytest.mark.parametrize("packing", PAIRS.values(), ids=PAIRS.keys())
def test_shear_along_x_and_along_y_differ_by_a_rotation(packing):
    """So that the drag of x -> x + gamma y is that of y -> y + gamma x in disks that rotate with the difference."""
    drag = LAW.matrix(packing, packing, "simple")
    sheared = np.zeros(drag.shape[0])
    sheared[2 * len(packing.positions) : -1] = 1.0
    sheared[1 : 2 * len(packing.positions) : 2] = packing.positions[:, 0]
    np.testing.assert_allclose(drag @ np.eye(len(sheared))[-1], drag @ sheared, rtol=0, atol=1e-13 * abs(drag).max())


DRAG = jamlab.StokesDrag(eta_f=0.3, tau=2.0)


def last(states):
    return list(states)[-1]


WITH_RATTLERS = {
    "bidisperse": lambda: jamlab.jam(64, "sp", 2),
    "k": lambda: jamlab.pack(n=32, pressure=1e-3, seed=3),
    "ratio 3": lambda: last(jamlab.compress(jamlab.jam(16, "sp", 1, size_ratio=3.0), to=0.9, step=0.03)),
    "uniform, Hertz": lambda: last(
        jamlab.compress(
            jamlab.jam(16, "sp", 2, sizes="uniform:0.3", law={"exponent": 2.5}), to=0.88, step=0.03, by="phi"
        )
    ),
    "droplets": lambda: jamlab.read(Path(__file__).parents[1] / "states" / "droplets_at_onset.h5"),
}


def modulus_of_disks(p, omega, touching):
    """G* under `DRAG` from dense matrices of all disks, contact by contact; rattlers are taken out at the end."""
    p = p.with_state(positions=p.positions - np.floor(p.positions @ np.linalg.inv(p.box)) @ p.box)
    found, held, alpha = list(touching(p)), np.ones(p.n, dtype=bool), p.params.get("exponent", 2.0)
    for _ in range(p.n):
        found = [(i, j, r) for i, j, r in found if held[i] and held[j]]
        held = np.bincount([end for pair in found for end in pair[:2]], minlength=p.n) >= 3
    drag = p.params["k"] if p.units == "k" else p.params["eps"] / np.mean(p.diameters) ** 2
    k, b = np.zeros((2, 2 * p.n + 1, 2 * p.n + 1))
    for i, j, r in found:
        s, distance = p.diameters[[i, j]].mean(), np.hypot(*r)
        soft = (p.params["k"] if p.units == "k" else p.params["eps"] / s**2) * (1 - distance / s) ** (alpha - 2)
        along = np.outer(r, r) / distance**2
        block = (alpha - 1) * soft * along - soft * (s - distance) / distance * (np.eye(2) - along)
        rows = np.zeros((2, 2 * p.n + 1))
        rows[:, 2 * i : 2 * i + 2], rows[:, 2 * j : 2 * j + 2], rows[0, -1] = -np.eye(2), np.eye(2), r[1]
        k += rows.T @ block @ rows
    b += drag * DRAG.tau * np.diag([*np.ones(2 * p.n), DRAG.eta_f / DRAG.tau * p.area])
    return eliminated(k, b, np.append(np.repeat(held, 2), True), omega) / p.area, held


def modulus_of_droplets(p, omega):
    """The same of droplets; those that rattle are deformed by the fluid, and remain."""
    drag = p.params["eps"] / np.mean(p.params["a0"] ** 0.5) ** 2 * DRAG.tau
    k = jamlab.dynamical_matrices(p)[0].toarray()
    share = 1 / np.repeat(np.diff(p.offsets), 2 * np.diff(p.offsets))
    b = drag * np.diag([*share, DRAG.eta_f / DRAG.tau * p.area])
    return eliminated(k, b, np.ones(len(k), dtype=bool), omega) / p.area, force_network(p).held


def eliminated(k, b, kept, omega):
    m = (k + 1j * np.array(omega)[:, None, None] * b)[:, kept][:, :, kept]
    return m[:, -1, -1] - np.einsum("fi,fi->f", m[:, -1, :-1], np.linalg.solve(m[:, :-1, :-1], m[:, :-1, [-1]])[..., 0])


@pytest.fixture(scope="module", params=WITH_RATTLERS)
def with_rattlers(request):
    return WITH_RATTLERS[request.param]()


@pytest.mark.parametrize("method", ["dense", "direct", "reduced"])
@pytest.mark.slow
def test_drag_on_the_backbone_is_that_of_the_whole_packing(with_rattlers, method, touching):
    """The unit of drag is the mean size of all particles; those that bear load are larger than the rattlers."""
    p, omega = with_rattlers, [1e-4, 1e-2, 0.3, 10.0]
    wanted, held = modulus_of_disks(p, omega, touching) if p.model == "sp" else modulus_of_droplets(p, omega)
    assert not held.all()
    found = jamlab.complex_modulus(p, omega, DRAG, method=method)
    assert np.abs((found.storage + 1j * found.loss) / wanted - 1).max() < 1e-9
    if method != "direct":
        assert found.spectrum.modulus(found.omega) == pytest.approx(wanted, rel=1e-9)
        assert found.spectrum.eta0 == pytest.approx(found.eta0, rel=1e-6)


def test_the_message_about_alpha_has_the_films_the_right_way_round():
    """Bubbles that slip on mobile films F ~ v^(2/3), on rigid ones v^(1/2) (Le Merrer et al. 2015)."""
    with pytest.raises(jamlab.InputError) as caught:
        jamlab.ContactDamping(alpha=2)
    words = str(caught.value)
    assert "with mobile surfactants have 2/3" in words and "with immobile surfactants 1/2" in words
