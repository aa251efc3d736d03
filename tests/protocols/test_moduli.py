"""Elastic moduli and G*(omega) against finite strain, closed forms, limits, finite differences and plain loops."""

from pathlib import Path

import numpy as np
import pytest

import jamlab
from jamlab import ContactDamping, StokesDrag
from jamlab.geometry.contact_network import without_rattlers
from jamlab.mechanics.elasticity import elastic_tensor
from jamlab.packing.deformation import sheared

ANGLES = np.linspace(0, np.pi, 36, endpoint=False)
STATES = Path(__file__).with_name("states")


@pytest.fixture(scope="module")
def packings():
    """Three packings of disks, of both force laws and from near onset to deep compression."""
    *_, eps = jamlab.compress(jamlab.jam(model="sp", n=32, seed=2), to=0.90, step=0.05, by="phi")
    return {
        "near": jamlab.pack(n=32, pressure=1e-4, seed=3),
        "deep": jamlab.pack(n=32, pressure=3e-2, seed=4),
        "eps": eps,
    }


@pytest.fixture(params=["near", "deep", "eps"])
def packing(packings, request):
    return packings[request.param]


@pytest.fixture
def network(packing):
    """The packing without rattlers."""
    return without_rattlers(packing)


def crystal(pressed):
    """Hexagonal crystal of unit disks, 4 x 6, at distance 1 - pressed; and that distance."""
    a = 1 - pressed
    i, j = np.divmod(np.arange(24), 6)
    x = np.column_stack([i + 0.5 * (j % 2), np.sqrt(0.75) * j])
    box = np.diag([4.0, 6 * np.sqrt(0.75)])
    return jamlab.Packing("sp", a * box, a * x, {"k": 2.0}, "k", np.ones(24)), a


# static moduli --------------------------------------------------------------------------------------------------------


def test_linear_response_equals_finite_strain(packing):
    """The analytic Hessian against LAMMPS stresses after shear and minimisation."""
    linear = jamlab.shear_modulus(packing)
    assert jamlab.shear_modulus(packing, method="finite-strain") == pytest.approx(linear, rel=1e-4)


def test_linear_response_equals_finite_strain_for_droplets(dp_dense):
    """Perimeter, area and contact terms at once."""
    linear = jamlab.shear_modulus(dp_dense)
    assert jamlab.shear_modulus(dp_dense, method="finite-strain") == pytest.approx(linear, rel=1e-4)


def test_relaxation_can_only_soften(packing, dp_dense):
    """The affine modulus is an upper bound in every direction. Relaxed ones may be negative: the box is held."""
    for p in (packing, dp_dense):
        for angle in ANGLES[::6]:
            relaxed, affine = (jamlab.shear_modulus(p, m, angle=angle) for m in ("linear-response", "affine"))
            assert relaxed <= affine
        assert jamlab.shear_modulus(p, average=True) < 0.9 * jamlab.shear_modulus(p, "affine", average=True)


@pytest.mark.parametrize("pressed", [1e-6, 0.05])
def test_hexagonal_crystal(pressed):
    """G = (sqrt(3)/4)(k - 3 f/a): U'' and U' of three bonds per disk; nothing to relax, every direction alike."""
    p, a = crystal(pressed)
    wanted = np.sqrt(3) / 4 * (2.0 - 3 * 2.0 * pressed / a)
    for angle in (0.0, 0.3, 1.0):
        assert jamlab.shear_modulus(p, "affine", angle=angle) == pytest.approx(wanted, rel=1e-9)
        assert jamlab.shear_modulus(p, angle=angle) == pytest.approx(wanted, rel=1e-9)
    pressure = np.sqrt(3) * 2.0 * pressed / a  # (1/2A) sum f r: three bonds per disk of area sqrt(3)/2 a^2
    assert jamlab.evaluate(p).pressure == pytest.approx(pressure, rel=1e-9)


