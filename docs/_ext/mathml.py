"""Formulas as MathML: written into the page when it is built, shown by the browser without any script.

latex2mathml does the conversion. This module adds what it leaves out: the thin spaces around names of functions, the
sides of bars, minus signs that stand before one operand, and upright words.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.errors import ExtensionError

if TYPE_CHECKING:
    from sphinx.application import Sphinx
    from sphinx.writers.html5 import HTML5Translator

THIN = "0.1667em"
# A bar is the same character on both sides; letters of a private range keep the side through the conversion.
FENCES = {
    "\\lvert": ("\ue000", "|", "prefix"),
    "\\rvert": ("\ue001", "|", "postfix"),
    "\\lVert": ("\ue002", "‖", "prefix"),
    "\\rVert": ("\ue003", "‖", "postfix"),
    "\\lbrace": ("\ue004", "{", "prefix"),
    "\\rbrace": ("\ue005", "}", "postfix"),
}
CLOSING = frozenset(")]}")
SIGNS = frozenset("−+±∓")


def mathml(latex: str, display: str) -> str:
    """Return a formula as one ``<math>`` element; a formula that cannot be converted stops the build."""
    latex = re.sub(r"\\\s", r"\\ ", latex)  # a space, at the end of a line too
    try:
        for command, (letter, _, _) in FENCES.items():
            latex = latex.replace(command, letter)
        root = ET.fromstring(convert(latex, display=display))  # noqa: S314  what was converted here
    except Exception as error:
        raise ExtensionError(
            f"no MathML for the formula {latex!r}: {error!r}"
        ) from error
    for element in root.iter():
        element.tag = element.tag.rpartition("}")[2]
    correct(root)
    return ET.tostring(root, encoding="unicode")


def correct(parent: ET.Element) -> None:
    """Correct the children of an element, and theirs."""
    for child in parent:
        set_kind(child)
        correct(child)
    for child in parent:
        set_sides(child)
    if parent.tag in ("math", "mrow", "mtd", "msqrt", "mstyle"):
        set_signs(parent)
        space_functions(parent)
    if parent.tag == "mover":
        parent.set("accent", "true")


def set_kind(element: ET.Element) -> None:
    """Make one upright word of upright letters, a name of a function's name and an operator of a sign."""
    if (
        element.tag == "mrow"
        and len(element) > 1
        and all(c.get("mathvariant") == "normal" for c in element)
    ):
        word = "".join(c.text or "" for c in element)
        element.clear()
        element.tag, element.text = "mi", word
    elif element.get("mathvariant") is not None:
        element.set("mathvariant", "normal")
    elif element.tag == "mo" and is_function(element):
        element.tag = "mi"
        element.attrib.clear()
    elif element.tag == "mi" and element.text in (*SIGNS, *";:′"):
        element.tag = "mo"
    elif (
        element.tag == "mi"
        and element.text
        and len(element.text) == 1
        and "Α" <= element.text <= "Ω"
    ):
        element.set("mathvariant", "normal")  # capital Greek is upright, as TeX has it


def set_sides(element: ET.Element) -> None:
    """State on which side of its content a bar or brace stands."""
    for letter, sign, form in FENCES.values():
        if element.text == letter:
            element.tag, element.text = "mo", sign
            element.attrib.update(
                form=form, fence="true", stretchy="false", lspace="0", rspace="0"
            )


def set_signs(row: ET.Element) -> None:
    """Make a sign a prefix where no operand stands before it, and close the space around a slash."""
    operand = False
    for element in row:
        if element.tag == "mo" and element.text in SIGNS and not operand:
            element.set("form", "prefix")
        if element.tag == "mo" and element.text == "/":
            element.attrib.update(lspace="0", rspace="0")
        if element.tag != "mspace" and (
            element.text is None or not element.text.isspace()
        ):
            operand = ends_operand(element)


def ends_operand(element: ET.Element) -> bool:
    """Return whether an element can be the end of an operand."""
    if element.tag != "mo":
        return element.tag != "mtext"
    return element.text in CLOSING or element.get("form") == "postfix"


def is_function(element: ET.Element) -> bool:
    """Return whether an element is the name of a function, with its exponent or index."""
    if element.tag in ("msub", "msup", "msubsup", "munder"):
        return is_function(element[0])
    return (
        element.tag in ("mi", "mo")
        and len(element.text or "") > 1
        and (element.text or "").isalpha()
    )


def space_functions(row: ET.Element) -> None:
    """Set thin spaces around names of functions, as TeX does: not beside brackets and operators."""
    children = list(row)
    for k in reversed(range(len(children))):
        if not is_function(children[k]):
            continue
        if k + 1 < len(children):
            after = children[k + 1]
            if after.tag not in ("mspace", "mtext") and (
                after.tag != "mo" or after.get("form") == "prefix"
            ):
                row.insert(k + 1, ET.Element("mspace", width=THIN))
        if (
            k
            and children[k - 1].tag not in ("mspace", "mtext")
            and not is_function(children[k - 1])
        ):
            before = children[k - 1]
            if ends_operand(before):
                row.insert(k, ET.Element("mspace", width=THIN))


def visit_inline(translator: HTML5Translator, node: nodes.math) -> None:
    """Write a formula within a line."""
    translator.body.append(
        f'<span class="math">{mathml(node.astext(), "inline")}</span>'
    )
    raise nodes.SkipNode


def visit_block(translator: HTML5Translator, node: nodes.math_block) -> None:
    """Write a formula that stands alone."""
    translator.body.append(
        f'<div class="math">{mathml(node.astext(), "block")}</div>\n'
    )
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, Any]:
    """Make ``html_math_renderer = "mathml"`` known."""
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_block, None))
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
