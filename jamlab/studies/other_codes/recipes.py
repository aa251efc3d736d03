"""Write recipes for codes without wheels: a packing with jamlab's own answer, and a script that runs the other code."""

from importlib import resources
from pathlib import Path

import numpy as np

from jamlab.checks import check_choice
from jamlab.engine.session import evaluate
from jamlab.packing.packing import Packing
from jamlab.storage.atomic_file import atomic_file, make_folder
from jamlab.studies.other_codes.peer import mean_diameters

RECIPES = {
    "hoomd": "conda install -c conda-forge hoomd   # version 4 or later; no wheels",
}


def write_recipe(name: str, folder: Path, packing: Packing) -> str:
    """Write `packing.npz` and `NAME_check.py` to a folder, and return how to run them.

    The file holds positions (n, 2), diameters (n,), sides (2,), eps, and jamlab's energy, forces and stress at these
    positions. The script prints how far the other code is from them, then minimises.

    Raises:
        InputError: there is no such recipe, or the other code cannot take the packing.
        StorageError: the folder cannot be written.
    """
    check_choice("recipe", name, RECIPES)
    species, s = mean_diameters(packing)
    here = evaluate(packing)
    make_folder(folder)
    with atomic_file(folder / "packing.npz") as temporary, temporary.open("wb") as file:
        np.savez(
            file,
            positions=packing.positions,
            species=species,
            s=s,
            sides=np.diag(packing.box),
            eps=float(packing.params["eps"]),
            energy=here.energy,
            forces=here.forces,
            stress=here.stress,
        )
    script = f"{name}_check.py"
    text = resources.files("jamlab.studies.other_codes").joinpath(f"{script}.txt").read_text(encoding="utf-8")
    with atomic_file(folder / script) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return f"{RECIPES[name]}\ncd {folder} && python {script}"
