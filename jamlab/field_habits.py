"""Words of fields and of other programs that `jamlab.habits` leaves open, asked before those; see there."""

from jamlab.habits import LIMITS, MODULE, Concept

_SPECTRA = ("ComplexModulus", "NonlinearModulus", "Oscillation")

FIELD = (
    # elasticity
    Concept("lame lambda_ lambda lam mu lame_coefficients lame_parameters first_lame second_lame", "", "",
            {"ElasticTensor": "`to_dataframe()`, in two dimensions mu = g and lambda = b - g"}),
    Concept("compliance compliance_tensor compliance_matrix S s_ijkl", "", "", {"ElasticTensor":
            "`relaxed`, whose inverse it is"}),
    Concept("anisotropy isotropic is_isotropic isotropy zener eigenvalues eigvals principal_moduli kelvin_moduli "
            "stable is_stable", "", "", {"ElasticTensor": "`relaxed`, the tensor of which it follows"}),
    Concept("C11 C12 C22 C33 C16 C26 C44 C66 c11 c12 c22 c33 c66 cxxxx cxyxy C_xyxy components c1212 mu_shear rotate",
            "", "",
            {"ElasticTensor": "`relaxed`, or `to_dataframe()`"}),
    Concept("nonaffine nonaffine_modulus non_affine_modulus nonaffine_part nonaffine_correction "
            "nonaffine_contribution", "", "",
            {"ElasticTensor": "`affine - relaxed`"}),
    Concept("p_wave longitudinal_modulus sound_velocity speed_of_sound sound_speed wave_speed", "",
            "`jamlab.elastic_tensor({p}).to_dataframe()`: the moduli of which it follows",
            {"ElasticTensor": "`to_dataframe()`, the moduli of which it follows"}),
    # oscillation
    Concept("G_abs magnitude_of_g", "", "", dict.fromkeys(_SPECTRA, "`abs(storage + 1j * loss)`")),
    Concept("G_p G_s", "", "", dict.fromkeys(_SPECTRA, "`storage`")),
    Concept("G_pp G_l", "", "", dict.fromkeys(_SPECTRA, "`loss`")),
    Concept("waveform waveforms fundamental stress_amplitude", "", "", {"Oscillation": "`stress` over `time`, or "
            "`harmonics`"}),
    Concept("eta_prime dynamic_viscosity eta_p", "", "", dict.fromkeys(_SPECTRA, "`loss / omega`")),
    Concept("eta_double_prime eta_pp eta_doubleprime", "", "", dict.fromkeys(_SPECTRA, "`storage / omega`")),
    Concept("cole_cole colecole nyquist van_gurp_palmen bode loglog_plot", "", "",
            dict.fromkeys(_SPECTRA, "`storage` and `loss`")),
    Concept("complex_compliance J_star J_prime storage_compliance loss_compliance", "", "",
            dict.fromkeys(_SPECTRA, "`1 / (storage + 1j * loss)`")),
    Concept("complex_viscosity eta_star", "", "", dict.fromkeys(_SPECTRA, "`abs(storage + 1j * loss) / omega`")),
    Concept("frequency_hz f hertz hz freq_hz", "", "",
            dict.fromkeys(("ComplexModulus", "NonlinearModulus"), "`omega / (2 * np.pi)`")),
    Concept("intracycle minimum_strain_modulus large_strain_modulus chebyshev fourier ft_rheology harmonic_spectrum",
            "harmonics", "`jamlab.oscillate({p}, omega, amplitude).harmonics`"),
    Concept("linear_regime lvr LVR linear_range amplitude_limit critical_strain", "",
            "`jamlab.oscillate({p}, omega, amplitude)` at several amplitudes"),
    Concept("I31 I3_1 i31 I3I1 e3 e_3 Q Q0 nonlinearity", "third_over_first"),
    Concept("G1_prime G1_double_prime G_1 G_L G_M g_n", "", "", {"Oscillation": "`storage`, `loss` or `harmonics`"}),
    Concept("loss_angle phase_lag phase_shift", "", "", dict.fromkeys(_SPECTRA, "`np.arctan2(loss, storage)`")),
    Concept("loss loss_angle phase_lag phase_angle phase_shift tan_phi viscoelastic viscoelastic_moduli "
            "frequency_response transfer_function trios rheocompass rheometer", "", "`jamlab.complex_modulus({p}, "
            "omega)`, with storage and loss"),
    # flow
    Concept("time_sweep relaxation_curve", "", "`jamlab.relax_stress({p}, strain, duration)`"),
    Concept("normal_force_difference first_normal", "normal_stress_difference"),
    Concept("peak_strain overshoot_strain strain_at_peak peak_position", "peak", "", {"FlowRun":
            "`to_dataframe()[['strain', 'stress']]`"}),
    Concept("msd mean_squared_displacement", "", "", {"FlowRun": "`jamlab.mean_square_displacement(run)`"}),
    Concept("displacement displacements trajectories unwrapped", "", "",
            {"FlowRun": "`frames`, packings whose positions differ"}),
    Concept("plastic_strain elastic_strain", "plastic_events"),
    Concept("restart continue_ resume continue_run extend", "", "", {"FlowRun": "`packing`, from which another run "
            "starts"}),
    Concept("converged success is_done done", "finished converged"),
    Concept("dissipated_energy heat", "dissipated dissipation"),
    Concept("yield_curve yield", "", "`jamlab.flow_curve({p}, rates).herschel_bulkley()`, or "
            "`jamlab.quasistatic_shear({p}, strain)`"),
    Concept("carreau carreau_yasuda cross cross_model papanastasiou ostwald power_law_fluid sisko fit_model "
            "carreau_fit cross_fit windhab three_component", "",
            "`jamlab.flow_curve({p}, rates)`: fit its rate and stress by scipy.optimize.curve_fit",
            {"FlowCurve": "`rate` and `stress`, in scipy.optimize.curve_fit"}),
    Concept("power_law power_law_fit powerlaw shear_thinning thinning_index", "", "",
            {"FlowCurve": "`herschel_bulkley()`"}),
    Concept("viscosities", "", "", {"FlowCurve": "`stress / rate`"}),
    Concept("thixotropy hysteresis hysteresis_loop three_interval 3itt ramp up_down_sweep shear_history preshear "
            "pre_shear", "", "`jamlab.shear(run.packing, rate)` after a run, and so on"),
    Concept("recovery creep_recovery recoverable_compliance recoil", "", "`jamlab.stop_flow(flow, duration)`, or "
            "`jamlab.creep(run.packing, 0.0, duration)` after a creep run"),
    Concept("N2 n2 second_normal_stress second_normal_stress_difference Psi1 psi1 first_normal_stress_coefficient",
            "", "", {"FlowCurve": "`normal_stress_difference / rate ** 2`"}),
    Concept("weissenberg deborah peclet capillary_number bagnold", "", "", {"FlowCurve": "`rate`", "ShearRun":
            "`rate`"}),
    Concept("stress_overshoot", "", "`jamlab.shear({p}, rate).peak`"),
    Concept("taus", "stress"),
    Concept("event_count n_events", "plastic_events events"),
    Concept("normalized_stress", "stress"),
    Concept("wall_time cpu_time elapsed walltime", "seconds"),
    Concept("power_index", "", "", {"FlowCurve": "`herschel_bulkley().exponent`"}),
    Concept("errorbars errorbar error_bars", "stress_stderr error_bound ci95"),
    Concept("angle phi_angle tangent", "", "", dict.fromkeys(_SPECTRA, "`np.arctan2(loss, storage)`")),
    Concept("viscous_modulus", "", "`jamlab.complex_modulus({p}, omega).loss`"),
    Concept("nonlinear_rheology nonlinear_response amplitude_dependence", "", "`jamlab.oscillate({p}, omega, "
            "amplitude)`, or `jamlab.flow_curve({p}, rates)`"),
    Concept("rate_of_strain", "rate rates"),
    Concept("synthetic_image render_image", "", "`jamlab.synthetic_micrograph({p})`"),
    Concept("edge_droplets touching_edge exclude", "cut"),
    Concept("hb_model", "herschel_bulkley", "`jamlab.flow_curve({p}, rates).herschel_bulkley()`"),
    Concept("cage caging kramers_kronig neighbor_changes angular_correlation use_gpu", "", LIMITS),
    Concept("pe etotal set_box write_data input pylammps", "", "", {"Session": "`command`, `evaluate()` or "
            "`packing()`"}),
    # structure
    Concept("make_jammed make_packing jammed_packing jam_disks", "", "`jamlab.jam(n)`, or `jamlab.pack(n, pressure)`"),
    Concept("particle_count disk_count", "n count"),
    Concept("cells voronoi areas volumes free_volume free_area cell_areas local_area polygon_area", "", "",
            {"Tessellation": "`area`"}),
    Concept("regions vertices ridges faces boundaries ridge_points edges", "", "", {"Tessellation": "`lines`"}),
    Concept("defects pentagons heptagons disclinations dislocations topology topological_charge polygons_of_cells "
            "plot_voronoi", "", "`jamlab.tessellation({p}).sides`", {"Tessellation": "`sides`"}),
    Concept("points sites generators", "", "", {"Tessellation": "`packing.positions`"}),
    Concept("degree degrees contacts_per_particle n_neighbors neighbors", "", "",
            {"Contacts": "`np.bincount(pairs.ravel(), minlength=packing.n)`"}),
    Concept("sparse csr coo laplacian incidence graph_matrix", "", "", {"Contacts": "`pairs`, the edges"}),
    Concept("P_f p_f pdf force_pdf force_histogram", "", "`jamlab.contacts({p}).forces.size`", {"Contacts":
            "`forces.size`"}),
    Concept("strong_contacts weak_contacts strong_forces weak_forces", "", "", {"Contacts": "`forces.size`"}),
    Concept("floppy floppy_mode mechanism mechanisms states_of_motion", "", "`jamlab.maxwell_count({p})`, or "
            "`jamlab.count_zero_modes({p})`"),
    Concept("E", "energy", "", {"Evaluation": "`energy`, or `jamlab.elastic_tensor(packing)` for moduli"}),
    Concept("fmax max_f f_max largest_force maximum_force residual_force force_norm fnorm", "max_force"),
    Concept("trace hydrostatic_pressure isotropic_stress stress_trace", "pressure"),
    Concept("excess z_minus_z_iso hyperstaticity contact_excess", "", "`jamlab.contacts({p})`: 2 (n_contacts - "
            "isostatic) / n_backbone", {"Contacts": "`2 * (n_contacts - isostatic) / n_backbone`"}),
    Concept("coordination_shell ase", "", "`jamlab.universe({p})` for MDAnalysis, or "
            "`jamlab.write(path, {p})` for freud and OVITO"),
    Concept("stress_anisotropy deviatoric deviatoric_stress principal_stresses stress_ratio von_mises shear_jammed "
            "principal_stress local_stress stress_per_particle per_particle_stress particle_stress virial_per_atom",
            "", "`jamlab.evaluate({p}).stress`", {"Evaluation": "`stress`"}),
    Concept("debye debye_frequency debye_level reduced_dos d_w cumulative_dos", "density frequencies",
            "`jamlab.density_of_states({p})`"),
    Concept("betweenness graph networkx to_networkx communities percolation largest_cluster connected clusters",
            "pairs", "`jamlab.contacts({p}).pairs`, edges for networkx"),
    Concept("thermal heat conductivity conductance diffusion_coefficient self_intermediate scattering_function isf "
            "alpha_relaxation entropy free_energy heat_capacity "
            "hydrostatic lubrication hydrodynamics polymer granular cohesion adhesion_energy wetting "
            "coalescence charge charges electrostatics dielectric magnetic", "", LIMITS),
    Concept("thermostat langevin nvt nve temperature annealing simulated_annealing thermal_annealing", "",
            "`jamlab.anneal({p}, 1e-5)`"),
    Concept("monte_carlo swap swap_monte_carlo swap_mc ultrastable ideal_packing swap_particles", "",
            "`jamlab.swap_sizes`, of disks, or `jamlab.anneal`"),
    # pictures
    Concept("particle_table droplet_table region_table particles_df features features_df spots", "table",
            "`jamlab.micrograph(picture).table()`"),
    Concept("calibrate calibration microns set_scale micron_size physical_size voxel_size spacing",
            "pixel", "`jamlab.micrograph(picture, pixel=0.5)`", {"Micrograph": "`pixel`, an argument of "
            "`jamlab.micrograph(picture)`"}),
    Concept("napari add_labels viewer open_in_napari napari_view to_napari imagej fiji rois roi to_roi label2rgb "
            "color_labels colorize", "labels",
            "`jamlab.micrograph(picture).labels`"),
    Concept("save_csv write_csv export_csv csv to_table save_table as_table save_results measurements results_table",
            "to_csv", "`jamlab.measure([{p}]).to_csv(path)`",
            {"Micrograph": "`table().to_csv(path)`", "Result": "`to_dataframe().to_csv(path)`",
             "Campaign": "`table().to_csv(path)`"}),
    Concept("filter_stubs stubs annotate annotate3d plot_traj subpx_bias proximity characterize tp_batch "
            "relabel relate_frames", "", "`jamlab.track_droplets(source)`, a table"),
    Concept("watershed binarize segment segmentation locate refine", "", "",
            {"Micrograph": "`labels`, the segmented picture"}),
    Concept("eccentricities roundness aspect_ratio solidity elongation orientation feret", "", "`jamlab.micrograph("
            "picture).labels`, of which skimage.measure.regionprops has it", {"Micrograph": "`labels`, of which "
            "skimage.measure.regionprops has it", "Packing": "`polygons.shapes()`, of which it follows"}),
    Concept("rattler_mask is_rattler", "rattlers"),
    Concept("boundary_mask edge_mask cut_mask border touching_border", "", "", {"Micrograph": "`cut`"}),
    Concept("threshold_value otsu_threshold level", "", "", {"Micrograph": "`contrast`"}),
    Concept("ep signal mass flags is_good bad", "", "", {"Micrograph": "`quality`, `reasons` and `noise`"}),
    Concept("img array thumbnail foreground bit_depth", "picture"),
    Concept("droplet_areas", "areas"),
    Concept("warnings warning problems issues notes messages", "reasons remedy"),
    Concept("magnification objective", "pixel"),
    Concept("filename file path source", "", "", {"Micrograph": "`picture`, the array: keep the name of its file"}),
    Concept("disorder order", "", "`jamlab.hexatic_order({p})`"),
    Concept("save_hdf5 save_frames write_frames save_trajectory", "", "", {"FlowRun": "`jamlab.write(path, frames)`"}),
    Concept("positions coordinates radii diameters box n boxes", "", "", {"FlowRun": "`packing`, or `frames`, of which "
            "it is an attribute"}),
    Concept("metadata provenance seed_used seed parameters params settings config arguments", "", "",
            {"FlowRun": "`packing.provenance`"}),
    Concept("duration total_time t_max", "time"),
    Concept("bands shear_bands localization profile", "velocity_profile"),
    Concept("slope_initial initial_slope initial_modulus tangent_modulus", "", "`jamlab.shear_modulus({p})`"),
    Concept("abs_eta eta_abs eta_complex", "", "", dict.fromkeys(_SPECTRA, "`abs(storage + 1j * loss) / omega`")),
    Concept("viscosity0 zero_shear eta_zero", "eta0"),
    Concept("tau_c characteristic_time tau_relax", "tau_star"),
    Concept("power_law_exponent log_derivative", "", "", {"ComplexModulus":
            "`np.gradient(np.log(storage), np.log(omega))`"}),
    Concept("err_storage err_loss storage_error loss_error storage_err", "error_bound"),
    Concept("shape nbins", "", "", {"ComplexModulus": "`omega.shape`", "FlowRun": "`stress.shape`", "FlowCurve":
            "`stress.shape`", "Contacts": "`pairs.shape`"}),
    Concept("n_disks h_matrix cell_matrix", "", "", {"Packing": "`n` particles in the `box`"}),
    Concept("tile repeat replicate supercell periodic_images", "", "", {"Packing": "`positions` and `box`: shift them "
            "by rows of the box"}),
    Concept("unwrap unwrapped unwrapped_positions", "positions"),
    Concept("plot_network plot_bonds draw_network show_network", "", "", {"Packing": "`jamlab.contacts({p}).plot()`"}),
    Concept("image img picture render to_image rasterize", "", "", {"Packing": "`jamlab.synthetic_micrograph({p})`, or "
            "`plot()`"}),
    Concept("eigenfrequencies eigenfrequency hessian_eigs natural_frequencies", "frequencies",
            "`jamlab.lowest_modes({p}).frequencies`"),
    Concept("z_dist z_histogram mean contact_histogram coordination_per_particle", "", "", {"Contacts":
            "`z`, or `np.bincount(pairs.ravel(), minlength=packing.n)` of each particle"}),
    Concept("tangents tangent tangential tangential_vectors normals normal_vectors", "", "", {"Contacts":
            "`r`, vectors between centres"}),
    Concept("strength weights weight force_weights mean_force max_force", "", "", {"Contacts": "`forces.size`"}),
    Concept("components connected_components isolated islands", "", "", {"Contacts": "`rattlers`, or `pairs` as edges "
            "of a graph"}),
    Concept("isotropic_packing jam_packing", "", "`jamlab.pack(n, pressure)`, or `jamlab.jam(n)` at onset"),
    Concept("biaxial triaxial uniaxial extension elongation_flow stretch tension", "", LIMITS),
    Concept("rheometry shear_test oscillatory_test rheology_test", "", "`jamlab.complex_modulus({p}, omega)`, "
            "`jamlab.shear({p}, rate)` or `jamlab.oscillate({p}, omega, amplitude)`"),
    Concept("local_strain falk_langer local_shear_strain best_fit_strain", "", "", dict.fromkeys(
            (MODULE, "Packing"), "`jamlab.nonaffine_response(packing)`")),
    Concept("list_decks decks deck lammps_scripts templates", "", "", {MODULE: "the command `jamlab decks`"}),
    Concept("n_threads set_n_threads", "", "the argument ranks of `jamlab.jam` or `jamlab.pack`"),
    Concept("progress tqdm progress_bar verbose", "progress", "", {MODULE: "the argument progress of `jamlab.pack` and "
            "others"}),
    Concept("about license licence credits authors docs documentation tutorial tutorials help usage url homepage "
            "manual readme", "", "", {MODULE: "the docs and README of the repository, or help(jamlab)"}),
    Concept("example examples demo dataset datasets download fetch sample_data example_data", "", "",
            {MODULE: "`jamlab.pack(n, pressure)`, or the command `jamlab demo`"}),
    # programs
    Concept("bootstrap jackknife confidence_interval finite_size resample average_over_seeds error_bars", "",
            "`jamlab.estimate`, or `jamlab.open_campaign(path)`"),
    Concept("load open", "", "", {"Campaign": "`packings` or `table()`"}),
    Concept("seeds n parameters params config settings", "", "", {"Campaign": "`content`, or `text` of the file"}),
    Concept("errors failed pending failures jobs_left done tasks running incomplete", "", "",
            {"Campaign": "`status`"}),
    Concept("output outputs output_dir directory dir path root", "", "", {"Campaign": "`folder`"}),
    Concept("run_all start launch execute", "", "", {"Campaign": "`run()`"}),
    Concept("thermo fix unfix compute reset box natoms version timestep dump neighbor", "", "",
            {"Session": "`command`, or `packing()` for the state"}),
    Concept("dtype ndim nbytes T flat itemsize", "positions", "", {"Result": "`to_dataframe()`, a table of pandas",
            "Micrograph": "`picture`, an array"}),
    Concept("size", "", "", {"Packing": "`n`, or `diameters`"}),
    Concept("values lambda_min lowest_eigenvalue smallest", "", "", {"Modes": "`eigenvalues`"}),
    Concept("n n_modes trivial goldstone translations softness normalize", "", "", {"Modes": "`eigenvalues` and "
            "`vectors`"}),
    Concept("arrows displacement_field mode_shape plot_mode quiver", "", "", {"Modes": "`plot()`, or `vectors`"}),
    Concept("elastic_part elastic_contribution elastic viscous_part viscous_contribution viscous", "", "",
            {"FlowRun": "`elastic_stress` or `viscous_stress`"}),
    Concept("elastic_modulus G_elastic", "", "", dict.fromkeys(_SPECTRA, "`storage`")),
    Concept("viscous_modulus G_viscous", "", "", dict.fromkeys(_SPECTRA, "`loss`")),
    Concept("damping_factor quality_factor", "", "", dict.fromkeys(_SPECTRA, "`loss / storage`")),
    Concept("absG abs_G Gabs moduli", "", "", dict.fromkeys(_SPECTRA, "`abs(storage + 1j * loss)`")),
    Concept("plot_moduli plot_gstar plot_G", "", "", dict.fromkeys(_SPECTRA, "`plot()`")),
    Concept("high_frequency low_frequency limit limits tau_max terminal_slope H_tau H G_t to_hz interpolate evaluate "
            "at predict exponent", "", "", {"ComplexModulus": "`g0`, `eta0`, `eta_inf`, `tau_star`, or `spectrum`, "
            "whose modulus(omega) gives G* at any omega"}),
    Concept("images image", "", "", {"FlowRun": "`frames`, packings with plot()"}),
    Concept("to_lammps to_xyz to_dump to_data to_hdf5 write_dump", "", "", {"FlowRun":
            "`jamlab.write(path, frames)`"}),
    Concept("fluctuations noise std_stress stress_fluctuations variance", "", "", {"FlowRun": "`stress.std()`"}),
    Concept("x y abscissa ordinate", "", "", {"FlowRun": "`strain` and `stress`", "FlowCurve": "`rate` and `stress`",
            "ComplexModulus": "`omega`, `storage` and `loss`"}),
    Concept("residuals log_fit plot_fit r2 aic bic predict fit_curve fitted slope log_slope", "", "",
            {"FlowCurve": "`herschel_bulkley()`, with misfit and plot()"}),
    Concept("friction dilatancy dilation", "", "", {"FlowCurve": "`stress / pressure`, or `pressure`"}),
    Concept("perim perims", "", "", {"Micrograph": "`shape_factor`, perimeter squared over 4 pi area"}),
    Concept("bounding_boxes bounding_box", "", "", {"Micrograph": "`outlines`, or `labels`"}),
    Concept("diams diam", "", "", {"Micrograph": "`np.sqrt(4 * areas / np.pi)`", "Packing": "`diameters`"}),
    Concept("nuclei seg objects blobs contour otsu", "", "", {"Micrograph": "`labels` or `outlines`"}),
    Concept("fill_fraction coverage covered area_coverage surface_fraction", "", "", {"Micrograph": "`rho`"}),
    Concept("focus sharpness", "blur"),
    Concept("dimensions width_px height width shape_px n_pixels channels", "", "", {"Micrograph": "`picture.shape`"}),
    Concept("display", "plot", "`{p}.plot()`"),
    Concept("r", "", "", {"Packing": "`positions`, or `disk_diameters / 2` for radii"}),
    Concept("box_lx lengths_of_box aspect aspect_ratio_of_box tilt xy_tilt", "", "", {"Packing": "`box`, whose rows "
            "are its edges"}),
    Concept("perturb add_noise jiggle displace randomize thermalize apply_strain affine_deform "
            "set_positions", "", "", {"Packing": "`with_state`, then `jamlab.relax({p})`"}),
    Concept("scale_to_phi set_phi set_density rescale_phi", "", "`jamlab.compress({p}, to=0.95)`"),
    Concept("set_pressure to_pressure at_pressure", "", "`jamlab.pack(n, pressure)`, or `jamlab.decompress({p}, "
            "pressure)`"),
    Concept("summary info report command how", "", "", {"Packing": "`jamlab.measure({p})`, or `provenance`"}),
    Concept("to_mdanalysis mdanalysis universe", "", "`jamlab.universe({p})`"),
    Concept("plot_forces plot_contacts plot_force_chains draw_contacts", "", "", {"Packing":
            "`jamlab.contacts({p}).plot()`"}),
    Concept("eigen spectrum vibrations", "", "`jamlab.lowest_modes({p}).frequencies`, or "
            "`jamlab.complex_modulus({p}, omega)`"),
    Concept("rate_sweep shear_rate_sweep viscosity_curve", "", "`jamlab.flow_curve({p}, rates)`"),
    Concept("athermal aqs_shear plastic plasticity", "", "`jamlab.quasistatic_shear({p}, strain)`"),
    Concept("brownian md molecular_dynamics inertia inertial underdamped utils constants", "", LIMITS),
    Concept("overdamped bubble bubble_dynamics viscous_dynamics", "", "`jamlab.shear({p}, rate)`"),
    Concept("boundaries periodic pbc walls wall confinement", "walls", "`jamlab.with_walls`"),
    Concept("pebble pebbles rigid_components", "", "", dict.fromkeys((MODULE, "Packing"),
            "`jamlab.rigid_clusters(packing)`")),
    Concept("kn modulus_of_contact", "", "`jamlab.pack(n, pressure)`, where the strength of contacts is 1"),
    Concept("stats statistics average", "", "`jamlab.measure({p})`, or `jamlab.estimate`"),
    Concept("droplets make_droplets droplet deformable deformable_particles dpm", "", "`jamlab.jam(n, 'dp')`, or "
            "`jamlab.droplets_from_disks`"),
    Concept("read_movie load_movie", "", "`jamlab.track_droplets(source)`"),
    Concept("keys values items fields columns names to_dict as_dict asdict dict to_json json to_yaml model_dump "
            "to_list tolist to_numpy as_array numpy array to_array", "", "",
            {"Result": "`to_dataframe()`, a table of pandas", "Packing": "`params`, `positions`, and "
             "`jamlab.write(path, {p})` for a file",
             "Campaign": "`table()`, a table of pandas", "Micrograph": "`table()`"}),
    Concept("steady", of={MODULE: "`jamlab.flow_curve({p}, rates)`, or the method steady of a run"}),
    Concept("copy deepcopy clone replace", "", "the object itself: results never change",
            {MODULE: "the packing itself: packings never change",
             "Recipe": "`dataclasses.replace(recipe, seed=2)`, then `jamlab.make`"}),
    Concept("config options settings rc rcparams rcParams set_option set_options configure defaults get_config "
            "configuration_file environment", "", "arguments of each function: there are no settings",
            {"Packing": "`provenance`", "Campaign": "`text`, the file"}),
    Concept("version code_version git_hash software created creator created_at date", "", "",
            {"Packing": "`provenance`"}),
    Concept("xyz r0 coordinate positions_array xy_positions com center_of_mass", "positions centres"),
    Concept("cache clear_cache cached memoize cache_dir checkpoint checkpoints", "",
            "`jamlab.open_campaign(path)`, which keeps its results", {MODULE:
            "`jamlab.open_campaign(path)`, which keeps its results"}),
    Concept("n_jobs map pool Pool multiprocessing joblib dask mpi mpi4py workers set_threads nproc parallel_map "
            "parallelize", "", "`jamlab.open_campaign(path)`, which runs several processes",
            {"Campaign": "`run()`, with its argument workers"}),
    Concept("viz visualize visualise visualization vis viewer explorer gui dashboard", "", "`jamlab.write_page(path, "
            "packings)`, or `{p}.plot()`"),
    Concept("rng default_rng RandomState generator_of_numbers seeds", "seeds", "the argument seed of `jamlab.pack` or "
            "`jamlab.jam`"),
    Concept("save_all savez pickle dumps loads to_pickle serialize store", "",
            "`jamlab.write(path, packings)`, or pickle itself"),
    # LAMMPS
    Concept("timestep reset_timestep atom_style atom_modify pair_modify neigh_modify bond_style compute group region "
            "variable run_style velocity min_style min_modify thermo_style thermo_modify read_restart write_restart "
            "special_bonds comm_modify include clear newton processors change_box displace_atoms delete_atoms", "",
            "", {MODULE: "`jamlab.Session(packing)`, which takes LAMMPS commands", "Session": "`command`"}),
    Concept("boundary", "", "", {MODULE: "`jamlab.with_walls`: the box is periodic before"}),
    Concept("run minimize_lammps script file input_script commands commands_string", "", "",
            {"Session": "`command`, or `minimize`"}),
    Concept("get_thermo extract_box extract_compute extract_fix extract_variable gather_atoms get_natoms numpy", "",
            "", {"Session": "`evaluate()`, `positions()` or `packing()`"}),
)  # fmt: skip
