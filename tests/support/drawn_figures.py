"""Figures drawn once from tables in which the papers' laws hold, for several test files."""

import atexit
import shutil
from functools import cache
from importlib import resources
from pathlib import Path
from tempfile import mkdtemp

import beyond_tables
import flow_tables
import paper_tables

from jamlab.errors import InputError
from studies import gallery
from studies.ensemble_tables import EnsembleTables
from studies.reference_data import save

TABLES = paper_tables.TABLES | flow_tables.TABLES | beyond_tables.TABLES
REFERENCE = Path(str(resources.files("studies").joinpath("reference")))
PICTURES = [name for name in gallery.FIGURES if gallery.FIGURES[name].__module__.endswith(".pictures")]
PUBLISHED = [f"dynamics-{name}" for name in ("flow-curves", "collapse", "amplitudes")]  # figures of flow with a verdict


@cache
def tables():
    made = {name: make() for name, make in TABLES.items()}

    def read(name):
        if name not in made:
            raise InputError(f"no table {name}")
        return made[name]

    return EnsembleTables(read, {"campaign": "made up"})


@cache
def drawn(name):
    return gallery.draw(name, tables())


@cache
def _saved():
    folder = Path(mkdtemp(prefix="jamlab-tables-"))
    atexit.register(shutil.rmtree, folder)
    save(tables(), folder, {"commit": "old"})
    return folder


def saved(folder):
    """All tables as reference data in a folder: a copy of what is written once."""
    return Path(shutil.copytree(_saved(), folder, dirs_exist_ok=True))
