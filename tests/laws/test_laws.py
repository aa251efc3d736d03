"""Force laws: derivatives, what is typical near onset, names and refusals."""

from dataclasses import dataclass
from importlib.metadata import entry_points
from typing import ClassVar

import numpy as np
import pytest
from laws_of_others import Ramp, Wca

import jamlab
from jamlab.errors import InputError
from jamlab.laws.adhesive import AdhesiveLaw
from jamlab.laws.laws import LAWS, declared, law_class
from jamlab.laws.pair_law import PairLaw
from jamlab.laws.power import PowerLaw
from jamlab.laws.rim import RimLaw
from jamlab.laws.spring_law import SpringLaw
from jamlab.laws.sticky import StickyLaw

OF_EACH = {
    "power": PowerLaw("k", 1.3),
    "power of eps": PowerLaw("eps", 1.3, 2.5),
    "sticky": StickyLaw("k", 1.3, 0.05, 0.05),
    "rim": RimLaw("eps", 1.3, 1.0),
    "adhesive": AdhesiveLaw("eps", 1.3, 1.0, 0.1, 0.3),
    "wca_here": Wca("eps", 1.3),
    "wca_here of k": Wca("k", 1.3),
    "nodeck": LAWS.get("nodeck")("eps", 1.3),
    "ramp": Ramp("eps", 1.3, 2.0, "cube"),
}


def test_every_law_is_looked_at():
    """Those that jamlab declares; tests and other packages register more."""
    own = {point.name for point in entry_points(group="jamlab.laws") if point.dist and point.dist.name == "jamlab"}
    assert own == {"adhesive", "power", "rim", "sticky"} and own < {law.name for law in OF_EACH.values()}


