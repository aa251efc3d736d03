"""Flow is by the laws of the analysis, or refused: what the plugin has of force law and drag is compared with them."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

import jamlab
from jamlab.engine.session import Session
from jamlab.flow import agreement
from jamlab.laws.laws import LAWS
from jamlab.laws.pair_law import PairStyle
from jamlab.laws.spring_law import SpringLaw
from jamlab.mechanics.stiffness import pressure
from jamlab.rheology.drag_law import DragLaw, contact_velocities
from tests.support.bubble_drag import BubbleDrag, CarriedBubbleDrag
from tests.support.wca_law import WcaLaw

CONTACT, FILM, STOKES = jamlab.ContactDamping(0.7), jamlab.ContactDamping(alpha=0.5), jamlab.StokesDrag(0.5)


def of_springs(**params):
    """Disks of a packing of springs, at rest under another law in units eps."""
    p = jamlab.pack(16, 1e-2, 1, ensemble="shear-stabilized")
    return jamlab.relax(jamlab.Packing("sp", p.box, p.positions, {"eps": 2.0, **params}, "eps", p.diameters))


STATES = {
    "springs": lambda: jamlab.pack(16, 1e-2, 1),
    "soft": lambda: jamlab.pack(16, 1e-6, 1),
    "Hertz": lambda: jamlab.pack(16, 1e-2, 1, law={"exponent": 2.5}),
    "sticky": lambda: jamlab.pack(16, 1e-2, 1, law={"stickiness": 0.02}),
    "sizes": lambda: jamlab.pack(72, 1e-2, 1, sizes="uniform:0.2"),
    "eps": lambda: of_springs(),
    "wca": lambda: of_springs(law=WcaLaw.name),
    "droplets": lambda: jamlab.read(Path(__file__).parents[1] / "states" / "stable_droplets.h5"),
}


@pytest.fixture(scope="module")
def states():
    return {name: make() for name, make in STATES.items()}


@pytest.fixture(autouse=True)
def anew():
    agreement.forget_flows()
    yield
    agreement.forget_flows()


def start(packing, law, **how):
    return jamlab.shear(packing, 1e-2, 1e-5, law, rows=2, **how)


def larger(value):
    return 1.001 * float(value)


MUTANTS = [  # state, drag, variable of LAMMPS, what becomes of it
    ("springs", CONTACT, "tau", larger),
    ("springs", CONTACT, "beta", larger),
    ("springs", CONTACT, "alpha", lambda _: 0.999),
    ("springs", CONTACT, "lever_arms", lambda _: "contact"),
    ("springs", CONTACT, "lever_arms", lambda _: "none"),
    ("springs", CONTACT, "even", lambda _: 1.001),
    ("springs", CONTACT, "background_drag", lambda value: 10 * value),
    ("springs", CONTACT, "eta_f", lambda _: 1e-3),
    ("springs", CONTACT, "k", larger),
    ("springs", CONTACT, "exponent", lambda _: 2.001),
    ("springs", CONTACT, "d1", larger),
    ("springs", CONTACT, "shell", lambda _: 1e-3),
    ("soft", CONTACT, "lever_arms", lambda _: "contact"),
    ("soft", CONTACT, "d2", lambda value: (1 + 1e-9) * value),
    ("springs", FILM, "alpha", lambda _: 0.501),
    ("springs", FILM, "tau", larger),
    ("springs", STOKES, "tau", larger),
    ("springs", STOKES, "eta_f", larger),
    ("springs", STOKES, "background_drag", larger),
    ("springs", jamlab.ContactDamping(lever_arms="contact"), "lever_arms", lambda _: "radius"),
    ("springs", CarriedBubbleDrag(), "even", larger),
    ("springs", CarriedBubbleDrag(), "lever_arms", lambda _: "radius"),
    ("Hertz", CONTACT, "exponent", lambda _: 2.501),
    ("Hertz", CONTACT, "tau", larger),
    ("sticky", CONTACT, "shell", larger),
    ("sizes", CONTACT, "own_sizes", lambda words: words.replace("power 0", "power 0.1")),
    ("eps", CONTACT, "eps", larger),
    ("wca", CONTACT, "pair_coeff", lambda words: words.replace("v_eps", "1.001*v_eps")),
    ("wca", CONTACT, "pair_coeff", lambda words: words.replace("v_s/2^(1/6)", "v_s/2^(1/6.01)")),
    ("wca", CONTACT, "pair_modify", lambda _: "shift no"),
    ("wca", CONTACT, "tau", larger),
    ("droplets", CONTACT, "tau", larger),
    ("droplets", CONTACT, "beta", larger),
    ("droplets", CONTACT, "background_drag", larger),
    ("droplets", FILM, "alpha", lambda _: 0.501),
    ("droplets", STOKES, "eta_f", larger),
    ("droplets", CONTACT, "gamma", larger),
    ("droplets", CONTACT, "ka", larger),
    ("droplets", CONTACT, "delta", larger),
    ("droplets", CONTACT, "eps", larger),
]


@pytest.mark.parametrize(("state", "law", "name", "change"), MUTANTS)
def test_no_other_law_passes(states, monkeypatch, state, law, name, change):
    kept, seen = Session.set_variables, []

    def changed(self, settings):
        found = {each: change(value) if each == name else value for each, value in settings.items()}
        seen.append(found != dict(settings))
        kept(self, found)

    monkeypatch.setattr(Session, "set_variables", changed)
    with pytest.raises(jamlab.JamlabError, match=r"the plugin has .*, the analysis "):
        jamlab.shear(states[state], 1e-2, 1e-3, law, rows=5)
    assert any(seen)


@pytest.mark.parametrize("state", STATES)
def test_the_law_itself_passes(states, state):
    start(states[state], CONTACT)


@pytest.mark.slow
@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("law", [FILM, STOKES, jamlab.ContactDamping(0.0, tau=3.0)], ids=str)
def test_every_law_passes_in_every_flow(states, state, law):
    packing = states[state]
    start(packing, law)
    if law is FILM and packing.kind.has_outlines:
        return  # from rest they slip past each other, which flows refuse
    agreement.forget_flows()
    jamlab.oscillate(packing, 1.0, 1e-6, law, cycles=2)
    agreement.forget_flows()
    jamlab.creep(packing, 1e-6 * max(packing.params.get("eps", 1.0), 1e-3), 1.0, law)
    agreement.forget_flows()
    jamlab.relax_stress(packing, 1e-6, 1.0, law)


def test_a_drag_that_says_other_words_than_its_matrix_is_refused(states):
    @dataclass(frozen=True)
    class Heavier(jamlab.ContactDamping):
        name: ClassVar[str] = "heavier"

        def matrix(self, packing, whole, direction):
            return 1.01 * super().matrix(packing, whole, direction)

        lammps_variables = jamlab.ContactDamping.lammps_variables

    with pytest.raises(jamlab.EngineError, match=r"dissipated power per area .* the drag law"):
        start(states["springs"], Heavier())


def test_a_force_law_that_names_another_pair_style_is_refused(states, monkeypatch):
    """Its cutoff lies at the contact, so that energies and forces vanish there alike."""
    monkeypatch.setattr(WcaLaw, "pair_style", PairStyle("harmonic/cut", ("10*v_eps/v_s^2", "v_s")))
    with pytest.raises(jamlab.EngineError, match=r"elastic energy per area .* the force law"):
        start(states["wca"], CONTACT)


def test_once_for_the_same_words(states, monkeypatch):
    kept, seen = agreement.compare, []

    def compare(*given):
        seen.append(kept(*given))
        return seen[-1]

    monkeypatch.setattr("jamlab.flow.overdamped_session.compare", compare)
    for law in (CONTACT, CONTACT, replace(CONTACT, tau=2.0)):
        start(states["springs"], law)
    assert seen == [True, True]
    seen.clear()
    jamlab.shear(states["springs"], 1e-2, 1e-3, STOKES, rows=5)  # no disk leaves the flow of a packing at rest
    assert seen == [False, True]


def test_a_flow_that_begins_without_contacts_is_compared_where_it_has_some(monkeypatch):
    loose = jamlab.pack(16, phi=0.75, seed=1)
    jamlab.shear(loose, 0.1, 0.6, rows=30)
    assert agreement._agreed
    agreement.forget_flows()
    kept = Session.set_variables
    monkeypatch.setattr(Session, "set_variables", lambda self, given: kept(self, {**given, "beta": 0.5}))
    with pytest.raises(jamlab.EngineError, match="dissipated power"):
        jamlab.shear(loose, 0.1, 1.5, rows=75)


def test_bubbles_flow_by_the_plugin_and_respond_as_their_matrix_says():
    packing = jamlab.pack(16, 1e-2, 1, ensemble="shear-stabilized")
    law = CarriedBubbleDrag(tau=2.0)
    linear = jamlab.complex_modulus(packing, 1.0, law)
    run = jamlab.oscillate(packing, 1.0, 1e-7, law, tolerance=1e-5)
    assert run.storage == pytest.approx(linear.storage[0], rel=1e-4)
    assert run.loss == pytest.approx(linear.loss[0], rel=1e-4)
    droplets = STATES["droplets"]()
    with pytest.raises(jamlab.InputError, match="'carried_bubble' for disks alone"):
        start(droplets, law)


def test_disks_flow_by_the_forces_of_any_pair_style(states):
    """Their energy is the one of the law, steps balance energy, and small strains are those of G*."""
    packing = states["wca"]
    run = start(packing, CONTACT)
    assert run.energy_error < 1e-4 and run.packing.provenance["flow_forces"] == "pair_style lj/cut 1.0"
    stopped = jamlab.shear(packing, 1e-2, 0.02, STOKES, rows=3)
    assert stopped.pressure[-1] == pytest.approx(pressure(stopped.packing), rel=1e-9)  # this drag has no pressure
    linear = jamlab.complex_modulus(packing, 1.0, CONTACT)
    small = jamlab.oscillate(packing, 1.0, 1e-7, CONTACT, tolerance=1e-5)
    assert small.storage == pytest.approx(linear.storage[0], rel=1e-4)
    assert small.loss == pytest.approx(linear.loss[0], rel=1e-4)


@dataclass(frozen=True)
class SpringsOfLammps(SpringLaw):
    """Springs of the plugin, as a law whose pair style is all that LAMMPS knows of it."""

    name: ClassVar[str] = "springs_of_lammps"
    pair_style: ClassVar[PairStyle] = PairStyle("harmonic/cut", ("v_eps/(2*v_s^2)", "v_s"))

    def __call__(self, contact, distance):
        k = self.energy_of(contact) / contact**2
        return 0.5 * k * (contact - distance) ** 2, -k * (contact - distance), k


LAWS.register(SpringsOfLammps.name, SpringsOfLammps)


def test_springs_of_a_pair_style_flow_as_those_of_the_plugin():
    """harmonic/cut beside the drag alone: its stiffness, a difference of forces, is that of the law to 1e-9."""
    packing = jamlab.pack(16, 1e-2, 1)
    p = packing.with_state(params={"k": 1.0, "law": SpringsOfLammps.name})
    own, beside = (jamlab.shear(each, 1e-2, 0.1, CONTACT, rows=5) for each in (packing, p))
    assert "flow_forces" not in own.packing.provenance
    assert beside.packing.provenance["flow_forces"] == "pair_style harmonic/cut"
    for name in ("stress", "pressure", "energy", "dissipated"):
        np.testing.assert_allclose(getattr(beside, name), getattr(own, name), rtol=1e-6)


def test_laws_that_nothing_carries_are_refused_by_name(states, monkeypatch):
    with pytest.raises(jamlab.InputError, match="does not carry the drag law 'bubble'"):
        start(states["springs"], BubbleDrag())
    monkeypatch.setattr(WcaLaw, "pair_style", None)
    with pytest.raises(jamlab.JamlabError, match=f"'{WcaLaw.name}' has no deck"):
        start(states["wca"], CONTACT)


def test_flow_is_read_back_with_the_law_of_another_package(states, tmp_path):
    run = start(states["springs"], CarriedBubbleDrag(3.0), path=tmp_path / "a.h5")
    again = jamlab.read_flow(tmp_path / "a.h5")
    assert again.damping == run.damping == CarriedBubbleDrag(3.0)


def test_rates_of_bubbles_are_those_of_centres():
    """`contact_velocities` without lever arms knows no rotation."""
    packing = jamlab.pack(8, 1e-2, 1)
    approach, slide, _ = contact_velocities(packing, "simple", lever_arms="none")
    spins = np.zeros(3 * packing.n + 1)
    spins[2 * packing.n : -1] = 1.0
    assert not (approach @ spins).any() and not (slide @ spins).any()
    assert DragLaw.power(CONTACT, packing, spins) > 0


STYLES = [  # what is refused by the plugin: commands, message
    (["pair_style disk/drag 1 1 elastic off exponent 2.5"], "leaves energies to other styles"),
    (["pair_style disk/drag 1 1 elastic no"], "elastic no is not one of"),
    (["pair_style disk/drag 1 1 even -1"], "even -1 must be a stiffness"),
    (["pair_style disk/drag 1 1 elastic off", "pair_coeff * * 1.0 1.0"], "needs: pair_coeff i j s"),
    (["pair_style disk/drag 1 1 elastic off", "pair_coeff * * 0.0"], "flat walls, which need elastic on"),
    (
        ["pair_style hybrid/overlay zero 1.0 disk/drag 1 1", "pair_coeff * * zero", "pair_coeff * * disk/drag 1 1"],
        "pushes particles too",
    ),
]


@pytest.mark.parametrize(("commands", "said"), STYLES)
def test_pair_styles_that_no_flow_can_have_are_refused(states, commands, said):
    flow = ["fix flow all overdamped rate 0.1", "run 0 post no"]
    with jamlab.Session(states["springs"]) as session, pytest.raises(jamlab.EngineError, match=said):
        for line in [*commands, *flow]:
            session.command(line)


@pytest.mark.slow
def test_a_contact_that_the_correction_of_a_step_closes_is_no_other_drag_law(states):
    """Droplets that flow under a stress: it is dragged on from the next step on."""
    crept = jamlab.creep(states["droplets"], 0.1, 0.5, background_drag=1e-2)
    assert crept.time[-1] == pytest.approx(0.5) and crept.energy_error < 1e-2
