"""Wrong types in every argument of every public function: an error of jamlab that names argument and type."""

import importlib
import inspect
import pkgutil
import typing
from typing import Annotated, Protocol, TypeVar

import numpy as np
import pytest
from campaigns import written
from numpy import typing as npt

import jamlab
from jamlab import arrays, checks
from jamlab.arguments import choices
from jamlab.arguments.table import ARGUMENTS
from jamlab.campaign.observables import OBSERVABLES
from jamlab.errors import named, naming_options
from jamlab.estimates.estimate import ENSEMBLE_QUANTITIES
from jamlab.laws.laws import NAMED, UNNAMED
from jamlab.laws.parameter import UNITS
from jamlab.packing.quantities import QUANTITIES
from jamlab.storage.table_file import TABLE_FORMATS
from jamlab.trajectories.lammps_data import STYLES

FUNCTIONS = [name for name in jamlab.__all__ if inspect.isfunction(getattr(jamlab, name))]
CLASSES = ["Packing", "Session"]  # made by users; ContactDamping and StokesDrag check their numbers
CAMPAIGN = ["status", "plan", "run", "table", "aggregate", "finished", "packings"]
STATISTICS = ["power_laws.fit_power_law", "confidence.bootstrap"]
STRANGE = [object(), None, True, 2.5, np.nan, 1j, "text", b"bytes", [], [object()], {}, {1: 2}, np.array("a"), int]
# good values, with which a function would run: a class may stand for a function
GOOD = {"progress": [int, True], "statistic": [int], "quantities": [int], "path": ["text"], "law": [{}]}
NUMBERS = "size_ratio background_drag direction discard duration error rate rates strain r k_max".split()
GOOD |= {name: [2.5] for name in NUMBERS}
REQUIRED = {
    **dict.fromkeys(("omega", "rate", "duration", "force", "alpha", "stress", "stiffness"), 1.0),
    **dict.fromkeys(("strain", "amplitude", "error"), 0.1),
    **dict.fromkeys(("value", "quantity"), "z"),
    **{"to": 0.95, "rho": 0.9, "rates": [1.0], "n": 4, "pressure": 1e-2, "count": 1, "offsets": [0, 3]},
    **{"k_max": 9.0, "r": 2.0},
    "outlines": [[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]],
    "positions": [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
    **{"pressures": [1e-3], "spectra": [[]], "tolerance": {"z": 0.1}, "columns": ("x",), "values": ["z"]},
    **{"task": "0" * 32, "groups": [[1.0, 2.0]], "statistic": lambda groups: 1.0},
    **{"x": [1.0, 2.0, 3.0], "y": [1.0, 2.0, 3.0]},
}


OF_FUNCTION = {name: {"error": {"z": 0.1}} for name in ("choose", "scene")}  # where a name takes something else


@pytest.fixture(scope="module")
def required(random_disks, tmp_path_factory):
    """Name -> a value for the arguments that have no default."""
    packing = random_disks()
    path = tmp_path_factory.mktemp("types") / "p.h5"
    jamlab.write(path, packing)
    own = {"u": jamlab.universe(packing), "source": packing, "packing": packing, "packings": [packing], "path": path}
    own |= {"recipe": jamlab.Recipe(protocol="phi", n=4, phi=0.5)}
    own |= {"before": packing, "after": packing}
    own |= {"flow": packing, "oscillations": [], "curves": [], "runs": [], "run": [packing, packing]}
    own |= {"box": packing.box, "found": jamlab.voids(packing), "picture": np.zeros((4, 4)), "damping": None}
    return REQUIRED | own


def test_every_public_function_is_checked():
    assert len(FUNCTIONS) > 40
    assert not [name for name in FUNCTIONS if not hasattr(getattr(jamlab, name), "__wrapped__")]


def checked_functions():
    """Every function of the package, and every method, whose arguments are checked."""
    for module in pkgutil.walk_packages(jamlab.__path__, "jamlab."):
        if not module.name.endswith("__main__"):
            for thing in vars(importlib.import_module(module.name)).values():
                for found in vars(thing).values() if inspect.isclass(thing) else [thing]:
                    found = found.fget if isinstance(found, property) else getattr(found, "__func__", found)
                    if inspect.isfunction(found) and found.__code__.co_filename == checks.__file__:
                        yield inspect.unwrap(found)


def unread(hint):
    """Parts of an annotation that the checks do not read, but for those that say that anything goes."""
    kind = checks._kind(hint)
    if kind is checks._ANYTHING and hint not in (typing.Any, Ellipsis):
        yield hint
    of_parts = typing.get_origin(hint) is not typing.Literal and kind.text != "a function"
    if not hasattr(hint, "__metadata__") and of_parts:  # of none of them do the parts count
        for part in typing.get_args(hint):
            yield from unread(part)


def test_every_annotation_of_an_argument_is_read():
    """Else its argument would go unchecked, whatever the version of numpy."""
    functions = {*checked_functions()}
    assert len(functions) > 90
    left = {(f.__qualname__, name, str(part)) for f in functions for name, hint in checks._hints(f).items()
            for part in unread(hint)}  # fmt: skip
    assert not left


class Unreadable(Protocol):
    """Cannot be asked about at run time."""

    member: int


@pytest.mark.parametrize(
    "hint",
    [npt.NDArray[np.float64], npt.NDArray[np.int64] | None, npt.ArrayLike, TypeVar("T"), Unreadable,
     Unreadable | int, Annotated[Unreadable, "of somebody else"], {1: 2}, 3],
)  # fmt: skip
def test_an_annotation_that_is_not_read_is_not_checked_and_no_error(hint):
    def function(argument):
        return argument

    function.__annotations__ = {"argument": hint}
    for value in (np.ones(2), [1, 2], 3, None):
        assert checks.checked(function)(value) is value


@pytest.mark.parametrize(
    ("hint", "good", "bad"),
    [
        (arrays.Array, [1, 2.5, [1, 2], np.ones((2, 2)), np.float32(1)], [True, "1", None, [[1], [1, 2]], 1j]),
        (arrays.ArrayLike | None, [1, None, (1.0, 2)], ["a", object(), [True]]),
        (arrays.Indices, [1, [1, 2]], [1.0, [True]]),
        (arrays.Mask, [True, [True, False]], [1, [0.0]]),
        (arrays.Complex, [1j, 1.0, [1, 2j]], ["1j", True]),
        (Annotated[int, "of somebody else"], [1, np.int64(2)], [2.5, "1"]),
        (str | arrays.ArrayLike | arrays.Mask, ["a", 1.0, [True]], [b"a", None, ["a"]]),
        (choices.Ensemble, ["fixed-box"], ["fixed", "", None, 1, ["fixed-box"]]),
        (choices.Direction | None, ["pure", 0.3, np.float32(1), None], ["affine", True, [0.3]]),
        (choices.ModelName, ["sp", "dimers"], [None, 2, ["sp"]]),  # a package may register dimers
        (choices.Law, ["hertz", {"k": 1.0, "law": "power"}, {"a0": [1.0, 2.0]}], [2.5, {1: 2.0}]),
    ],
)
def test_types_of_arrays_carry_their_check(hint, good, bad):
    def function(argument):
        return argument

    function.__annotations__ = {"argument": hint}
    call = checks.checked(function)
    for value in good:
        assert call(value) is value or call(value) == checks.as_plain(value)
    for value in bad:
        with pytest.raises(jamlab.InputError, match=r"function: argument = |unknown argument "):
            call(value)


def test_types_of_choices_hold_the_names_that_there_are():
    for choice, names in (
        (choices.QuantityName, QUANTITIES),
        (choices.EnsembleQuantity, ENSEMBLE_QUANTITIES),
        (choices.TableName, ("states", "onset", *OBSERVABLES)),
        (choices.TableFormat, TABLE_FORMATS),
        (choices.AtomStyle, STYLES),
        (choices.Units, UNITS),
    ):
        assert typing.get_args(choice) == tuple(names)
    names = [name for part in typing.get_args(choices.LawName) for name in typing.get_args(part)]
    assert names == sorted([*NAMED, *(law for laws in UNNAMED.values() for law in laws.values())])


def test_a_wrong_name_is_answered_with_those_that_there_are():
    @checks.checked
    def made(ensemble: choices.Ensemble, direction: choices.Direction | None = None) -> None:
        """Take two choices."""

    with pytest.raises(jamlab.InputError, match=r"^unknown ensemble 'box': use one of fixed-box, shear-stabilized$"):
        made("box")
    with pytest.raises(
        jamlab.InputError, match=r"^unknown direction 'x': use `simple`, or another of simple, pure, or a number$"
    ):
        made("fixed-box", "x")


def beyond(name, place):
    """Numbers just outside the range of an argument, and those that are not finite."""
    line = ARGUMENTS.get(name)
    if line is not None and line.kind in ("integer", "number"):
        least, highest = line.limits_at(place)
        out = [] if least is None else [least if line.above else least - (line.kind == "integer" or abs(least) or 1)]
        out += [] if highest is None else [highest + 1 if line.kind == "integer" else 1.001 * highest + 1e-300]
        yield from [int(value) for value in out] if line.kind == "integer" else [*out, np.nan, np.inf]


@pytest.mark.parametrize("name", FUNCTIONS + CLASSES)
def test_a_number_out_of_the_range_in_the_table_is_refused_with_the_range(name, required):
    """Before anything else is looked at: other arguments are of the right type, and may be impossible together."""
    function = getattr(jamlab, name)
    parameters = inspect.signature(function).parameters
    p = required["packing"]
    needed = (
        required
        | OF_FUNCTION.get(name, {})
        | {"model": "sp", "box": p.box, "params": p.params, "positions": p.positions}
    )
    needed = {key: needed[key] for key, each in parameters.items() if each.default is each.empty and key in needed}
    needed |= {"error": {"z": 0.1}} if name in ("choose", "scene") else {}
    for key in parameters:
        kind = checks._arguments(inspect.unwrap(function if name in FUNCTIONS else function.__init__)).kinds.get(key)
        for value in beyond(key, name):
            if kind and kind.holds(value):
                with pytest.raises(jamlab.InputError) as refused:
                    function(**needed | {key: value})
                assert str(refused.value) == f"{key} = {value!r}: must be {ARGUMENTS[key].allowed(name)}"


def test_a_message_names_the_option_if_the_command_has_it():
    with naming_options({"first_step": "--first-step"}):
        assert named("first_step", 2.0) == "--first-step 2.0" and named("seed", -1) == "seed = -1"
    assert named("first_step", 2.0) == "first_step = 2.0"


def test_masked_entries_are_refused_wherever_an_array_is_one(random_disks):
    half = np.ma.masked_array(np.ones((20, 20)), np.eye(20))
    for call in (
        lambda: jamlab.micrograph(half),
        lambda: jamlab.micrograph(labels=np.ma.masked_array(np.eye(20, dtype=int), np.eye(20))),
        lambda: random_disks().with_state(positions=half[:, :2]),
        lambda: jamlab.complex_modulus(random_disks(), half[0]),
    ):
        with pytest.raises(jamlab.InputError, match="mask"):
            call()


@pytest.mark.parametrize("name", FUNCTIONS + CLASSES)
def test_only_errors_of_jamlab(name, required, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    p = required["packing"]
    made_from = {"model": "sp", "box": p.box, "params": p.params, "positions": p.positions, "diameters": p.diameters}
    own = made_from if name == "Packing" else OF_FUNCTION.get(name, {})
    refuse_strange(getattr(jamlab, name), required | own)


@pytest.mark.parametrize("name", [n if n != "run" else pytest.param(n, marks=pytest.mark.slow) for n in CAMPAIGN])
def test_methods_of_a_campaign(name, required, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml"))
    refuse_strange(getattr(campaign, name), required)


@pytest.mark.parametrize("name", STATISTICS)
def test_statistics(name, required):
    module, function = name.split(".")
    found = getattr(importlib.import_module(f"jamlab.statistics.{module}"), function)
    refuse_strange(found, required | {"n": [1.0, 2.0, 3.0]})


def refuse_strange(function, required):
    """Give every argument all that is strange: nothing but a JamlabError may come of it."""
    parameters = inspect.signature(function).parameters.values()
    named = [p for p in parameters if p.kind is not p.VAR_KEYWORD]
    refused = 0
    for parameter in named:
        others = {p.name: required[p.name] for p in named if p.default is p.empty and p is not parameter}
        for value in STRANGE:
            good = any(value is each or value == each for each in GOOD.get(parameter.name, []))
            if good or (parameter.annotation in (bool, "bool") and value is True):
                continue
            if value is parameter.default or (value is None and "None" in str(parameter.annotation)):
                continue
            try:
                if parameter.kind is parameter.VAR_POSITIONAL:
                    function(value, **others)
                else:
                    function(**others | {parameter.name: value})
            except jamlab.JamlabError:
                refused += 1
    assert refused >= 8 * len(named)


def test_an_unknown_argument_is_refused_by_name():
    @checks.checked
    def halve(n: int) -> int:
        return n // 2

    assert halve(n=4) == 2
    for typed, meant in (("N", "use `n`"), ("random_state", "it takes n"), ("nn", "n")):
        with pytest.raises(jamlab.ArgumentError) as refused:
            halve(**{typed: 4})
        assert isinstance(refused.value, TypeError)
        assert repr(typed) in str(refused.value) and meant in str(refused.value)
    for typed in ("phi", "random_state", "verbose"):
        with pytest.raises(jamlab.ArgumentError, match=repr(typed)):
            jamlab.jam(n=8, **{typed: 1})


def test_progress_is_a_line_on_stderr(capsys):
    jamlab.jam(n=8, seed=1, progress=True)
    assert "%" in capsys.readouterr().err
