"""What users hand to public functions can be made from public names."""

import inspect
import typing

import jamlab

HANDED_ON = {  # results of one function that spare another the same work; nobody makes them by hand
    "DiskCells",
    "ForceNetwork",
    "VertexContacts",
    "Pairs",
    "EnsembleWay",
    "WayRecord",
    "Outcome",
}


def functions():
    """Name and function of every public function and of every public method."""
    for name in jamlab.__all__:
        thing = getattr(jamlab, name)
        members = {name: thing} if inspect.isfunction(thing) else vars(thing) if inspect.isclass(thing) else {}
        for member, value in members.items():
            found = getattr(value, "__func__", value)
            if inspect.isfunction(found) and not member.startswith("_"):
                yield f"{name}.{member}", inspect.unwrap(found)


def classes_in(hint):
    """All classes that stand in an annotation."""
    if inspect.isclass(hint) and not typing.get_args(hint):
        yield hint
    for part in hint if isinstance(hint, list) else typing.get_args(hint):
        yield from classes_in(part)


def arguments_of(function):
    for name, hint in function.__annotations__.items():
        if name != "return":
            known = vars(jamlab) | vars(typing) | {"Axes": object, "pd": object} | function.__globals__
            yield name, eval(hint, known) if isinstance(hint, str) else hint


def test_no_argument_has_a_type_that_is_not_public():
    hidden = {
        (name, argument, kind.__name__)
        for name, function in functions()
        for argument, hint in arguments_of(function)
        for kind in classes_in(hint)
        if kind.__module__.startswith("jamlab")
        and getattr(jamlab, kind.__name__, None) is not kind
        and kind.__name__ not in HANDED_ON
    }
    assert not hidden
