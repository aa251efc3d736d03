"""Classes of results and of settings: functions of `jamlab` make and take them, and few scripts name them."""

from jamlab.engine.evaluation import Evaluation as Evaluation
from jamlab.estimates.choice import Choice as Choice
from jamlab.estimates.estimate import Estimate as Estimate
from jamlab.flow.creep_and_relaxation import CreepRun as CreepRun
from jamlab.flow.creep_and_relaxation import StoppedFlow as StoppedFlow
from jamlab.flow.creep_and_relaxation import StressRelaxation as StressRelaxation
from jamlab.flow.flow_curve import FlowCurve as FlowCurve
from jamlab.flow.mean_flow_curve import MeanFlowCurve as MeanFlowCurve
from jamlab.flow.oscillate import Oscillation as Oscillation
from jamlab.flow.quasistatic_run import QuasistaticShear as QuasistaticShear
from jamlab.flow.shear import ShearRun as ShearRun
from jamlab.flow.steady_state import SteadyState as SteadyState
from jamlab.geometry.contact_network import ContactForces as ContactForces
from jamlab.geometry.contact_network import Contacts as Contacts
from jamlab.geometry.hexatic_order import HexaticOrder as HexaticOrder
from jamlab.geometry.particle_shape import ContactLengths as ContactLengths
from jamlab.geometry.tessellation import Tessellation as Tessellation
from jamlab.geometry.voids.voids import Voids as Voids
from jamlab.geometry.voids.voids import VoidStatistics as VoidStatistics
from jamlab.mechanics.density_of_states import DensityOfStates as DensityOfStates
from jamlab.mechanics.elasticity import ElasticTensor as ElasticTensor
from jamlab.mechanics.maxwell_count import MaxwellCount as MaxwellCount
from jamlab.mechanics.nonaffine_response import NonaffineResponse as NonaffineResponse
from jamlab.mechanics.vibrations import Modes as Modes
from jamlab.micrographs.measured_droplets import Micrograph as Micrograph
from jamlab.motion.local_strain import LocalStrain as LocalStrain
from jamlab.motion.local_strain import LocalStrains as LocalStrains
from jamlab.motion.mean_square_displacement import MeanSquareDisplacement as MeanSquareDisplacement
from jamlab.motion.overlap import Overlap as Overlap
from jamlab.motion.t1_events import T1Events as T1Events
from jamlab.rheology.complex_modulus import ComplexModulus as ComplexModulus
from jamlab.rheology.critical_scaling import Collapse as Collapse
from jamlab.rheology.displacement_correlation import DisplacementCorrelation as DisplacementCorrelation
from jamlab.rheology.mean_spectrum import MeanSpectra as MeanSpectra
from jamlab.rheology.mean_spectrum import MeanSpectrum as MeanSpectrum
from jamlab.rheology.mode_character import ModeCharacter as ModeCharacter
from jamlab.rheology.nonlinear_drag import NonlinearModulus as NonlinearModulus
from jamlab.rheology.relaxation_spectrum import RelaxationSpectrum as RelaxationSpectrum
from jamlab.statistics.herschel_bulkley import HerschelBulkley as HerschelBulkley
from jamlab.structure.pair_correlation import PairCorrelation as PairCorrelation
from jamlab.structure.spectral_density import SpectralDensity as SpectralDensity
from jamlab.structure.structure_factor import ShellMeans as ShellMeans
from jamlab.structure.structure_factor import StructureFactor as StructureFactor

__all__ = [name for name in dir() if name[0] != "_"]
