"""Numbers of the solvers that make packings, each with its reason; `settings=` hands in others."""

from dataclasses import dataclass, fields


@dataclass(frozen=True)
class NewtonSettings:
    """Numbers of Newton steps at a fixed box, `descend_by_newton`.

    Halved or doubled, they change force evaluations and factorisations by less than 5 % and lose no state, except for
    `near_steps` (11 % more of the first, or 22 % more of the second), `first_shift` (a third more of both either way)
    and a larger `good` (18 and 43 % more).
    """

    steps: int = 150  # at most
    # at most, from a guess near the minimum; beyond, first-order steps bring disks nearer for less
    near_steps: int = 40
    # longest move of a coordinate in one step, mean particle size; contacts beyond are not in the Hessian
    reach: float = 0.05
    first_shift: float = 1e-3  # added to the Hessian's diagonal at first
    least_shift: float = 1e-10  # keeps rattlers and translations, which have no stiffness, from running away
    last_shift: float = 1e6  # with more than this, steps are too short to get anywhere
    accepted: float = 1e-3  # part of the energy foretold that a step must gain
    # good, poor: parts above which the shift shrinks and below which it grows, Nocedal & Wright
    good: float = 0.75
    poor: float = 0.25
    # shrink, grow: factors of the shift; fast down, so that the end is quadratic
    shrink: float = 0.2
    grow: float = 5.0
    definite: float = 4.0  # factor of the shift until the shifted Hessian is positive definite


@dataclass(frozen=True)
class LbfgsSettings:
    """Numbers of preconditioned L-BFGS for droplets, `jamlab/descend`.

    Measured on 40 states of 64 droplets up to rho = 0.99: `refresh` from 15 to 40 changes the CPU time by 10 % at most;
    with `refresh` = 40, `least_shift` from 1e-4 to 1e-3 and `shift` from 1 to 4 change the steps by 6 % at most.
    """

    steps: int = 5000  # at most
    refresh: int = 20  # steps that one factorisation serves; all of them are remembered
    # longest move of a coordinate in one step, mean particle size; contacts beyond are not in the Hessian
    reach: float = 0.05
    # times the longest move of the step before that a step is tried with at most: full steps mostly miss while contacts
    # open and close, and every miss costs an evaluation
    longer: float = 2.0
    # times the longest move of the last step: gaps that count as contacts in the Hessian of `many_droplets` and more
    closing: float = 0.3
    trials: int = 8  # force evaluations in one line search
    energy_digits: float = 1e-13  # relative change of the energy below which it is rounding
    # part of the energy foretold by the slope that a step must gain (Armijo), Nocedal & Wright 3.1
    sufficient: float = 1e-4
    # least cosine between a step and the change of the force along it for the pair to be remembered
    curved: float = 1e-10
    # added to the Hessian's diagonal over the largest force: far from balance long steps miss, and the Hessian has
    # negative modes down to some ten times that
    shift: float = 2.0
    least_shift: float = 3e-4  # with less, steps along soft modes are longer than the quadratic model holds


@dataclass(frozen=True)
class RelaxationSettings:
    """Which method takes over from which. Noise is the largest force over the pressure."""

    rounds: int = 3  # starts with first-order steps; another follows when Newton steps leave their basin
    # from here on FIRE goes on almost to the end, instead of conjugate gradients: local events keep the one step length
    # of any other method short. An onset of 96 disks costs the same by either, of 256 and 512 two to three times less
    # by FIRE; states of a sweep cost 1.5 times more at 96, and 1.2 times less at 256.
    many_disks: int = 200
    # from here on gaps that a step will close are in the Hessian: with 1024, 5000 steps do not reach a minimum without;
    # with 256 a sweep takes .54 to .93 times the CPU, with 64 the same
    many_droplets: int = 512
    newton_noise: float = 1e-7  # at which Newton steps take over there; started earlier they stall
    stages: int = 12  # of a quench at most: the pressure, and with it the target, falls on the way
    # a stage whose pressure falls by less than this factor was stopped by its steps, not by a new target
    jump: float = 0.5
    close: float = 1.05  # with a free box, a stage that starts with its target times this or less aims lower by as much
    cg_steps: int = 20_000  # at most, in one call
    fire_stretch: int = 3000  # FIRE steps after which it starts anew
    fire_steps_droplets: int = 300  # FIRE steps between two rounds, droplets: away from where the last one stalled
    settle_steps: int = 1500  # L-BFGS steps when it only matters whether a packing jams
    # contacts, over the strength of the law: FIRE steps grow no longer where disks that stiffen are softer
    softest: float = 1e-3
    # droplets: below, forces that are left cannot bring a packing to jam that has no contacts
    loose_force: float = 2e-5


