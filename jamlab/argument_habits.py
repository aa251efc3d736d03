"""Words of arguments and options that one function or command answers in its own way; what they mean everywhere stands
in `habits` of the table of arguments."""

from jamlab.habits import LIMITS, Concept

# asked before the words of the table
OF_ONE_FUNCTION = (
    Concept("accuracy", of={"jamlab deck": "`tolerance`"}),
    Concept("force", of={"jamlab deck": "`force_tolerance`"}),
    Concept("above", of={"jamlab deck": "`step`"}),
    Concept("fluid viscosity", of={"jamlab deck": "`eta_f`"}),
    Concept("arms", of={"jamlab deck": "`lever_arms`"}),
    Concept("viscous", of={"jamlab deck": "`damping`"}),
    Concept("steps_shear", of={"jamlab deck": "`strain`"}),
    Concept(
        "vertices n_vertices nv num_vertices",
        of={
            "jam": "`law`, such as jam(n, 'dp', law={'vertices': 16})",
            "jamlab jam": "`--law vertices=16`, with `--model dp`",
        },
    ),
    Concept(
        "exponent stickiness weight ka delta contact nv_small nv_large vertices",
        of=dict.fromkeys(
            ("jam", "pack", "scene", "droplets_from_disks", "droplets_from_outlines"),
            (
                "`law`, which takes parameters of the force law by name, such as law={'gamma': 0.3} or "
                "law={'exponent': 2.5}"
            ),
        ),
    ),
    Concept("mu mu_s friction_coefficient", of=dict.fromkeys(("pack", "jam"), LIMITS)),
    Concept(
        "minmass min_mass min_area min_size remove_small_objects exclude_border clear_border edge",
        of=dict.fromkeys(
            ("micrograph", "track_droplets"), "the picture as it is: specks and droplets cut by its edge are set aside"
        ),
    ),
    Concept(
        "diameter min_diameter max_diameter particle_size separation",
        of=dict.fromkeys(("micrograph", "track_droplets"), "the picture as it is: droplets of all sizes are found"),
    ),
    Concept(
        "search_range max_displacement max_disp max_distance",
        of={"track_droplets": "the pictures as they are: a droplet is sought up to half the spacing away"},
    ),
    Concept(
        "trajectory_error",
        of={
            "flow_curve": "a second curve at another `tolerance`, which shows the error",
            "jamlab flow-curve": "a second curve at another `--tolerance`, which shows the error",
        },
    ),
    Concept("tolerance accuracy", of={"scene": "`error`"}),
    Concept("model", of={"pack": "`jamlab.jam(n, 'dp')` for droplets, then `jamlab.compress`: pack makes disks"}),
    Concept("alpha", of={"nonlinear_modulus": "`damping`, such as ContactDamping(alpha=0.5)"}),
    Concept("ring rings", of={"contrast": "a segmentation, of Cellpose or StarDist, as labels"}),
    Concept(
        "gamma line_tension",
        of={
            "jamlab jam": "`--law gamma=0.2`",
            **dict.fromkeys(
                ("jam", "pack", "scene", "droplets_from_disks", "droplets_from_outlines"),
                "`law`, such as law={'gamma': 0.3}",
            ),
        },
    ),
    Concept(
        "max_iterations max_iter maxiter max_steps n_iterations",
        of=dict.fromkeys(
            ("pack", "jam", "relax"), "`force_tolerance`: minimization ends there, after as many steps as it takes"
        ),
    ),
    Concept(
        "n_steps",
        of=dict.fromkeys(
            ("pack", "relax"), "`force_tolerance`: minimization ends there, after as many steps as it takes"
        ),
    ),
    Concept(
        "polydispersity polydisperse size_distribution sigma_d disp",
        of=dict.fromkeys(("pack", "jam"), "`sizes`, such as sizes='lognormal:0.2'"),
    ),
    Concept(
        "dt timestep time_step",
        of=dict.fromkeys(
            ("shear", "creep", "oscillate", "relax_stress", "flow_curve", "stop_flow"),
            "`tolerance`: time steps follow from the error that they may make",
        ),
    ),
    Concept(
        "potential alpha hertz force_law pair_style interaction parameters params",
        of=dict.fromkeys(
            ("pack", "jam", "scene"), "`law`, such as law='hertz' or law={'exponent': 2.5}, or the name of another law"
        ),
    ),
    Concept(
        "k kn stiffness spring_constant eps epsilon",
        of=dict.fromkeys(("pack", "jam"), "other units: the strength of contacts and the mean diameter are always 1"),
    ),
    Concept(
        "average mean averaged isotropic", of={"shear_modulus": "no `direction`: the mean over all is the default"}
    ),
    Concept("show view", of={"shell": "`jamlab explore`, which writes a page"}),
    Concept(
        "phi rho packing_fraction density",
        of={"jamlab jam": "`jamlab pack --phi`, or `jamlab compress --to` from onset"},
    ),
    Concept(
        "amplitude",
        of={"complex_modulus": "`jamlab.oscillate(packing, omega, amplitude)`: linear response has no amplitude"},
    ),
)
