"""pair_style circuloline with adhesion: energies and forces of droplets, walls and disks beside plain numpy, on ranks,
in files, in runs that change it, in flows."""

import itertools
from pathlib import Path

import numpy as np
import outlines
import pytest
from droplet_flows import CONTACT, STOKES, DropletFlow
from engine.test_per_atom_tallies import SHOW, TALLIES
from engine.test_plugin_on_ranks import run
from outlines import DISK, EPS, RING, WALL, WIDTH

import jamlab
from jamlab.engine.session import Session
from jamlab.geometry.vertex_contacts import vertex_contacts
from jamlab.protocols.descent_of_droplets import DROPLET_STEPS, FAR, descend_droplets

OWN = {RING: (0.1, 0.3), WALL: (0.05, 0.2), DISK: (0.0, 0.0)}
PAIRS = {(RING, DISK): (0.08, 0.25)}


def adhesion(i, j):
    pair = (min(i, j), max(i, j))
    if pair in PAIRS:
        return PAIRS[pair]
    if i == j:
        return OWN[i]
    pull = np.sqrt(OWN[i][0] * OWN[j][0])
    return pull, (OWN[i][1] + OWN[j][1]) / 2 * (pull > 0)


def laws(i, j):
    return *outlines.mixed(i, j), *adhesion(i, j)


def coefficients(form=""):
    lines = [f"pair_coeff {k} {k} {EPS[k]} {WIDTH[k]} {form} adhesion {a} {b}\n" for k, (a, b) in OWN.items()]
    for (i, j), (a, b) in PAIRS.items():
        eps, width = outlines.mixed(i, j)
        lines.append(f"pair_coeff {i} {j} {eps:.17g} {width:.17g} {form} adhesion {a} {b}\n")
    return "".join(lines)


def forces_of(lmp, n):
    return np.array(lmp.gather_atoms("f", 1, 3)).reshape(n, 3)[:, :2]


@pytest.mark.parametrize("form", outlines.FORMS)
def test_droplets_walls_and_disks_beside_plain_numpy(lmp, tmp_path, form):
    """Of types that adhere, of mixed types, of types that only repel: more contacts than those of repulsion."""
    state = outlines.scene(31)
    outlines.start(lmp, tmp_path, state, coefficients(form) + "run 0\n")
    assert lmp.get_thermo("pe") == pytest.approx(outlines.energy(state, laws, form), rel=1e-12)
    np.testing.assert_allclose(forces_of(lmp, len(state.points)), outlines.forces(state, form, laws), atol=1e-10)
    met = outlines.contacts(state, laws, form)
    assert len(met) > len(outlines.contacts(state, form=form)) and {(RING, WALL), (RING, DISK)} & {c.types for c in met}


def test_no_polygon_adheres_to_itself(lmp, tmp_path):
    """Contacts with itself repel, whatever its vertices do to others."""
    corners = [(0, 0), (2, 0), (2, 1.2), (1.14, 1.2), (1.14, 0.3), (0.86, 0.3), (0.86, 1.2), (0, 1.2)]  # a slit of 0.28
    ends = np.array([*corners, corners[0]], dtype=float)
    parts = [a + np.linspace(0, 1, 4, endpoint=False)[:, None] * (b - a) for a, b in itertools.pairwise(ends)]
    state = outlines.Scene([outlines.Outline(np.concatenate(parts) + 1.0)], np.array([5.0, 5.0]), 0.06)
    more = outlines.FORCE.splitlines()[6] + " self 0.06\n" + coefficients() + "run 0\n"
    outlines.start(lmp, tmp_path, state, more)
    assert lmp.get_thermo("pe") == pytest.approx(outlines.energy(state, laws), rel=1e-12)


@pytest.mark.parametrize("newton", ["on", "off"])
@pytest.mark.parametrize("ranks", [1, *(pytest.param(n, marks=pytest.mark.slow) for n in (2, 4))])
def test_atoms_share_the_energy_on_ranks(tmp_path, ranks, newton):
    state = outlines.scene(33)
    (tmp_path / "data").write_text(outlines.data(state))
    deck = outlines.deck("data", newton) + coefficients() + TALLIES + "run 0\n" + SHOW.format("all")
    pe, *virial, energy, xx, yy, xy = run(tmp_path, deck, ranks)["state-all"]
    assert pe == pytest.approx(outlines.energy(state, laws), rel=1e-12) and energy == pytest.approx(pe, rel=1e-12)
    assert [xx, yy, xy] == pytest.approx(virial, rel=1e-9)


PRINT = 'run 0\nprint "state-{0} $(pe:%.17g) $(evdwl:%.17g) $(pxy:%.17g) $(fmax:%.17g)"\n'
AGAIN = outlines.AREA + outlines.THERMO + "neighbor 0.1 bin\nspecial_bonds lj/coul 1.0 1.0 1.0\n"


def test_files_keep_the_adhesion(tmp_path):
    """The same bits from a restart file, and from a data file with all pairs."""
    (tmp_path / "data").write_text(outlines.data(outlines.scene(34)))
    own = "fix d_a0 all property/atom d_a0\n"
    style = outlines.FORCE.splitlines()[6] + "\n"
    deck = outlines.deck("data") + coefficients() + PRINT.format("own") + "write_restart r\nwrite_data d pair ij\n"
    deck += "clear\nread_restart r\n" + own + AGAIN + PRINT.format("restart")
    deck += outlines.HEAD.format(newton="on") + "bond_style line/tension\n" + style
    deck += "read_data d fix d_a0 NULL d_a0\n" + AGAIN + PRINT.format("data")
    found = run(tmp_path, deck, 1)
    assert found["state-restart"].tolist() == found["state-own"].tolist() == found["state-data"].tolist()


