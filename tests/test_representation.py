"""What a prompt and a notebook show of packings and results: one short line, and a picture."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

import jamlab


@pytest.mark.parametrize("model", ["sp", "dp"])
def test_reprs_are_short_and_say_what_is_there(model, sp_jammed, dp_dense):
    packing = {"sp": sp_jammed, "dp": dp_dense}[model]
    assert f"n={packing.n}" in repr(packing) and "converged=True" in repr(packing)
    results = (jamlab.voids(packing), jamlab.contacts(packing), jamlab.elastic_tensor(packing))
    for thing in (packing, *results, jamlab.complex_modulus(packing, np.logspace(-3, 1, 5))):
        assert len(repr(thing)) < 250 and "\n" not in repr(thing), repr(thing)
    assert "omega=(5,) float64" in repr(thing) and f"g0={thing.g0:.6g}" in repr(thing)


@pytest.mark.parametrize("tilt", [0.0, 0.3, -0.2])
def test_notebook_picture_shows_every_particle_inside_its_cell(random_disks, random_polygons, tilt):
    for packing, tag in ((random_disks(tilt), "circle"), (random_polygons(tilt), "polygon")):
        html = packing._repr_html_()
        assert len(html) < 60_000
        svg = ET.fromstring(html[html.index("<svg") : html.index("</svg>") + 6])
        shapes = svg.find("{*}g").findall("{*}" + tag)
        assert len(shapes) >= packing.n  # particles across the border are drawn on both sides
        if tag == "circle":
            scale = 280 / packing.box[0, 0]
            drawn = {float(shape.get("r")) for shape in shapes}
            assert drawn == {round(0.5 * scale * d, 1) for d in packing.diameters}


def test_laws_read_as_words():
    assert str(jamlab.ContactDamping()) == "contact damping, β = 1"
    assert str(jamlab.ContactDamping(beta=0.1, alpha=0.5)) == "contact damping, β = 0.1, α = 0.5"
    assert str(jamlab.StokesDrag(eta_f=0.5, tau=2)) == "Stokes drag, η_F = 0.5, τ1 = 2"
    assert repr(jamlab.ContactDamping()) == "ContactDamping(beta=1.0, tau=1.0, alpha=1.0, arms='radius')"


def test_a_collapse_without_errors_says_why():
    known = jamlab.Collapse(0.5, 1.0, 0.5, 0.02, 0.03, 0.01, 0.1)
    assert "μ = 0.5 ± 0.02" in str(known) and "no error" not in str(known)
    unknown = jamlab.Collapse(0.5, 1.0, 0.5, np.nan, np.nan, np.nan, 0.1)
    assert "nan" not in str(unknown) and "two or more of each pressure" in str(unknown)
