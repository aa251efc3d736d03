"""Arguments and options that users of other programs type, and what they mean; see `jamlab.habits`."""

from jamlab.habits import LIMITS, SHELL, Concept

# the same for arguments of functions and options of commands, asked before those above
ARGUMENTS = (
    Concept("mu mu_s friction_coefficient", "", "", dict.fromkeys(("pack", "jam"), LIMITS)),
    Concept("minmass min_mass min_area min_size remove_small_objects exclude_border clear_border edge", "", "",
            dict.fromkeys(("micrograph", "track_droplets"), "the picture as it is: specks and droplets cut by its edge "
            "are set aside")),
    Concept("diameter min_diameter max_diameter particle_size separation", "", "", dict.fromkeys(
            ("micrograph", "track_droplets"), "the picture as it is: droplets of all sizes are found")),
    Concept("px resolution micron_per_pixel um_per_pixel", "pixel"),
    Concept("search_range max_displacement max_disp max_distance", "", "", {"track_droplets": "the pictures as they "
            "are: a "
            "droplet is sought up to half the spacing away"}),
    Concept("trajectory_error", "", "", {"flow_curve": "a second curve at another `tolerance`, which shows the error",
            "jamlab flow-curve": "a second curve at another `--tolerance`, which shows the error"}),
    Concept("invert inverted dark bright polarity", "contrast"),
    Concept("path filename file fname output outfile filepath dest", "path out"),
    Concept("gamma line_tension", "strain", "", {"jamlab jam": "`--law gamma=0.2`"}),
    Concept("max_iterations max_iter maxiter max_steps n_iterations n_steps", "", "", dict.fromkeys(("pack", "jam",
            "relax"),
            "`tolerance`: minimization ends there, after as many steps as it takes")),
    Concept("random_state rng seeds seed_number random_seed rng_seed", "seed"),
    Concept("polydispersity polydisperse size_distribution sigma_d disp", "sizes", "",
            dict.fromkeys(("pack", "jam"), "`sizes`, such as sizes='lognormal:0.2'")),
    Concept("bidispersity ratio size_ratio radii_ratio bidisperse bidisperse_ratio d_ratio", "size_ratio ratio"),
    Concept("large fraction_of_large x_large", "fraction_large"),
    Concept("verbose show_progress tqdm quiet", "progress as_json"),
    Concept("tol ftol force_tol etol eps_f force_tolerance rtol atol precision", "tolerance"),
    Concept("n_jobs workers nproc num_workers njobs n_workers", "processes workers ranks"),
    Concept("threads nthreads n_threads cores omp_num_threads", "ranks processes"),
    Concept("dt timestep time_step", "tolerance", "", {kind: "`tolerance`: time steps follow from the error that they "
            "may make" for kind in ("shear", "creep", "oscillate", "relax_stress", "flow_curve", "stop_flow")}),
    Concept("n_cycles num_cycles periods", "cycles"),
    Concept("line_tension surface_tension", "gamma"),
    Concept("solver algorithm", "method"),
    Concept("parallel", "processes ranks"),
    Concept("eta viscosity", "damping"),
    Concept("n_vertices num_vertices nv", "vertices"),
    Concept("save", "out path"),
    Concept("duration", "strain"),
    Concept("f", "omega"),
    Concept("t_max tmax total_time run_time time_max", "duration"),
    Concept("save_every dump_every output_every every_n", "snapshot_every every frames"),
    Concept("target target_phi phi_max phi_target", "to pressure"),
    Concept("target_pressure p_target", "pressure"),
    Concept("dphi drho n_steps dgamma increment delta_phi stepsize step_size", "step"),
    Concept("potential alpha law hertz force_law pair_style interaction", "law exponent", "",
            dict.fromkeys(("pack", "jam"), "`exponent`, such as exponent=2.5 for Hertzian disks")),
    Concept("k kn stiffness spring_constant eps epsilon", "", "", dict.fromkeys(("pack", "jam"),
            "other units: the strength of contacts and the mean diameter are always 1")),
    Concept("theta direction_angle phi_angle", "angle direction"),
    Concept("n fold l symmetry", "k"),
    Concept("image pic array img", "picture"),
    Concept("index frame_number i_frame", "frame"),
    Concept("n_modes num_modes k how_many", "count"),
    Concept("show view", "", "", {SHELL: "`jamlab explore`, which writes a page"}),
    Concept("phi rho packing_fraction density", "phi to", "", {"jamlab jam": "`jamlab pack --phi`, or `jamlab compress "
            "--to` from onset"}),
    Concept("amplitude", "strain", "", {"complex_modulus": "`jamlab.oscillate(packing, omega, amplitude)`: linear "
            "response has no amplitude"}),
)  # fmt: skip
