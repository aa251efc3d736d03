"""What users of other programs type from habit, written down before they look anything up: who, call, what is meant.

Lines of a block share their start: `name:meant` is an attribute or function typed, and what must be named by an answer
that leads on; several that serve are parted by `|`, `-` is nothing that jamlab has. A call in full stands in `CALLS`.
"""

# who, what the names are typed after -> names
NAMES = {
    # P1: microscopy, trackpy and scikit-image
    ("P1", "m"): "phi:rho packing_fraction:rho area_fraction:rho centroids:centres centers:centres positions:centres "
    "xy:centres radii:areas|table diameters:areas|table equivalent_diameter:areas|table to_csv:table|to_dataframe "
    "save:draw|table|to_dataframe to_dataframe:ok df:table|to_dataframe overlay:draw|plot show:plot|draw "
    "imshow:plot|draw "
    "forces:packing coordination:z coordination_number:z n:count num_droplets:count label:labels mask:labels "
    "regions:labels|table regionprops:table|to_dataframe circularity:shape perimeter:shape perimeters:shape "
    "shape_factor:shape eccentricity:labels contours:outlines boundaries:outlines pixel_size:pixel scale:pixel "
    "image:picture frame:picture edges:outlines neighbors:neighbours voronoi:cells n_neighbors:neighbours "
    "pressure:packing "
    "psi6:packing hexatic:packing intensity:contrast|labels snr:noise quality:ok plot:ok contacts:ok area:areas z:ok",
    ("P1", "jamlab"): "track:track_droplets link:track_droplets locate:micrograph batch:track_droplets|micrograph "
    "segment:micrograph analyze_image:micrograph image:micrograph load_image:micrograph imread:micrograph "
    "segmentation:micrograph detect:micrograph Micrograph:results|micrograph voronoi:tessellation "
    "msd:mean_square_displacement "
    "watershed:micrograph find_contacts:contacts render:synthetic_micrograph|plot pair_correlation:ok "
    "gr:universe bond_order:hexatic_order nearest_neighbors:contacts|tessellation velocity_field:- "
    "packing_fraction:ok voids:ok deformation:shape_factors anisotropy:shape_factors|elastic_tensor "
    "shape_factor:shape_factors circularity:shape_factors stress_from_image:micrograph|evaluate "
    "force_inference:contacts|micrograph|evaluate drift:- strain_field:-",
    ("P1", "p"): "radii:diameters centers:positions|centroids shape:shape_factors areas:polygons|particle_areas "
    "neighbors:tessellation forces:evaluate|contacts contacts:contacts num_particles:n perimeter:perimeters "
    "polygons:ok vertices:positions|polygons coordination:contacts",
    # P3: rheology of soft solids
    ("P3", "jamlab"): "storage_modulus:complex_modulus loss_modulus:complex_modulus dynamic_modulus:complex_modulus "
    "relaxation_modulus:relax_stress stress_relaxation:relax_stress yield_stress:flow_curve "
    "yield_strain:quasistatic_shear "
    "poisson_ratio:elastic_tensor stress_tensor:evaluate pair_correlation:ok vdos:density_of_states "
    "density_of_states:ok normal_modes:lowest_modes eigenmodes:lowest_modes sweep:compress|pack "
    "frequency_sweep:complex_modulus amplitude_sweep:oscillate startup:shear startup_shear:shear aqs:quasistatic_shear "
    "AQS:quasistatic_shear laos:oscillate LAOS:oscillate saos:complex_modulus herschel_bulkley:flow_curve "
    "ensemble:open_campaign|estimate participation_ratio:lowest_modes viscosity:flow_curve|complex_modulus "
    "G_prime:complex_modulus Gp:complex_modulus Gpp:complex_modulus gstar:complex_modulus creep_compliance:creep "
    "compliance:creep steady_shear:flow_curve|shear flow_sweep:flow_curve rheology:complex_modulus "
    "young_modulus:elastic_tensor youngs_modulus:elastic_tensor elastic_moduli:elastic_tensor|shear_modulus "
    "elastic_constants:elastic_tensor G:shear_modulus K:bulk_modulus B:bulk_modulus modulus:shear_modulus "
    "dos:density_of_states modes:lowest_modes dynamical_matrix:hessian|dynamical_matrices "
    "eigenvalues:lowest_modes|hessian jamming_point:jam phi_j:jam phi_c:jam find_jamming:jam onset:jam "
    "isostatic:maxwell_count|contacts coordination:contacts z:contacts|measure contact_number:contacts "
    "pressure:measure|evaluate energy:measure|evaluate stress:evaluate virial:evaluate "
    "strain_sweep:oscillate|quasistatic_shear "
    "oscillatory_shear:oscillate step_strain:relax_stress cessation:stop_flow "
    "correlation_length:displacement_correlation collapse:scaling_collapse scaling:scaling_collapse "
    "critical_exponents:scaling_collapse nonaffine:nonaffine_response d2min:local_strain "
    "D2min:nonaffine_response "
    "nonaffine_displacement:nonaffine_response relaxation_time:complex_modulus|effective_relaxation_time "
    "relaxation_spectrum:complex_modulus avalanches:quasistatic_shear plastic_events:quasistatic_shear "
    "rearrangements:quasistatic_shear shear_band:shear velocity_profile:shear lissajous:oscillate "
    "first_normal_stress_difference:shear normal_stress:evaluate|shear drag:ContactDamping|StokesDrag "
    "damping:ContactDamping|StokesDrag bubble_model:pack|jam|shear durian:pack|jam|shear hertzian:pack|jam "
    "self_stress:maxwell_count floppy_modes:maxwell_count|count_zero_modes isostaticity:maxwell_count "
    "pebble_game:rigid_clusters force_distribution:contacts force_chains:contacts steady_state:flow_curve|shear "
    "bulk_viscosity:- lees_edwards:shear box_relax:pack|BoxStrains isotropic_compression:compress fire:relax "
    "minimize:relax",
    ("P3", "s"): "Gp:storage Gpp:loss gprime:storage gdoubleprime:loss G1:storage G2:loss G_prime:storage "
    "G_double_prime:loss storage_modulus:storage loss_modulus:loss freq:omega frequency:omega frequencies:omega "
    "w:omega "
    "tan_delta:loss complex:storage modulus:storage|spectrum abs:storage eta:loss viscosity:eta0|loss "
    "relaxation_times:spectrum|tau_star relaxation_time:tau_star tau:tau_star g_inf:eta_inf G0:g0 Ginf:eta_inf "
    "phase:loss errors:error_bound to_csv:to_dataframe",
    ("P3", "run"): "sigma:stress shear_stress:stress gamma:strain gamma_dot:rate|shear_rate t:time times:time "
    "viscosity:stress eta:stress N1:normal_stress_difference n1:normal_stress_difference p:pressure packings:frames "
    "snapshots:frames trajectory:frames final:packing yield_stress:steady|peak z:contacts|z_all "
    "velocity:velocity_profile mean_stress:steady average:steady overshoot:peak",
    ("P3", "fc"): "rates:rate shear_rate:rate gamma_dot:rate viscosity:stress eta:stress sigma:stress "
    "error:stress_stderr errors:stress_stderr yield_stress:herschel_bulkley fit:herschel_bulkley n:herschel_bulkley",
    ("P3", "hb"): "sigma_y:yield_stress tau_y:yield_stress tau0:yield_stress n:exponent k:consistency K:consistency "
    "to_dataframe:ok params:yield_stress errors:yield_stress_stderr residual:misfit",
    ("P3", "c"): "mu_stderr:mu_ci95 lambda_stderr:lambda_ci95 errors:mu_ci95 exponents:ok beta:mu nu:lambda_ "
    "to_dataframe:ok p:pressure pressures:pressure chi2:spread residual:spread mu_error:mu_ci95 fit:mu|exponents",
    (
        "P3",
        "modes",
    ): "frequencies:ok omega:frequencies freq:frequencies eigenvectors:vectors eigenfrequencies:frequencies "
    "participation:ok participation_ratio:participation dos:density "
    "density:ok "
    "values:eigenvalues polarization:vectors",
    (
        "P3",
        "t",
    ): "G:relaxed|shear_modulus B:bulk_modulus|relaxed K:bulk_modulus|relaxed nu:to_dataframe|relaxed "
    "voigt:to_dataframe "
    "C:relaxed shear_modulus:shear_modulus bulk_modulus:bulk_modulus poisson:to_dataframe|relaxed to_dataframe:ok",
    ("P3", "net"): "fn:forces normal_force:forces force:forces overlap:forces overlaps:forces coordination:z "
    "n:n_contacts num_contacts:n_contacts i:pairs ids:pairs distances:r lengths:r angles:r normals:r fabric:r",
    # P4: an engineer who builds on the package
    (
        "P4",
        "jamlab",
    ): "__version__:ok version:__version__ cite:CITATION citation:CITATION config:arguments set_seed:seed seed:seed "
    "logger:getLogger "
    "load:read open:read save:write load_hdf5:read read_hdf5:read to_hdf5:write export:write dump:write from_file:read "
    "from_lammps:read to_lammps:write Simulation:Session System:Packing Box:Packing Particles:Packing Config:Packing "
    "Packing:ok simulate:shear|jam|pack run:open_campaign|Session Campaign:open_campaign|results "
    "parallel:measure|open_campaign "
    "batch:open_campaign|measure test:doctor show_versions:doctor exceptions:JamlabError errors:JamlabError "
    "Error:JamlabError types:results random_packing:pack|jam generate:pack|jam create:pack|jam make_packing:pack|jam "
    "neighbor_list:contacts|tessellation hexatic:hexatic_order structure_factor:ok rdf:pair_correlation",
    ("P4", "p"): "to_dict:Packing|write|params to_json:write copy:with_state to_numpy:positions to_dataframe:measure "
    "save:write to_hdf5:write to_lammps:write N:n size:n num:n coords:positions pos:positions x:positions xy:positions "
    "radius:diameters types:diameters lattice:box cell:box L:box volume:area density:phi packing_fraction:phi "
    "potential_energy:evaluate energy:evaluate pressure:measure|evaluate seed:provenance metadata:provenance "
    "replace:with_state energy_per_particle:evaluate|measure",
    ("P4", "campaign"): "plot:table|aggregate to_dataframe:table results:table tasks:finished|status progress:status "
    "resume:run data:table|packings path:file|folder summary:status|aggregate mean:aggregate",
    ("P4", "session"): "lmp:command run:command|steps cmd:command forces:evaluate|forces_at energy:evaluate "
    "step:steps extract:fix_vector|command",
}
CALLS = [
    # P1
    ("P1", "jamlab.micrograph(mask_file)", "labels"),
    ("P1", "jamlab.micrograph(mask, pixel_size=0.5)", "pixel"),
    ("P1", "jamlab.micrograph(image=mask)", "picture"),
    ("P1", "jamlab.micrograph(labels=mask, scale=0.5)", "pixel"),
    ("P1", "jamlab.contacts(m)", r"packing\('dp'\)"),
    ("P1", "jamlab.shear_modulus(m)", r"packing\('dp'\)"),
    ("P1", "jamlab.measure(m)", r"packing\('dp'\)"),
    ("P1", "jamlab.voids(m)", r"packing\('dp'\)"),
    ("P1", "m.packing()", "ok"),
    ("P1", "m.table()", "ok"),
    ("P1", "pd.DataFrame(m)", "table|to_dataframe"),
    ("P1", "len(m)", "count"),
    # P3
    ("P3", "jamlab.pack(32, 1e-3, polydispersity=0.2)", "sizes"),
    ("P3", "jamlab.pack(32, 1e-3, potential='hertz')", "law='hertz'"),
    ("P3", "jamlab.pack(32, 1e-3, law='hertz')", "ok"),
    ("P3", "jamlab.pack(32, 1e-3, alpha=2.5)", "law"),
    ("P3", "jamlab.pack(32, 1e-3, friction=0.3)", "limits"),
    ("P3", "jamlab.pack(32, 1e-3, dim=3)", "limits"),
    ("P3", "jamlab.pack(32, p=1e-3)", "pressure"),
    ("P3", "jamlab.pack(32, phi=0.86)", "ok"),
    ("P3", "jamlab.pack(32, packing_fraction=0.86)", "phi"),
    ("P3", "jamlab.pack(32, 1e-3, bidispersity=1.4)", "size_ratio"),
    ("P3", "jamlab.pack(32, 1e-3, ratio=1.4)", "size_ratio"),
    ("P3", "jamlab.pack(32, 1e-3, k=2.0)", "1 by|always 1|unit"),
    ("P3", "jamlab.pack(32, 1e-3, stiffness=2.0)", "unit|always 1"),
    ("P3", "jamlab.pack(32, 1e-3, random_state=2)", "seed"),
    ("P3", "jamlab.pack(N=32, pressure=1e-3)", r"\bn\b"),
    ("P3", "jamlab.jam(N=8)", r"\bn\b"),
    ("P3", "jamlab.jam(8, phi=0.9)", "compress"),
    ("P3", "jamlab.jam(8, pressure=1e-3)", "pack"),
    ("P3", "jamlab.jam(8, ftol=1e-12)", "tolerance"),
    ("P3", "jamlab.compress(p, phi=0.9)", r"\bto\b"),
    ("P3", "jamlab.compress(p, 0.9, dphi=0.01)", "step"),
    ("P3", "jamlab.compress(p, 0.9, n_steps=10)", "step"),
    ("P3", "jamlab.complex_modulus(p, frequency=[1.0])", "omega"),
    ("P3", "jamlab.complex_modulus(p, frequencies=[1.0])", "omega"),
    ("P3", "jamlab.complex_modulus(p, 1.0)", "ok"),
    ("P3", "jamlab.complex_modulus(p, [1.0], drag='stokes')", "damping"),
    ("P3", "jamlab.complex_modulus(p, [1.0], damping='stokes')", "StokesDrag"),
    ("P3", "jamlab.complex_modulus(p, [1.0], 1.0)", "ContactDamping"),
    ("P3", "jamlab.complex_modulus(p, [1.0], amplitude=0.1)", "oscillate"),
    ("P3", "jamlab.complex_modulus(p, np.logspace(-3, 0, 4))", "ok"),
    ("P3", "jamlab.shear(p, gamma_dot=1e-2)", "rate"),
    ("P3", "jamlab.shear(p, shear_rate=1e-2)", "rate"),
    ("P3", "jamlab.shear(p, 1e-2, dt=0.1)", "tolerance"),
    ("P3", "jamlab.shear(p, 1e-2, gamma_max=1.0)", "strain"),
    ("P3", "jamlab.shear(p, 1e-2, total_strain=1.0)", "strain"),
    ("P3", "jamlab.shear(p, 1e-2, save_every=10)", "snapshot_every"),
    ("P3", "jamlab.flow_curve(p, gamma_dot=[1e-2])", "rates"),
    ("P3", "jamlab.oscillate(p, frequency=1.0, amplitude=1e-4)", "omega"),
    ("P3", "jamlab.oscillate(p, omega=1.0, gamma0=1e-4)", "amplitude"),
    ("P3", "jamlab.creep(p, sigma=1e-4, duration=10.0)", "stress"),
    ("P3", "jamlab.creep(p, 1e-4, t_max=10.0)", "duration"),
    ("P3", "jamlab.quasistatic_shear(p, gamma=0.1)", "strain"),
    ("P3", "jamlab.quasistatic_shear(p, 0.1, dgamma=0.01)", "strain_step"),
    ("P3", "jamlab.lowest_modes(p, n_modes=4)", "count"),
    ("P3", "jamlab.lowest_modes(p, k=4)", "count"),
    ("P3", "jamlab.shear_modulus(p, average=True)", "direction"),
    ("P3", "jamlab.shear_modulus(p, theta=0.3)", "direction"),
    ("P3", "jamlab.shear_modulus(p, angle=0.3)", "direction"),
    ("P3", "jamlab.scaling_collapse(campaign)", "spectra"),
    ("P3", "jamlab.scaling_collapse([1e-2], [jamlab.complex_modulus(p, [1.0])])", "a list of its spectra"),
    ("P3", "jamlab.complex_modulus(p, [1.0], beta=0.5)", "`damping`"),
    ("P3", "jamlab.compress(p, pressure=0.1)", r"jamlab\.pack"),
    ("P3", "jamlab.decompress(p, to=1e-3)", "`pressure`"),
    ("P3", "jamlab.pack(16, 1e-2, law='Hertzian')", "use 'hertz'"),
    ("P3", "jamlab.measure(p, ['psi_6_overall'])", "use `psi_6_global`"),
    ("P3", "jamlab.make(p)", r"jamlab\.make\(packing\.recipe\)"),
    ("P3", "p.recipe.replace(seed=2)", r"dataclasses\.replace"),
    ("P3", "p.recipe.make()", r"jamlab\.make\(recipe\)"),
    ("P3", "dataclasses.replace(p.recipe, exponent=2.5)", "`law`"),
    ("P3", "dataclasses.replace(p.recipe, unheard=1)", "takes protocol"),
    ("P3", "jamlab.scaling_collapse(spectra_table)", "spectra"),
    ("P3", "jamlab.measure(p, ['G'])", r"'?\bg\b'?"),
    ("P3", "jamlab.measure(p, 'coordination')", r"\bz\b"),
    ("P3", "jamlab.measure(p, strongest)", "ok"),
    ("P3", "jamlab.measure([p, p], ['z', strongest])", "ok"),
    ("P3", "jamlab.measure(p, ['phi', 'G_xy'])", "g_x"),
    ("P3", "jamlab.hexatic_order(p, n=6)", r"\bk\b"),
    # P4
    ("P4", "jamlab.pack(32, np.float32(1e-3))", "ok"),
    ("P4", "jamlab.pack(np.int64(32), 1e-3)", "ok"),
    ("P4", "jamlab.pack(32, 1e-3, verbose=True)", "progress"),
    ("P4", "jamlab.pack(32, 1e-3, timeout=1)", "has no argument 'timeout'"),
    ("P4", "jamlab.pack(32, 1e-3, max_iter=10)", "tolerance"),
    ("P4", "jamlab.pack(32, 1e-3, n_jobs=2)", "ranks"),
    ("P4", "jamlab.pack(32, 1e-3, rng=np.random.default_rng(1))", "seed"),
    ("P4", "jamlab.measure([p, p], n_jobs=2)", "workers"),
    ("P4", "jamlab.measure([p, p], workers=2)", "ok"),
    ("P4", "jamlab.write('p.h5', p)", "ok"),
    ("P4", "jamlab.write(p, 'p.h5')", "path"),
    ("P4", "jamlab.read(filename='p.h5')", "path"),
    ("P4", "jamlab.read('p.h5', index=0)", "frame"),
    ("P4", "jamlab.write_movie(run, 'm.mp4')", r"\bpath\b"),
    ("P4", "jamlab.Packing(p.positions, p.box)", "model"),
    ("P4", "jamlab.open_campaign(campaign_file)", "ok"),
    ("P4", "[task for task in campaign]", "finished|table"),
    ("P4", "campaign.run(n_jobs=1)", "workers"),
    ("P4", "pickle.loads(pickle.dumps(p)) == p", "ok"),
    ("P4", "p.positions.sum()", "ok"),
    ("P4", "jamlab.evaluate(p).forces", "ok"),
    ("P4", "hash(p)", "ok"),
]
# shell: words -> what is meant, as `use jamlab WORD` or an option
SHELL = {
    "restart": "resumes",
    "sweep": "compress|campaign",
    "examples": "decks|demo",
    "track": "analyze|track_droplets",
    "minimize p.h5": "relax",
    "view p.h5": "explore",
    "plot p.h5": "explore",
    "show p.h5": "explore",
    "lmp in.sp.jam": "deck",
    "run in.sp.jam": "deck",
    "list": "decks",
    "init": "campaign new",
    "new": "campaign new",
    "resume": "resumes",
    "status": "campaign status",
    "info p.h5": "analyze",
    "measure p.h5": "analyze",
    "export p.h5": "convert",
    "test": "doctor",
    "version": "ok",
    "help": "ok",
    "image mask.tif": "analyze",
    "segment mask.tif": "analyze",
    "decompress p.h5": "compress|decompress",
    "modulus p.h5": "gstar|analyze",
    "frequency-sweep p.h5": "gstar",
    "g-star p.h5": "gstar",
    "rheology p.h5": "gstar",
    "quasistatic p.h5": "shear",
    "aqs p.h5": "shear",
    "stress-relaxation p.h5": "relax-stress",
    "oscillatory p.h5": "oscillate",
    "movie p.h5": "explore",
    "generate": "jam|pack",
    "make": "jam|pack",
    "create": "jam|pack",
    "batch": "campaign",
    "ensemble": "campaign",
    "check": "doctor",
    "install": "doctor",
    "cite": "-",
    "jam -N 8": "-n",
    "jam --num 8": "--n",
    "jam --phi 0.9": "compress",
    "jam --pressure 1e-3": "pack",
    "jam --output o.h5": "--out",
    "jam -n 8 --show": "explore|--json|it takes",
    "jam -n 8 --verbose": "it takes|progress",
    "jam --gamma 0.2": "--law",
    "pack --phi 0.86": "--pressure|it takes",
    "pack -n 8 --p 1e-3": "--pressure",
    "pack -n 8 --pressure 1e-3 --potential hertz": "--law",
    "pack --polydispersity 0.2": "--sizes",
    "analyze p.h5 --pixel-size 0.5": "--pixel",
    "analyze p.h5 --quantities z": "--quantity",
    "shear p.h5 --gamma-dot 1e-2": "--rate",
    "shear p.h5 --dt 0.1": "--tolerance",
    "shear p.h5 --output o.h5": "--out",
    "oscillate p.h5 --frequency 1": "--omega",
    "gstar p.h5 --frequency 1": "--omega-min",
    "compress p.h5 --phi 0.9": "--to",
    "compress p.h5 --pressure 0.1": "jamlab pack --pressure",
    "decompress p.h5 --to 1e-3": "--pressure",
    "shear-quasistatic p.h5": "quasistatic-shear",
    "compress p.h5 --dphi 0.01": "--step",
}
