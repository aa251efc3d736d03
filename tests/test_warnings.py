"""Warnings name the line of the user, and a negative modulus is said once for each packing by whatever returns one."""

import ast
import functools
import importlib
import pathlib
import types
import warnings
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from campaigns import written

import jamlab
from jamlab import errors
from jamlab.measure import MODULI

FOLDER = pathlib.Path(jamlab.__file__).parent
SOURCES = {path: path.read_text() for path in sorted(FOLDER.rglob("*.py"))}


@pytest.fixture(scope="module")
def unstable():
    """Packings of which G_xy and the mean over directions are negative."""
    return [jamlab.pack(16, 1e-3, seed=seed) for seed in (3, 7)]


def said(call):
    """Texts of the warnings of a call; each is at a line of this file, under the plain filters of Python."""
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("default")
        call()
    assert {each.filename for each in found} <= {__file__}, [str(each) for each in found]
    return [str(each.message) for each in found]


def test_one_function_alone_warns():
    """`errors.warn` finds the line; nobody counts how many functions lie between."""
    for path, text in SOURCES.items():
        if not ("warn" in text or "stacklevel" in text):
            continue
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Attribute) and node.attr in ("warn", "warn_explicit"):
                assert path.name == "errors.py", f"{path}:{node.lineno}"
            assert not (isinstance(node, ast.keyword) and node.arg == "stacklevel"), path


def test_whatever_module_warns_the_line_is_the_callers():
    """Every module that calls `warn`: a function of it, and one below that, called from here."""
    modules = [
        ".".join(("jamlab", *path.relative_to(FOLDER).with_suffix("").parts))
        for path, text in SOURCES.items()
        if "warn" in text
        and any(
            isinstance(n, ast.Call) and getattr(n.func, "id", "").startswith("warn") for n in ast.walk(ast.parse(text))
        )
    ]
    assert len(modules) > 8
    code = compile("def inner(): warn('seen', JamlabWarning)\ndef outer(): inner()", "inside", "exec")
    for name in modules:
        space = {"warn": errors.warn, "JamlabWarning": jamlab.JamlabWarning, "__name__": name}
        exec(code, space)
        importlib.import_module(name)
        outer = functools.lru_cache(types.FunctionType(space["outer"].__code__, space))
        assert said(outer) == ["seen"]


def test_the_line_is_the_users_through_libraries_and_threads(unstable):
    p = unstable[0]
    assert len(said(lambda: np.apply_along_axis(jamlab.complex_modulus.__get__(p), 0, [1.0, 2.0]))) == 1
    assert len(said(functools.partial(jamlab.shear_modulus, p))) == 1
    for library in ("dask", "distributed.client", "dask_jobqueue.core", "tornado.ioloop", "loky.process_executor"):
        space = {"__name__": library, "call": functools.partial(errors.warn, library)}
        exec(compile("def through(): call()", library, "exec"), space)
        assert said(space["through"]) == [library]
    with ThreadPoolExecutor(1) as pool, warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("default")
        pool.submit(jamlab.shear_modulus, p).result()
    assert len(found) == 1  # a thread has no line of the user: the warning is not lost


CALLS = {
    "shear_modulus": lambda p: jamlab.shear_modulus(p, direction="simple"),
    "shear_modulus, finite strain": lambda p: jamlab.shear_modulus(p, "finite-strain", direction="simple"),
    "shear_modulus, angles": lambda p: jamlab.shear_modulus(p, direction=[0.0, 0.1]),
    "shear_modulus, mean": jamlab.shear_modulus,
    "elastic_tensor": jamlab.elastic_tensor,
    "measure": jamlab.measure,
    "measure, one": lambda p: jamlab.measure(p, "g_x"),
    "complex_modulus": lambda p: jamlab.complex_modulus(p, [1.0]),
    "nonlinear_modulus": lambda p: jamlab.nonlinear_modulus(p, [1.0], jamlab.ContactDamping(alpha=0.5), stress=1e-5),
    "choose_flow": lambda p: jamlab.choose_flow(p, omega=1.0),
    "choose_flow, power law": lambda p: jamlab.choose_flow(
        p, jamlab.ContactDamping(alpha=0.5), omega=1.0, amplitude=1e-3
    ),
}


@pytest.mark.parametrize("name", CALLS)
def test_a_negative_modulus_is_said_once_for_each_packing(name, unstable):
    """At one line of a loop, where Python shows a text once."""
    texts = said(lambda: [CALLS[name](p) for p in unstable])
    assert len(texts) == 2 and texts[0] != texts[1] and all("shear-stabilized" in text for text in texts)


def test_the_number_is_the_one_returned(unstable):
    found = jamlab.shear_modulus(unstable[0], direction="simple")
    assert found < 0 and f"{found:.6g}" in said(lambda: jamlab.shear_modulus(unstable[0], direction="simple"))[0]
    stable = jamlab.pack(16, 1e-2, seed=1, ensemble="shear-stabilized")
    assert not [text for call in CALLS.values() for text in said(lambda call=call: call(stable))]
    assert not said(lambda: jamlab.shear_modulus(unstable[0], "affine", direction="simple"))
    assert not said(lambda: jamlab.complex_modulus(unstable[0], [1.0], prestress=False))
    assert not said(lambda: list(jamlab.compress(unstable[0], to=0.86, step=0.01)))  # returns packings


def test_several_packings_and_their_mean(unstable, monkeypatch):
    monkeypatch.setattr(importlib.import_module("jamlab.measure"), "_count_processes", lambda left, *_: left)
    for workers in (1, 2):
        texts = said(lambda workers=workers: jamlab.measure(unstable, MODULI, workers=workers))
        assert [text.partition(":")[0] for text in texts] == ["state 0", "state 1"]
    (text,) = said(lambda: jamlab.mean_spectra(unstable, np.ones(1)))
    assert "G_xy < 0 in 2 of 2 packings" in text


@pytest.mark.slow
def test_a_table_of_a_campaign(tmp_path):
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml", n=64, seeds=1, compress=None, pressures=[1e-3]))
    campaign.run(1)
    table = campaign.table("states")
    negative = int((table["g_x"] < 0).sum())
    texts = said(lambda: campaign.table("states"))
    assert len(texts) == bool(negative) and all(f"g_x < 0 in {negative} of {len(table)}" in text for text in texts)
