"""Licences of requirements, from their metadata, fit LAMMPS or are explained; one title names the program."""

import re
import tomllib
from email.message import Message
from importlib import metadata
from pathlib import Path

import yaml
from licence_table import OF_RUN, RUN, licence, requirements, rows
from typer.main import get_command

from jamlab.cli.main import app

ROOT = Path(__file__).parents[1]
# what may be distributed together with GPL-2.0-only; of "A OR B" one is enough, of "A AND B" both
FITS = re.compile(r"(BSD|0BSD|MIT|PSF|Zlib|CC0|ISC|MPL-2|GPL-2\.0|HPND|LicenseRef-MPICH|LGPL-2)[\w.-]*")


def test_each_requirement_has_its_licence():
    found = {name: groups for name, _, groups in rows()}
    direct = {name: ", ".join(groups) for name, groups in requirements().items() if RUN in groups}
    assert len(direct) > 10 and {name: found[name] for name in direct} == direct
    assert OF_RUN in found.values()


def test_what_does_not_fit_lammps_is_named_in_words():
    prose = (ROOT / "docs" / "reference" / "licences.md").read_text(encoding="utf-8").lower()
    for name, known, groups in rows():
        if groups.split(", ")[0] in (RUN, OF_RUN):
            fits = any(all(FITS.fullmatch(each) for each in one.split(" AND ")) for one in known.split(" OR "))
            assert fits or name in prose, f"{name} is under {known}, which licences.md does not explain"


def test_the_licence_of_metadata_comes_from_expression_classifier_or_text(monkeypatch):
    cases = [
        ({"License-Expression": "MIT"}, "MIT"),
        ({"Classifier": "License :: OSI Approved :: GNU General Public License v2 (GPLv2)"}, "GPL-2.0-only"),
        ({"License": "BSD 3-Clause License Copyright (c) 2017"}, "BSD-3-Clause"),
        ({}, "not named"),
    ]
    for fields, expected in cases:
        message = _message(fields)
        monkeypatch.setattr(metadata, "metadata", lambda name, message=message: message)
        assert licence("numpy") == expected


def test_one_title_names_the_program():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    described = project["description"]
    title = f"jamlab: {described[0].lower()}{described[1:]}"
    assert yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))["title"] == title
    assert f"title: '{title}'\n" in (ROOT / "paper.md").read_text(encoding="utf-8")
    assert get_command(app).help == f"{described}."


def _message(fields):
    message = Message()
    for name, value in fields.items():
        message[name] = value
    return message
