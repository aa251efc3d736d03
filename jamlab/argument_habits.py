"""Words of arguments and options that one function or command answers in its own way; what they mean everywhere stands
in `habits` of the table of arguments. And objects that arguments are given, with what to give instead."""

from jamlab.habits import LIMITS, PACKING, Concept

# what is asked for, or the function; class given -> what to give instead
INSTEAD = {
    **{("Packing", kind): f"{way}, a packing" for kind, way in PACKING.items()},
    **dict.fromkeys(
        [("Packing", kind) for kind in ("FlowRun", "Contacts", "HexaticOrder", "Tessellation", "Voids")],
        "its attribute packing",
    ),
    ("Packing", "FlowCurve"): "one of its packings",
    **{(name, "Packing"): "the path first" for name in ("write", "write_contacts", "write_page")},
    **{("write_movie", kind): "the path first: write_movie(path, run)" for kind in ("FlowRun", "list", "tuple")},
    ("Packing", "Campaign"): "campaign.packings(task), where task is one of campaign.finished()",
    ("Packing", "DataFrame"): "packings, such as campaign.packings(task) of each task of a campaign",
    ("Packing", "list"): "one packing at a time",
    ("Packing", "tuple"): "one packing at a time",
    ("Packing", "str"): "jamlab.read(path)",
    ("Packing", "PosixPath"): "jamlab.read(path)",
    ("Packing", "ndarray"): "jamlab.Packing(model, box, positions, params)",
    ("scaling_collapse", "dict"): "pressures, and for each of them the spectra jamlab.complex_modulus(packing, omega) "
    "of packings",
    **dict.fromkeys(
        [("scaling_collapse", kind) for kind in ("list", "tuple")],
        "pressures, and for each of them a list of its spectra: scaling_collapse([1e-2, 1e-3], [[s1, s2], [s3, s4]])",
    ),
    ("scaling_collapse", "MeanSpectra"): "the campaign or the table that the means are of: scaling_collapse(campaign)",
    ("density_of_states", "DataFrame"): "the campaign: density_of_states(campaign, select={'target_pressure': 1e-3})",
    ("Campaign.aggregate", "str"): "a list of columns, such as ['z']",
    ("Recipe", "Packing"): "its recipe: jamlab.make(packing.recipe)",
    **dict.fromkeys(
        [("Recipe", kind) for kind in ("str", "PosixPath")],
        "jamlab.read(path).recipe of a file, or jamlab.Recipe.from_json(text)",
    ),
    **dict.fromkeys(
        [("DragLaw", kind) for kind in ("str", "float", "int", "dict")],
        "an object, such as jamlab.ContactDamping(beta=1.0) or jamlab.StokesDrag()",
    ),
    **dict.fromkeys(
        [("ContactDamping", kind) for kind in ("str", "float", "int")],
        "jamlab.ContactDamping(beta=1.0) or jamlab.StokesDrag()",
    ),
    ("Executor", "Client"): "client.get_executor(pure=False) of Dask",
    ("Executor", "Cluster"): "distributed.Client(cluster).get_executor(pure=False)",
    ("Executor", "Pool"): "concurrent.futures.ProcessPoolExecutor()",
}

_DAMPED = (
    *("complex_modulus", "displacement_response", "displacement_correlation", "displacement_spectrum"),
    *("dynamical_matrices", "mean_spectra"),
    *("shear", "flow_curve", "oscillate", "creep", "relax_stress", "stop_flow"),
)
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
            ("jam", "pack", "scene", "Recipe", "droplets_from_disks", "droplets_from_outlines"),
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
    Concept(
        "ncores jobs np cpus n_cpu n_jobs workers nproc num_workers njobs n_workers processes cores parallel",
        of={"jamlab gstar": "one process: gstar has no more, and `--ranks` are threads for making a packing"},
    ),
    Concept(
        "n n_packings packings samples", of={"estimate": "`error`, from which sizes and numbers of packings follow"}
    ),
    Concept("x horizontal", of={"direction": "`simple`"}),
    Concept("law force_law potential hertz", of={"jamlab deck": "`exponent`"}),
    Concept("frames snapshot_every", of={"jamlab deck": "`rows`"}),
    Concept("damping drag stokes", of={"in.sp.startup": "`background_drag`"}),
    Concept("model", of={"pack": "`jamlab.jam(n, 'dp')` for droplets, then `jamlab.compress`: pack makes disks"}),
    Concept("alpha", of={"nonlinear_modulus": "`damping`, such as ContactDamping(alpha=0.5)"}),
    Concept("ring rings", of={"contrast": "a segmentation, of Cellpose or StarDist, as labels"}),
    Concept(
        "gamma line_tension",
        of={
            "jamlab jam": "`--law gamma=0.2`",
            **dict.fromkeys(
                ("jam", "pack", "scene", "Recipe", "droplets_from_disks", "droplets_from_outlines"),
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
            ("pack", "jam", "scene", "Recipe"),
            "`law`, such as law='hertz' or law={'exponent': 2.5}, or the name of another law",
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
    Concept("to phi rho", of={"decompress": "`pressure`", "jamlab decompress": "`--pressure`"}),
    Concept(
        "pressure target_pressure",
        of={
            "compress": "`jamlab.pack(n, pressure)`: compress goes to a packing fraction",
            "jamlab compress": "`jamlab pack --pressure`: compress goes to a packing fraction, --to",
        },
    ),
    Concept(
        "beta tau eta_f stokes",
        of=dict.fromkeys(_DAMPED, "`damping`, such as jamlab.ContactDamping(beta=0.5) or jamlab.StokesDrag(eta_f=1.0)"),
    ),
    Concept(
        "amplitude",
        of={"complex_modulus": "`jamlab.oscillate(packing, omega, amplitude)`: linear response has no amplitude"},
    ),
)
