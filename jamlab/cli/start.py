"""Start the command `jamlab`."""

import codecs
import os
import signal
import sys
import unicodedata


def main() -> None:
    """Run the words of the shell. A signal during the imports ends the process: nothing has begun."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_DFL)
    open_streams()
    from jamlab.cli.main import main as run

    run()


def open_streams() -> None:
    """Replace closed streams, so that no file that is opened later gets what is printed, and print letters that the
    encoding of a stream lacks by other names."""
    while (opened := os.open(os.devnull, os.O_RDWR)) <= 2:
        os.set_inheritable(opened, True)
    os.close(opened)
    sys.stdout = sys.stdout or open(1, "w")  # Python itself has None for what is closed
    sys.stderr = sys.stderr or open(2, "w")
    codecs.register_error("jamlab", _plain)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="jamlab")


def _plain(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(map(plain, error.object[error.start : error.end])), error.end


def plain(letter: str) -> str:
    """A letter in ASCII: Greek ones by name, others without accents; ? where there is none."""
    greek, _, name = unicodedata.name(unicodedata.normalize("NFKD", letter)[0], "").rpartition(" LETTER ")
    if greek.startswith("GREEK"):
        return name.lower()
    without = unicodedata.normalize("NFKD", letter).encode("ascii", "ignore").decode()
    return {"\u00b1": "+-", "\u2212": "-", "\u00b7": "*", "\u00b0": " degrees"}.get(letter) or without or "?"
