"""Laws of the rims of droplets, by name: which there are, what they take, and what they refuse."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from packings_by_hand import SQUARE, droplets

import jamlab
from jamlab.laws.laws import LAWS, declared, law_class
from jamlab.laws.parameter import Parameter
from jamlab.laws.rim import RimLaw


@dataclass(frozen=True)
class Cushion(RimLaw):
    """A rim that grows stiffer: U = (eps/n)(1 - d/delta)^n."""

    name: ClassVar[str] = "cushion"
    parameters: ClassVar[Mapping[str, Parameter]] = {
        **RimLaw.parameters,
        "power": Parameter(default=3.0, least=2.0, largest=5.0),
    }

    power: float = 3.0

    def __call__(self, contact, distance):
        """See `PairLaw`."""
        x, n = np.maximum(1.0 - distance / contact, 0.0), self.power
        return (
            self.strength * x**n / n,
            -self.strength * x ** (n - 1) / contact,
            (n - 1) * self.strength * x ** (n - 2) / contact**2,
        )


LAWS.register("cushion", Cushion)


def with_law(**law):
    p = droplets([SQUARE, SQUARE + np.array([1.2, 0.0])], delta=0.25)
    return p.with_state(params={**p.params, **law})


def test_the_law_of_rims_is_the_one_that_is_named():
    assert law_class({}, "rims") is RimLaw and law_class({"law": "cushion"}, "rims") is Cushion
    assert "power" not in declared({}, between="rims") and "power" in declared({"law": "cushion"}, between="rims")
    assert with_law().law == with_law(law="rim").law
    assert with_law(law="cushion").params["law"] == "cushion" and with_law(law="cushion", power=4.0).law.power == 4.0


def test_analysis_follows_the_law_that_is_named():
    soft, stiff = with_law(), with_law(law="cushion", power=2.0)
    np.testing.assert_allclose(jamlab.contacts(soft).forces.size, jamlab.contacts(stiff).forces.size, rtol=1e-13)
    overlap = 1 - 0.2 / 0.25
    ratio = jamlab.contacts(with_law(law="cushion")).forces.size / jamlab.contacts(soft).forces.size
    np.testing.assert_allclose(ratio, [overlap], rtol=1e-12)


@pytest.mark.parametrize("ending", ["h5", "data", "dump", "xyz"])
def test_files_keep_the_law(tmp_path, ending):
    p = with_law(law="cushion", power=4.0)
    jamlab.write(tmp_path / f"p.{ending}", p if ending == "data" else [p])
    q = jamlab.read(tmp_path / f"p.{ending}")
    assert q == p and q.params["law"] == "cushion" and type(q.law) is Cushion


REFUSED = {
    "of disks": (lambda: with_law(law="power"), "has no such parameter"),
    "of rims for disks": (lambda: jamlab.pack(8, phi=0.5, law="rim"), "a law of model dp"),
    "unknown": (lambda: with_law(law="glue"), "unknown force law 'glue'"),
    "of another law": (lambda: with_law(law="rim", power=3.0), "'power'"),
    "out of range": (lambda: with_law(law="cushion", power=9.0), "'power'] is 9.0: must be a number from 2 to 5"),
    "no deck": (lambda: jamlab.evaluate(with_law(law="cushion")), "law 'cushion' has no deck"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refusals_name_value_and_remedy(name):
    call, said = REFUSED[name]
    with pytest.raises(jamlab.JamlabError) as caught:
        call()
    assert said in str(caught.value)
