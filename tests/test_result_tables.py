"""Every result is a table of what a user would write down, and says which of its arrays are not in it."""

from dataclasses import fields
from functools import partial

import numpy as np
import pandas as pd
import pytest
from one_of_each import objects

import jamlab


@pytest.fixture(scope="module")
def results():
    return {name: thing for name, thing in objects().items() if name not in ("Packing", "Campaign")}


def _same(part, column):
    return np.array_equal(part, column, equal_nan={part.dtype.kind, column.dtype.kind} <= {*"fc"})


def test_no_array_is_left_out_without_a_word(results):
    assert {*jamlab.results.__all__} <= {*results}
    for name, thing in results.items():
        table = thing.to_dataframe()
        assert table.shape[1] and (len(table) or name in ("PictureVoids", "T1Events")), name
        assert len(set(table.columns)) == table.shape[1] and "not_in_table" not in table.columns
        away = set(table.attrs.get("not_in_table", ()))
        assert not away & set(table.columns) and away <= {field.name for field in fields(thing)}
        for field in fields(thing):
            value = getattr(thing, field.name)
            if not isinstance(value, np.ndarray) or field.name in away or field.name in table.attrs:
                continue
            columns = [table[each].to_numpy() for each in table if np.shape(table[each]) == np.shape(value)[:1]]
            parts = value.T if value.ndim == 2 else [value]
            held = all(any(_same(part, column) for column in columns) for part in parts)
            assert held or name in ("ElasticTensor", "Collapse"), (name, field.name)  # whose tables follow below
        assert "<p>" in thing._repr_html_()


def test_contacts(results):
    """i, j, force, gap, length and direction; the forces alone have the pairs as well."""
    c = results["Contacts"]
    table, forces = c.to_dataframe(), c.forces.to_dataframe()
    assert list(table.columns[:6]) == ["i", "j", "force", "gap", "length", "angle"]
    np.testing.assert_array_equal(table[["i", "j"]], c.pairs)
    np.testing.assert_array_equal(table["force"], c.forces.size)
    sizes = c.packing.diameters
    np.testing.assert_allclose(
        table["length"] - 0.5 * (sizes[table["i"]] + sizes[table["j"]]), table["gap"], atol=1e-14
    )
    np.testing.assert_allclose(np.cos(table["angle"]) * table["length"], c.r[:, 0], atol=1e-14)
    assert table.attrs["units"] == {"length": "d", "force": "k d", "stress": "k"}
    pd.testing.assert_frame_equal(forces[["i", "j", "gap"]], table[["i", "j", "gap"]])


def test_elastic_tensor(results):
    """Moduli of the table are those of the functions; the components are the energy's second derivatives."""
    p, t = jamlab.pack(16, 1e-2, seed=1), results["ElasticTensor"]
    table = t.to_dataframe().set_index("response")
    relaxed = table.loc["relaxed"]
    assert relaxed["g"] == pytest.approx(jamlab.shear_modulus(p), rel=1e-12)
    assert relaxed["g_x"] == pytest.approx(jamlab.shear_modulus(p, direction="simple"), rel=1e-12)
    assert relaxed["b"] == pytest.approx(jamlab.bulk_modulus(p), rel=1e-12)
    assert table.loc["affine", "b"] == pytest.approx(jamlab.bulk_modulus(p, "affine"), rel=1e-12)
    assert relaxed["nu"] == pytest.approx((relaxed["b"] - relaxed["g"]) / (relaxed["b"] + relaxed["g"]))
    assert relaxed["c_12"] == t.relaxed[0, 0, 1, 1] and relaxed["c_23"] == t.relaxed[1, 1, 0, 1]


def test_collapse_and_fit(results):
    c = results["Collapse"].to_dataframe()
    assert c.attrs["mu"] == results["Collapse"].mu and len(c) == 6
    np.testing.assert_array_equal(c.pivot(index="pressure", columns="omega", values="loss"),
                                  results["Collapse"].loss[::-1])  # fmt: skip
    fit = results["HerschelBulkley"].to_dataframe()
    np.testing.assert_allclose(fit["law"], fit["stress"], rtol=1e-6)
    assert fit.attrs["yield_stress"] == pytest.approx(0.01, rel=1e-4)