@dataclass(frozen=True)
class BorderSettings:
    """Numbers of Newton steps over sites and box, `descend_with_box`; the shift is that of `NewtonSettings`."""

    steps: int = 40  # factorisations at most: near a minimum 4 to 20 do; first-order steps come nearer for less
    reach: float = 0.1  # longest move of a coordinate in one step, mean particle size
    longest_strain: float = 0.02  # of the box in one step
    # first_shift, least_shift, last_shift: of the Hessian's diagonal; of the strains' times the number of sites
    first_shift: float = 1e-4
    least_shift: float = 1e-10
    last_shift: float = 1e3
    searches: int = 6  # lengths tried along one step at most
    slack: float = 0.5  # part of the slope at its start that may be left at the end of a step, uphill
    fallen: float = 0.2  # factor of the largest force that is good enough by itself: slopes lose their digits first
    # good, poor: lengths of a step above which the shift shrinks and below which it grows
    good: float = 0.75
    poor: float = 0.25
    # shrink, grow: factors of the shift
    shrink: float = 0.2
    grow: float = 5.0
    softest: float = 1e-9  # least curvature over the largest that a strain is divided by
    digits: float = 1e-12  # of unbalanced stress over pressure, at the end
    rounding: float = 3e-16  # of a stress, over the stiffness of a contact


@dataclass(frozen=True)
class BoxRelaxationSettings:
    """Numbers of the relaxation of disks with their box, `relax_disks_and_box`."""

    # largest force over pressure at which a packing at fixed box shows whether anything holds the box
    jammed: float = 1e-2
    noise: float = 1e-6  # the same at which Newton steps take over; started at 1e-4 many fail
    finer: float = 0.1  # its factor where they fail
    rounds: int = 12  # at most
    # from here on FIRE alone meets a pressure: 40 Newton steps ended at 1e-10 with 32768 disks
    fire_only_disks: int = 10_000
    near: int = 10  # Newton steps from a guess of the minimum, before anything else
    leave: float = 1e-3  # shear of a box that rests on a saddle, as symmetric packings of few disks do
    balanced: float = 10.0  # unbalanced stress at the end, over that of rounding or of 1e-12 of the pressure
    areas: int = 40  # of a box at a pressure that are tried at most, behind all this
    widest: float = 0.02  # change of the area in one step
    held: float = 1e-9  # error of a pressure over the load of the packing, at the end
    met: float = 1e-7  # error of a pressure over the pressure that is good enough where FIRE has reached it by itself


@dataclass(frozen=True)
class BoxShearSettings:
    """Numbers of the shear of the box around droplets, `relax_with_box_shear`."""

    stress_tolerance: float = 1e-8  # residual shear stress over pressure at the end
    steps: int = 60  # of the box at most
    shift: float = 1e-8  # of the Hessian's diagonal: droplets that slide have no stiffness of their own
    # reach, longest_strain: longest move of a coordinate, mean particle size, and strain of the box, in one step
    reach: float = 0.05
    longest_strain: float = 0.02
    # grow, refused: factors of the part of a Newton step that is taken, after one downhill and after one uphill
    grow: float = 2.5
    refused: float = 0.25


