"""All arguments, each once."""

from jamlab.arguments.analysis import ANALYSIS
from jamlab.arguments.argument import Argument
from jamlab.arguments.campaigns import CAMPAIGNS
from jamlab.arguments.decks import DECKS
from jamlab.arguments.files import FILES
from jamlab.arguments.flow import FLOW
from jamlab.arguments.making import MAKING
from jamlab.arguments.micrographs import MICROGRAPHS
from jamlab.arguments.reading import READING
from jamlab.arguments.sessions import SESSIONS
from jamlab.arguments.sweeps import SWEEPS

# subject, as a heading of the page -> its arguments
SUBJECTS: dict[str, tuple[Argument, ...]] = {
    "Making packings": MAKING,
    "Sweeps and changes of packings": SWEEPS,
    "Flow": FLOW,
    "Analysis": ANALYSIS,
    "Files of other programs": READING,
    "Files and tables": FILES,
    "Campaigns": CAMPAIGNS,
    "Pictures": MICROGRAPHS,
    "Sessions of LAMMPS": SESSIONS,
    "Decks": DECKS,
}
ARGUMENTS: dict[str, Argument] = {each.name: each for subject in SUBJECTS.values() for each in subject}


def argument(name: str) -> Argument:
    """The line of an argument.

    Args:
        name: of a function, or of an option without its dashes.

    Raises:
        KeyError: the table has no such argument.
    """
    return ARGUMENTS[name]