def test_frequencies_are_roots_of_eigenvalues(results):
    modes = results["Modes"]
    assert np.allclose(modes.frequencies**2, np.abs(modes.eigenvalues))
    unstable = jamlab.results.Modes(np.array([-4.0, 9.0]), np.eye(2)[:, None], np.zeros(1, int), 2, 1e-9)
    assert unstable.frequencies.tolist() == [-2.0, 3.0]


def test_a_part_of_a_function_has_its_name_and_an_error_its_state(results):
    """Of several packings the error of a function says in a note which one it failed for."""
    p = jamlab.pack(16, 1e-2, seed=1)
    found = jamlab.measure(p, [partial(strongest), "z"])
    assert found["strongest"] == strongest(p)
    with pytest.raises(ZeroDivisionError) as failed:
        jamlab.measure([p, p], lambda packing: 1 / 0)
    assert failed.value.__notes__ == ["state 0"]


def strongest(packing):
    return jamlab.contacts(packing).forces.size.max()


def test_functions_of_the_user_are_measured(results):
    p = jamlab.pack(16, 1e-2, seed=1)
    found = jamlab.measure(p, [strongest, "z", lambda packing: packing.n])
    assert (
        list(found) == ["strongest", "z", "<lambda>"] and found["strongest"] == strongest(p) and found["<lambda>"] == 16
    )
    several = jamlab.measure([p, p], strongest)
    assert several["strongest"].tolist() == [strongest(p)] * 2
    for wrong, told in {"positions": "ndarray", "params": "ReadOnlyDict"}.items():
        with pytest.raises(jamlab.InputError, match=f"state 0: {wrong} returned a value of type {told}: .*one number"):
            jamlab.measure([p], named(wrong))
    with pytest.raises(jamlab.InputError, match="called strongest"):
        jamlab.measure(p, [strongest, named("n", "strongest")])
    with pytest.raises(jamlab.InputError, match="quantity of jamlab"):
        jamlab.measure(p, named("n", "z"))


def named(attribute, name=""):
    def function(packing):
        return getattr(packing, attribute)

    function.__name__ = name or attribute
    return function


def test_numbers_of_numpy_are_numbers():
    """float32 once overflowed beside limits beyond its range; the value is that of the same float."""
    single = float(np.float32(1e-2))
    for kind in (np.float32, np.float64, np.float16, np.array):
        value = kind(1e-2)
        assert jamlab.pack(np.int16(8), value, np.uint8(1)) == jamlab.pack(8, float(value), 1)
    p = jamlab.pack(8, single, seed=1)
    s = jamlab.complex_modulus(p, np.float32(1e-2), jamlab.ContactDamping(beta=np.float32(1.0)))
    assert s.omega[0] == single and type(p.params["k"]) is float
    exact = jamlab.pack(8, single, law={"exponent": float(np.float32(2.5))})
    assert jamlab.pack(8, np.float32(1e-2), law={"exponent": np.float32(2.5)}) == exact
    state = jamlab.shear(p, rate=np.float32(0.1), strain=np.float32(0.01), rows=np.int32(2))
    assert state.strain[-1] == pytest.approx(0.01)
    made = jamlab.Packing("sp", p.box, p.positions, {"k": np.float32(1.0)}, "k", p.diameters)
    strained = [jamlab.shear_modulus(made, "finite-strain", strain_step=kind(2.0**-20)) for kind in (np.float32, float)]
    assert strained[0] == strained[1]
    parts = [np.array(0.1), np.float32(0.2), 0.3]  # in sequences and mappings too
    curve = [jamlab.flow_cost(p, rates)["rate"].tolist() for rates in (parts, tuple(parts), [*map(float, parts)])]
    assert curve[0] == curve[1] == curve[2] and all(type(rate) is float for rate in curve[0])
    error = {"z": np.array(0.5)}
    assert repr(jamlab.choose(0.9, error)) == repr(jamlab.choose(0.9, {"z": 0.5}))
    for wrong in (np.float32(np.nan), np.float32(np.inf), np.bool_(True), np.array([1e-2])):
        with pytest.raises(jamlab.InputError, match="pressure"):
            jamlab.pack(8, wrong)