@dataclass(frozen=True)
class OnsetSettings:
    """Numbers of the search for onset that `lammps_inputs/parts/onset` does not share with the decks. Halved or
    doubled, each changes force evaluations by less than 1 % and factorisations by at most 3 %, and loses no state, over
    five sweeps of disks and droplets."""

    # on the largest force of droplets: enough to tell a state jammed by step_fine from a loose one
    search_tolerance: float = 1e-6
    # the same for droplets near onset: forces that are left could not make up u_contact, F^2 delta^2/(2 eps)
    loose_tolerance: float = 5e-8
    loose_energy: float = 0.01  # contact energy over u_contact that forces left in loose disks may hold
    bearing: float = 0.01  # largest force over pressure and mean size below which contacts carry a load
    decompressions: int = 80  # at most
    jump: float = 0.1  # contacts lost within this part of the way to the extrapolated onset are lost in one go
    least_root: float = 0.03  # part of sqrt(U) that remains at least in one decompression
    stride: float = 0.7  # factor of a decompression that did not converge: come from elsewhere
    # jammed states that unjam during decompression, or end on a saddle, until one counts that rests on rattlers
    falls: int = 8
    most_falls: int = 24  # at most: a box that shears may repeat itself for ever


@dataclass(frozen=True)
class RigidSettings:
    """Numbers of the search for the onset of droplets over rigid bodies, whose Newton steps are otherwise those of
    `NewtonSettings`. Halved or doubled, shifts and factors change its iterations by -8 to 50 %, so do not matter."""

    steps: int = 3000  # at most, in one relaxation: 3 to 340 are usual, a few that lose their contacts take 1000
    # first_shift, least_shift, last_shift: of the Hessian's diagonal, over the stiffness of a contact, eps/delta^2
    first_shift: float = 6e-5
    least_shift: float = 6e-12
    last_shift: float = 6.0
    # searches, slack: lengths tried along a step that leads uphill, and part of its slope that may be left; without, a
    # search takes four times as many factorisations
    searches: int = 5
    slack: float = 0.5
    rim: float = 0.2  # longest move of a coordinate in one step, over delta: outlines never jump over each other
    # settled, ended: largest force over the largest contact force, to tell jammed from loose, and at the end
    settled: float = 1e-6
    ended: float = 1e-9
    rounding: float = 5e-13  # of forces, over eps/delta
    loose: float = 0.1  # contact energy over u_contact with which a relaxation ends
    balanced: float = 1e-4  # largest force over the largest contact force at the end of the way down
    stiffness: float = 1.8  # of a droplet against a contact, over its line tension
    softest: float = 1e-3  # the same over that of a rim: with less the droplets themselves are searched
    # lowest, highest: contact energy on the way down over that to come down to
    lowest: float = 0.05
    highest: float = 15.0
    slides: int = 20  # along modes that give way, one after the other, at most
    slide: float = 0.05  # length of one, mean particle size
    moved: float = 0.2  # part of a slide that remains where nothing stops it
    # same, repeats: how near in phi a state is the one before, and how often it is judged before the search goes on
    # from denser ones
    same: float = 1e-6
    repeats: int = 2
    # tries at most until a state of droplets is a minimum or comes loose, and changes of phi for each
    judgements: int = 8
    corrections: int = 4
    farthest: float = 100.0  # change of the distance to onset at most, in one of them
    gone: float = 1e-22  # contact energy per vertex of droplets from which no extrapolation leads back
    # steps of droplets at most: from rigid ones, from there to the smallest forces, after a slide, and where that does
    # not end
    droplet_steps: int = 600
    finer_steps: int = 120
    slide_steps: int = 150
    lbfgs_steps: int = 800
    box_steps: int = 12  # of the box around droplets, each with as many of theirs


@dataclass(frozen=True)
class SaddleSettings:
    """Numbers of the way off a saddle, `leave_saddles`."""

    slides: int = 40  # along unstable modes at most, until none is left: one droplet in ten slides on its flats
    # slide, nearest: longest, and the first try, mean particle size
    slide: float = 0.1
    nearest: float = 1e-6
    bisections: int = 40  # to the contact that stops it, which then overlaps by rounding
    # held, pressed: force uphill at which a slide ends, over pressure times particle size, and over the tolerance
    held: float = 1e-3
    pressed: float = 0.1
    # alike, returns: cosine of two modes that are one, and how often it may come back
    alike: float = 0.9
    returns: int = 1
    finest: float = 1e-13  # largest force there: contacts that hold a slide bear 1e-13 to 1e-11, rounding leaves 1e-13
    # probe, pushed: move either way, mean particle size, that rattlers push back, and the least force that is not
    # rounding: 1.4e-12 to 7e-10 were seen, where a curvature of -1e-11 alone leaves 1e-15
    probe: float = 1e-4
    pushed: float = 5e-13


