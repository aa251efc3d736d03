"""Figures drawn once from tables in which the papers' laws hold, for several test files."""

import atexit
import shutil
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import beyond_tables
import flow_tables
import paper_tables

from jamlab.errors import InputError
from studies import pages
from studies.ensemble_tables import NAMES, EnsembleTables
from studies.reference_data import open_tables, write_tables
from studies.registry import BEYOND, PAPERS

TABLES = paper_tables.TABLES | flow_tables.TABLES | beyond_tables.TABLES
FIGURES = [study.name for study in (*PAPERS, *BEYOND) if not study.tasks]
PICTURES = ("boromand-2", "boromand-8-voids", "baumgarten-1-fields")
PUBLISHED = [f"dynamics-{name}" for name in ("flow-curves", "collapse", "amplitudes")]  # figures of flow with a verdict


@cache
def tables():
    made = {name: make() for name, make in TABLES.items()}

    def read(name):
        if name not in made and name in NAMES:
            raise InputError(f"no table {name}")
        return made[name] if name in made else open_tables().read(name)  # of studies, which are measured

    return EnsembleTables(read, {"campaign": "made up"})


@cache
def drawn(name):
    return pages.draw(name, tables())


@cache
def _saved():
    folder = Path(mkdtemp(prefix="jamlab-tables-"))
    atexit.register(shutil.rmtree, folder)
    write_tables(tables(), folder, "old")
    return folder


def saved(folder):
    """All tables as reference data in a folder: a copy of what is written once."""
    return Path(shutil.copytree(_saved(), folder, dirs_exist_ok=True))
