"""Every hint names what exists: each is evaluated on a real object, for all classes, functions, commands and words."""

import inspect
import logging
import re
import types
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pandas as pd
import pytest
import typer
from one_of_each import STATES, objects

import jamlab
from jamlab.argument_habits import INSTEAD
from jamlab.cli.command_habits import COMMANDS
from jamlab.cli.main import app
from jamlab.field_habits import FIELD
from jamlab.habits import CONCEPTS, LIMITS, MODULE, SHELL
from jamlab.hints import HABITS, argument_hint, attributes, hint, meant, misspelt
from jamlab.laws.laws import LAWS
from jamlab.laws.parameter import Parameter
from jamlab.laws.power import PowerLaw
from jamlab.packing.quantities import MEASURED

WORDS = sorted({word for concept in (*FIELD, *CONCEPTS, *HABITS) for word in concept.words.split()})
PUBLIC = [*jamlab.__all__, "__version__"]
FUNCTIONS = [name for name in jamlab.__all__ if inspect.isfunction(getattr(jamlab, name))]
CODE = re.compile("`([^`]*)`")


@pytest.fixture(scope="module")
def things():
    return objects()


@pytest.fixture(scope="module")
def at_hand(things):
    return names_at_hand(things)


def names_at_hand(things):
    """Names that hints use; functions that take long only check their arguments and give what is at hand."""
    packing, run = things["Packing"], things["ShearRun"]
    droplets = jamlab.read(STATES / "compressed_droplets.h5")
    made = {"flow_curve": things["FlowCurve"], "shear": run, "oscillate": things["Oscillation"], "pack": packing}
    made |= {"quasistatic_shear": things["QuasistaticShear"], "creep": things["CreepRun"], "jam": packing}
    made |= {"relax_stress": things["StressRelaxation"], "compress": [packing], "decompress": packing}
    made |= {"Session": None, "estimate": things["Estimate"], "scaling_collapse": things["Collapse"]}
    made |= {"track_droplets": None, "micrograph": things["Micrograph"], "universe": None, "write": None}
    made |= {"read": packing, "read_all": [packing], "open_campaign": things["Campaign"], "write_movie": None}
    made |= {"displacement_correlation": things["DisplacementCorrelation"], "synthetic_micrograph": None}
    made |= {"displacement_spectrum": things["DisplacementSpectrum"]}
    made |= {"stop_flow": things["StoppedFlow"], "relax": packing, "mean_flow_curve": things["MeanFlowCurve"]}
    made |= {"density_of_states": things["DensityOfStates"], "mean_spectra": things["MeanSpectra"]}
    made |= {"pair_correlation": things["PairCorrelation"], "structure_factor": things["StructureFactor"]}
    made |= {"spectral_density": things["SpectralDensity"], "anneal": packing, "relax_radii": packing}
    made |= {"swap_sizes": packing, "damped_vibrations": things["DampedVibrations"]}
    made |= {"quasilocalized_modes": things["QuasilocalizedModes"], "lowest_modes": things["Modes"]}
    own = {name: bound(getattr(jamlab, name), found) for name, found in made.items()}
    spared = types.SimpleNamespace(**{name: getattr(jamlab, name) for name in PUBLIC} | own)
    names = {"jamlab": spared, "np": np, "packing": packing, "omega": np.ones(1), "rates": [0.1], "strain": 0.1}
    names |= {
        "m": types.SimpleNamespace(
            packing=lambda model: droplets if model == "dp" else packing, draw=lambda path: None
        ),
        "session": types.SimpleNamespace(packing=lambda: packing),
        "rate": 0.1,
    }
    names |= {"n": 4, "pressure": 1e-2, "path": "p.h5", "packings": [packing], "duration": 1.0, "stress": 1e-3}
    names |= {
        "campaign": things["Campaign"],
        "model": "dp",
        "onset": packing,
        "amplitude": 1e-3,
        "flow": run,
        "run": run,
        "values": ["z"],
    }
    names |= {
        "pressures": [1.0],
        "spectra": [[]],
        "picture": None,
        "pictures": [],
        "source": [],
        "logging": logging,
    }
    return names | {"known": set()}


def bound(function, found):
    """A function that only checks which arguments it is given."""

    def call(*args, **kwargs):
        inspect.signature(function).bind(*args, **kwargs)
        return found

    return call


def wrong(text, thing, at_hand):
    """What is wrong with the code of a hint; "" where all of it can be evaluated."""
    try:
        check(text, thing, at_hand)
    except Exception as error:  # whatever it is: what was hinted at does not exist
        return f"{type(thing).__name__}{text}: {type(error).__name__}: {error}"
    return ""


