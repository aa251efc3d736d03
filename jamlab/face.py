"""The public functions and classes, as the package hands them down: their names, where they stand, what else they are
called.

Nothing below may import the package itself, which names all that lies above.
"""

import os
import re
from functools import cache

NAMES: list[str] = []
_FOLDER = os.path.dirname(__file__)


@cache
def modules() -> dict[str, str]:
    """Public name -> module within jamlab, as `__init__.pyi` has it."""
    lines = re.findall(r"^from \.([\w.]+) import \w+ as (\w+)", _read("__init__.pyi"), re.MULTILINE)
    return {name: module for module, name in lines}


def completed(text: str) -> str:
    """The map of the package with the functions that it does not name, by the folders that they stand in."""
    named, more = {*re.findall(r"\w+", text)}, dict[str, list[str]]()
    for name, module in modules().items():
        if name[0].islower() and name not in named:
            more.setdefault(module.partition(".")[0].capitalize(), []).append(name)
    before, gap, example = text.partition("\n\n    ")
    return before + "".join(f"\n{folder:<13}{', '.join(names)}" for folder, names in more.items()) + gap + example


def also_called() -> dict[str, list[str]]:
    """Function -> what its docstring says behind "Also called:"; sources are read, since to import all takes long."""
    found = {}
    for name, module in modules().items():
        source = _read(f"{module.replace('.', os.sep)}.py")
        body = re.search(rf"^def {name}\(.*?(?=^(?:def|class|@)|\Z)", source, re.MULTILINE | re.DOTALL)
        if body and (words := re.search(r"\n    Also called: ([\w,\s]+)\.\n", body[0])):
            found[name] = re.findall(r"\w+", words[1])
    return found


def _read(name: str) -> str:
    with open(os.path.join(_FOLDER, name), encoding="utf-8") as file:  # pathlib would be loaded for this alone
        return file.read()
