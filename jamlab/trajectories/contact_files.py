"""Contact networks for other programs: bonds between the centres of particles, with their forces.

OVITO reads bonds from a second dump beside the dump of the particles; ParaView and VTK read points and lines, .vtp.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.geometry.contact_network import Contacts, contacts
from jamlab.geometry.particle_shape import particle_areas
from jamlab.packing.lammps_files import dump_frame
from jamlab.packing.neighbors import moves_home
from jamlab.packing.packing import Packing
from jamlab.storage.atomic_file import atomic_file
from jamlab.storage.formats import check_ending


@checked
def write_contacts(path: str | os.PathLike[str], packing: Packing) -> list[Path]:
    """Write the contact network of a packing, with particles as points and contacts as bonds.

    A bond has `force` (positive: repulsive), `gap` of the surfaces (negative: overlap) and `bearing` (0 if one particle
    is a rattler). A point has the number of its particle, its radius (droplets: of a disk of equal area) and a flag for
    rattlers.

    Args:
        path: FILE.dump: the particles, and FILE.bonds.dump with the bonds, which OVITO loads by the modifier "Load
            trajectory". FILE.vtp: points and lines for ParaView; a contact that crosses the border of the box
            ends at an extra point, marked by `image` = 1.
        packing: SP or DP.

    Returns:
        The files written.

    Raises:
        InputError: unknown ending, or outlines of two droplets cross.
        StorageError: a file cannot be written.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> [file.name for file in jamlab.write_contacts("packing.dump", p)]
        ['packing.dump', 'packing.bonds.dump']
    """
    check_ending(path, "dump", "vtp")
    file, network = Path(path), contacts(packing)
    if file.suffix.lower() == ".vtp":
        texts = {file: _vtp(network)}
    else:
        texts = {file: _points_dump(network), file.with_suffix(f".bonds{file.suffix}"): _bonds_dump(network)}
    for name, text in texts.items():
        with atomic_file(name) as temporary:
            temporary.write_text(text, encoding="ascii")
    return list(texts)


def _points(network: Contacts) -> tuple[Array, dict[str, NDArray[Any]]]:
    """(n, 2) centres in the cell, and what else a point has."""
    packing = network.packing
    centres = packing.centroids + moves_home(packing.centroids, packing.box)
    radii = np.sqrt(particle_areas(packing) / np.pi) if packing.diameters is None else 0.5 * packing.disk_diameters
    return centres, {"particle": np.arange(packing.n), "radius": radii, "rattler": network.rattlers.astype(int)}


def _bonds(network: Contacts) -> dict[str, NDArray[Any]]:
    forces = network.forces
    force = np.where(forces.pulls, -forces.size, forces.size)
    return {"force": force, "gap": forces.gap, "bearing": network.bearing.astype(int)}


def _points_dump(network: Contacts) -> str:
    centres, also = _points(network)
    count, ones = len(centres), np.ones(len(centres), dtype=np.int64)
    places = {"x": centres[:, 0], "y": centres[:, 1], "z": np.zeros(count)}
    return dump_frame(network.packing.box, "ATOMS", count, {"id": ones.cumsum(), "type": ones, **places, **also})


def _bonds_dump(network: Contacts) -> str:
    ends = {f"batom{k + 1}": network.pairs[:, k] + 1 for k in range(2)}
    return dump_frame(network.packing.box, "ENTRIES", len(network.pairs), {**ends, **_bonds(network)})


def _vtp(network: Contacts) -> str:
    """VTK's PolyData in XML; contacts across the border end at points of their own."""
    centres, also = _points(network)
    i, j = network.pairs.T
    ends = centres[i] + network.r
    outside = np.abs(ends - centres[j]).max(axis=1, initial=0) > 1e-6 * also["radius"].mean()
    end = j.copy()
    end[outside] = len(centres) + np.arange(outside.sum())
    points = np.concatenate([centres, ends[outside]])
    of = np.concatenate([np.arange(len(centres)), j[outside]])
    values = {name: column[of] for name, column in also.items()} | {"image": (np.arange(len(of)) >= len(centres)) * 1}
    count = len(i)
    root = ElementTree.Element("VTKFile", type="PolyData", version="1.0", byte_order="LittleEndian")
    data = ElementTree.SubElement(root, "PolyData")
    counts = {"NumberOfPoints": str(len(points)), "NumberOfVerts": "0", "NumberOfLines": str(count)}
    piece = ElementTree.SubElement(data, "Piece", counts | {"NumberOfStrips": "0", "NumberOfPolys": "0"})
    _arrays(piece, "PointData", values)
    _arrays(piece, "CellData", _bonds(network))
    _arrays(piece, "Points", {"Points": np.column_stack([points, np.zeros(len(points))])})
    lines = {"connectivity": np.column_stack([i, end]).ravel(), "offsets": 2 * np.arange(1, count + 1)}
    _arrays(piece, "Lines", lines)
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _arrays(piece: Any, name: str, arrays: dict[str, NDArray[Any]]) -> None:
    section = ElementTree.SubElement(piece, name)
    for key, values in arrays.items():
        kind = "Float64" if values.dtype.kind == "f" else "Int64"
        look = {"type": kind, "Name": key, "NumberOfComponents": str(values.ndim * 2 - 1), "format": "ascii"}
        ElementTree.SubElement(section, "DataArray", look).text = " ".join(f"{v:.17g}" for v in values.ravel().tolist())