def check(text, thing, at_hand):
    """Evaluate all code of a hint."""
    own = {*attributes(type(thing))} - {"packing"} if thing is not None else set()  # it is one of the user in a hint
    space = {name: value for name, value in at_hand.items() if name not in own}
    for code in {*CODE.findall(text)} - at_hand["known"]:
        if "jamlab." in code:
            at_hand["known"].add(code)  # the same for every class
        if code.startswith("jamlab ") and not code.startswith("jamlab."):
            assert code.removeprefix("jamlab ") in COMMANDS_THERE, text
            continue
        names = {node for node in compile(code, "hint", "eval").co_names if node not in space and node in own}
        if (
            code.startswith("plot")
            or ".plot" in code
            or "draw(" in code
            or "write(" in code
            or "to_csv" in code
            or "export(" in code
        ):
            code = code.partition("(")[0]  # draws or writes
        try:
            eval(code, {}, space | {name: getattr(thing, name) for name in names})
        except jamlab.InputError as error:  # an attribute of one of the two kinds of packings
            assert isinstance(thing, jamlab.Packing | jamlab.results.ShearRun), (text, error)  # or of longer flows


def commands(group=None, prefix=""):
    group = group or typer.main.get_command(app)
    for name, command in group.commands.items():
        yield from commands(command, f"{prefix}{name} ") if hasattr(command, "commands") else [(prefix + name, command)]


def names_of(command):
    return [name for each in command.params for name in each.opts]


COMMANDS_THERE = dict(commands())


@pytest.mark.parametrize(
    "words",
    [WORDS[::4], *(pytest.param(WORDS[k::4], marks=pytest.mark.slow) for k in (1, 2, 3))],
    ids=["every fourth", "first rest", "second rest", "third rest"],
)
def test_every_hint_of_a_class_exists(things, at_hand, words):
    asked, found = 0, set()
    for thing in [*things.values(), None]:
        cls = type(thing)
        kinds = [each.__name__ for each in cls.__mro__] if thing is not None else [MODULE]
        known = attributes(cls) if thing is not None else PUBLIC
        told = {hint(word, kinds, known, MEASURED) for word in words if word not in known and not hasattr(cls, word)}
        asked += len(told)
        found |= {wrong(text, thing, at_hand) for text in told}
    assert found == {""} and asked > 500


def test_every_hint_of_an_argument_exists(at_hand):
    found = set()
    for name in FUNCTIONS:
        known = list(inspect.signature(getattr(jamlab, name)).parameters)
        for text in {argument_hint(word, name, known) for word in WORDS if word not in known}:
            if ": use " in text and (code := CODE.findall(text)) and code[0] not in known:
                found.add(wrong(text, None, at_hand))
    assert found == {""}


def test_every_hint_of_the_shell_exists():
    for name, command in COMMANDS_THERE.items():
        options = [each.opts[0].lstrip("-").replace("-", "_") for each in command.params]
        for word in WORDS:
            use = meant(word, [f"jamlab {name}", SHELL], options, argument=True)
            for code in CODE.findall(use):
                command, _, option = code.removeprefix("jamlab ").partition(" --")
                there = command in COMMANDS_THERE or code.lstrip("-").split()[0] in options
                assert there and (not option or f"--{option}" in names_of(COMMANDS_THERE[command])), (name, word, use)
    assert {use for use in COMMANDS.values()} <= {*COMMANDS_THERE}


def test_what_stands_in_place_of_an_object_are_classes(things):
    classes = {base.__name__ for thing in things.values() for base in type(thing).__mro__}
    classes |= {"DataFrame", "list", "tuple", "dict", "str", "float", "int", "PosixPath", "ndarray", "Session"}
    classes |= {"Client", "Cluster", "Pool"}  # of Dask and multiprocessing
    assert {kind for _, kind in INSTEAD} <= classes
    with pytest.raises(jamlab.InputError, match=r"m\.packing\('dp'\)"):
        jamlab.contacts(things["Micrograph"])
    with pytest.raises(jamlab.InputError, match="spectra"):
        jamlab.scaling_collapse(things["Campaign"], [[]])
    with pytest.raises(jamlab.InputError, match=r"scaling_collapse\(campaign\)"):
        jamlab.scaling_collapse(things["MeanSpectra"])
    with pytest.raises(jamlab.InputError, match=r"density_of_states\(campaign, select="):
        jamlab.density_of_states(pd.DataFrame())