@pytest.mark.parametrize("method", ["linear-response", "affine"])
def test_average_is_the_mean_over_angles(packing, method):
    """Three angles do the work of thirty-six, though single ones differ."""
    values = [jamlab.shear_modulus(packing, method, angle=angle) for angle in ANGLES]
    assert jamlab.shear_modulus(packing, method, average=True) == pytest.approx(np.mean(values), rel=1e-12)
    assert np.ptp(values) > 1e-3 * np.mean(values)


def test_modulus_turns_with_the_packing(packing):
    """Positions and box turned by 90 degrees: angle 0 becomes angle 90, which is shear along y."""
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])  # rows: (x, y) -> (-y, x)
    turned = packing.with_state(positions=packing.positions @ turn, box=packing.box[::-1, ::-1])
    for angle in (0.0, 0.4):
        wanted = jamlab.shear_modulus(packing, angle=angle)
        assert jamlab.shear_modulus(turned, angle=angle + np.pi / 2) == pytest.approx(wanted, rel=1e-9)


def test_bulk_modulus_equals_the_slope_of_the_pressure(packings):
    """dU/A of a box change: sum over C_iikk = -dp/dln(linear size) at constant network, p as LAMMPS gives it."""
    p, step = packings["deep"], 1e-7
    trace = np.einsum("iikk->", elastic_tensor(p).relaxed)
    found = []
    with jamlab.Session(p) as session:
        for factor in (1 + step, 1 - step):
            session.load(p.with_state(box=factor * p.box, positions=factor * p.positions))
            e = session.minimize(1e-13, style="cg", steps=5000)
            found.append(-2 * e.pressure * p.area * factor)  # dU/dfactor = -trace(S) A / factor
    assert (found[0] - found[1]) / (2 * step) / p.area == pytest.approx(trace, rel=1e-4)


def test_what_has_no_modulus_is_refused(random_disks, packings):
    """Not at a minimum; not jammed; unknown method."""
    places = np.stack(np.meshgrid(np.arange(4.0), np.arange(4.0)), axis=-1).reshape(-1, 2)
    square = jamlab.Packing("sp", 4 * np.eye(2), places, {"k": 1.0}, "k", np.full(16, 1.1))  # in balance, but buckles
    assert jamlab.evaluate(square).max_force < 1e-14
    for modulus in (jamlab.shear_modulus, lambda p: jamlab.complex_modulus(p, [1.0])):
        with pytest.raises(jamlab.ConvergenceError, match="negative mode"):
            modulus(square)
        with pytest.raises(jamlab.ConvergenceError, match="minimum"):
            modulus(random_disks(0.0, phi=1.1))
    loose = packings["near"].with_state(box=2 * packings["near"].box, positions=2 * packings["near"].positions)
    with pytest.raises(jamlab.ConvergenceError, match="every particle rattles"):
        jamlab.shear_modulus(loose)
    with pytest.raises(jamlab.InputError, match=r"'guess'.*linear-response"):
        jamlab.shear_modulus(packings["near"], "guess")
    for angle in ("x", np.nan, [[0.0]]):
        with pytest.raises(jamlab.InputError, match="angle = "):
            jamlab.shear_modulus(packings["near"], angle=angle)


# matrices -------------------------------------------------------------------------------------------------------------


def test_strain_row_of_k_against_finite_differences(network):
    """d2U/dgamma du and d2U/dgamma2 from LAMMPS forces and stress in sheared boxes."""
    step = 1e-7
    k = jamlab.dynamical_matrices(network)[0].toarray()
    n = network.n
    up, down = (jamlab.evaluate(sheared(network, sign * step)) for sign in (1, -1))
    coupling = -(up.forces - down.forces).ravel() / (2 * step)
    assert np.abs(coupling - k[-1, : 2 * n]).max() < 1e-6 * np.abs(coupling).max()
    curvature = -network.area * (up.stress[0, 1] - down.stress[0, 1]) / (2 * step)
    assert k[-1, -1] == pytest.approx(curvature, rel=1e-6)


