"""jamlab: jammed packings of soft disks and deformable droplets in two dimensions, on LAMMPS.

States       jam, pack, compress, decompress, relax, scene, droplets_from_disks, droplets_from_outlines; evaluate;
             swap_sizes, relax_radii, anneal: more stable ones; Session; make, Recipe: the same packing again, or a
             variation of it
All at once  measure: rho, z, pressure, G, B, shapes, voids ... as numbers
Structure    contacts, packing_fraction, shape_factors, voids, void_statistics, tessellation, hexatic_order,
             particle_areas, relative_areas, contact_lengths, local_packing_fraction, remove_rattlers,
             with_walls, slab: rough walls, the layer between them; pair_correlation, structure_factor,
             spectral_density: hyperuniformity
Elasticity   shear_modulus, bulk_modulus, elastic_tensor, nonaffine_response, hessian, lowest_modes, density_of_states,
             density_by_size, quasilocalized_modes, count_zero_modes, maxwell_count: constraint counting; rigid_clusters
Oscillation  complex_modulus with ContactDamping or StokesDrag, mean_spectra: over packings, kind by kind;
             scaling_collapse, nonlinear_modulus, effective_relaxation_time, dynamical_matrices, damped_vibrations,
             displacement_response, displacement_correlation, displacement_spectrum; mode_character: of droplets
Flow         shear, flow_curve, oscillate, creep, relax_stress, stop_flow: overdamped, in time; flow_cost,
             mean_flow_curve: over packings; read_flow; quasistatic_shear: without time; softening: before an event;
             event_sizes: power laws
Motion       local_strain: D2min; mean_square_displacement, self_overlap; t1_events: of runs, sequences and tracks
Files        read, read_all, write, write_contacts
MDAnalysis   universe, from_universe, PackingAnalysis
Ensembles    open_campaign -> Campaign: plan, run, start, table, aggregate
Least model  choose: disks or droplets for a tolerance; choose_flow: spectrum, equivalent damping or a run;
             estimate: a mean over packings to an error; estimate_cost
Settings     BoxStrains: how a box may deform; jamlab.results has the classes of results and of settings
Pictures     .plot(ax) of packings, curves, networks and cells; write_page: interactive page of a sweep; write_movie
Micrographs  micrograph, synthetic_micrograph, track_droplets
Errors       JamlabError: InputError, ConvergenceError, EngineError, StorageError, BoundaryError, SelfCrossingError;
             JamlabWarning: a correct result that may surprise

    onset = jamlab.jam(n=32, seed=1)
    for p in jamlab.compress(onset, to=0.9, step=0.02):
        print(jamlab.contacts(p).z, jamlab.shear_modulus(p))

`help(jamlab.jam)` has arguments, units, errors and an example; so has every name. Shell: `jamlab --help`.
"""

# The public names are in `__init__.pyi`. They load when they are first used: LAMMPS itself imports this package at
# every start to find the plugin.

from typing import Any

import lazy_loader

from jamlab.face import NAMES as _NAMES
from jamlab.face import completed as _completed

_load, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
_NAMES[:] = __all__
__doc__ = _completed(__doc__ or "")


def __getattr__(name: str) -> Any:
    """Load a public name; the version is read from the installed distribution."""
    if name == "__version__":
        from importlib.metadata import version

        return version("jamlab")
    if name in __all__ or name.startswith("__"):
        return _load(name)
    from jamlab.habits import MODULE
    from jamlab.hints import hint
    from jamlab.packing.quantities import MEASURED

    use = hint(name, [MODULE], [*__all__, "__version__"], MEASURED)
    if name in _load("results").__all__:
        use = f": use `jamlab.results.{name}`"
    raise AttributeError(f"module 'jamlab' has no attribute {name!r}{use}", name=name)
