"""Names of 0.2 work and warn."""

import inspect

import numpy as np
import pytest

import jamlab
from jamlab import old_names
from jamlab.checks import checked

EVERY = {**old_names.FUNCTIONS, **{old: f"results.{new}" for old, new in old_names.CLASSES.items()}}


@pytest.mark.parametrize("old", EVERY)
def test_an_old_name_is_the_new_one_and_warns(old):
    thing = jamlab
    for part in EVERY[old].split("."):
        thing = getattr(thing, part)
    with pytest.warns(FutureWarning) as caught:
        assert getattr(jamlab, old) is thing
    assert EVERY[old] in str(caught[0].message) and caught[0].filename == __file__
    assert old not in jamlab.__all__


def test_every_result_class_is_found_where_it_was():
    for name in jamlab.results.__all__:
        assert name not in jamlab.__all__ and inspect.isclass(getattr(jamlab.results, name))
        with pytest.warns(FutureWarning):
            assert getattr(jamlab, name) is getattr(jamlab.results, name)


@pytest.mark.parametrize("function", old_names.ARGUMENTS)
def test_an_old_argument_is_the_new_one_and_warns(function):
    old = old_names.ARGUMENTS[function]
    known = inspect.signature(getattr(jamlab, function)).parameters
    for name, new in old.items():
        if new in known:
            with pytest.warns(FutureWarning) as caught:
                assert old_names.today(function, {name: 1}, known) == {new: 1}
            assert name in str(caught[0].message) and new in str(caught[0].message)
            with pytest.raises(jamlab.InputError) as refused:
                old_names.today(function, {new: 2, name: 1}, known)
            assert name in str(refused.value) and "1" in str(refused.value)
        assert name not in known


def test_old_arguments_and_values_reach_the_call():
    with pytest.warns(FutureWarning):
        p = jamlab.jam(n=10, seed=1, large=0.3, start="from-disks")
    assert p == jamlab.jam(n=10, seed=1, fraction_large=0.3) and hash(p) == hash(p.with_state(onset=None))
    assert p != p.with_state(positions=np.nextafter(p.positions, 9)) and p != 1
    with pytest.warns(FutureWarning):
        assert jamlab.jam(*("sp", 8, 2)) == jamlab.jam(8, "sp", 2)


def test_an_unknown_argument_is_refused_by_name():
    @checked
    def halve(n: int) -> int:
        return n // 2

    assert halve(n=4) == 2
    for typed, meant in (("N", "n"), ("random_state", "it takes n"), ("nn", "n")):
        with pytest.raises(jamlab.ArgumentError) as refused:
            halve(**{typed: 4})
        assert (
            isinstance(refused.value, TypeError) and repr(typed) in str(refused.value) and meant in str(refused.value)
        )
    for typed in ("phi", "random_state", "verbose"):
        with pytest.raises(jamlab.ArgumentError) as refused:
            jamlab.jam(n=8, **{typed: 1})
        assert repr(typed) in str(refused.value)


def test_progress_is_a_line_on_stderr(capsys):
    jamlab.jam(n=8, seed=1, progress=True)
    assert "%" in capsys.readouterr().err


def test_results_are_tables(sp_jammed):
    s = jamlab.complex_modulus(sp_jammed, [1e-2, 1.0], prestress=False)
    table = s.to_dataframe()
    assert list(table["omega"]) == [1e-2, 1.0] and table.attrs["g0"] == s.g0 and "<table" in s._repr_html_()
    c = jamlab.contacts(sp_jammed).to_dataframe()
    assert len(c) == len(jamlab.contacts(sp_jammed).pairs) and {"i", "j", "force", "bearing"} <= set(c.columns)
