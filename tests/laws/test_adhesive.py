"""Droplets that adhere: energy, forces and Hessian beside plain numpy, what pulls two of them apart, refusals."""

from pathlib import Path

import numpy as np
import plain_adhesion
import pytest
from packings_by_hand import SQUARE, droplets
from scipy import integrate

import jamlab
from jamlab.geometry.vertex_contacts import vertex_contacts
from jamlab.laws.adhesive import AdhesiveLaw
from jamlab.laws.sticky import StickyLaw
from jamlab.mechanics.stiffness import forces, hessian
from jamlab.models.droplets import regular_polygon

STATES = Path(__file__).parents[1] / "states"
LAW = {"adhesion": 0.08, "adhesion_range": 0.3}


@pytest.fixture(scope="module")
def onset():
    """Four droplets just above onset, stored."""
    return jamlab.read(STATES / "few_droplets.h5").with_state(ensemble="fixed-box")


def wandering(onset, seed):
    """Vertices moved at random, in a box that leans, with a law at random."""
    rng = np.random.default_rng(seed)
    lean = np.array([[1.0, 0.0], [rng.uniform(-0.2, 0.2), 1.0]])
    places = onset.positions @ lean + rng.normal(0, 0.015, onset.positions.shape)
    law = {"adhesion": rng.uniform(0.02, 0.2), "adhesion_range": rng.uniform(0.3, 0.6), "eta": 0.1 * (seed % 2)}
    return onset.with_state(positions=places, box=onset.box @ lean, params={**onset.params, **law})


@pytest.mark.parametrize("seed", range(10))
def test_ten_states_beside_plain_numpy(onset, seed):
    p = wandering(onset, seed)
    energy, push = plain_adhesion.forces(p, p.positions.astype(complex))
    found = jamlab.evaluate(p)
    assert found.energy == pytest.approx(energy.real, abs=1e-10)
    np.testing.assert_allclose(found.forces, push.real, atol=1e-10)
    np.testing.assert_allclose(forces(p), push.real, atol=1e-10)
    gaps = jamlab.contacts(p).forces.gap
    assert gaps.max() < p.law.range and (gaps > 0).any()


@pytest.mark.parametrize("seed", [2, 3])
def test_the_hessian_beside_complex_steps(onset, seed):
    p = wandering(onset, seed)
    plain = plain_adhesion.hessian(p)
    np.testing.assert_allclose(hessian(p).toarray(), plain, atol=1e-9 * np.abs(plain).max())


def facing(gap, nv=300, turns=(0.0, 0.3), **law):
    """Two regular polygons of area 1 side by side, `gap` between the circles through their vertices."""
    radius = np.sqrt(2 / (nv * np.sin(2 * np.pi / nv)))
    rings = [regular_polygon(nv, 1.0, turn) + np.array([k * (2 * radius + gap), 0.0]) for k, turn in enumerate(turns)]
    p = droplets(rings, delta=0.25)
    return p.with_state(params={**p.params, **LAW, **law}), radius


def pull_of_circles(gap, radius, nv):
    """Quadrature of the pull between circles, each of `nv` vertices spread evenly: a vertex at the angle a lies at
    the distance d from the other circle, in the direction of its centre."""
    law = AdhesiveLaw("eps", 1.0, 0.25, *LAW.values())

    def along(a):
        across, ahead = radius * np.sin(a), 2 * radius + gap - radius * np.cos(a)
        away = np.hypot(across, ahead)
        d = away - radius
        slope = 0.0 if d >= 0.25 + law.range else law(np.array([0.25]), np.array([d]))[1][0]
        return slope * ahead / away

    return 2 * nv / (2 * np.pi) * integrate.quad(along, -0.8, 0.8, limit=500, epsabs=1e-10)[0]


def test_the_pull_between_droplets_beside_a_quadrature():
    """At all gaps, and so the largest, at which the two come apart."""
    gaps = 0.25 * (1 + np.array([-0.02, 0.0, 0.03, 0.06, 0.09, 0.15]))
    found, wanted = [], []
    for gap in gaps:
        p, radius = facing(gap)
        found.append(-jamlab.contacts(p).forces.on_j[0, 0])
        wanted.append(pull_of_circles(gap, radius, 300))
    np.testing.assert_allclose(found, wanted, rtol=0, atol=5e-3 * max(wanted))
    assert 0 < np.argmax(found) < len(gaps) - 1 and np.argmax(found) == np.argmax(wanted)


def test_one_vertex_is_pulled_at_most_by_the_adhesion():
    """eps l1/delta, at the gap l1 delta, by closed form; and none beyond the range."""
    spike = np.array([[0.0, 0.5], [-1.0, 1.0], [-1.0, 0.0]])
    wall = SQUARE + np.array([0.0, 0.0])

    def pull(gap):
        p = droplets([spike - [gap, 0.0], wall], delta=0.25)
        p = p.with_state(params={**p.params, **LAW})
        found = jamlab.contacts(p).forces
        return -found.on_j[0, 0] if len(found.gap) else 0.0

    gaps = 0.25 * (1 + np.linspace(-0.1, 0.4, 51))
    pulls = np.array([pull(gap) for gap in gaps])
    assert pulls.max() == pytest.approx(0.08 / 0.25, rel=1e-12)
    assert gaps[pulls.argmax()] == pytest.approx(0.25 * 1.08, rel=1e-12)
    assert (pulls[gaps > 0.25 * 1.3] == 0).all() and (pulls[(gaps > 0.2501) & (gaps < 0.25 * 1.299)] > 0).all()


