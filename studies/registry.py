"""All studies by name, in the groups that are drawn on one page."""

from collections.abc import Mapping, Sequence
from functools import cache, partial
from types import ModuleType

from jamlab.checks import check_choice
from jamlab.figures.explorer.write_page import explorer_assets
from studies import droplet_calibration, micrograph_errors
from studies.beyond import droplet_modes, droplet_sizes, droplet_structure, foams, jamming, polydispersity
from studies.beyond import stiffening_disks as stiffening
from studies.dynamics import collapse, flow_curves
from studies.other_codes import compare
from studies.panels import Drawing
from studies.papers.baumgarten import correlation, motion, spectra
from studies.papers.baumgarten import pictures as pictures_of_t
from studies.papers.boromand import coefficients, confluence, contacts_and_modulus, geometry, onset, pictures, voids
from studies.papers.verdicts import RULE, first_line
from studies.reference_data import example_sections
from studies.speed_accuracy import chart, flow, minimisers, moduli, packing_fractions, packings, size_scaling
from studies.stability import disks, droplets, dynamics, elastic_moduli
from studies.stability import map as stability
from studies.study import Group, Study

_figure = partial(Study, tasks={})  # drawn from tables of campaigns

PAPERS = (
    _figure("boromand-1", "Disks with their overlaps at phi = 1, shared half and half", draw=pictures.figure_1),
    _figure("boromand-2", "Packings of both models near rho = 0.92, with their contacts", draw=pictures.figure_2),
    _figure(
        "boromand-3", "Close-up of droplets near confluence, with the rims of their polygons", draw=pictures.figure_3
    ),
    _figure(
        "boromand-4", "True against nominal packing fraction, particle areas, shape factors", draw=geometry.figure_4
    ),
    _figure(
        "boromand-5", "z and G against rho and phi, with the fits of tables 1-2", draw=contacts_and_modulus.figure_5
    ),
    _figure(
        "boromand-6",
        "z - z_J and G against the distance to onset, log-log, one curve per size",
        draw=contacts_and_modulus.figure_6,
    ),
    _figure("boromand-7", "z_conf - z against rho* - rho, and both times N", draw=confluence.figure_7),
    _figure(
        "boromand-8", "Voids: share with l sides, shape factor of those with three, mean areas", draw=voids.figure_8
    ),
    _figure(
        "boromand-8-voids",
        "Voids of both models near confluence, coloured by their number of sides",
        draw=pictures.figure_8_snapshots,
    ),
    _figure(
        "boromand-9",
        "z(rho) and rho(A) of polygons, the curves that the paper lays over its experiments",
        draw=confluence.figure_9,
    ),
    _figure("boromand-10", "Distributions of onset, their width and mean against N", draw=onset.figure_10),
    _figure(
        "boromand-11",
        "Five power laws that tie packing fractions, energy, area and shape together",
        draw=geometry.figure_11,
    ),
    _figure(
        "tables", "Coefficients of tables 1 and 2 from our packings, over the paper's", draw=coefficients.tables_1_2
    ),
    _figure(
        "baumgarten-1",
        "G' and G'' of one pressure near jamming: Kelvin-Voigt at both ends, square roots between",
        draw=spectra.figure_1,
    ),
    _figure(
        "baumgarten-1-fields",
        "Displacements of disks at zero and at peak stress, at a low, a critical and a high frequency, on one scale",
        draw=pictures_of_t.figure_1_fields,
    ),
    _figure(
        "baumgarten-2",
        "What is damped: relative motion at a contact, and motion against the affine flow of the fluid",
        draw=pictures_of_t.figure_2,
    ),
    _figure(
        "baumgarten-3",
        "G* of balanced contact damping for a range of pressures, and its collapse",
        draw=spectra.figure_3,
    ),
    _figure("baumgarten-4", "Sliding that is damped less, or not at all", draw=spectra.figure_4),
    _figure(
        "baumgarten-5",
        "Medians of approach, sliding and non-affine motion in slow shear against pressure",
        draw=motion.figure_5,
    ),
    _figure(
        "baumgarten-6",
        "Stokes drag: collapse for eta_F = 1, and what the viscosity of the fluid adds",
        draw=spectra.figure_6,
    ),
    _figure(
        "baumgarten-7",
        "Correlation of transverse displacements under both laws, and its length",
        draw=correlation.figure_7,
    ),
    _figure("baumgarten-8", "Viscosity against pressure for several sizes: one curve in p N^2", draw=motion.figure_8),
    _figure(
        "dynamics-flow-curves",
        "Flow curves of disks around onset, stress over pressure, and the law of Herschel and Bulkley",
        draw=flow_curves.flow_curves,
    ),
    _figure(
        "dynamics-collapse",
        "Scaling collapse of flow curves around onset, with its exponents",
        draw=collapse.flow_collapse,
    ),
    _figure(
        "dynamics-overshoot",
        "Overshoot of start-up from quenched packings: height, excess over steady flow, and strain",
        draw=flow_curves.overshoot,
    ),
    _figure(
        "dynamics-yield",
        "Yield stress from steady flow, quasi-static shear, start-up and creep, side by side",
        draw=flow_curves.yield_stress,
    ),
    _figure(
        "dynamics-amplitudes",
        "G' and G'' against the amplitude at three frequencies, with softening and yielding against pressure",
        draw=flow_curves.amplitude_sweeps,
    ),
    _figure(
        "dynamics-power-law",
        "Stress of flow under power-law drag over the rate to that power, and what misses the collapse",
        draw=collapse.power_law_collapse,
    ),
    _figure(
        "dynamics-equivalent-damping",
        "Error of the equivalent linear damping against frequency and the power of the drag",
        draw=flow_curves.equivalent_damping,
    ),
    _figure(
        "dynamics-droplets",
        "Flow curves of droplets and disks at the same packing fraction, and their pressure",
        draw=flow_curves.droplets_beside_disks,
    ),
)
BEYOND = (
    _figure(
        "beyond-droplet-spectra",
        "G* of droplets over packing fraction, disks beside them, and droplets over line tension; two drag laws",
        draw=droplet_modes.droplet_spectra,
    ),
    _figure(
        "beyond-droplet-modes",
        "Relaxation spectra of droplets by the motion of its modes, and what moves in slow and in fast ones",
        draw=droplet_modes.droplet_modes,
    ),
    _figure(
        "beyond-droplet-contacts",
        "Contacts of droplets at onset: pairs, contacts of vertices, states of self-stress and floppy modes",
        draw=droplet_structure.droplet_contacts,
    ),
    _figure(
        "beyond-droplet-sizes",
        "Finite size of droplets: z - z_J and G at fixed distances, crossover, unstable boxes, onset and its width",
        draw=droplet_sizes.droplet_sizes,
    ),
    _figure(
        "beyond-droplet-vertices",
        "z, G and A of droplets over the distance to onset for more and more vertices, and their limit of many",
        draw=droplet_sizes.droplet_vertices,
    ),
    _figure(
        "beyond-droplet-voids",
        "Shape factor of voids between three droplets, by vertices and stiffness, over packing fraction and overlap",
        draw=droplet_structure.droplet_voids,
    ),
    _figure(
        "beyond-stiffening-disks",
        "Pressure, excess contacts and G of Hertzian disks over the distance from onset, beside harmonic ones",
        draw=stiffening.stiffening_disks,
    ),
    *jamming.STUDIES,
    *foams.STUDIES,
    *polydispersity.STUDIES,
)
CHARTS: Mapping[str, chart.Chart] = {
    each.name: each
    for each in (
        *(minimisers.DISKS, minimisers.DROPLETS, packings.ONSET, packings.PRESSURE),
        *(packing_fractions.FRACTIONS, moduli.SHEAR_MODULUS, moduli.SPECTRUM, moduli.DROPLET_SPECTRUM),
        *(packings.VERTICES, flow.INERTIA, flow.SOLVERS, packings.MEANS, minimisers.CODES),
    )
}
_ROOMS: tuple[ModuleType, ...] = (disks, elastic_moduli, droplets, dynamics)
MAPS: Mapping[str, stability.Map] = {each.name: each for room in _ROOMS for each in room.MAPS}


