"""Say what is wrong in a campaign file: the place, the value, and the key that was meant."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, get_args

from jamlab.arguments.table import ARGUMENTS
from jamlab.campaign.observable import FileTable
from jamlab.checks import name_meant

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

# key -> what it is called elsewhere, beside the habits of the argument of its name; said only in tables with the key
# arguments of `Campaign.run`
_OF_A_RUN = ("workers", "processes", "n_jobs", "cores", "cpus")
_ALSO_CALLED = {
    "name": "campaign title label id",
    "sweep": "task run batch",
    "model": "particles",
    "n": "number size count particle_number",
    "seeds": "samples replicas realizations realisations repeats packings seed",
    "onset": "jam jamming",
    "compress": "compression",
    "pressures": "pressure p target_pressures",
    "observables": "measure output outputs tables",
    "law": "exponent stickiness gamma",
    "sizes": "diameters radii",
    "force_tolerance": "tolerances force",
    "pressure_tolerance": "error",
    "ranks": "processors mpi",
    "contact": "beta",
    "stokes": "eta_f",
    "to": "until stop highest",
    "first_step": "first closest",
    "step": "d_phi d_rho",
    "lowest": "min low start from first",
    "highest": "max high stop end to last",
    "points": "n count number num samples",
    "first": "start from lowest min",
    "last": "stop end to highest max",
    "rates": "rate shear_rate shear_rates strain_rate strain_rates gamma_dot gammadot",
    "amplitudes": "amplitude strain strains gamma0",
    "stresses": "stress",
    "quasistatic_shear": "aqs athermal_quasistatic",
    "cyclic_shear": "cyclic limit_cycles hysterons",
}


def explain(problem: "ErrorDetails", root: type[FileTable], plain: Mapping[str, type[FileTable]]) -> str:
    """Place, value and message of one problem that pydantic found. `plain`: tables that no annotation shows, by the key
    that holds them."""
    place = ""
    for part in problem["loc"]:
        if isinstance(part, int):
            place += f"[{part + 1}]"
        elif not _is_kind(part):
            place += f".{part}" if place else part
    kind = problem["type"]
    if kind == "missing":
        return f"{place}: is missing: give it"
    if kind == "extra_forbidden":
        *above, key = problem["loc"]
        everywhere = dict(_keys_of_tables(root, plain))
        held_by = next((part for part in reversed(above) if part in everywhere), "")
        return f"{place}: {_explain_unknown(str(key), everywhere[held_by], everywhere)}"
    said = problem["msg"].removeprefix("Value error, ")
    if kind == "list_type" and problem["loc"] == ("sweep",):
        return f"{place}: write [[sweep]] above the keys of each sweep, in two pairs of brackets"
    if isinstance(problem["input"], list) and kind.endswith("_type"):
        said = "takes one value: give each value a sweep of its own"
    value = "" if isinstance(problem["input"], dict) else f" = {_show(problem['input'])}"
    return f"{place}{value}: {said}"


def _is_kind(part: str) -> bool:
    """Whether a part of a place is the kind of value, where a key may have several."""
    return part.startswith(("list[", "range"))


def _keys_of_tables(
    table: type[FileTable], plain: Mapping[str, type[FileTable]], holder: str = ""
) -> Iterator[tuple[str, list[str]]]:
    """Keys of a table and of all tables in it, by the key that holds them; "" for the file."""
    yield holder, list(table.model_fields)
    for key, field in table.model_fields.items():
        inner = plain.get(key) or next(_tables(field), None)
        if inner is not None:
            yield from _keys_of_tables(inner, plain, key)


def _tables(field: Any) -> Iterator[type[FileTable]]:
    """Tables that a field of a table may hold."""
    if isinstance(field, type) and issubclass(field, FileTable):
        yield field
    for part in (getattr(field, "annotation", None), *get_args(field)):
        if part is not None:
            yield from _tables(part)


def _explain_unknown(key: str, keys: list[str], everywhere: Mapping[str, list[str]]) -> str:
    """The key that was meant by an unknown one, or the table that has it, and all keys that there are."""
    holders = [holder for holder, known in everywhere.items() if holder and key in known]
    where = f"it is a key of {' and '.join(holders)}." if holders else "leave it out."
    if key in _OF_A_RUN:
        return f"unknown key: give it to the run, as jamlab campaign run --workers 2. Keys here: {', '.join(keys)}"
    if not holders and (elsewhere := _meant_elsewhere(key, everywhere)):
        where = elsewhere
    meant = [known for known in keys if key.lower() == known or key in _words(known)]
    said = f"did you mean {meant[0]}?" if meant else name_meant(key, keys, otherwise=where)
    return f"unknown key, {said} Keys here: {', '.join(keys)}"


def _meant_elsewhere(key: str, everywhere: Mapping[str, list[str]]) -> str:
    """The key of another table that is called so; "" if there is none."""
    found = [
        (known, holder) for holder, keys in everywhere.items() for known in keys if key in _words(known) and holder
    ]
    holders = [holder for known, holder in found if known == found[0][0]]
    return f"did you mean {found[0][0]}, a key of {' and '.join(dict.fromkeys(holders))}?" if found else ""


def _words(key: str) -> list[str]:
    """What else a key is called, the argument of its name included."""
    habits = ARGUMENTS[key].habits if key in ARGUMENTS else ""
    return [word for word in f"{_ALSO_CALLED.get(key, '')} {habits}".split() if word not in _OF_A_RUN]


def _show(value: Any) -> str:
    """Write out a wrong value, on one line and not longer than a line."""
    try:
        text = repr(value)
    except (RecursionError, ValueError):  # nested deeply, or an integer of more than 4300 digits
        return f"a {type(value).__name__} too long to print"
    shown = 120  # characters of a wrong value in its message
    return text if len(text) <= shown else f"{text[:shown]}..."
