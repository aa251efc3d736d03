"""A drag law of somebody else is right in G* from its matrix alone, and refused by name where nothing carries it."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from scipy import sparse

import jamlab
from jamlab.packing.natural_units import stiffness_scale
from jamlab.rheology.drag_law import DRAGS, DragLaw, contact_velocities, law_of_record, make_law, parameter
from tests.support.bubble_drag import BubbleDrag

OMEGA = np.array([1e-3, 1.0, 30.0])


def bonds(packing):
    """Pairs that touch and the vectors between them, by plain numpy over all images."""
    r = packing.positions[None] - packing.positions[:, None]
    cells = r @ np.linalg.inv(packing.box)
    r = (cells - np.round(cells)) @ packing.box
    reach = 0.5 * (packing.diameters[:, None] + packing.diameters[None])
    i, j = np.nonzero(np.triu(np.hypot(r[..., 0], r[..., 1]) < reach, 1))
    return i, j, r[i, j]


def matrices(packing, tau):
    """Hessian of springs with pre-stress, and drag of bubbles, in u and gamma, written out contact by contact."""
    n = packing.n
    k, b = np.zeros((2, 2 * n + 1, 2 * n + 1))
    for i, j, r in zip(*bonds(packing), strict=True):
        distance, s = np.hypot(*r), 0.5 * (packing.diameters[i] + packing.diameters[j])
        normal = r / distance
        along = np.outer(normal, normal)
        block = along - (s - distance) / distance * (np.eye(2) - along)
        moves = np.zeros((2, 2 * n + 1))  # r of all coordinates
        moves[:, 2 * i : 2 * i + 2], moves[:, 2 * j : 2 * j + 2] = -np.eye(2), np.eye(2)
        moves[:, -1] = [r[1], 0.0]
        k += moves.T @ block @ moves
        b += tau * moves.T @ moves
    return k, b


def moduli(k, b, area, omega):
    found = []
    for w in omega:
        m = k + 1j * w * b
        q = np.linalg.lstsq(m[:-1, :-1], -m[:-1, -1], rcond=1e-12)[0]
        found.append((m[-1, -1] + m[-1, :-1] @ q) / area)
    return np.array(found)


@pytest.mark.parametrize("method", ["dense", "direct", "reduced"])
def test_modulus_of_bubbles_is_that_of_plain_numpy(method):
    packing = jamlab.remove_rattlers(jamlab.pack(16, 1e-2, 1, ensemble="shear-stabilized"))
    k, b = matrices(packing, tau=2.0)
    expected = moduli(k, b, packing.area, OMEGA)
    found = jamlab.complex_modulus(packing, OMEGA, BubbleDrag(tau=2.0), method=method)
    np.testing.assert_allclose(found.storage + 1j * found.loss, expected, rtol=1e-8)
    slow = np.append(np.linalg.lstsq(k[:-1, :-1], -k[:-1, -1], rcond=1e-12)[0], 1.0)
    assert found.eta0 == pytest.approx(slow @ b @ slow / packing.area, rel=1e-8)  # no drift: B is blind to it


def test_flow_refuses_a_law_that_no_program_carries():
    packing = jamlab.pack(8, 1e-2, 1)
    for run in (
        lambda law: jamlab.shear(packing, 1e-2, 0.01, law),
        lambda law: jamlab.oscillate(packing, 1.0, 1e-6, law),
        lambda law: jamlab.creep(packing, 1e-6, 1.0, law),
        lambda law: jamlab.relax_stress(packing, 1e-6, 1.0, law),
        lambda law: jamlab.stop_flow(packing, 1.0, law),
        lambda law: jamlab.flow_curve(packing, [1e-2], law),
    ):
        with pytest.raises(jamlab.InputError, match="does not carry the drag law 'bubble'"):
            run(BubbleDrag())
    with pytest.raises(jamlab.InputError, match="measured for ContactDamping and StokesDrag alone"):
        jamlab.choose_flow(packing, BubbleDrag(), omega=1.0)


def test_a_subclass_has_neither_name_nor_carrier_nor_gears_of_its_parent():
    @dataclass(frozen=True)
    class Half(jamlab.ContactDamping):
        def matrix(self, packing, whole, direction):
            return 0.5 * super().matrix(packing, whole, direction)

    packing, law = jamlab.pack(8, 1e-2, 1), Half()
    assert (law.name, law.lammps_variables(), law.on_approach()) == ("Half", None, None)
    rates = np.random.default_rng(1).standard_normal(3 * packing.n + 1)
    assert law.power(packing, rates) == pytest.approx(0.5 * jamlab.ContactDamping().power(packing, rates))


@pytest.mark.parametrize("seed", [2, 5, 11])
def test_gears_are_found_from_the_matrix_alone(seed):
    packing, law = jamlab.pack(2, 1e-2, seed), jamlab.ContactDamping()
    matrix = law.matrix(packing, packing, "simple")
    assert len(DragLaw.gears(law, packing, matrix)) == len(law.gears(packing)) == 1
    wide = jamlab.remove_rattlers(jamlab.pack(32, 1e-2, 1))
    assert DragLaw.gears(law, wide, law.matrix(wide, wide, "simple")) == []


@pytest.mark.parametrize(
    "law", [jamlab.ContactDamping(0.3, alpha=0.5), jamlab.ContactDamping(), jamlab.StokesDrag(0.3)]
)
def test_power_is_the_slope_of_its_scaling(law):
    """A Rayleigh function of degree alpha + 1 dissipates as that power of the velocities, and no drift of the whole
    packing counts at contacts."""
    packing = jamlab.pack(8, 1e-2, 1)
    rates = np.random.default_rng(1).standard_normal(3 * packing.n + 1)
    assert law.power(packing, 2 * rates) == pytest.approx(2 ** (law.alpha + 1) * law.power(packing, rates))
    if law.alpha == 1:
        assert law.power(packing, rates) == pytest.approx(DragLaw.power(law, packing, rates))


def test_files_say_the_package_of_a_law_that_is_missing():
    law = BubbleDrag(tau=3.0)
    assert law_of_record(law.record()) == law
    with pytest.raises(jamlab.InputError, match=r"'froth' is of the package froths: install or import it"):
        law_of_record({"law": "froth", "package": "froths"})


def test_laws_are_made_by_name_from_declared_parameters():
    assert make_law("bubble", {"tau": 2.0}) == BubbleDrag(2.0) and make_law("contact", {}) == jamlab.ContactDamping()
    with pytest.raises(jamlab.InputError, match="'bubble' has no parameter 'beta': it has tau"):
        make_law("bubble", {"beta": 1.0})
    with pytest.raises(jamlab.InputError, match="tau = -1: must be a positive number"):
        make_law("bubble", {"tau": -1})
    with pytest.raises(jamlab.InputError, match="unknown drag law 'bubbles'"):
        make_law("bubbles", {})
    with pytest.raises(jamlab.InputError, match="one word"):
        DRAGS.register("two words", type("Two", (BubbleDrag,), {"name": "two words"}))
    with pytest.raises(jamlab.InputError, match="frozen dataclass"):
        DRAGS.register("none", object)


def test_numbers_without_a_declaration_must_be_numbers():
    @dataclass(frozen=True)
    class Plain(DragLaw):
        name: ClassVar[str] = "plain"
        c: float = 1.0
        d: float = parameter(1.0, "a share", least=0.0, largest=1.0)

        def matrix(self, packing, whole, direction):
            raise NotImplementedError

    assert str(Plain()) == "plain drag, c = 1, d = 1"
    with pytest.raises(jamlab.InputError, match="c = nan: must be a number"):
        Plain(c=np.nan)
    with pytest.raises(jamlab.InputError, match="d = 2: must be a number from 0 to 1"):
        Plain(d=2)


@dataclass(frozen=True)
class NormalAndBackground(DragLaw):
    """Drag of approach beside a background of its own."""

    name: ClassVar[str] = "normal_and_background"

    def matrix(self, packing, whole, direction):
        approach, _, _ = contact_velocities(packing, direction, lever_arms="none")
        beside = jamlab.StokesDrag(eta_f=0.0, tau=0.03).matrix(packing, whole, direction)
        return sparse.csc_array(stiffness_scale(whole) * (approach.T @ approach) + beside)

    def lammps_variables(self):
        return {"tau": 1.0, "beta": 0.0, "lever_arms": "none", "even": 1.0, "background_drag": 0.03}


@pytest.mark.parametrize("more", [None, 0.01])
def test_a_background_of_the_law_adds_to_that_of_the_flow(more):
    p = jamlab.pack(16, 1e-2, seed=1)
    run = jamlab.shear(p, 0.1, 1e-3, NormalAndBackground(), rows=1, background_drag=more)
    assert run.background_drag == (more or 0.0)  # the dissipated power has been compared with that of both


@dataclass(frozen=True)
class Misspelt(BubbleDrag):
    """A word that the plugin does not know."""

    name: ClassVar[str] = "misspelt"

    def lammps_variables(self):
        return {"tau": self.tau, "evn": 1.0}


def test_a_word_that_the_plugin_does_not_know_is_refused():
    with pytest.raises(jamlab.InputError, match="lammps_variables has 'evn', which the plugin does not know"):
        jamlab.shear(jamlab.pack(16, 1e-2, seed=1), 0.1, 1e-3, Misspelt())