@pytest.mark.parametrize("law", OF_EACH.values(), ids=OF_EACH)
def test_force_and_stiffness_are_derivatives_of_the_energy(law):
    contact, h = np.full(40, 1.0 if law.between == "rims" else 1.2), 1e-6
    distance = np.linspace(0.8, 0.999, 40) * (contact + law.range)
    distance = distance[np.abs(distance - contact - 0.5 * law.range) > 1e-3]  # where a sticky bond begins to yield
    contact = contact[: len(distance)]
    _, slope, stiffness = law(contact, distance)
    (up, up_slope, _), (down, down_slope, _) = law(contact, distance + h), law(contact, distance - h)
    np.testing.assert_allclose(slope, (up - down) / (2 * h), rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(stiffness, (up_slope - down_slope) / (2 * h), rtol=1e-5, atol=1e-6)
    end = law(contact[:1], contact[:1] + law.range)
    np.testing.assert_allclose([end[0][0], end[1][0]], 0.0, atol=1e-14)
    assert (law.drag_stiffness(contact, distance) >= 0).all()


@pytest.mark.parametrize("exponent", [2.0, 2.5, 3.0])
def test_what_is_typical_follows_from_the_energy(exponent):
    """The base class finds from U what a power law has in closed form."""
    law = PowerLaw("k", 1.0, exponent)
    for value in (1e-6, 1e-3, 0.1):
        for method in ("linear_in_phi", "pressure_at", "force_at", "beside_springs"):
            assert getattr(PairLaw, method)(law, value) == pytest.approx(getattr(law, method)(value), rel=1e-6), method
        assert PairLaw.stiffness_at(law, value) * law.stiffness == pytest.approx(law.stiffness_at(value), rel=1e-6)
        # up to a factor, which secants do not see
        ratio = [law.root_energy(u) / PairLaw.root_energy(law, u) for u in (value, 0.1 * value)]
        assert ratio[0] == pytest.approx(ratio[1], rel=1e-6)
    assert PairLaw.root_energy(law, 0.0) == 0.0 and SpringLaw.root_energy(law, 4.0) == 2.0


def test_the_law_is_the_one_that_is_named():
    assert law_class({"k": 1.0}) is PowerLaw and law_class({"k": 1.0, "stickiness": 0.1}) is StickyLaw
    assert law_class({"law": "wca_here"}) is Wca
    assert set(declared({}, "k")) == {"k", "exponent", "stickiness"}
    assert set(declared({"law": "ramp"})) == {"eps", "law", "weight", "form"}
    named, plain = (jamlab.pack(16, phi=0.9, seed=2, law=law) for law in ({"law": "power"}, {}))
    assert np.array_equal(named.positions, plain.positions) and named.params == {"k": 1.0, "law": "power"}


BOX, HERE = np.diag([3.0, 3.0]), [[0.5, 0.5], [1.4, 0.5]]


def two(params, units="eps"):
    return jamlab.Packing("sp", BOX, HERE, params, units, [1.0, 1.0])


REFUSED = {
    "no such law": (
        lambda: two({"eps": 1.0, "law": "lj"}),
        "unknown force law 'lj': known are adhesive, power, rim, sticky",
    ),
    "not a name": (lambda: two({"eps": 1.0, "law": 3}), "params['law'] is 3"),
    "a list": (lambda: two({"eps": 1.0, "law": ["wca_here"]}), "params['law'] is ['wca_here']"),
    "of another law": (
        lambda: two({"eps": 1.0, "law": "wca_here", "exponent": 2.0}),
        "law 'wca_here' of model sp in units eps",
    ),
    "those it has": (lambda: two({"eps": 1.0, "law": "ramp", "wait": 1.0}), "use eps, law, weight, form"),
    "units": (lambda: two({"k": 1.0, "law": "ramp"}, "k"), "law 'ramp' has no units 'k': use eps"),
    "a number": (lambda: two({"eps": 1.0, "law": "ramp", "weight": 11.0}), "'weight'] is 11.0: must be a number from"),
    "a text": (lambda: two({"eps": 1.0, "law": "ramp", "weight": "much"}), "'weight'] is 'much'"),
    "a choice": (lambda: two({"eps": 1.0, "law": "ramp", "form": "round"}), "form 'round': use one of square, cube"),
    "strength as text": (lambda: two({"eps": "much", "law": "wca_here"}), "params['eps'] is 'much'"),
    "power with stickiness": (lambda: two({"eps": 1.0, "law": "power", "stickiness": 0.1}), "'stickiness'"),
    "sticky without": (lambda: two({"eps": 1.0, "law": "sticky"}), "needs a stickiness above 0"),
    "text among own": (lambda: two({"eps": 1.0, "stickiness": 0.1, "exponent": "hertz"}), "'hertz'"),
    "pack": (
        lambda: jamlab.pack(16, 1e-2, law={"law": "wca_here", "exponent": 2.5}),
        "law 'wca_here' has no parameter 'exponent'",
    ),
    "pack, too high": (lambda: jamlab.pack(16, 1e4, law="wca_here"), "10000.0"),
    "pack, as text": (lambda: jamlab.pack(16, "high", law="wca_here"), "high"),
    "pack, tension": (lambda: jamlab.pack(16, -1e-3, law="wca_here"), "-0.001"),
    "jam": (lambda: jamlab.jam(16, law="lj"), "unknown force law 'lj'"),
    "droplets": (lambda: jamlab.jam(8, "dp", law="wca_here"), "a law of model sp"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refusals_name_value_and_remedy(name):
    call, said = REFUSED[name]
    with pytest.raises(jamlab.InputError) as caught:
        call()
    assert said in str(caught.value)


def test_a_law_that_breaks_the_rules_is_not_registered():
    for law, said in [(3, "derived from"), (type("Other", (), {}), "derived from")]:
        with pytest.raises(jamlab.InputError, match=said):
            LAWS.register("other", law)
    with pytest.raises(jamlab.InputError, match="taken"):
        LAWS.register("wca_here", type("Wca", (Wca,), {}))


def test_what_no_carrier_can_do_is_refused_by_name():
    lone = two({"eps": 1.0, "law": "nodeck"})
    with pytest.raises(jamlab.EngineError, match=r"law 'nodeck' has no deck.*`pair_style`.*NoDeck.*docs/extending"):
        jamlab.evaluate(lone)
    assert len(jamlab.contacts(lone).pairs) == 1  # analysis has no need of it
    assert Wca("eps", 1.0).carriers == {"deck"} and PowerLaw("k", 1.0).carriers == {"deck", "kernel", "plugin"}
    walls = jamlab.with_walls(jamlab.pack(16, phi=0.9, seed=1, law="wca_here"), flat=True)
    with pytest.raises(jamlab.EngineError, match="law 'wca_here' has no flat walls"):
        jamlab.evaluate(walls)
    many = jamlab.pack(300, phi=0.3, seed=1, sizes=np.linspace(0.9, 1.1, 300))
    with pytest.raises(jamlab.EngineError, match="law 'wca_here': more than 256 sizes"):
        jamlab.evaluate(many.with_state(params={"k": 1.0, "law": "wca_here"}))


@dataclass(frozen=True)
class Cut(PairLaw):
    """A screened charge that ends at contact, where it still pushes."""

    name: ClassVar[str] = "cut"

    def __call__(self, contact, distance):
        eps = self.energy_of(contact)
        y = eps * contact / distance * np.exp(1 - distance / contact)
        inverse = 1 / distance + 1 / contact
        return y - eps, -y * inverse, y * (inverse**2 + 1 / distance**2)


def test_a_force_that_jumps_at_contact_is_refused():
    """No state near the jump has a minimum, and a search would not end."""
    with pytest.raises(jamlab.InputError, match="force of disks that just touch is 2, must be 0"):
        _ = Cut("eps", 1.0).stiffness


@dataclass(frozen=True)
class WrongStiffness(Ramp):
    """U'' that no carrier but analysis has."""

    name: ClassVar[str] = "wrong_stiffness"

    def __call__(self, contact, distance):
        energy, slope, stiffness = super().__call__(contact, distance)
        return energy, slope, 1.01 * stiffness


@dataclass(frozen=True)
class WrongSign(Ramp):
    """U' as a force that pushes."""

    name: ClassVar[str] = "wrong_sign"

    def __call__(self, contact, distance):
        energy, slope, stiffness = super().__call__(contact, distance)
        return energy, -slope, stiffness


@pytest.mark.parametrize(
    ("law", "said"),
    [
        (WrongStiffness, r"r = 0\.97, contact at 1, its U'' is 2\.02, but U' changes with r by (2|1\.9999)"),
        (WrongSign, r"its U' is 0\.06"),
    ],
)
def test_derivatives_that_are_none_are_refused(law, said):
    with pytest.raises(InputError, match=said + f".* check the derivatives of {law.__name__}"):
        law.of({"eps": 1.0}, "eps")
    assert Ramp.of({"eps": 1.0}, "eps").strength == 1.0
