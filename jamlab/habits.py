"""What users of other programs type, and what they mean: the table from which hints are made.

A public function says in its docstring what it is also called. See `jamlab.hints`; `tests/test_hints.py` evaluates
whatever stands between backticks on real objects.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

MODULE = "jamlab"
SHELL = "shell"  # every command
LIMITS = "it is not in jamlab, see docs/explanation/limits.md"


class Concept(NamedTuple):
    """One thing that users mean by several words."""

    words: str  # as they are typed
    has: str = ""  # attributes, arguments or options by which jamlab has it; the first that is there is meant
    use: str = ""  # what gives it elsewhere; {p} stands for a packing
    of: Mapping[str, str] = {}  # class, function, or command as "jamlab NAME": what gives it there, before all others


# class -> how its packing is written in a hint
PACKING = {"Micrograph": "m.packing('dp')", "Session": "session.packing()"}

# file formats and programs in names such as read_data or to_numpy
_FORMATS = ("data dump lammps xyz extxyz hdf5 h5 npz npy json vtk gsd pdb ase ovito file trajectory snapshot "
            "configuration packing packings").split()  # fmt: skip
_RUN = {
    "QuasistaticShear": "`jamlab.flow_curve({p}, rates)`",
    "ShearRun": "`stress / rate`",
    "CreepRun": "`stress / rate`",
    "FlowCurve": "`stress / rate`",
    "HerschelBulkley": "`stress / rate`",
}
_NOT_HERE = dict.fromkeys(
    (MODULE, SHELL, "Packing", "Contacts", "ContactForces", "pack", "jam", "shear", "compress", "scene"), LIMITS
)
_SPECTRUM = "`jamlab.complex_modulus({p}, omega).%s`"
_QUASISTATIC = "`jamlab.quasistatic_shear({p}, strain)`"

CONCEPTS = (
    # oscillation
    Concept("Gp gp gprime g_prime G_prime Gprime G1 storage_modulus storage_mod elastic elastic_part real real_part",
            "storage",
            _SPECTRUM % "storage"),
    Concept("Gpp gpp gdoubleprime g_double_prime G_double_prime Gdoubleprime G2 loss_modulus loss_mod viscous "
            "viscous_part imag imaginary imaginary_part", "loss",
            _SPECTRUM % "loss"),
    Concept("gstar Gstar G_star g_star complex complex_shear_modulus dynamic_modulus dynamic_moduli "
            "viscoelastic_modulus G_complex",
            "", "`jamlab.complex_modulus({p}, omega)`",
            {**dict.fromkeys(("ComplexModulus", "NonlinearModulus", "Oscillation"), "`storage + 1j * loss`"),
             "RelaxationSpectrum": "`modulus(omega)`"}),
    Concept("abs modulus magnitude", "modulus", "`jamlab.shear_modulus({p})`",
            {**dict.fromkeys(("ComplexModulus", "NonlinearModulus", "Oscillation"), "`abs(storage + 1j * loss)`"),
             "ElasticTensor": "`relaxed`, or `jamlab.shear_modulus(packing)`"}),
    Concept("tan_delta tandelta tand loss_tangent loss_factor", "", _SPECTRUM % "loss",
            dict.fromkeys(("ComplexModulus", "NonlinearModulus", "Oscillation"), "`loss / storage`")),
    Concept("phase phase_angle phase_lag delta", "", "",
            {**dict.fromkeys(("ComplexModulus", "NonlinearModulus"), "`np.arctan2(loss, storage)`"),
             "Oscillation": "`np.arctan2(loss, storage)`"}),
    Concept("freq frequency frequencies w angular_frequency omegas freqs", "omega frequencies omega_min", "",
            {"RelaxationSpectrum": "`rates`"}),
    Concept("omega eigenfrequencies eigenfrequency", "frequencies", ""),
    Concept("g0 G0 G_0 plateau_modulus static_modulus g_eq", "g0", "`jamlab.shear_modulus({p})`"),
    Concept("g_inf Ginf G_inf high_frequency_modulus", "", "",
            dict.fromkeys(("ComplexModulus", "RelaxationSpectrum"), "`eta_inf`, since G* grows as i omega eta_inf")),
    Concept("eta viscosity apparent_viscosity dynamic_viscosity eta_star complex_viscosity", "",
            "`jamlab.flow_curve({p}, rates)`, or `jamlab.complex_modulus({p}, omega).eta0`",
            {**_RUN, "ComplexModulus": "`eta0`, `eta_inf` or `loss / omega`", "NonlinearModulus": "`loss / omega`",
             "RelaxationSpectrum": "`eta0`", "Oscillation": "`loss / omega`"}),
    Concept("eta_0 zero_shear_viscosity", "eta0", _SPECTRUM % "eta0"),
    Concept("tau relaxation_time relaxation_times terminal_time taus times_of_relaxation lifetime", "tau_star tau", "",
            {MODULE: "`jamlab.complex_modulus(packing, omega).tau_star`", "RelaxationSpectrum": "`1 / rates`",
             "ComplexModulus": "`tau_star`, or `spectrum.rates` of all elements", "ModeCharacter": "`1 / rates`"}),
    Concept("relaxation_spectrum spectra_of_times", "spectrum", _SPECTRUM % "spectrum"),
    Concept("weights amplitudes_of_modes moduli", "strengths", ""),
    Concept("frequency_sweep saos small_amplitude rheology mechanical_spectrum linear_viscoelasticity viscoelasticity "
            "oscillatory_rheology linear_response spectroscopy", "", "`jamlab.complex_modulus({p}, omega)`"),
    Concept("amplitude_sweep laos LAOS oscillatory_shear oscillation oscillatory lissajous strain_sweep",
            "", "`jamlab.oscillate({p}, omega, amplitude)`", {"Oscillation": "`plot()`"}),
    Concept("harmonic third_harmonic I3 i3", "third_over_first", ""),
    # errors
    Concept("error errors err stderr std uncertainty uncertainties sem sigma_stress",
            "error_bound stress_stderr standard_error yield_stress_stderr ci95",
            "", {"Choice": "`bound`", "HerschelBulkley": "`yield_stress_stderr`, `consistency_stderr` and "
             "`exponent_stderr`", "Collapse": "`mu_ci95`, `lambda_ci95` and `delta_ci95`"}),
    Concept("mu_stderr mu_error mu_err mu_std", "mu_ci95"),
    Concept("lambda_stderr lambda_error lam_ci95 lam_stderr lam_error lambda_err", "lambda_ci95"),
    Concept("delta_stderr delta_error delta_err", "delta_ci95"),
    Concept("chi2 residual residuals cost r2 goodness rmse", "misfit spread"),
    Concept("params parameters coefficients popt fit fit_params", "params",
            "", {"HerschelBulkley": "`yield_stress`, `consistency` and `exponent`", "FlowCurve": "`herschel_bulkley()`",
                 "Collapse": "`exponents`, or `mu`, `lambda_` and `delta`"}),
    Concept("ci confidence_interval interval", "ci95 mu_ci95"),
    # scaling
    Concept("beta exponent_of_pressure", "mu", "", {"Collapse": "`mu` of G_0 ~ p^mu"}),
    Concept("nu z_exponent", "lambda_", "", {"Collapse": "`lambda_` of tau* ~ p^-lambda", "ElasticTensor":
            "`to_dataframe()['nu']`"}),
    Concept("collapse scaling critical_exponents critical_scaling scaling_exponents data_collapse master_curve "
            "scaling_collapse", "", "`jamlab.scaling_collapse(pressures, spectra)`",
            {"Campaign": "`jamlab.scaling_collapse(campaign)`"}),
    Concept("correlation_length xi", "length", "`jamlab.displacement_correlation({p}, omega).length`"),
    # flow
    Concept("tau_xy shear_stress sigma_xy sxy s_xy xy_stress", "stress", "`jamlab.evaluate({p}).stress`"),
    Concept("sigma tau", "stress", "`jamlab.evaluate({p}).stress`",
            {"Packing": "`diameters`, or `jamlab.evaluate({p}).stress`"}),
    Concept("stress stresses stress_tensor virial pressure_tensor cauchy_stress virial_stress sigma_ij", "stress",
            "`jamlab.evaluate({p}).stress`"),
    Concept("gamma strain shear_strain total_strain gamma_max max_strain strains final_strain",
            "strain strain_asked amplitude"),
    Concept("gamma0 gamma_0 strain_amplitude amp", "amplitude strain"),
    Concept("gamma_dot gammadot shear_rate strain_rate shear_rates rate gdot", "rate rates shear_rate"),
    Concept("t times dt timestep", "time"),
    Concept("power dissipated_power dissipation_rate", "dissipation"),
    Concept("N1 n1 first_normal_stress first_normal_stress_difference normal_stress_differences",
            "normal_stress_difference",
            "`jamlab.shear({p}, rate).normal_stress_difference`"),
    Concept("normal_stress normal_stresses", "", "`jamlab.evaluate({p}).stress`",
            dict.fromkeys(("FlowRun", "FlowCurve"), "`pressure` and `normal_stress_difference`")),
    Concept("p P pressures pressure press", "pressure pressures", "`jamlab.measure({p}, 'pressure')['pressure']`",
            {"jam": "`jamlab.pack(n, pressure)`, which makes packings at a pressure", "jamlab jam": "`jamlab pack`",
             "scene": "`jamlab.pack(n, pressure)`",
             "ElasticTensor": "`jamlab.evaluate(packing).pressure`"}),
    Concept("packings snapshots trajectory configurations configs", "frames packings", "",
            {"FlowRun": "`frames`, or `packing` for the last one"}),
    Concept("states", "", "", {"Campaign": "`table('states')`"}),
    Concept("spectra mean_spectra", "", "", {"Campaign": "`table('spectra')`, or `jamlab.mean_spectra(campaign)`"}),
    Concept("final last final_state last_packing end_state", "packing"),
    Concept("mean_stress average average_stress steady_state_stress steady_stress mean", "steady value mean_local", "",
            {"Campaign": "`aggregate(values)`"}),
    Concept("steady_state steady_shear flow_sweep flowcurve flow flow_curves constitutive flow_curve mean_flow_curve",
            "steady", "`jamlab.flow_curve({p}, rates)`", {"Campaign": "`jamlab.mean_flow_curve(campaign)`"}),
    Concept("overshoot stress_overshoot maximum max max_stress peak_stress", "peak"),
    Concept("plateau plateau_stress flow_stress", "steady g0"),
    Concept("movie animate animation video write_movie", "", "`jamlab.write_movie(path, run)`",
            {**dict.fromkeys(("Packing", "Contacts"), "`jamlab.write_movie(path, run)` of a flow"),
            "Modes": "`plot()`"}),
    Concept("yield_stress sigma_y tau_y tau0 tau_0 sigma0", "yield_stress",
            "`jamlab.flow_curve({p}, rates).herschel_bulkley()`",
            {"FlowCurve": "`herschel_bulkley().yield_stress`", "ShearRun": "`steady()`, or `peak` for the overshoot"}),
    Concept("yield_strain yielding yield_point", "", _QUASISTATIC + ", where the stress levels off",
            {"ShearRun": "`peak`"}),
    Concept("herschel_bulkley hb HB herschel_bulkley_fit fit_herschel_bulkley yield_stress_fit "
            "fit_hb hb_fit bingham casson fit_flow_curve", "herschel_bulkley",
            "`jamlab.flow_curve({p}, rates).herschel_bulkley()`",
            {"Campaign": "`jamlab.mean_flow_curve(campaign).herschel_bulkley()`"}),
    Concept("n index flow_index power exponent", "exponent", "", {"FlowCurve": "`herschel_bulkley().exponent`"}),
    Concept("k K consistency consistency_index", "consistency", "", {"FlowCurve": "`herschel_bulkley().consistency`"}),
    Concept("startup startup_shear start_up simulate simple_shear lees_edwards stress_growth steady_shearing "
            "bubble_model durian "
            "couette deform strain_controlled strain_controlled_shear constant_rate", "", "`jamlab.shear({p}, rate)`"),
    Concept("aqs AQS athermal_quasistatic quasistatic avalanches plastic_events rearrangements shear_quasistatic "
            "stress_drop T1 t1 t1_events stress_drops", "events plastic_events", _QUASISTATIC),
    Concept("stress_relaxation relaxation_modulus step_strain relaxation G_of_t", "modulus",
            "`jamlab.relax_stress({p}, strain, duration)`"),
    Concept("residual", "residual_stress"),
    Concept("background", "background_drag"),
    Concept("points", "points_per_cycle"),
    Concept("applied", "applied_stress applied_strain"),
    Concept("cessation flow_cessation stop arrest flow_arrest", "residual_stress",
            "`jamlab.stop_flow(flow, duration)`"),
    Concept("compliance creep_compliance J creep_test constant_stress stress_controlled stress_sweep", "compliance",
            "`jamlab.creep({p}, stress, duration)`"),
    Concept("shear_band shear_banding velocity velocity_profile velocities profile", "velocity_profile velocity",
            "`jamlab.shear({p}, rate).velocity_profile`: packings are at rest"),
    Concept("drag damping damping_law drag_law viscous_force", "damping",
            "`jamlab.ContactDamping()` or `jamlab.StokesDrag()`"),
    Concept("d2min D2min D2_min D2 falk_langer local_shear_strain atomic_strain", "d2min",
            "`jamlab.local_strain(run)`"),
    Concept("t1 T1 t1_event T1_events t1s neighbor_swap rearrangements neighbor_changes", "t1",
            "`jamlab.t1_events(run)`"),
    Concept("chi4 chi_4 overlap_function self_overlap_function dynamic_heterogeneity dynamic_susceptibility",
            "susceptibility", "`jamlab.self_overlap(run)`"),
    Concept("nonaffine nonaffine_displacement nonaffine_displacements non_affine nonaffinity", "nonaffine",
            "`jamlab.nonaffine_response({p})`",
            {"Micrograph": "`jamlab.nonaffine_response(m.packing('sp'))`"}),
    # elasticity
    Concept("G_xy g_xy", "g_x g0", "`jamlab.shear_modulus({p}, direction='simple')`"),
    Concept("G g shear_modulus shear_mod shear_moduli", "g0 g", "`jamlab.shear_modulus({p})`",
            {"ElasticTensor": "`to_dataframe()['g']`, or `jamlab.shear_modulus(packing)`", "NonlinearModulus":
             "`storage`"}),
    Concept("K B k b bulk bulk_mod bulk_modulus bulk_moduli compressibility", "b", "`jamlab.bulk_modulus({p})`",
            {"ElasticTensor": "`to_dataframe()['b']`, or `jamlab.bulk_modulus(packing)`"}),
    Concept("young_modulus youngs_modulus young E elasticity stiffness elastic_moduli elastic_constants "
            "elastic_modulus stiffness_tensor "
            "stiffness_matrix lame", "", "`jamlab.elastic_tensor({p}).to_dataframe()`",
            {"Contacts": "`packing.params` of the law of force, or `jamlab.hessian(packing)`",
            "ElasticTensor": "`to_dataframe()`"}),
    Concept("poisson poisson_ratio poissons_ratio", "",
            "`jamlab.elastic_tensor({p}).to_dataframe()['nu']`", {"ElasticTensor": "`to_dataframe()['nu']`"}),
    Concept("voigt C c_ijkl cij tensor C_ijkl", "relaxed", "`jamlab.elastic_tensor({p}).relaxed`",
            {"ElasticTensor": "`relaxed`, or `to_dataframe()` in Voigt's notation"}),
    Concept("born born_modulus affine_modulus", "affine", "`jamlab.shear_modulus({p}, 'affine')`"),
    Concept("modes dos vdos density_of_states normal_modes eigenmodes eigenvalues phonons spectrum_of_modes "
            "vibrational_modes density D D_omega boson_peak omega_star w_star diagonalize eigh eig eigsh soft_modes "
            "low_frequency_modes",
            "frequencies eigenvalues", "`jamlab.density_of_states({p})`, or `jamlab.lowest_modes({p}, None)`",
            {"Modes": "`density()`, or `frequencies`", "Campaign": "`jamlab.density_of_states(campaign)`"}),
    Concept("damped_modes damped_eigenmodes complex_eigenvalues attenuation quality_factor damping_ratio underdamped "
            "quadratic_eigenvalue_problem", "attenuation damping_ratio", "`jamlab.damped_vibrations({p}, masses=1.0)`"),
    Concept("values eigenvals eigvals evals eigs w2 omega2 lowest", "eigenvalues"),
    Concept("eigenvectors displacement displacements eigvecs evecs eigenvecs mode polarization polarizations "
            "mode_shapes",
            "vectors displacements",
            "`jamlab.lowest_modes({p}).vectors`, or `jamlab.track_droplets(source)` of pictures"),
    Concept("participation mode_participation localization localisation participation_ratio participation_ratios "
            "ipr pr", "participation", "`jamlab.lowest_modes({p}).participation`"),
    Concept("hessian dynamic_matrix dynamical_matrix dynmat stiffness_of_sites force_constants", "",
            "`jamlab.hessian({p})`, or `jamlab.dynamical_matrices({p})`"),
    Concept("self_stress self_stresses states_of_self_stress floppy_modes isostatic isostaticity constraint_counting "
            "constraints maxwell",
            "self_stress_states isostatic floppy_modes", "`jamlab.maxwell_count({p})`"),
    Concept("pebble_game rigid_cluster rigidity clusters", "sizes", "`jamlab.rigid_clusters({p})`",
            {"Micrograph": "`jamlab.rigid_clusters(m.packing('sp'))`"}),
    # structure
    Concept("coordination coordination_number contact_number mean_contacts z_mean Z", "z z_all",
            "`jamlab.contacts({p}).z`"),
    Concept("z", "z_all", "`jamlab.contacts({p}).z`"),
    Concept("contacts contact_network contact_list find_contacts neighbor_list neighbour_list pair_list bonds "
            "adjacency adjacency_matrix",
            "bonds contacts pairs",
            "`jamlab.contacts({p})`"),
    Concept("forces force", "forces on_j", "`jamlab.evaluate({p}).forces`, or `jamlab.contacts({p}).forces`",
            {"Contacts": "`forces`"}),
    Concept("fn f_n normal_force normal_forces contact_forces force_distribution force_chains force_network "
            "magnitude_of_force force_magnitude f gap gaps overlap overlaps delta delta_n indentation", "",
            "`jamlab.contacts({p}).forces`",
            {"Contacts": "`forces`, with gap and size", "ContactForces": "`size`, `on_j` or `gap`"}),
    Concept("i j ij id1 id2 ids indices pair edges adjacency bonds", "pairs", "",
            {"ContactForces": "`to_dataframe()`"}),
    Concept("distances distance separation r_ij normals fabric fabric_tensor vectors angles theta branch "
            "branch_vectors "
            "contact_angles directions bond_vectors", "", "`jamlab.contacts({p}).r`", {"Contacts": "`r`, vectors "
            "between centres"}),
    Concept("lengths length", "",
            "`jamlab.contacts({p}).r`",
            {"Packing": "`box`, or `jamlab.contacts({p}).r` of contacts", "Contacts": "`r`, vectors between centres"}),
    Concept("rattlers rattler floaters", "rattlers", "`jamlab.contacts({p}).rattlers`"),
    Concept("jammed unjammed is_jammed stable is_stable unstable mechanically_stable mechanical_stability", "",
            "`jamlab.contacts({p}).unjammed`",
            {"Contacts": "`not unjammed`", "MaxwellCount": "`floppy_modes == 0`"}),
    Concept("neighbors neighbours n_neighbours n_neighbors nearest_neighbors", "neighbours neighbors pairs",
            "`jamlab.tessellation({p})`, or `jamlab.contacts({p}).pairs`", {"Tessellation": "`sides`"}),
    Concept("voronoi voronoi_cells cells delaunay tessellation triangulation delaunay_triangulation free_volume "
            "free_area", "cells",
            "`jamlab.tessellation({p})`"),
    Concept("rdf g_r gr g_of_r radial_distribution radial_distribution_function pair_distribution_function "
            "pair_distribution g2 pcf paircorrelation compute_rdf", "g", "`jamlab.pair_correlation({p}, 5.0)`"),
    Concept("s_of_q s_of_k sq S_q sk s_k S_k ssf static_structure_factor", "values mean",
            "`jamlab.structure_factor({p}, 20.0)`"),
    Concept("hyperuniform hyperuniformity chi_k chi_v chi_V", "values mean", "`jamlab.spectral_density({p}, 20.0)`"),
    Concept("to_ase to_ovito to_freud ovito freud", "",
            "`jamlab.universe({p})` for MDAnalysis, or `jamlab.write(path, {p})` for freud and OVITO"),
    Concept("psi6 psi_6 hexatic bond_order boo steinhardt bond_angles bond_orientational_order hexatic_order "
            "orientational_order", "local psi_6",
            "`jamlab.hexatic_order({p})`"),
    Concept("overall psi_6_overall psi6_global psi_global", "global_order psi_6_global"),
    Concept("circularity shape_factor shape_index asphericity deformation anisotropy shape", "shape_factor",
            "`jamlab.shape_factors({p})`",
            {"Contacts": "`r`: the fabric is the mean of its directions", "Packing": "`jamlab.shape_factors({p})`, "
             "`jamlab.evaluate({p}).stress`, or `jamlab.contacts({p}).r` for the fabric"}),
    Concept("area areas cell_areas polygon_area particle_area", "areas area", "`jamlab.particle_areas({p})`",
            {"Packing": "`polygons.areas`, or `jamlab.particle_areas({p})`",
             "FlowRun": "`jamlab.particle_areas(packing)`"}),
    Concept("perimeter perimeters", "perimeters perimeter", "`jamlab.shape_factors({p})`",
            {"Packing": "`polygons.perimeters`, or `jamlab.shape_factors({p})`",
             "Micrograph": "`shape_factor`, perimeter squared over 4 pi area"}),
    Concept("packing_fraction area_fraction phi density rho volume_fraction solid_fraction liquid_fraction "
            "packing_density",
            "phi rho packing_fraction to", "`jamlab.packing_fraction({p})`",
            {"jam": "`jamlab.compress(onset, to=0.9)`, from onset", "Packing": "`phi`, or "
             "`jamlab.packing_fraction({p})`",
             "jamlab jam": "`jamlab compress`, from onset",
             "FlowRun": "`jamlab.packing_fraction(packing)`"}),
    Concept("tolerance force_tol ftol", "force_tolerance tolerance", ""),
    Concept("jamming_point phi_j phi_c phi_J find_jamming onset jamming jamming_onset phi_jam rcp "
            "critical_density critical_packing_fraction jamming_density jamming_fraction "
            "random_close_packing", "phi_J rho_J",
            "`jamlab.jam(n).phi`"),
    Concept("void_fraction porosity", "", "`1 - jamlab.packing_fraction({p})`", {"Micrograph": "`1 - rho`"}),
    Concept("void pores holes pore_sizes", "voids", "`jamlab.voids({p})`"),
    Concept("z_iso isostatic_z", "isostatic", "`jamlab.contacts({p}).isostatic`, the contacts needed"),
    Concept("excess_coordination delta_z dz excess_contacts z_excess", "", "`jamlab.contacts({p})`: 2 (n_contacts - "
            "isostatic) / n_backbone", {"Contacts": "`2 * (n_contacts - isostatic) / n_backbone`"}),
    Concept("rattler_fraction fraction_of_rattlers f_r", "", "`jamlab.contacts({p}).rattlers.mean()`",
            {"Contacts": "`rattlers.mean()`"}),
    Concept("backbone rigid_backbone", "n_backbone", "`jamlab.remove_rattlers({p})`"),
    Concept("zero_modes n_zero n_zero_modes null_modes", "", "`jamlab.count_zero_modes({p})`"),
    # particles
    Concept("polydispersity dispersity size_dispersity", "", "", {"Packing": "`diameters.std() / diameters.mean()`",
            "Micrograph": "`areas`"}),
    Concept("sizes size size_distribution size_ratio radii_ratio bidispersity diameter_ratio", "diameters areas"),
    Concept("eps epsilon k kn ka stiffness spring_constant exponent stickiness force_law law_parameters", "", "",
            {"Packing": "`params`, the parameters of the law of force"}),
    Concept("strain gamma shear_strain", "", "", {"Packing": "`box`, whose rows are its edges, or `params`"}),
    Concept("ids id indices tags particle_ids", "", "", {"Packing": "`positions`: particles are counted from 0 in its "
            "order"}),
    Concept("dt time timestep", "", "", {"Packing": "`jamlab.shear({p}, rate)`: a packing is at rest, without time"}),
    Concept("radii radius r_i R sizes_of_particles", "diameters", "`jamlab.particle_areas({p})`",
            {**dict.fromkeys(("pack", "jam"), "`sizes`, diameters in any unit"),
             "Packing": "`disk_diameters / 2`", "Micrograph": "`np.sqrt(areas / np.pi)`"}),
    Concept("diameter diameters equivalent_diameter equivalent_diameters d", "diameters",
            "`jamlab.particle_areas({p})`", {**dict.fromkeys(("pack", "jam"), "`sizes`"),
             "Micrograph": "`np.sqrt(4 * areas / np.pi)`"}),
    Concept("center_of_mass centers_of_mass centers centres centroids xy positions coords coordinates pos points "
            "get_positions wrap x y",
            "centres positions centroids centroid"),
    Concept("coords pos x wrap arrays", "positions"),
    Concept("polygons vertices contours boundaries outlines edges_of_particles", "outlines", "",
            {"Packing": "`polygons.shapes()`", "pack": "`jamlab.jam(n, 'dp', law={'vertices': 16})`"}),
    Concept("N num num_particles n_particles natoms n_atoms particles number num_droplets droplet_count droplets "
            "n_droplets npart count "
            "num_contacts n nc",
            "n n_contacts count n_particles", "", {"Estimate": "`packings`", "Choice": "`packings`"}),
    Concept("box_length box_size L Lx box boxsize side", "", "", dict.fromkeys(("pack", "jam"), "`n`: the size of the "
            "box follows")),
    Concept("L cell lattice lx Lx ly Ly box box_length box_size volume boxsize dimensions", "box", "",
            {"Packing": "`box`, or `area`"}),
    Concept("remove subset mask without keep filter", "select"),
    Concept("boundary boundaries_of_box periodic pbc boundary_conditions wall", "walls", "",
            dict.fromkeys(("pack", "jam"), "`jamlab.with_walls` afterwards: the box is periodic")),
    Concept("n_vertices num_vertices vertices_per_particle", "offsets"),
    Concept("types type species", "", "", {"Packing": "`diameters`: a particle has a size, no type"}),
    Concept("masses mass inertia", "", "`jamlab.damped_vibrations({p})`, and the argument masses of "
            "`jamlab.complex_modulus` and `jamlab.lowest_modes`; flow is overdamped"),
    Concept("images image_flags", "image", "`jamlab.contacts({p}).shift`, of every contact"),
    Concept("copy replace modify update with_positions add translate scale rotate shift", "with_state", "",
            {"Packing": "`with_state`: packings never "
            "change, so none needs a copy"}),
    Concept("seed metadata history info version_of_jamlab how_made", "provenance seeds", "",
            {MODULE: "the argument seed of `jamlab.pack` or `jamlab.jam`"}),
    Concept("set_seed random_seed np_seed", "", "the argument seed of `jamlab.pack` or `jamlab.jam`"),
    Concept("energy potential_energy energies U total_energy energy_per_particle", "energy",
            "`jamlab.evaluate({p}).energy`"),
    Concept("to_numpy as_array", "", "", {"Packing": "`positions`"}),
    Concept("elastic_energy strain_energy", "energy", "`jamlab.evaluate({p}).energy`"),
    # files and tables
    Concept(" ".join(f"{do}_{what}" for do in ("read", "load", "open", "import", "from") for what in (
        "tiff tif png jpg jpeg image images picture pictures mask masks labels stack nd2 czi lif avi").split()), "",
            "`jamlab.micrograph(picture)`"),
    Concept(" ".join(f"{do}_{what}" for do in ("read", "load", "open", "import") for what in _FORMATS), "",
            "`jamlab.read(path)`"),
    Concept("from_csv read_csv load_csv read_table", "", "", {MODULE: "pandas.read_csv: tables are plain CSV files"}),
    Concept(" ".join(f"{do}_{what}" for do in ("write", "save", "to", "export", "dump") for what in _FORMATS), "", "",
            {MODULE: "`jamlab.write(path, packings)`", "Packing": "`jamlab.write(path, {p})`"}),
    Concept("to_excel to_parquet to_latex to_markdown to_string to_records groupby hist histogram head tail iloc loc "
            "columns index sort_values query median describe rolling pivot merge", "", "",
            {**dict.fromkeys(("Result", "Micrograph"), "`to_dataframe()`, a table of pandas"),
             "Campaign": "`table()`, a table of pandas", "Packing": "`jamlab.measure([{p}])`, columns of a table"}),
    Concept("stress_strain stress_strain_curve curve", "", "", {"FlowRun": "`to_dataframe()[['strain', 'stress']]`, or "
            "`plot()`", "FlowCurve": "`to_dataframe()`, or `plot()`"}),
    Concept("energy_drops avalanche_sizes drop_sizes event_sizes", "", "", {"QuasistaticShear": "`events.released`"}),
    Concept("mu mu_I friction_coefficient macroscopic_friction stress_ratio", "", "",
            dict.fromkeys(("FlowCurve", "FlowRun"), "`stress / pressure`")),
    Concept("inertial_number", "", "", {"FlowCurve": "`rate`: motion is overdamped", "ShearRun":
            "`rate`: motion is overdamped"}),
    Concept("Kn harmonic potential potentials hertzian hertz soft_sphere soft_spheres force_law pair_style "
            "pair_potential interaction", "", "`jamlab.pack(n, pressure)`, whose argument exponent belongs to the "
            "energy",
            {"Packing": "`law` and `params`"}),
    Concept("bidisperse binary binary_mixture polydisperse monodisperse", "", "", {MODULE: "the arguments size_ratio "
            "and sizes of `jamlab.pack` or `jamlab.jam`"}),
    Concept("run fix unfix pair_coeff thermo", "", "", {MODULE: "`jamlab.Session(packing)`, which takes LAMMPS "
            "commands"}),
    Concept("load open from_file read_file load_hdf5 read_hdf5 from_lammps read_lammps load_packing io", "",
            "`jamlab.read(path)`"),
    Concept("read_trajectory trajectory_of_file load_trajectory Trajectory iterread read_frames", "",
            "`jamlab.read_all(path)`"),
    Concept("save write export dump to_hdf5 to_lammps to_json to_file savefig to_dict to_csv", "write draw", "",
            {MODULE: "`jamlab.write(path, packings)`", "Packing": "`jamlab.write(path, {p})`",
             "Result": "`to_dataframe().to_csv(path)`", "Micrograph": "`draw(path)`, or `table().to_csv(path)`",
             "Campaign": "`export(folder)`, or the command `jamlab campaign export`",
             "Session": "`jamlab.write(path, {p})`"}),
    Concept("to_dataframe df dataframe table results data to_pandas as_dataframe asdict pandas", "to_dataframe table",
            "`jamlab.measure([{p}])`, a table of observables"),
    Concept("overlay", "plot", "`m.draw(path)` of a micrograph m"),
    Concept("plot draw show imshow view figure render loglog semilogx semilogy scatter quiver contour", "plot",
            "`{p}.plot()`, or plot() of most results",
            {"Campaign": "`table()` or `aggregate(values)`: a table with plot()", MODULE: "`packing.plot()`, or "
             "`jamlab.synthetic_micrograph(packing)`"}),
    Concept("measure observables compute analyze", "", "`jamlab.measure({p})`"),
    Concept("path filename fname", "", "", {"Campaign": "`file` or `folder`"}),
    # making
    Concept("cg sd hftn minimizer conjugate_gradient steepest_descent equilibrate quench find_minimum minimize "
            "minimise fire FIRE relax relaxation_of_energy "
            "energy_minimization", "",
            "`jamlab.relax({p})`"),
    Concept("compress isotropic_compression hydrostatic_compression compression sweep inflate swell swelling "
            "pressure_sweep", "",
            "`jamlab.compress({p}, to=0.95)`, or `jamlab.pack(n, pressure)` for each pressure"),
    Concept("unjam unload decompression expand", "", "`jamlab.decompress({p}, pressure)`"),
    Concept("box_relax box_relaxation npt variable_cell enthalpy_minimization constant_pressure", "",
            "`jamlab.pack(n, pressure)`, or `jamlab.BoxStrains` in a Session"),
    Concept("random_packing generate create make_packing make random initialize sample initial_configuration "
            "make_packings new_packing", "",
            "`jamlab.pack(n, pressure)`, or `jamlab.jam(n)` at onset", {"Recipe": "`jamlab.make(recipe)`"}),
    Concept("emulsion foam soft_disks jammed_packing particles_of_foam", "", "`jamlab.jam(n, model)`, or "
            "`jamlab.pack(n, pressure)`"),
    Concept("ensemble campaign Campaign job_array run_campaign submit slurm sbatch qsub queue workflow", "",
            "`jamlab.open_campaign(path)`, or "
            "`jamlab.estimate`"),
    Concept("run batch parallel", "steps run",
            "`jamlab.open_campaign(path)`, or `jamlab.track_droplets(pictures)` of a series"),
    Concept("Simulation simulation Engine lammps", "", "`jamlab.Session({p})`"),
    Concept("System Box create_box from_arrays from_numpy from_positions Particles Config Configuration Disks "
            "Droplets Snapshot Frame State from_ase", "",
            "`jamlab.Packing`"),
    # pictures
    Concept("track link link_df trackpy track_particles tracking linking trajectories tracks", "",
            "`jamlab.track_droplets(source)`"),
    Concept("load_mask read_mask otsu threshold_otsu binarize hough hough_circles "
            "connected_components cellpose stardist locate segment segmentation detect analyze_image image load_image "
            "imread watershed find_droplets "
            "read_image analyse_image threshold_image force_inference stress_from_image picture",
            "picture labels", "`jamlab.micrograph(picture)`"),
    Concept("image frame picture_array raw", "picture"),
    Concept("render render_packing draw_packing", "", "`jamlab.synthetic_micrograph({p})`, or `{p}.plot()`"),
    Concept("gap film_thickness", "film"),
    Concept("n_labels num_labels number_of_labels n_objects n_regions", "count"),
    Concept("adjacency network", "touching"),
    Concept("summary report confidence errors error", "numbers"),
    Concept("reliability is_reliable reliable good", "quality"),
    Concept("extract", "table"),
    Concept("label mask regions segmentation_mask label_image", "labels", "`jamlab.micrograph(labels=picture)`"),
    Concept("regionprops regionprops_table properties props", "", "`jamlab.micrograph(labels=picture).table()`",
            {"Micrograph": "`table()`"}),
    Concept("pixel_size scale microns_per_pixel calibration um_per_px mpp pixelsize pixel_size_um", "pixel"),
    Concept("snr signal_to_noise", "noise"),
    Concept("units", "unit unit_names", "", {MODULE: "`packing.unit_names`"}),
    Concept("power_law power_law_fit powerlaw exponent_fit scaling_fit", "", "", {MODULE: "the function "
            "fit_power_law of the module jamlab.statistics.power_laws"}),
    # shell and package
    Concept("lammps_version test tests show_versions selftest check_installation doctor", "", "the command `jamlab "
            "doctor`"),
    Concept("version VERSION get_version", "__version__", "", {MODULE: "`jamlab.__version__`"}),
    Concept("exceptions errors Error exception JamlabException error JammingError", "", "",
            {MODULE: "`jamlab.JamlabError`"}),
    Concept("types classes", "", "", {MODULE: "`jamlab.results`"}),
    Concept("imsd emsd drift subtract_drift compute_drift van_hove", "", "", {MODULE: LIMITS}),
    Concept("velocity_field strain_field displacement_field piv dic optical_flow", "", "", {MODULE: LIMITS}),
    Concept("eccentricity", "", "", dict.fromkeys((MODULE, "Packing"), LIMITS)),
    Concept("eccentricity bbox bounding_box solidity convexity extent euler_number convex_area convex_hull filled_area "
            "major_axis_length minor_axis_length axis_major_length axis_minor_length major_axis minor_axis orientation "
            "moments moments_hu inertia_tensor feret_diameter_max feret elongation aspect_ratio roundness compactness "
            "intensity brightness intensity_mean mean_intensity max_intensity intensity_image weighted_centroid", "",
            "",
            {"Micrograph": "`labels`, of which skimage.measure.regionprops has it"}),
    Concept("crop rotate flip resize rescale smooth blurred denoise gaussian median_filter filter background "
            "subtract_background normalize invert clean dilate erode opening closing skeleton threshold", "", "",
            {"Micrograph": "`picture`, an array: change it before `jamlab.micrograph(picture)`",
             MODULE: "scikit-image for it, before `jamlab.micrograph(picture)`"}),
    Concept("edges edge boundary", "outlines", "", {"Packing": "`polygons.edges`"}),
    Concept("scale_bar scalebar", "pixel"),
    Concept("as_packing to_packing make_packing to_model", "packing"),
    Concept("droplet_forces forces_from_shape infer_forces forces_from_image contact_forces", "",
            "`jamlab.contacts(m.packing('dp')).forces` of a micrograph m"),
    Concept("photoelastic photoelasticity pegs", "", "", {MODULE: LIMITS}),
    Concept("local_density local_phi local_rho", "", "`jamlab.local_packing_fraction({p})`"),
    Concept("cite citation bibtex", "", "", {MODULE: "the file CITATION.cff of the repository"}),
    Concept("logger logging log set_log_level verbose verbosity debug", "", "",
            {MODULE: "`logging.getLogger('jamlab')`"}),
    Concept("bulk_viscosity gpu cuda", "", "", _NOT_HERE),
    Concept("dim dimension dimensions friction mu_friction ft tangential tangential_forces torque torques gravity "
            "temperature kT T activity", "", "", _NOT_HERE),
    Concept("set_num_threads num_threads", "ranks", "the argument ranks of `jamlab.jam` or `jamlab.pack`"),
    Concept("lmp lammps_command cmd execute", "command"),
    Concept("step steps run_steps integrate", "steps"),
    Concept("extract gather get", "", "", {"Session": "`evaluate()`, `positions()` or `fix_vector`"}),
    Concept("tasks jobs", "finished", "", {"Campaign": "`finished()`"}),
    Concept("progress progress_bar", "progress status"),
    Concept("resume restart continue_run", "", "", {"Campaign": "`run()`, which resumes"}),
    Concept("summary overview", "summary status"),
    Concept("time_series history", "to_dataframe"),
    Concept("lam lmbda", "lambda_"),
    Concept("slope Delta", "delta"),
    Concept("crossover crossover_frequency", "tau_star"),
    Concept("maxwell prony prony_series maxwell_modes maxwell_elements fit generalized_maxwell", "spectrum"),
    Concept("strong backbone_contacts", "bearing"),
)  # fmt: skip