def test_it_changes_during_a_run(lmp, tmp_path):
    state = outlines.scene(35)
    change = "variable a equal ramp(0.1,0.02)\nvariable b equal ramp(0.3,0.22)\n"
    change += "fix change all adapt 1 pair circuloline adhesion 1 1 v_a pair circuloline range 1 1 v_b\nrun 10\n"
    outlines.start(lmp, tmp_path, state, coefficients() + change)
    later = {**OWN, RING: (0.02, 0.22)}

    def changed(i, j):
        if DISK in (i, j):
            return laws(i, j)
        pull = np.sqrt(later[i][0] * later[j][0])
        return *outlines.mixed(i, j), pull, (later[i][1] + later[j][1]) / 2

    assert lmp.get_thermo("pe") == pytest.approx(outlines.energy(state, changed), rel=1e-12)


REFUSED = {
    "negative": ("adhesion -0.1 0.2", r"adhesion -0\.1 must not be negative"),
    "short range": ("adhesion 0.2 0.1", r"adhesion 0\.2 needs a range beyond it, not 0\.1"),
    "equal range": ("adhesion 0.2 0.2", r"adhesion 0\.2 needs a range beyond it"),
    "one number": ("adhesion 0.1", r"adhesion"),
    "a text": ("adhesion much 0.2", r"much"),
    "too many": ("0.25 outline 3 adhesion 0.1 0.2", r"pair_coeff i j eps \[delta"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_bad_words_are_refused(lmp, tmp_path, name):
    words, said = REFUSED[name]
    outlines.start(lmp, tmp_path, outlines.scene(36))
    with pytest.raises(Exception, match=said):
        lmp.command(f"pair_coeff 1 1 1.0 {words}")


def test_a_range_that_grows_is_refused(lmp, tmp_path):
    outlines.start(lmp, tmp_path, outlines.scene(36), coefficients() + "variable b equal 0.3+0.01*step\n")
    lmp.command("fix change all adapt 1 pair circuloline range 1 1 v_b")
    with pytest.raises(Exception, match=r"reach of types 1 and 1 grew to 0\.3\d+ from 0\.325"):
        lmp.command("run 3")


# flows ---------------------------------------------------------------------------------------------------------------

DRAGS = {CONTACT: jamlab.ContactDamping(), STOKES: jamlab.StokesDrag(eta_f=0.0)}


@pytest.fixture(scope="module")
def packing():
    """Eight droplets at rest, some of whose gaps are bridged."""
    p = jamlab.read(Path(__file__).parents[1] / "states" / "stable_droplets.h5")
    p = jamlab.relax(p.with_state(params={**p.params, "adhesion": 0.004, "adhesion_range": 0.6}))
    distances = vertex_contacts(p).distance / 0.25
    assert p.converged and (distances > 1.05).any() and (distances < 1.0).any()
    return p


@pytest.mark.parametrize(("drag", "newton"), [(CONTACT, "on"), (STOKES, "off")])
def test_stress_of_a_step_in_rate_is_the_fast_limit(tmp_path, packing, drag, newton):
    """Contacts that pull drag as those that push do."""
    limit = jamlab.complex_modulus(packing, [1.0], DRAGS[drag]).eta_inf
    native = jamlab.evaluate(packing)
    with DropletFlow(tmp_path, packing, "rate 0.01 solver 1e-10", drag, newton) as flow:
        row = flow.run(0)
        assert flow.forces() == pytest.approx(native.forces, abs=1e-12)
    assert row["viscous"] / 0.01 == pytest.approx(limit, abs=1e-9)
    assert row["elastic"] == pytest.approx(-native.stress[0, 1], abs=1e-13)


def test_flows_balance_their_energy(packing):
    found = jamlab.shear(packing, rate=1e-2, strain=5e-3)
    assert "energy balance to better than" in repr(found)
    assert len(found.stress) and np.isfinite(found.stress).all()


def test_a_descent_ends_at_its_force(packing):
    """Contacts that pull have a negative energy, which says nothing of contacts that are gone."""
    with Session(packing.with_state(params=packing.params | {"adhesion": 0.05, "adhesion_range": 0.3})) as session:
        state = descend_droplets(session, 1e-10, FAR, DROPLET_STEPS.settle)
        assert session.contact_energy() < 0.0 and state.max_force <= 1e-10


@pytest.mark.parametrize("law", ["bend", "perimeter"])
def test_flows_need_the_virials_of_laws(tmp_path, packing, law):
    packing = packing.with_state(params=packing.params | {"kappa": 0.1, "kp": 1.0, "p0": 3.7})
    with DropletFlow(tmp_path, packing, "rate 0.01", CONTACT) as flow:
        flow.lmp.command(f"fix_modify {law} virial no")
        with pytest.raises(Exception, match=f"stresses need the virial of fix {law}: use fix_modify {law} virial yes"):
            flow.run(1)


def test_flat_walls_adhere(packing):
    """At the distance along y, the deck as the analysis."""
    p = jamlab.with_walls(packing, flat=True)
    met = jamlab.contacts(p)
    energy = jamlab.evaluate(p).energy
    bare = jamlab.evaluate(p.with_state(params={**p.params, "adhesion": 0.0, "adhesion_range": 0.0})).energy
    assert len(met.pairs) and energy != bare
