"""The compiled static response against dense numpy, at any place, and against sparse factors, at minima."""

from pathlib import Path

import kinds_of_packings
import numpy as np
import pytest
import random_packings
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import jamlab
from jamlab.laws.rim import CONTACT_FORMS
from jamlab.mechanics import elasticity
from jamlab.mechanics.elasticity import linear_response
from jamlab.mechanics.factors import UnstableError
from jamlab.mechanics.force_network import force_network
from jamlab.mechanics.static_response import respond, rows_of, strain_stiffness
from jamlab.mechanics.stiffness import energy_terms
from jamlab.packing.terms import Terms, area_terms

STATES = Path(__file__).parents[1] / "states"


def dense(terms, size):
    """Forces (size, 2), K_uu, K_uE (2 size, 4), K_EE (4, 4) by plain loops over all terms."""
    force, uu, ue, ee = np.zeros((size, 2)), np.zeros((2 * size, 2 * size)), np.zeros((2 * size, 4)), np.zeros((4, 4))
    for term in terms:
        for k, sites in enumerate(term.sites):
            rows = (2 * sites[:, None] + [0, 1]).ravel()
            h = term.hessian[k].reshape(len(rows), -1)
            strained = np.kron(term.local[k][:, None, :], np.eye(2)[:, :, None]).reshape(len(rows), 4)  # du/dE
            np.add.at(force, sites, -term.gradient[k])
            np.add.at(uu, (rows[:, None], rows), h)
            np.add.at(ue, rows, h @ strained)
            ee += strained.T @ h @ strained
    return force, uu, ue, ee


def anchored(terms, size, stiffness):
    """Every site held by a spring of its own, so that any packing has a response."""
    sites, none = np.arange(size)[:, None], np.zeros((size, 1, 2))
    block = np.broadcast_to(stiffness * np.eye(2)[:, None], (size, 1, 2, 1, 2))
    return [*terms, Terms("anchor", sites, none, np.zeros(size), none, block)]


@pytest.mark.parametrize("model", ["sp", *CONTACT_FORMS])
@settings(max_examples=10)
@given(data=st.data())
def test_any_terms_give_the_response_of_dense_numpy(model, data):
    """Random packings, with absent sites and sites that stay; a term between two images of one site among them."""
    packing = data.draw(random_packings.disks() if model == "sp" else random_packings.polygons(model))
    rng, size = np.random.default_rng(data.draw(random_packings.seeds)), len(packing.positions)
    terms = energy_terms(packing)
    held = rng.random(size) < 0.8
    moves = held & (rng.random(size) < 0.8)
    assume(moves.any())
    kept = [Terms.among(term, held) for term in anchored(terms, size, 1.0)]
    stiffness = 2 * np.abs(dense(kept, held.sum())[1]).sum(axis=1).max() + 1.0
    _answers_as_dense(anchored(terms, size, stiffness), held, moves)


def _answers_as_dense(terms, held, moves):
    """Of all sites the held ones are there, of which some move."""
    row = np.where(moves, np.cumsum(moves) - 1, np.where(held, -1, -2))
    found = respond(terms, row, 1e-15)
    force, uu, ue, ee = dense([term.among(held) for term in terms], held.sum())
    free = np.repeat(moves[held], 2)
    u = np.zeros_like(ue)
    u[free] = -np.linalg.solve(uu[np.ix_(free, free)], ue[free])
    assert found.firm
    for mine, wanted in (
        (found.forces[held], force),
        (found.affine.reshape(4, 4), ee),
        (found.displacements[held].reshape(-1, 4), u),
        (found.back.reshape(4, 4), -u.T @ ue),
    ):
        np.testing.assert_allclose(mine, wanted, rtol=0, atol=1e-11 * (1e-3 + np.abs(wanted).max()))
    assert not found.displacements[~moves].any() and not found.forces[~held].any()


def test_a_spring_between_images_of_one_site_does_not_hold_it():
    bonds = np.einsum("ab,ij->aibj", [[1.0, -1.0], [-1.0, 1.0]], [[2.0, 0.5], [0.5, 1.0]])
    sites, local = np.array([[0, 0], [0, 1]]), np.array([[[0.0, 0.0], [1.0, 0.3]], [[0.0, 0.0], [0.3, 1.0]]])
    springs = Terms("contact", sites, local, np.zeros(2), np.zeros((2, 2, 2)), np.stack([bonds, bonds]))
    _answers_as_dense(anchored([springs], 2, 1.0), np.ones(2, dtype=bool), np.ones(2, dtype=bool))


