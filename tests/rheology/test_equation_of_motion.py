"""K and B of disks and of deformable polygons against finite differences, plain loops, symmetry and null space."""

import numpy as np
import pytest
from droplet_drag import drag_rates

import jamlab
from jamlab import ContactDamping, StokesDrag
from jamlab.geometry.contact_network import remove_rattlers
from jamlab.packing.deformation import sheared

LAWS = [
    ContactDamping(),
    ContactDamping(beta=0.0),
    ContactDamping(beta=0.3, tau=2.0, lever_arms="contact"),
    StokesDrag(eta_f=0.7),
]


@pytest.fixture(scope="module")
def sp_deep():
    """Disks at pressure 1e-2 k, rattlers taken out."""
    return remove_rattlers(jamlab.pack(n=32, pressure=1e-2, seed=3))


@pytest.fixture(scope="module", params=["sp", "sp-eps", "dp"])
def network(request, sp_deep, dp_dense):
    """Disks whose springs have one stiffness, or one energy at full overlap; droplets."""
    if request.param == "sp-eps":
        *_, packing = jamlab.compress(jamlab.jam(16, "sp", 2), 0.9, 0.05, by="phi")
        return remove_rattlers(packing)
    return sp_deep if request.param == "sp" else remove_rattlers(dp_dense)


def gradient(p, u, strain):
    """dU/du and dU/dgamma from LAMMPS forces and stress, site by site, then gamma; sheared, then displaced by u."""
    q = sheared(p, strain)
    e = jamlab.evaluate(q.with_state(positions=q.positions + u))
    return np.append(-e.forces.ravel(), -p.area * e.stress[0, 1])  # stress is -(1/A) dU/dE


def test_hessian_against_finite_differences(network):
    """K v along random directions v, gamma row and column included, < 1e-7 of the largest entry."""
    step = 1e-7
    k = jamlab.dynamical_matrices(network)[0]
    sites = len(network.positions)
    rows = np.append(np.arange(2 * sites), k.shape[0] - 1)
    k = k[rows][:, rows]
    rng = np.random.default_rng(1)
    directions = [rng.normal(size=2 * sites + 1) / 10, np.eye(2 * sites + 1)[-1], np.eye(2 * sites + 1)[3]]
    for v in directions:
        u, strain = v[:-1].reshape(-1, 2), v[-1]
        up, down = (gradient(network, sign * step * u, sign * step * strain) for sign in (1, -1))
        assert np.abs((up - down) / (2 * step) - k @ v).max() < 1e-7 * abs(k).max()


def disk_dissipation(contacts, p, law, u, spin, flow):
    """Baumgarten & Tighe eq 6, contact by contact; arms as printed, or to the middle of the overlap."""
    total = 0.0
    for i, j, r in contacts:
        normal = r / np.hypot(*r)
        du = u[j] - u[i] + flow * np.array([r[1], 0.0])
        arms = p.diameters[[i, j]] / 2
        stiffness = p.params["k"] if p.units == "k" else p.params["eps"] / arms.sum() ** 2
        if law.lever_arms == "contact":
            arms = arms - (arms.sum() - np.hypot(*r)) / 2
        slide = du @ [-normal[1], normal[0]] - arms @ spin[[i, j]]
        total += stiffness * law.tau / 2 * ((du @ normal) ** 2 + law.beta * slide**2)
    return total


def dissipation(contacts, p, law, rates):
    """Rayleigh function R of all rates."""
    sites = len(p.positions)
    u, flow = rates[: 2 * sites].reshape(-1, 2), rates[-1]
    if isinstance(law, StokesDrag):
        share = 1.0 if p.model == "sp" else 1 / np.repeat(np.diff(p.offsets), np.diff(p.offsets))
        drag = p.params["k"] if p.units == "k" else p.params["eps"]
        return law.tau / 2 * drag * np.sum(share * np.sum(u**2, axis=1)) + law.eta_f / 2 * flow**2 * p.area
    if p.model == "sp":
        return disk_dissipation(contacts, p, law, u, rates[2 * sites : -1], flow)
    return law.tau / 2 * np.sum(drag_rates(p, u, np.array([[0.0, flow], [0.0, 0.0]]), law.beta) ** 2)


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_damping_matrix_against_finite_differences(network, law, touching):
    """B is the Hessian of R; R is quadratic, so differences are exact: along random rates and along gamma."""
    b = jamlab.dynamical_matrices(network, law)[1]
    contacts = list(touching(network)) if network.model == "sp" else ()
    rng = np.random.default_rng(2)
    v, w = rng.normal(size=(2, b.shape[0]))
    w[-1] = 1.0
    gamma = np.eye(b.shape[0])[-1]
    for along in (w, gamma):
        up, down = (dissipation(contacts, network, law, v + sign * along) for sign in (1, -1))
        assert (up - down) / 2 == pytest.approx(along @ (b @ v), rel=1e-10)


@pytest.mark.parametrize("prestress", [True, False])
@pytest.mark.parametrize("law", LAWS, ids=str)
def test_symmetry_and_null_space(network, law, prestress):
    """Both symmetric; K blind to translation and rotation, contact damping to translation, Stokes drag not."""
    if network.model == "dp" and not prestress:
        with pytest.raises(jamlab.InputError, match="prestress = False"):
            jamlab.dynamical_matrices(network, law, prestress=prestress)
        return
    k, b = (m.toarray() for m in jamlab.dynamical_matrices(network, law, prestress=prestress))
    sites = len(network.positions)
    size = 3 * sites + 1 if network.model == "sp" else 2 * sites + 1
    assert k.shape == b.shape == (size, size)
    translations = np.zeros((2, size))
    translations[0, 0 : 2 * sites : 2] = translations[1, 1 : 2 * sites : 2] = 1
    for m in (k, b):
        assert np.abs(m - m.T).max() <= 1e-14 * np.abs(m).max()
    assert np.abs(k @ translations.T).max() < 1e-12 * np.abs(k).max()
    assert not k[2 * sites : -1].any()
    modes = np.linalg.eigvalsh(k[: 2 * sites, : 2 * sites])
    assert np.abs(modes[:2]).max() < 1e-12 * modes[-1] < 1e-7 * modes[-1] < modes[2]
    drags = np.linalg.eigvalsh(b)
    assert drags[0] > -1e-12 * drags[-1]  # never a source of energy
    assert np.abs(b @ translations.T).max() < 1e-12 * np.abs(b).max() or isinstance(law, StokesDrag)
    if isinstance(law, StokesDrag):
        assert b[0, 0] > 0
    elif network.model == "sp" and law.beta > 0:  # no mode without drag but the translations
        moving = np.linalg.eigvalsh(b[:-1, :-1])
        assert np.abs(moving[:2]).max() < 1e-12 * moving[-1] < 1e-9 * moving[-1] < moving[2]