@pytest.mark.parametrize("pull, reach", [(0.02, 0.2), (0.05, 0.2)])
def test_the_contact_angle_is_that_of_young_and_dupre(pull, reach):
    """Where elastic edges keep vertices apart: cos a = 1 - w/(2 gamma), with the energy w of the vertices in contact
    over its length. The contact ends at a vertex: one corner of the free polygon is allowed."""
    nv, extra = 48, {"gamma": 0.4, "ka": 300.0, "eta": 1e-3, "kl": 1.0}
    p, _ = facing(0.25, nv, (0.7, 2.1), adhesion=pull, adhesion_range=reach, **extra)
    p = jamlab.relax(p)
    met = vertex_contacts(p)
    bound = np.unique(met.vertex[met.distance < 0.25 * (1 + pull)])
    angles, length = [], 0.0
    for ring in np.arange(2 * nv).reshape(2, nv):
        own = np.intersect1d(ring, bound)
        length += np.ptp(p.positions[own, 1])
        for step in (1, -1):
            free = np.setdiff1d(np.roll(ring, -step)[np.isin(ring, own)], own)
            before = np.array([np.roll(ring, step)[np.flatnonzero(ring == k)[0]] for k in free])
            away = np.abs(p.positions[free] - p.positions[before])
            angles += list(np.degrees(np.arctan2(*away.T)))
    work = 2 * len(bound) * pull * reach / 2 / length
    assert p.converged and np.mean(angles) == pytest.approx(np.degrees(np.arccos(1 - work / 0.8)), abs=360 / nv)
    assert np.mean(angles) > 2 * 360 / nv  # beyond the corner of the free polygon


def test_twice_the_adhesion_is_the_force_of_sticky_disks():
    d = np.linspace(0.8, 1.19, 60)
    here, there = AdhesiveLaw("eps", 1.3, 1.0, 0.1, 0.2), StickyLaw("eps", 1.3, 0.1, 0.1)
    for own, other in zip(here(np.ones(60), d), there(np.ones(60), d), strict=True):
        np.testing.assert_allclose(own, other, atol=1e-13)
    p = droplets([SQUARE], delta=0.25)
    assert p.with_state(params={**p.params, "adhesion": 0.1}).law.range == pytest.approx(0.05)


def test_droplets_come_to_rest_and_hold_under_tension(onset):
    p = jamlab.relax(onset.with_state(params={**onset.params, **LAW}))
    high, low = (list(jamlab.compress(p, to=p.phi + way, step=0.02, by="phi"))[-1] for way in (0.02, -0.06))
    assert p.converged and high.converged and low.converged
    assert jamlab.evaluate(low).pressure < 0 < jamlab.evaluate(high).pressure
    found = [jamlab.shear_modulus(p, direction="simple", method=m) for m in ("linear-response", "finite-strain")]
    assert found[0] == pytest.approx(found[1], rel=1e-4) and found[0] > 0


@pytest.mark.parametrize("ending", ["h5", "data", "dump", "xyz"])
@pytest.mark.parametrize("law", [LAW, {"law": "adhesive", **LAW}, {"adhesion": 0.08}])
def test_files_keep_the_law(tmp_path, onset, ending, law):
    p = onset.with_state(params={**onset.params, **law})
    jamlab.write(tmp_path / f"p.{ending}", p if ending == "data" else [p])
    q = jamlab.read(tmp_path / f"p.{ending}")
    assert q == p and q.law == p.law and {**q.params, "a0": 0} == {**p.params, "a0": 0}


def two(**law):
    p = droplets([SQUARE, SQUARE + np.array([1.26, 0.0])], delta=0.25)
    return p.with_state(params={**p.params, **law})


REFUSED = {
    "negative": (lambda: two(adhesion=-0.1), "'adhesion'] is -0.1: must be a number from 1e-09 to 1"),
    "too large": (lambda: two(adhesion=2.0, adhesion_range=5.0), "'adhesion'] is 2.0"),
    "a text": (lambda: two(adhesion="much"), "'adhesion'] is 'much'"),
    "nan": (lambda: two(adhesion=float("nan")), "'adhesion'] is nan"),
    "range alone": (lambda: two(adhesion_range=0.3), "adhesion_range = 0.3 without adhesion: give adhesion"),
    "short range": (lambda: two(adhesion=0.2, adhesion_range=0.1), "give a longer range, or leave it out for 0.4"),
    "range too long": (lambda: two(adhesion=0.2, adhesion_range=11.0), "'adhesion_range'] is 11.0"),
    "named without": (lambda: two(law="adhesive"), "law 'adhesive' needs an adhesion above 0"),
    "rim with": (lambda: two(law="rim", adhesion=0.1), "'adhesion'"),
    "every edge": (lambda: two(adhesion=0.1, contact="segment/smooth"), "use contact = 'outline'"),
    "of disks": (lambda: jamlab.pack(8, phi=0.8, law={"adhesion": 0.1}), "adhesion is a parameter of model dp"),
    "jam": (lambda: jamlab.jam(8, "dp", law={"adhesion": 0.1}), "has no onset at zero contact energy; use"),
    "decompress": (lambda: jamlab.decompress(two(adhesion=0.1), 1e-3), "use compress(packing, to)"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refusals_name_value_and_remedy(name):
    call, said = REFUSED[name]
    with pytest.raises(jamlab.JamlabError) as caught:
        call()
    assert said in str(caught.value) and "\n" not in str(caught.value)