@pytest.mark.parametrize(("beta", "tau"), [(0.0, 1.0), (1.0, 1.0), (0.4, 2.5)])
def test_contact_damping_is_its_rayleigh_function(network, touching, beta, tau):
    """Baumgarten & Tighe eqs 5-6, contact by contact: du_par, and du_perp at the contact with both rotations."""
    n = network.n
    _, b = jamlab.dynamical_matrices(network, ContactDamping(beta=beta, tau=tau))
    rates = np.random.default_rng(0).normal(size=3 * n + 1)
    u, spin, flow = rates[: 2 * n].reshape(-1, 2), rates[2 * n : -1], rates[-1]
    wanted = 0.0
    for i, j, r in touching(network):
        normal = r / np.hypot(*r)
        tangent = np.array([-normal[1], normal[0]])
        s = network.diameters[[i, j]].mean()
        stiffness = network.params["k"] if network.units == "k" else network.params["eps"] / s**2
        du = u[j] - u[i] + flow * np.array([r[1], 0.0])
        slide = du @ tangent - network.diameters[i] / 2 * spin[i] - network.diameters[j] / 2 * spin[j]
        wanted += stiffness * tau / 2 * ((du @ normal) ** 2 + beta * slide**2)
    assert rates @ (b @ rates) / 2 == pytest.approx(wanted, rel=1e-12)


def test_stokes_drag_is_its_rayleigh_function(network):
    """Eqs 7-8: against the affine flow on every particle, and the fluid."""
    n, eta, tau = network.n, 0.7, 2.0
    rates = np.random.default_rng(1).normal(size=3 * n + 1)
    _, b = jamlab.dynamical_matrices(network, StokesDrag(eta_f=eta, tau=tau))
    wanted = tau / 2 * np.sum(rates[: 2 * n] ** 2) + eta / 2 * rates[-1] ** 2 * network.area
    assert rates @ (b @ rates) / 2 == pytest.approx(wanted, rel=1e-12)


# G*(omega) ------------------------------------------------------------------------------------------------------------

DAMPINGS = [ContactDamping(beta=1.0), ContactDamping(beta=0.1, tau=2.0), StokesDrag(eta_f=1.0)]


@pytest.mark.parametrize("damping", DAMPINGS)
@pytest.mark.parametrize("prestress", [True, False])
def test_low_frequency_limit(packing, damping, prestress):
    """G' -> g0 = the static modulus, G''/omega -> eta0."""
    omega = 1e-9
    s = jamlab.complex_modulus(packing, [omega], damping, prestress=prestress)
    static = elastic_tensor(packing, prestress=prestress).relaxed[0, 1, 0, 1]
    assert s.g0 == pytest.approx(static, rel=1e-8)
    assert s.storage[0] == pytest.approx(s.g0, rel=1e-8)
    assert s.loss[0] / omega == pytest.approx(s.eta0, rel=1e-6)
    if prestress:
        assert s.g0 == pytest.approx(jamlab.shear_modulus(packing), rel=1e-10)


@pytest.mark.parametrize("damping", DAMPINGS)
def test_high_frequency_limit(packing, damping):
    """G''/omega -> eta_inf, below eta0: fast flow dissipates least. Stokes: affine flow and storage."""
    omega = 1e7
    s = jamlab.complex_modulus(packing, [omega, 10 * omega], damping)
    assert s.loss / s.omega == pytest.approx(s.eta_inf, rel=1e-6)
    assert s.storage[1] == pytest.approx(s.storage[0], rel=1e-4)
    assert s.g0 < s.storage[0] and s.eta_inf < s.eta0
    if isinstance(damping, StokesDrag):
        assert s.eta_inf == pytest.approx(1.0, rel=1e-12)
        assert s.storage[0] == pytest.approx(jamlab.shear_modulus(packing, "affine"), rel=1e-6)


@pytest.mark.parametrize("tau", [1.0, 3.0])
def test_eq_18_is_exact(packing, tau):
    """Without damping of sliding and prestress every contact is a Kelvin-Voigt element: G* = G0 (1 + i omega tau)."""
    omega = np.logspace(-4, 3, 8)
    s = jamlab.complex_modulus(packing, omega, ContactDamping(beta=0.0, tau=tau), prestress=False)
    assert s.storage == pytest.approx(s.g0, rel=1e-10)
    assert s.loss == pytest.approx(s.g0 * omega * tau, rel=1e-10)


