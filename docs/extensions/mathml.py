"""Equations as MathML: what docutils translates, corrected where browsers would draw something else.

A subscript of a letter with an accent stands beside the letter, not below it; a star in a superscript is one of
mathematics; a slash and what stands in a script have no spaces; brackets grow only after `left`.
"""

import re
from html import unescape
from xml.etree import ElementTree

from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml

SPACE = "{http://www.w3.org/1998/Math/MathML}"
STAR = "∗"
FENCES = set("⟨⟩⌊⌋⌈⌉‖")  # which docutils stretches as after a `left`
CLOSE = {"lspace": "0", "rspace": "0"}  # no spaces around an operator
_NAMED = re.compile(r"&(?!amp;|lt;|gt;|#)\w+;")  # characters that HTML names and XML does not
SCRIPTS = {f"{SPACE}{name}" for name in ("msub", "msup", "msubsup")}
ElementTree.register_namespace("", SPACE[1:-1])


def mathml(tex: str, as_block: bool = False) -> str:
    """Translate an equation.

    Raises:
        MathError: it cannot be translated, or something stands above and below a letter.
    """
    try:
        text = tex2mathml(tex, as_block=as_block)
    except IndexError as error:
        raise MathError("a script without its letter") from error
    math = ElementTree.fromstring(_NAMED.sub(lambda found: unescape(found[0]), text))
    for element in list(math.iter()):
        if element.tag == f"{SPACE}mo" and element.text == "/":
            element.attrib |= CLOSE
        if element.text in FENCES and r"\left" not in tex:
            element.set("stretchy", "false")
        if element.tag == f"{SPACE}munderover":
            _mend_accent(element)
        if element.tag in SCRIPTS:
            for script in element[1:]:
                _mend_script(script)
            if element[0].tag == f"{SPACE}munderover":
                _mend_accent(element[0])
                if (
                    element.tag == f"{SPACE}msup" and element[0].tag == f"{SPACE}msub"
                ):  # x_i^2 of an accented letter: both beside it
                    element.tag, element[:1] = f"{SPACE}msubsup", list(element[0])
    return ElementTree.tostring(math, encoding="unicode")


def _mend_script(script: ElementTree.Element) -> None:
    """No spaces within subscripts and superscripts, and a star as in print."""
    for element in script.iter(f"{SPACE}mo"):
        element.text, element.attrib = STAR if element.text == "*" else element.text, element.attrib | CLOSE


def _mend_accent(element: ElementTree.Element) -> None:
    """Put the subscript of a letter beside it where only an accent stands above."""
    letter, below, above = element
    if letter.tag != f"{SPACE}mi":
        return
    if above.get("stretchy") != "false" and above.get("accent") != "true":
        raise MathError(f"something above and below the letter {letter.text}: write a subscript of {{...}}")
    accented = ElementTree.Element(f"{SPACE}mover")
    accented.extend([letter, above])
    element.tag, element[:] = f"{SPACE}msub", [accented, below]
