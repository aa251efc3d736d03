"""Put what is wrong with a campaign file in words: key, value and remedy."""

import difflib
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

_SHOWN = 120  # characters of a wrong value in its message


def explain(content: dict[str, Any], problem: "ErrorDetails", known_keys: Callable[[list[Any]], list[str]]) -> str:
    """State key, value and remedy of one problem that pydantic found.

    Args:
        content: of the file.
        problem: one of `ValidationError.errors()`.
        known_keys: place of a key -> keys of the table that it stands in.
    """
    place = [part for part in problem["loc"] if not (isinstance(part, str) and part.startswith(("list[", "range")))]
    key, value = "", content
    for part in place:
        if isinstance(part, int):
            key += f"[{part + 1}]"
        else:
            word = part if part.isidentifier() else _show(part)
            key += f".{word}" if key else word
        if isinstance(value, list) and isinstance(part, int) and part < len(value):
            value = value[part]
            if isinstance(value, dict) and "name" in value:
                key += f" ({value['name']})"
        elif isinstance(value, dict):
            value = value.get(str(part), problem["input"])
    kind, context = problem["type"], problem.get("ctx", {})
    if kind == "missing":
        return f"{key} is missing: add it"
    if kind == "extra_forbidden":
        known = known_keys(place)
        near = difflib.get_close_matches(str(place[-1]), known, 1)
        hint = f"did you mean {near[0]}?" if near else f"use {', '.join(known)}"
        return f"{key} = {_show(problem['input'])}: unknown key, {hint}"
    if kind == "value_error":
        text = str(context["error"])
        return f"{key}: {text}" if isinstance(value, dict) else f"{key} = {_show(value)}: {text}"
    remedy = _REMEDIES[kind].format(**context) if kind in _REMEDIES else problem["msg"].lower()
    return f"{key} = {_show(problem['input'])}: {remedy}"


def _show(value: Any) -> str:
    """Write out a wrong value, on one line and not longer than a line."""
    try:
        text = repr(value)
    except (RecursionError, ValueError):  # nested deeply, or an integer of more than 4300 digits
        return f"a {type(value).__name__} too long to print"
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}..."


_REMEDIES = {
    "greater_than": "must be above {gt}",
    "greater_than_equal": "must be {ge} or more",
    "less_than_equal": "must be {le} or less",
    "multiple_of": "half of the particles are large, so it must be an even number",
    "literal_error": "use one of {expected}",
    "int_type": "must be a whole number",
    "float_type": "must be a number",
    "bool_type": "must be true or false",
    "string_type": "must be text in quotes",
    "list_type": "must be a list in square brackets",
    "dict_type": "must be a table",
    "model_type": "must be a table",
    "finite_number": "must be a finite number",
    "too_long": "the list is too long: give at most {max_length}",
    "too_short": "the list is empty: give at least one",
    "string_pattern_mismatch": "use letters, digits, '_', '.' and '-' only",
}
