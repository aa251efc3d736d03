"""Wrong types in every argument of every public function: an error of jamlab that names argument and type."""

import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

import jamlab
from jamlab.checks import checked

FUNCTIONS = [name for name in jamlab.__all__ if inspect.isfunction(getattr(jamlab, name))]
STRANGE = [
    object(),
    None,
    True,
    2.5,
    float("nan"),
    1j,
    "text",
    b"bytes",
    [],
    [object()],
    {},
    {1: 2},
    np.array("a"),
    int,
]
REQUIRED = {
    "omega": 1.0,
    "to": 0.95,
    "rho": 0.9,
    "n": 4,
    "pressure": 1e-2,
    "count": 1,
    "offsets": [0, 3],
    "positions": [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
    "pressures": [1e-3],
    "spectra": [[]],
    "force": 1.0,
    "alpha": 1.0,
    "stress": 1.0,
    "stiffness": 1.0,
    "tolerance": {"z": 0.1},
    "columns": ("x",),
}


@pytest.fixture(scope="module")
def required(random_disks, tmp_path_factory):
    """Name -> a value for the arguments that have no default."""
    packing = random_disks()
    path = tmp_path_factory.mktemp("types") / "p.h5"
    packing.write(path)
    own = {
        "u": jamlab.universe(packing),
        "source": packing,
        "packing": packing,
        "packings": [packing],
        "path": path,
        "found": jamlab.voids(packing),
    }
    return REQUIRED | own | {"picture": np.zeros((4, 4)), "damping": None}


def test_every_public_function_is_checked():
    assert len(FUNCTIONS) > 40
    assert not [name for name in FUNCTIONS if not hasattr(getattr(jamlab, name), "__wrapped__")]


@pytest.mark.parametrize("name", FUNCTIONS)
def test_only_errors_of_jamlab(name, required, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    function = getattr(jamlab, name)
    parameters = inspect.signature(function).parameters.values()
    named = [p for p in parameters if p.kind is not p.VAR_KEYWORD]
    refused = 0
    for parameter in named:
        others = {p.name: required[p.name] for p in named if p.default is p.empty and p is not parameter}
        for value in STRANGE:
            if (parameter.annotation is bool and value is True) or (parameter.name == "progress" and value is int):
                continue
            if value is parameter.default or (value is None and "None" in str(parameter.annotation)):
                continue
            try:
                function(**others, **{parameter.name: value})
            except jamlab.JamlabError:
                refused += 1
    assert refused >= 8 * len(named)


def test_what_was_taken_silently(random_disks, tmp_path):
    p = random_disks()
    for damping in (0, {}, "contact"):
        with pytest.raises(jamlab.InputError, match=r"complex_modulus: damping = .*must be a ContactDamping"):
            jamlab.complex_modulus(p, [1.0], damping)
    with pytest.raises(jamlab.InputError, match=r"prestress = 'a' \(str\): must be True or False"):
        jamlab.complex_modulus(p, [1.0], prestress="a")
    with pytest.raises(jamlab.InputError, match=r"read: path = True \(bool\): must be text or a path"):
        jamlab.read(True)
    with pytest.raises(jamlab.InputError, match=r"jam: n = 2.0 \(float\): must be a whole number"):
        jamlab.jam(n=2.0)
    with pytest.raises(jamlab.InputError, match=r"ranks = 10+.*at most"):
        jamlab.pack(n=4, pressure=1e-2, ranks=10**30)
    for law in ({"beta": "a"}, {"beta": None}, {"tau": [1]}, {"tau": True}):
        with pytest.raises(jamlab.InputError, match=f"{next(iter(law))} = "):
            jamlab.ContactDamping(**law)
    with pytest.raises(jamlab.InputError, match="eta_f = "):
        jamlab.StokesDrag(eta_f={})


@checked
def everything(
    whole: int,
    number: float = 0.5,
    *,
    flag: bool = False,
    text: str | None = None,
    values: ArrayLike = (),
    whole_values: NDArray[np.int64] | None = None,
    names: Sequence[str] = (),
    table: Mapping[str, float] | None = None,
    stream: Iterable[int] = (),
    path: str | Path = "",
    picture: str | Path | ArrayLike = "",
    call: Callable[[int], int] | None = None,
    **rest: float,
) -> str:
    """Arguments of every kind."""
    return "done"


RIGHT = [
    {"whole": np.int32(3)},
    {"number": 2},
    {"number": np.float32(2)},
    {"flag": np.True_},
    {"text": None},
    {"values": 1},
    {"values": [[1, 2.0]]},
    {"whole_values": np.arange(3)},
    {"names": ["a", "b"]},
    {"table": {"z": 1}},
    {"stream": range(2)},
    {"path": Path("a")},
    {"picture": "a.png"},
    {"picture": np.zeros((2, 2), dtype=np.uint8)},
    {"call": abs},
    {"other": 1.5},
]
WRONG = [
    {"whole": 2.0},
    {"whole": True},
    {"number": "2"},
    {"number": True},
    {"flag": 1},
    {"text": 1},
    {"values": "12"},
    {"values": [[1], [1, 2]]},
    {"whole_values": [0.5]},
    {"names": "ab"},
    {"names": ["a", 1]},
    {"table": {1: 1}},
    {"table": {"z": "1"}},
    {"stream": ["a"]},
    {"path": 1},
    {"picture": None},
    {"call": 1},
    {"other": "a"},
]


@pytest.mark.parametrize("given", RIGHT, ids=lambda given: next(iter(given)))
def test_right_types_pass(given):
    assert everything(**{"whole": 1} | given) == "done"


@pytest.mark.parametrize("given", WRONG, ids=lambda given: next(iter(given)))
def test_wrong_types_are_named(given):
    ((name, value),) = given.items()
    with pytest.raises(jamlab.InputError, match=rf"everything: {name} = .*\({type(value).__name__}\): must be "):
        everything(**{"whole": 1} | given)


def test_by_position_and_for_readers():
    with pytest.raises(jamlab.InputError, match="number = 'a'"):
        everything(1, "a")
    assert list(inspect.signature(everything).parameters)[:2] == ["whole", "number"]
    assert everything.__doc__ == "Arguments of every kind."