@pytest.mark.parametrize(
    ("name", "use"),
    [("loss_modulus", "complex_modulus"), ("storage_modulus", "complex_modulus"), ("stress_relaxation", "relax_stress"),
     ("relaxation_modulus", "relax_stress"), ("yield_stress", "flow_curve"), ("poisson_ratio", "elastic_tensor"),
     ("stress_tensor", "evaluate"), ("rdf", "pair_correlation"), ("vdos", "lowest_modes"),
     ("get_forces", "evaluate"), ("minimise_energy", "jamlab.relax"), ("energy_minimization", "jamlab.relax"),
     ("read_dump", "jamlab.read(path)"), ("load_mask", "jamlab.micrograph"), ("AnyError", "jamlab.JamlabError"),
     ("hydrostatic_compression", "use `jamlab.compress"), ("hessian_matrix", "jamlab.hessian"),
     ("sweep", "compress"), ("version", "__version__"), ("cite", "CITATION"), ("shear_moduls", "shear_modulus"),
     ("b", "bulk_modulus"), ("void_area", "measure"), ("quasistatics_shear", "quasistatic_shear"),
     ("flow_stop", "stop_flow"), ("gravity", "limits.md"), ("Contacts", "jamlab.results.Contacts")],
)  # fmt: skip
def test_a_name_means_one_thing(name, use):
    with pytest.raises(AttributeError, match=re.escape(use)):
        getattr(jamlab, name)


def test_names_that_look_alike_are_no_hint(things):
    """Spelling alone once led from the loss modulus to the bulk modulus."""
    assert not misspelt("unjammed", ["jammed"]) and not misspelt("eta_star", ["tau_star"])
    assert misspelt("storag", ["storage", "loss"]) == "storage" and not misspelt("loss_modulus", ["bulk_modulus"])
    for name in ("no_such_thing", "modullus_of_nothing"):
        with pytest.raises(AttributeError) as refused:
            getattr(things["ComplexModulus"], name)
        assert "did you mean" not in str(refused.value) and "it has omega, storage, loss, g0" in str(refused.value)
    assert LIMITS in argument_hint("friction", "pack", ["n"])


@pytest.mark.parametrize(
    ("thing", "name", "use"),
    [("Modes", "D", "use `density()`, or `frequencies`"),
     ("Contacts", "anisotropy", "use `r`"), ("Micrograph", "mean_z", "use `z`"),
     ("FlowCurve", "normal_stress", "`pressure` and `normal_stress_difference`"), ("Micrograph", "sizes", "`areas`"),
     ("Micrograph", "threshold", "`picture`"), ("Micrograph", "intensity", "`labels`"), ("Packing", "creep", "creep"),
     ("Micrograph", "quality_flags", "for 'quality' use `quality`"), ("Packing", "centers_of_mass", "`positions`"),
     ("Contacts", "histogram", "`to_dataframe()`"), ("Contacts", "stiffness", "packing.params"),
     *((curve, "rates", "use `rate`") for curve in ("FlowCurve", "MeanFlowCurve", "HerschelBulkley")),
     ("Collapse", "pressures", "use `pressure`")],
)  # fmt: skip
def test_a_name_means_one_thing_of_its_class(things, thing, name, use):
    """A part is named where only that is known: each of these led astray, or nowhere."""
    with pytest.raises(AttributeError, match=re.escape(use)):
        getattr(things[thing], name)


