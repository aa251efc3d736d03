"""Packings from nothing: onset, compression, target pressure; what is reached, how surely, and what is refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import jamlab
from jamlab.measure import why_no_modulus
from jamlab.mechanics.factors import FLOPPY
from jamlab.mechanics.force_network import force_network
from jamlab.mechanics.predicted_motion import unstable_directions
from jamlab.mechanics.stiffness import stiffness
from jamlab.protocols import rigid_search, saddles

WINDOW = (1e-16, 1e-13)  # contact energy per disk or vertex that defines onset, Boromand et al. 2.3


def assert_onset(p, model, n, seed, force):
    """What every packing at onset must be, whatever its seed."""
    e = jamlab.evaluate(p)
    assert (p.model, p.n, p.units) == (model, n, "eps")
    assert WINDOW[0] <= e.contact_energy / len(p.positions) <= WINDOW[1]
    assert e.max_force <= force and p.max_force <= force
    assert p.converged is True and p.provenance["seed"] == seed
    assert p.phi_J == p.phi
    assert jamlab.packing_fraction(p) == pytest.approx(p.phi_J, abs=1e-4)  # no overlaps to speak of
    assert e.pressure > 0


def isostatic(p):
    """Whether every constraint of the backbone counts exactly once."""
    c = jamlab.contacts(p)
    return c.n_contacts == 2 * c.n_backbone - 1 == c.isostatic


def test_disks_jam_isostatically():
    """Four seeds of the first command in the README."""
    packings = {seed: jamlab.jam(model="sp", n=64, seed=seed) for seed in (1, 2, 3, 4)}
    for seed, p in packings.items():
        assert_onset(p, "sp", 64, seed, 1e-12)
        assert 0.80 < p.phi_J < 0.86
        assert jamlab.contacts(p).rattlers.mean() < 0.2
    assert sum(isostatic(p) for p in packings.values()) >= 3
    assert len({p.phi_J for p in packings.values()}) == 4
    sizes = np.unique(packings[1].diameters, return_counts=True)
    assert sizes[0] == pytest.approx([2 / 2.4, 2.8 / 2.4]) and sizes[1].tolist() == [32, 32]


def test_droplets_jam():
    """rho counts the rims; the polygons are still the free droplets."""
    dp_onset = jamlab.jam(model="dp", n=12, seed=1, law={"gamma": 0.1, "ka": 50.0})
    assert_onset(dp_onset, "dp", 12, 1, 1e-8)
    assert 0.78 < dp_onset.phi_J < 0.87
    regular = np.repeat([12 / np.pi * np.tan(np.pi / 12), 17 / np.pi * np.tan(np.pi / 17)], 6)
    assert jamlab.shape_factors(dp_onset) == pytest.approx(regular, rel=1e-3)
    assert np.diff(dp_onset.offsets).tolist() == [12] * 6 + [17] * 6
    a0 = dp_onset.params["a0"]
    assert a0[-1] / a0[0] == pytest.approx((17 / 12) ** 2) and np.sqrt(a0[[0, -1]]).mean() == pytest.approx(1)


@pytest.mark.parametrize(("model", "n"), [("sp", 32), ("dp", 8)])
def test_one_seed_gives_one_packing_bit_for_bit(model, n):
    """Within one process and whatever ran before."""
    first, second = jamlab.jam(model=model, n=n, seed=5), jamlab.jam(model=model, n=n, seed=5)
    assert first.positions.tobytes() == second.positions.tobytes()
    assert first.box.tobytes() == second.box.tobytes() and first.phi_J == second.phi_J


@pytest.mark.parametrize("seed", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_six_disks_that_left_a_saddle_are_held(seed):
    """Eight contacts of five disks balance by symmetry, one fewer than hold them: once returned as converged."""
    packing = jamlab.jam(n=6, seed=seed, ensemble="shear-stabilized")
    assert jamlab.contacts(packing).n_contacts >= jamlab.contacts(packing).isostatic
    assert jamlab.elastic_tensor(packing).relaxed[0, 1, 0, 1] > 0


def test_soft_contacts_at_onset_balance_as_springs_do():
    """Energies of a minimum are those of springs, forces of disks that stiffen 300 times smaller at exponent 3."""
    packing = jamlab.jam(n=8, seed=1, law={"exponent": 3.0})
    found = jamlab.evaluate(packing)
    assert packing.converged and np.abs(found.forces).max() < 1e-4 * found.pressure


def _assert_stable(packing):
    """A minimum: no eigenvalue of the backbone below zero by more than rounding, and moduli."""
    network = force_network(packing)
    values = np.linalg.eigvalsh(stiffness(network.packing).uu.toarray())
    assert values[0] > -FLOPPY * values[-1]
    assert packing.converged
    assert np.isfinite(jamlab.measure(packing, ["g", "g_x", "b"])["g"])
    assert why_no_modulus(packing) == ""


@pytest.mark.parametrize("ensemble", ["fixed-box", "shear-stabilized"])
@pytest.mark.parametrize("seed", [2, 5])
def test_onset_of_droplets_is_a_minimum_or_says_what_holds_it(ensemble, seed):
    """Between two opposite flats, a curvature of -4e-11 beside 307 hides below any tolerance on forces."""
    packing = jamlab.jam(12, "dp", seed, ensemble=ensemble)
    assert_onset(packing, "dp", 12, seed, 1e-10)
    _assert_held(packing)
    if ensemble == "shear-stabilized":
        assert jamlab.evaluate(packing).stress[0, 1] == pytest.approx(0.0, abs=1e-9)


def _assert_held(packing):
    """A minimum by its Hessian, or by the rattlers that push back what would slide."""
    if not packing.on_rattlers:
        _assert_stable(packing)
        return
    with jamlab.Session(packing) as session:
        assert saddles.rests_on_rattlers(session)
    assert "on_rattlers" not in packing.with_state(positions=packing.positions + 1e-3).provenance
    assert why_no_modulus(packing)


@pytest.mark.parametrize(
    ("n", "seed", "said"),
    [(2, 3, "more than half the box"), pytest.param(3, 1, "no jamming onset", marks=pytest.mark.slow)],
)
def test_the_search_ends_where_nothing_can_jam(n, seed, said):
    """Triangles whose edges are, or become, longer than half the box."""
    with pytest.raises(jamlab.JamlabError, match=said):
        jamlab.jam(n, "dp", seed, sizes="monodisperse", law={"vertices": 3})


def test_four_droplets_jam():
    """Which took 25 tries once."""
    assert_onset(jamlab.jam(4, "dp", 1), "dp", 4, 1, 1e-10)


@pytest.mark.parametrize(
    "how",
    [
        {"law": {"vertices": 24}},
        {"law": {"delta": 0.05}},
        {"sizes": "lognormal:0.3"},
        {"law": {"contact": "segment/smooth"}},
    ],
)
def test_droplets_of_other_kinds_jam(how):
    """Many vertices, thin rims, sizes; and a form of contacts that is not searched over rigid bodies."""
    packing = jamlab.jam(8, "dp", 2, **how)
    assert_onset(packing, "dp", 8, 2, 1e-10)
    assert packing.provenance["minimizer"] == ("lbfgs" if "contact" in how.get("law", {}) else "rigid")


SADDLE = Path(__file__).parents[1] / "states" / "droplets_on_a_saddle.h5"
ON_RATTLER = Path(__file__).parent / "states" / "droplet_on_a_rattler.h5"
FREE_EACH_OTHER = Path(__file__).parent / "states" / "droplets_that_free_each_other.h5"


def test_a_droplet_that_slid_onto_a_rattler_is_told_from_one_on_a_saddle():
    """Onset of 64, seed 197: nine searches ended so. The Hessian, without rattlers, gives way in both states."""
    for packing, held in ((jamlab.read(ON_RATTLER), True), (jamlab.read(SADDLE), False)):
        with jamlab.Session(packing) as session:
            assert unstable_directions(packing)[1] < 0
            assert saddles.rests_on_rattlers(session) is held
            assert np.array_equal(session.packing().positions, packing.positions)


def test_a_packing_rests_on_rattlers_only_if_all_that_slides_was_tried(monkeypatch):
    packing = jamlab.read(ON_RATTLER)
    modes, lowest, count = unstable_directions(packing)
    few, more = (modes[:1], lowest, count + 1), (np.repeat(modes, 2, axis=0)[: count + 1], lowest, count + 1)
    for found, held in (([few, few], False), ([few, more], True)):  # named at first, and when all are asked for
        monkeypatch.setattr(saddles, "unstable_directions", lambda *_, found=found: found.pop(0))
        with jamlab.Session(packing) as session:
            assert saddles.rests_on_rattlers(session) is held


def test_a_packing_read_from_a_saddle_relaxes_and_is_followed_to_minima():
    """The same mechanism for `relaxed` and for `compress` with an error, which would follow the saddle."""
    on_saddle = jamlab.read(SADDLE)
    _assert_stable(jamlab.relax(on_saddle))
    (state,) = jamlab.compress(on_saddle, on_saddle.phi + 1e-4, 1e-4, by="phi", pressure_tolerance=0.3)
    _assert_stable(state)


@pytest.mark.slow
def test_droplets_that_rattlers_stop_are_relaxed_compressed_and_sheared():
    """One of 64 droplets is stopped, its Hessian gives way: sweeps ended at such states."""
    packing = jamlab.read(ON_RATTLER)
    (state,) = jamlab.compress(packing, packing.phi + 1e-6, 1e-6, by="phi")
    sheared = jamlab.quasistatic_shear(packing, 1e-6, 1e-6)
    assert sheared.converged.all()
    for found in (jamlab.relax(packing), state, sheared.packing):
        assert found.converged and found.on_rattlers and found.max_force <= found.force_tolerance == 1e-10
        _assert_held(found)


@pytest.mark.slow
def test_droplets_that_free_each_other_slide_until_rattlers_stop_all():
    """Of 128 droplets three slide; what stops one sets another free, more often than a mode is tried at first."""
    found = jamlab.relax(jamlab.read(FREE_EACH_OTHER))
    assert found.converged and found.on_rattlers and found.max_force <= found.force_tolerance
    _assert_held(found)


def test_disks_that_balance_on_a_saddle_leave_it():
    """A square lattice under pressure: no force is left by symmetry, and shear to a triangular one goes downhill."""
    side = 3 * 0.95
    grid = np.stack(np.meshgrid(*2 * [np.arange(3) + 0.5]), -1).reshape(-1, 2) / 3
    square = jamlab.Packing("sp", side * np.eye(2), side * grid, {"k": 1.0}, "k", np.ones(9))
    assert jamlab.evaluate(square).max_force < 1e-14 and unstable_directions(square)[1] < 0
    found = jamlab.relax(square)
    assert found.converged and unstable_directions(found) is None
    assert jamlab.evaluate(found).energy < jamlab.evaluate(square).energy


@pytest.mark.parametrize("start", ["direct", "from-disks"])
def test_droplets_of_thin_rims_do_not_pass_through_each_other(start):
    """A step of 0.01 at phi = 0.2 moves neighbours by 0.025, more than the rim."""
    packing = jamlab.jam(4, "dp", 1, start=start, law={"delta": 0.02})
    assert packing.converged and 0.6 < packing.phi < 0.9 and packing.provenance["start"] == start
    jamlab.contacts(packing)  # refuses outlines that cross


def test_the_usual_start_of_droplets_is_direct_and_disks_have_none():
    droplets = jamlab.jam(4, "dp", 3)
    assert droplets == jamlab.jam(4, "dp", 3, start="direct") != jamlab.jam(4, "dp", 3, start="from-disks")
    assert droplets.recipe.start == "direct" and jamlab.Recipe(protocol="onset", n=4).start == "from-disks"
    with pytest.raises(jamlab.InputError, match="start = 'direct'"):
        jamlab.jam(4, "sp", 3, start="direct")


@pytest.mark.parametrize(("n", "seed", "steps", "slides"), [(32, 2, 20, 1), (16, 3, 8, 0)])
def test_droplets_that_short_steps_do_not_bring_to_rest_are_relaxed_at_length(monkeypatch, n, seed, steps, slides):
    """After a slide, and from rigid droplets. Otherwise the search comes back to the minimum beside which they stall:
    of 512 droplets by its usual steps, of fewer by steps as few as these."""
    usual, again = jamlab.jam(n, "dp", seed, start="direct").phi, []
    monkeypatch.setattr(rigid_search, "RIGID", replace(rigid_search.RIGID, droplet_steps=steps, slide_steps=2))
    relax = rigid_search.RigidSearch._relax_again
    kept = lambda search: again.append(relax(search)) or again[-1]  # noqa: E731
    monkeypatch.setattr(rigid_search.RigidSearch, "_relax_again", kept)
    assert jamlab.jam(n, "dp", seed, start="direct").phi == pytest.approx(usual, abs=1e-9)
    assert [found.converged for found in again] == [True] * slides