@dataclass(frozen=True)
class SweepSettings:
    """Numbers of a sweep, `compress`."""

    secant_steps: int = 15  # at most, to a true packing fraction
    met: float = 0.01  # distance from a state's packing fraction over that to the state before
    met_last: float = 1e-6  # distance of the last state from its packing fraction
    halvings: int = 4  # of a step that does not end in a minimum, at most
    least_slope: float = 0.1  # of rho against phi for a secant; below, the packing has jumped to another basin
    shortest: float = 1e-7  # step in phi, when following a basin
    loose: float = 1e3  # pressure over force tolerance below which a pressure is not worth predicting
    easy: float = 0.3  # part of the error allowed below which the next step may be twice as long


@dataclass(frozen=True)
class PressureSettings:
    """Numbers of the search for a pressure that `lammps_inputs/in.sp.pressure` does not share with the deck."""

    # force over pressure on the way to the target, and how near, |log(p/target)|, that must come before the next is
    # tried, or the box set free. The way changes the ensemble: by steps of p -> 0.6 p, relaxed to 1e-2, phi of 50
    # packings (n = 512, p = 1e-4) ends higher by 6e-4 +- 2e-4, with one level less lower by 1.5e-4 +- 1e-4; two levels
    # more change it by 2e-5 +- 2e-5.
    ladder: tuple[tuple[float, float], ...] = ((3e-2, 2.0), (1e-2, 0.5))
    # factors of a pressure that a random start does not meet: one of them is met first, and the packing decompressed
    above: tuple[float, ...] = (10.0, 100.0, 1000.0)


@dataclass(frozen=True)
class SolverSettings:
    """Numbers of all solvers that make packings, for the argument `settings`.

    The defaults lie on plateaus: each was halved and doubled, force evaluations and factorisations were counted.

    Attributes:
        newton: Newton steps at a fixed box.
        lbfgs: preconditioned L-BFGS, droplets.
        near: the same beside a minimum.
        relaxation: which method takes over from which.
        border: Newton steps over sites and box.
        box_relaxation: disks relaxed with their box.
        box_shear: droplets relaxed with the shear of their box.
        onset: search for jamming onset, `jam`.
        rigid: search for the onset of droplets over rigid bodies.
        saddles: the way off a saddle, droplets.
        sweep: states at packing fractions, `compress`.
        pressure: search for a pressure, `pack`.

    Example:
        >>> from dataclasses import replace
        >>> usual = jamlab.results.SolverSettings()
        >>> few = replace(usual, newton=replace(usual.newton, steps=50))
        >>> jamlab.jam(n=16, seed=1, settings=few).converged
        True
    """

    newton: NewtonSettings = NewtonSettings()
    lbfgs: LbfgsSettings = LbfgsSettings()
    # the quadratic model holds: a small shift, and factors that follow contacts as these open and close
    near: LbfgsSettings = LbfgsSettings(steps=400, refresh=10, trials=16, shift=0.0, least_shift=1e-6)
    relaxation: RelaxationSettings = RelaxationSettings()
    border: BorderSettings = BorderSettings()
    box_relaxation: BoxRelaxationSettings = BoxRelaxationSettings()
    box_shear: BoxShearSettings = BoxShearSettings()
    onset: OnsetSettings = OnsetSettings()
    rigid: RigidSettings = RigidSettings()
    saddles: SaddleSettings = SaddleSettings()
    sweep: SweepSettings = SweepSettings()
    pressure: PressureSettings = PressureSettings()

    def __repr__(self) -> str:
        changed = (f.name for f in fields(self) if getattr(self, f.name) != f.default)
        return f"SolverSettings({', '.join(f'{name}={getattr(self, name)!r}' for name in changed)})"


SOLVERS = SolverSettings()
