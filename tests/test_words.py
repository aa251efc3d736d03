"""Words of docstrings, captions, messages, settings, scripts, decks and changelog; units on the axes of pictures."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
FOLDERS = ("jamlab", "studies", "docs/gallery_scripts", "docs/extensions", "plugin", "lammps_inputs")
KINDS = ("", ".py", ".js", ".md", ".toml", ".h", ".cpp", ".html", ".rst")  # decks have no ending
LEFT_OUT = ("studies/data", "studies/speed_history/records")  # measured
TERMS = {  # never written: the term of the field instead
    "another basin": "another minimum",
    "basin": "energy minimum",
    "blew up": "diverged",
    "blow up": "diverge",
    "blows up": "diverges",
    "came loose": "unjammed",
    "come loose": "unjam",
    "comes loose": "unjams",
    "largest force left": "residual force",
    "massless": "overdamped",
    "without mass": "overdamped",
    "without inertia": "overdamped",
    "soft particles": "soft disks",
    "deformable polygons (dp)": "deformable droplets (DP)",
    "to and fro": "cyclic, or: both directions added",
    "onto one curve": "scaling collapse",
    "handful": "few",
    "what statics asks for": "isostatic number",
    "held motions": "constraint counting",
    "limit of detection": "detection limit",
    "loaded springs": "pre-stress",
    "shear without time": "quasi-static shear",
    "sheared until none": "shear-stabilised",
    "no shear stress is left": "zero shear stress",
    "off their front": "not on the Pareto front",
    "that of the": "the noun again",
    "those of the": "the noun again",
    "no longer": "present tense",
    "any more": "present tense",
}
UNIT = r"(?:k|d|s|ε|τ|γ|1/d|1/k|kτ|1/τ)"  # how units begin


def prose():
    """Path and text of every file that is read, or whose words are shown."""
    yield "CHANGELOG.md", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*")):
            name = path.relative_to(ROOT).as_posix()
            if path.is_file() and path.suffix in KINDS and not name.startswith(LEFT_OUT):
                yield name, path.read_text(encoding="utf-8")


def test_the_terms_of_the_field_are_written():
    """Across ends of lines too, with the marks of comments."""
    between = r"[\s#*/]+"
    patterns = {term: rf"(?<![\w-]){between.join(map(re.escape, term.split()))}(?![\w-])" for term in TERMS}
    found = []
    for name, text in prose():
        flat = re.sub(between, " ", text.lower())
        for term in filter(flat.__contains__, TERMS):
            for hit in re.finditer(patterns[term], text, re.IGNORECASE):
                found.append(f"{name}:{text[: hit.start()].count(chr(10)) + 1}: {term}: write {TERMS[term]}")
    assert not found, "\n".join(found)


def test_units_on_axes_have_one_form():
    """Labels of studies and of the gallery take them by `jamlab.plotting.in_unit`, maps and charts as `unit`."""
    by_hand = rf"""\S[ ]+\[\$?\\?{UNIT}[^\]\n"]*\]["']|\w, \$?{UNIT}[\w/·²⁴₁ ]{{0,4}}\$?["']"""
    label = re.compile(r"label|^(?:x|y|error|title) = |set_title|title=")
    lines = [
        f"{name}:{number}: {line.strip()}"
        for name, text in prose()
        if name.startswith(("studies/", "docs/gallery_scripts/")) and name.endswith((".py", ".toml"))
        for number, line in enumerate(text.splitlines(), 1)
        if label.search(line) and re.search(by_hand, line)
    ]
    assert not lines, "\n".join(lines)