@pytest.mark.parametrize("damping", DAMPINGS)
def test_complex_modulus_solves_the_equation_of_motion(packing, damping):
    """Dense: (K + i omega B) Q = dS A e_gamma, G* = dS/gamma, on all coordinates at once; error estimates hold."""
    omega = np.array([1e-3, 0.1, 10.0])
    s = jamlab.complex_modulus(packing, omega, damping)
    k, b = (m.toarray() for m in jamlab.dynamical_matrices(without_rattlers(packing), damping))
    for w, got in zip(omega, s.storage + 1j * s.loss, strict=True):
        force = np.zeros(len(k))
        force[-1] = packing.area
        q = np.linalg.lstsq(k + 1j * w * b, force, rcond=1e-13)[0]  # least norm: translations are free
        assert abs(1 / q[-1] - got) < 1e-8 * abs(got)
    assert np.all(s.error < 1e-8)


@pytest.mark.parametrize("omega", [0.0, -1.0, np.nan, np.inf])
def test_frequencies_must_be_positive(packings, omega):
    """The value is named; droplets and unknown methods are refused too."""
    with pytest.raises(jamlab.InputError, match=f"omega = {omega}.*positive"):
        jamlab.complex_modulus(packings["near"], [1.0, omega])


def test_what_has_no_spectrum_is_refused(packings, dp_onset):
    """Droplets without pre-stress, unknown methods, impossible damping."""
    with pytest.raises(jamlab.InputError, match="prestress = False: deformable polygons"):
        jamlab.complex_modulus(dp_onset, [1.0], prestress=False)
    with pytest.raises(jamlab.InputError, match="unknown method 'guess'"):
        jamlab.complex_modulus(packings["near"], [1.0], method="guess")
    for damping, message in ((ContactDamping, "beta = -1"), (StokesDrag, "eta_f = -1")):
        with pytest.raises(jamlab.InputError, match=message):
            damping(-1)
        with pytest.raises(jamlab.InputError, match="tau = 0: must be a positive time"):
            damping(1.0, tau=0)


# small boxes and other lengths ----------------------------------------------------------------------------------------


def test_two_disks_answer_finite_strain_as_linear_response():
    """Sheared too far, one image of a contact takes the place of another: the same pair, not the same contact."""
    p = jamlab.jam(n=2)
    assert jamlab.shear_modulus(p) == pytest.approx(0.5, rel=1e-6)
    assert jamlab.shear_modulus(p, "finite-strain") == pytest.approx(jamlab.shear_modulus(p), rel=1e-6)


@pytest.mark.parametrize("scale", [1e-6, 1e3, 1e6])
def test_a_packing_at_onset_is_at_rest_in_any_unit_of_length(scale):
    """Forces are compared with pressure times size; what is not at rest is not at rest in any unit either."""
    p = jamlab.jam(n=16, seed=1)

    def scaled(q):
        return q.with_state(positions=scale * q.positions, box=scale * q.box, diameters=scale * q.diameters)

    assert jamlab.shear_modulus(scaled(p)) * scale**2 == pytest.approx(jamlab.shear_modulus(p), rel=1e-9)
    push = np.random.default_rng(0).normal(size=p.positions.shape) * 1e-8
    with pytest.raises(jamlab.ConvergenceError, match=r"not at an energy minimum.*relax it first"):
        jamlab.shear_modulus(scaled(p.with_state(positions=p.positions + push)))


def test_a_droplet_squeezed_by_two_others_bears_load():
    """For z it is a rattler, as a disk would be; taken out, its neighbors were out of balance and G was not defined."""
    p = jamlab.read(STATES / "squeezed_droplet.h5")  # n = 16, 0.003 above onset
    found = jamlab.contacts(p)
    squeezed = found.rattlers & (np.bincount(found.pairs.ravel(), minlength=p.n) == 2)
    assert squeezed.sum() == 1
    assert jamlab.shear_modulus(p) == pytest.approx(jamlab.shear_modulus(p, method="finite-strain"), rel=1e-3)
