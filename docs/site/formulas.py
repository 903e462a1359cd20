"""Formulas as MathML, which browsers draw by themselves: no script, nothing fetched."""

from __future__ import annotations

from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.util import logging

logger = logging.getLogger(__name__)


def write(writer: Any, node: nodes.Node, display: str) -> None:
    try:
        writer.body.append(convert(node.astext(), display=display))
    except Exception as error:  # of many kinds, one a mistake in the formula
        logger.warning("formula %r: %r", node.astext(), error, location=node)
    raise nodes.SkipNode


def visit_inline(writer: Any, node: nodes.math) -> None:
    write(writer, node, "inline")


def visit_block(writer: Any, node: nodes.math_block) -> None:
    write(writer, node, "block")


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_node(nodes.math, override=True, html=(visit_inline, None))
    app.add_node(nodes.math_block, override=True, html=(visit_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
