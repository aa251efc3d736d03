"""How packings are made, and what statics says of them."""

import numpy as np
from constant_battery import STATES, droplets, jamlab, read, relaxed, scenario, shaken


@scenario
def jam_disks(folder):
    return [jamlab.jam(n=16, seed=seed) for seed in (1, 2)]


@scenario
def jam_disks_sheared(folder):
    return jamlab.jam(n=16, seed=2, ensemble="shear-stabilized")


@scenario
def jam_many_disks(folder):
    return jamlab.jam(n=220, seed=1)


@scenario
def jam_droplets(folder):
    return [jamlab.jam(n=8, model="dp", seed=seed) for seed in (1, 2)]


@scenario
def jam_droplets_direct(folder):
    return jamlab.jam(n=6, model="dp", seed=1, start="direct")


@scenario
def jam_droplets_sheared(folder):
    return jamlab.jam(n=8, model="dp", seed=3, ensemble="shear-stabilized")


@scenario
def jam_droplets_of_few_vertices(folder):
    return jamlab.evaluate(jamlab.jam(n=8, model="dp", seed=1, law={"nv_small": 12, "delta": 0.3}))


@scenario
def pack_disks(folder):
    return [jamlab.pack(32, pressure, seed=seed) for seed, pressure in ((1, 1e-3), (2, 1e-2), (3, 0.1), (4, 1e-5))]


@scenario
def pack_at_phi(folder):
    return jamlab.pack(32, phi=0.9, seed=1)


@scenario
def pack_sheared(folder):
    return jamlab.pack(16, 1e-3, seed=1, ensemble="shear-stabilized")


@scenario
def pack_sticky(folder):
    return [
        jamlab.pack(32, 1e-3, seed=1, law={"stickiness": 0.02}),
        jamlab.pack(16, 1e-2, seed=2, law={"stickiness": 0.1}),
    ]


@scenario
def pack_hertz(folder):
    return jamlab.pack(32, 1e-4, seed=1, law={"exponent": 2.5})


@scenario
def pack_sizes(folder):
    sizes = ("lognormal:0.2", "uniform:0.3", "power-law:3,2")
    found = []
    for each in sizes:
        try:
            found.append(jamlab.pack(24, 1e-2, seed=1, sizes=each))
        except jamlab.InputError as error:
            found.append(str(error)[:60])
    return found


@scenario
def compress_disks(folder):
    onset = read(folder, "onset")
    return [
        *jamlab.compress(onset, to=onset.phi + 0.02, step=0.005),
        *jamlab.compress(onset, to=onset.phi + 0.05, by="phi", per_decade=2, first_step=1e-4),
    ]


@scenario
def compress_droplets(folder):
    starts = [read(folder, "dp8"), *(jamlab.jam(n=8, model="dp", seed=seed) for seed in (2, 3, 4))]
    return [p for start in starts for p in jamlab.compress(start, to=0.88, step=0.01)]


@scenario
def compress_droplets_far(folder):
    return [*jamlab.compress(droplets(), to=0.96, step=0.03)]


@scenario
def decompress_disks(folder):
    return [jamlab.decompress(read(folder, "sp64"), 1e-5), jamlab.decompress(read(folder, "sp16"), 1e-4)]


@scenario
def relax_disks(folder):
    return [jamlab.relax(shaken(read(folder, name), 0.02)) for name in ("sp16", "sp64", "sticky", "flat", "walled")]


@scenario
def relax_many_disks(folder):
    return jamlab.relax(shaken(read(folder, "sp500"), 0.02))


@scenario
def relax_marginal(folder):
    return jamlab.relax(shaken(read(folder, "marginal"), 0.01), 1e-13)


@scenario
def relax_droplets(folder):
    starts = [shaken(droplets(), 0.01 * seed, seed) for seed in range(1, 7)]
    return [relaxed(p) for p in [*starts, shaken(read(folder, "dp36"), 0.01)]]