def test_zero_modes_of_a_droplet_alone_are_loose_and_negative_ones_unstable():
    """Six vertices of which nothing but the area is fixed: all of them are eliminated within their droplet."""
    turn = np.pi / 3 * np.arange(6)
    ring = np.column_stack([np.cos(turn), np.sin(turn)])
    area = area_terms("area", ring, np.zeros(1, dtype=np.int64), 6, 1.0, np.zeros(1))
    for stiffness, firm, unstable in ((0.0, False, False), (1e-3, True, False), (-1e-3, False, True)):
        found = respond(anchored([area], 6, stiffness), np.arange(6), 1e-12)
        assert (found.firm, found.unstable) == (firm, unstable)


def _tiny(count):
    """Disks on a square lattice that press on images of themselves."""
    places = np.stack(np.meshgrid(np.arange(count), np.arange(count)), axis=-1).reshape(-1, 2) + 0.25
    return jamlab.Packing("sp", count * np.array([[1.0, 0.0], [0.5, 0.9]]), places @ [[1, 0], [0.5, 0.9]],
                          {"k": 1.0}, "k", np.full(count**2, 1.05))  # fmt: skip


def _disks(**law):
    return jamlab.pack(n=32, pressure=1e-2, seed=1, **law)


CASES = {
    "disks": _disks,
    "unstressed": _disks,
    "Hertz": lambda: _disks(law={"exponent": 2.5}),
    "sticky": lambda: _disks(law={"stickiness": 0.04}),
    "fixed disks": lambda: jamlab.relax(_disks().with_state(fixed=np.arange(32) % 5 == 0)),
    "rough walls": lambda: jamlab.relax(jamlab.with_walls(_disks(), 1.5)),
    "flat walls": lambda: jamlab.relax(jamlab.with_walls(_disks(), flat=True)),
    "one particle": lambda: _tiny(1),
    "four particles": lambda: _tiny(2),
    "droplets": lambda: jamlab.read(STATES / "compressed_droplets.h5"),
    "smooth droplets": lambda: jamlab.relax(
        kinds_of_packings.law(jamlab.read(STATES / "compressed_droplets.h5"), contact="segment/smooth")
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_minima_answer_as_sparse_factors_say(case):
    """Numpy's assembly and factors of a general matrix beside both kernels."""
    packing, prestress = CASES[case](), case != "unstressed"
    network, frame = force_network(packing), packing.frame
    row = rows_of(network.held, frame.free_sites, frame.all_free)
    plain = elasticity._of_fixed_droplets(network, prestress)
    terms = energy_terms(packing, prestress=prestress)
    compiled = strain_stiffness(terms, row)
    _alike(compiled.uu.toarray(), plain.uu.toarray(), 1e-13)
    _alike(compiled.ue, plain.ue, 1e-13)
    _alike(compiled.ee, plain.ee, 1e-13)
    found = respond(terms, row, packing.law.floppy)
    assert found.firm != frame.slips  # along flat walls, a floppy mode
    if not found.firm or not row.max() >= 0:
        return
    wanted = elasticity._beside_floppy_modes(network, row, plain, 6)
    for mine, theirs in zip((found.affine, found.back, found.displacements), wanted, strict=True):
        _alike(mine, theirs, 1e-10)


def _alike(mine, theirs, error):
    np.testing.assert_allclose(mine, theirs, rtol=0, atol=error * (1e-300 + np.abs(theirs).max(initial=0)))


def test_forces_out_of_balance_are_refused():
    packing = _disks()
    moved = packing.with_state(positions=packing.positions + 1e-3 * np.eye(32, 2))
    with pytest.raises(jamlab.ConvergenceError, match="not at an energy minimum: the largest residual force is"):
        linear_response(moved)


def test_a_saddle_is_unstable_with_the_negative_modes_of_its_matrix():
    packing = jamlab.read(STATES / "droplets_on_a_saddle.h5")
    network, frame = force_network(packing), packing.frame
    row, terms = rows_of(network.held, frame.free_sites, frame.all_free), energy_terms(packing)
    assert respond(terms, row, packing.law.floppy).unstable
    values = np.linalg.eigvalsh(strain_stiffness(terms, row).uu.toarray())
    with pytest.raises(UnstableError, match="negative mode") as caught:
        linear_response(packing)
    assert caught.value.count == (values < 0).sum() and len(caught.value.modes) == caught.value.count
    assert caught.value.eigenvalue == pytest.approx(values[0], abs=1e-14 * values[-1])
    raised = respond(anchored(terms, len(row), 1e-9), row, packing.law.floppy)  # by more than the negative eigenvalue
    assert raised.firm and not raised.unstable