def test_an_unknown_argument_is_answered_by_the_known_one():
    packing = jamlab.pack(8, 1e-2, seed=1)
    for call, told in {
        "pack(32, 1e-3, timeout=1)": "pack has no argument 'timeout'; it takes n, pressure, seed",
        "micrograph(p, minmass=3)": "specks and droplets cut by its edge are set aside",
        "track_droplets([p, p], diameter=3)": "track_droplets has no argument 'diameter': use the picture as it is",
        "track_droplets([p, p], search_range=3)": "half the spacing",
        "flow_curve(p, [1.0], trajectory_error=True)": "another `tolerance`",
        "BoxStrains([[0.0, 1.0], [0.0, 0.0]])": "shape (any, 2, 2)",
        "pack(32, 1e-3, potential='hertz')": "use `law`, such as law='hertz' or law={'exponent': 2.5}",
        "pack(32, 1e-3, law='Hertzian')": "unknown force law 'Hertzian': use 'hertz'; give",
        "pack(32, 1e-3, law='hertz-mindlin')": "'hertz-mindlin': known are harmonic, hertz, power, sticky",
        "jam(8, 'dp', law='glue')": "give parameters as law={'adhesion': 0.1}",
        "complex_modulus(p, [1.0], beta=0.5)": "use `damping`, such as jamlab.ContactDamping(beta=0.5)",
        "shear(p, 0.1, damping='stokes')": "give an object, such as jamlab.ContactDamping(beta=1.0)",
        "compress(p, pressure=0.1)": "use `jamlab.pack(n, pressure)`",
        "decompress(p, to=1e-3)": "use `pressure`",
        "measure(p, ['psi_6_overall'])": "use `psi_6_global`",
        "shear_modulus(p, direction='x')": "use `simple`",
        "scene(0.9, 16, tolerance=0.1)": "use `error`",
        "estimate('z', 0.9, n=16)": "use `error`, from which",
        "make(p)": "give its recipe: jamlab.make(packing.recipe)",
        "make('p.h5')": "jamlab.read(path).recipe",
        "Recipe(protocol='phi', n=8, phi=0.8, exponent=2.5)": "use `law`",
        "Recipe(protocol='phi', n=8, phi=0.8, unheard=1)": "it takes protocol, n",
        "scaling_collapse([1e-2], [jamlab.complex_modulus(p, [1.0])])": "a list of its spectra",
        "pack(32, 1e-3, k=2.0)": "are always 1",
        "pack(32, 1e-3, law={'k': 2.0})": "are always 1",
        "pack(32, 1e-3, law={'gamma': 0.1})": "of model dp",
        "pack(32, 1e-3, law={'stickines': 0.1})": "did you mean stickiness?",
        "pack(32, 1e-3, gamma=0.1)": "use `law`, such as law={'gamma': 0.3}",
        "pack(32, 1e-3, exponent=2.5)": "use `law`, which takes parameters of the force law by name",
        "jam(8, 'dp', vertices=16)": "use `law`, such as jam(n, 'dp', law={'vertices': 16})",
        "pack(N=32, pressure=1e-3)": "pack has no argument 'N': use `n`",
        "pack(32, 1e-3, verbose=True)": "use `progress`",
        "jam(8, max_iter=3)": "jam has no argument 'max_iter'",
        "jam(8, 'dp', law='hertz')": "law['exponent'] = 2.5: exponent is a parameter of model sp",
        "jam(8, phi=0.9)": "use `jamlab.compress(onset, to=0.9)`",
        "pack(8, 1e-2, model='dp')": "use `jamlab.jam(n, 'dp')` for droplets",
        "droplets_from_disks(p, step=1)": "droplets_from_disks has no argument 'step'",
        "scene(0.9, friction=1)": "limits.md",
    }.items():
        with pytest.raises(jamlab.InputError) as refused:
            eval(f"jamlab.{call}", {"jamlab": jamlab, "p": packing})
        assert told in str(refused.value)
    recipe = packing.recipe
    for word, told in {"replace": "`dataclasses.replace(recipe, seed=2)`", "make": "`jamlab.make(recipe)`"}.items():
        with pytest.raises(AttributeError, match=re.escape(told)):
            getattr(recipe, word)
    for law in ("hertz", {"exponent": 2.5}, {"law": "hertz"}):
        assert jamlab.pack(8, 1e-2, law=law).params["exponent"] == 2.5


@dataclass(frozen=True)
class HintedLaw(PowerLaw):
    """Springs with parameters whose names mean something else where no law declares them."""

    name: ClassVar[str] = "hinted"
    parameters: ClassVar[dict[str, Parameter]] = {
        "potential": Parameter(choices=("soft", "hard"), default="soft"),
        **dict.fromkeys(("alpha", "p", "friction", "timeout", "N"), Parameter(default=1.0)),
    }

    potential: str = "soft"
    alpha: float = 1.0
    p: float = 1.0
    friction: float = 1.0
    timeout: float = 1.0
    N: float = 1.0


def test_parameters_of_a_law_may_be_called_as_it_declares(monkeypatch):
    given = {"potential": "hard", "alpha": 2.5, "p": 0.1, "friction": 0.3, "timeout": 3.0, "N": 5.0}
    with pytest.raises(jamlab.ArgumentError, match="'potential'"):
        jamlab.jam(8, potential="hard")
    monkeypatch.setitem(LAWS._entries, "hinted", HintedLaw)
    onset = jamlab.jam(8, law={"law": "hinted", **given})
    assert {name: onset.params[name] for name in given} == given and onset.params["law"] == "hinted"
    for typed, own in (("potentia", "potential"), ("frictions", "friction"), ("time_out", "timeout")):
        with pytest.raises(jamlab.InputError, match=f"no parameter {typed!r}; did you mean {own}"):
            jamlab.jam(8, law={"law": "hinted", typed: 1.0})
    with pytest.raises(jamlab.InputError) as refused:
        jamlab.jam(8, law={"law": "hinted", "hertz": 1.0})
    assert "exponent" not in str(refused.value)  # which this law does not have
    with pytest.raises(jamlab.InputError, match="choose another name"):
        LAWS.register("hertz", type("Hertz", (HintedLaw,), {"name": "hertz"}))