@scenario
def relax_saddle(folder):
    return jamlab.relax(jamlab.read(STATES / "droplets_on_a_saddle.h5"))


@scenario
def droplets_from_disks(folder):
    return jamlab.droplets_from_disks(jamlab.pack(8, phi=0.88, seed=1))


@scenario
def minimize_box(folder):
    p = shaken(read(folder, "stabilized"), 0.01)
    return jamlab.relax(p)


@scenario
def jam_disks_in_steps(folder):
    return jamlab.jam(n=6, seed=2, search="incremental")


@scenario
def elasticity(folder):
    found = []
    for name in ("sp16", "sp64", "sticky", "stabilized"):
        p = read(folder, name)
        found += [jamlab.elastic_tensor(p), jamlab.nonaffine_response(p), jamlab.maxwell_count(p)]
    return [*found, jamlab.elastic_tensor(droplets()), jamlab.elastic_tensor(read(folder, "sp500"))]


@scenario
def moduli(folder):
    p, q = read(folder, "sp64"), droplets()
    ways = ("linear-response", "finite-strain", "affine")
    return [
        *(jamlab.shear_modulus(p, method=way, direction="simple") for way in ways),
        *(jamlab.bulk_modulus(p, method=way) for way in ways),
        jamlab.shear_modulus(p, direction=np.linspace(0, 3, 4)),
        jamlab.shear_modulus(q),
    ]


@scenario
def vibrations(folder):
    found = [jamlab.lowest_modes(read(folder, name), 6).frequencies for name in ("sp16", "sp64", "sp500")]
    return [*found, jamlab.count_zero_modes(read(folder, "marginal")), jamlab.lowest_modes(droplets(), 4).frequencies]


@scenario
def rigidity(folder):
    clusters = [jamlab.rigid_clusters(read(folder, name)) for name in ("sp16", "sp64", "marginal", "sticky")]
    return [
        *clusters,
        jamlab.maxwell_count(read(folder, "marginal")),
        jamlab.count_zero_modes(read(folder, "sp500")),
        jamlab.contacts(read(folder, "sp64")).forces,
    ]


@scenario
def evaluate(folder):
    return [jamlab.evaluate(read(folder, name)) for name in ("sp64", "sticky", "walled", "flat")] + [
        jamlab.evaluate(droplets())
    ]


@scenario
def geometry(folder):
    p, q = read(folder, "sp64"), droplets()
    of_droplets = (jamlab.contact_lengths, jamlab.shape_factors, jamlab.particle_areas, jamlab.relative_areas)
    return [
        *(jamlab.packing_fraction(each) for each in (p, q, read(folder, "walled"), read(folder, "flat"))),
        *(each(q) for each in of_droplets),
        *(jamlab.tessellation(each).area for each in (p, q)),
        *(jamlab.local_packing_fraction(each) for each in (p, q)),
        *(jamlab.hexatic_order(each) for each in (p, q)),
        jamlab.remove_rattlers(p),
        jamlab.shape_factors(q, rim=True),
    ]


@scenario
def voids(folder):
    found = [jamlab.voids(each) for each in (read(folder, "sp64"), read(folder, "sticky"), droplets())]
    return [*found, jamlab.void_statistics(*found[:2]), jamlab.void_statistics(found[2])]


@scenario
def slabs(folder):
    return [jamlab.slab(read(folder, name)) for name in ("walled", "flat")]


@scenario
def walls(folder):
    p = read(folder, "sp64")
    return [jamlab.relax(jamlab.with_walls(p, thickness=1.5, flat=flat)) for flat in (False, True)]


@scenario
def measure(folder):
    return [
        jamlab.measure([read(folder, "sp16"), read(folder, "sp64")]),
        jamlab.measure([droplets()]),
        jamlab.measure([read(folder, "sp16"), read(folder, "sp64")], ["z", "g"], workers=2),
    ]