def _lead_of_papers(drawings: Sequence[Drawing]) -> str:
    count = first_line([claim for drawing in drawings for claim in drawing.claims])
    return f"Figures of Boromand et al. and of Baumgarten & Tighe from our own packings. {count} {RULE}"


@cache
def groups() -> dict[str, Group]:
    """The groups by name, which is that of their page."""
    charts, maps = ([each.study for each in of.values()] for of in (CHARTS, MAPS))
    measured = (
        size_scaling.STUDY,
        _figure(
            "micrograph-errors",
            "Errors of micrographs against light, noise, blur, films and size of droplets",
            draw=micrograph_errors.micrograph_errors,
        ),
    )
    assets = explorer_assets()
    return {
        "papers": Group("Figures of both papers", _lead_of_papers, PAPERS, assets=assets, opening=example_sections),
        "beyond": Group("Beyond the papers", lambda _: "What other laws of jamming and of foams say.", BEYOND),
        "speed-accuracy": Group("Cost against error", lambda _: chart.LEAD, (*charts, *measured), columns=1),
        "stability": Group("Where methods fail", lambda _: stability.LEAD, maps, columns=2),
    }


@cache
def studies() -> dict[str, Study]:
    """All studies by name; two ship no table, and are in no group."""
    every = [study for group in groups().values() for study in group.studies]
    return {study.name: study for study in (*every, compare.STUDY, droplet_calibration.STUDY)}


def chosen(names: list[str]) -> dict[str, Group]:
    """Groups of these names; "all" stands for every one, and names of studies are a group of their own."""
    every, known = groups(), studies()
    for name in names:
        check_choice("study", name, ["all", *every, *known])
    found = {name: group for name, group in every.items() if name in names or "all" in names}
    single = [known[name] for name in dict.fromkeys(names) if name in known]
    if single:
        lead = "; ".join(study.title for study in single) + "."
        found["studies"] = Group("Studies", lambda _: lead, single, assets=explorer_assets())
    return found
