"""What every interactive page has around its content: templates, style sheet with filters, script, and policy."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from taskslam.report import palette, words
from taskslam.report.markers import Style, marker_icon

_STYLES = ("style.css", "interactive.css", "print.css")
_SCRIPTS = ("units.js", "page.js")


@dataclass(frozen=True)
class Entry:
    """A method in the filter."""

    label: str
    style: Style

    @property
    def icon(self) -> Markup:
        """Its marker."""
        return marker_icon(self.style, self.label)


def render(
    template: str,
    legend: Sequence[Entry],
    modes: Iterable[str],
    parts: Sequence[tuple[str, str]],
    served_by: str = "",
    more: Sequence[str] = (),
    **content: Any,
) -> str:
    """The page that a template gives. legend, modes: what its filter offers; parts: anchors and names of its links.

    served_by: name of the style sheet and the script of a page that talks with the program that serves it. more: files
    that this page's script and style need beside those of every page.
    """
    own = (f"{served_by}.css", f"{served_by}.js") if served_by else _SCRIPTS
    files = [*own, *more]
    style = _style(legend, modes) + "".join(_own(name) for name in files if name.endswith(".css"))
    script = "\n".join(_own(name) for name in files if name.endswith(".js"))
    environment = Environment(
        loader=PackageLoader("taskslam.report.page"), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    return environment.get_template(template).render(
        legend=legend,
        modes=modes,
        parts=parts,
        words=words,
        palette=palette,
        style=Markup(style),  # noqa: S704 our own file, no input in it
        script=Markup(script),  # noqa: S704 our own file, no input in it
        policy=_policy(style, script) + ("; connect-src 'self'" if served_by else ""),
        **content,
    )


def json_in_script(content: Mapping[str, Any]) -> Markup:
    """JSON that is safe inside a script element: it holds no `<`, and ASCII alone."""
    text = json.dumps(content, allow_nan=False, separators=(",", ":"))
    return Markup(text.replace("<", "\\u003c"))  # noqa: S704 JSON in which no tag can begin or end


def _own(name: str) -> str:
    return resources.files("taskslam.report.page").joinpath("templates", name).read_text(encoding="utf-8")


def _style(legend: Sequence[Entry], modes: Iterable[str]) -> str:
    """The style sheet, with a rule for each box of the filter: what it stands for is hidden while it is not checked."""
    boxes = [("method", entry.style.key) for entry in legend] + [("mode", mode) for mode in modes]
    rules = [
        f':root:has(#show-{value}:not(:checked)) [data-{kind}="{value}"] {{ display: none !important; }}'
        for kind, value in boxes
    ]
    return "\n".join([palette.style_sheet(), *(_own(name) for name in _STYLES), *rules])


def _policy(style: str, script: str) -> str:
    """What the browser may do for this page: run its own script, apply its own style, draw its own pictures."""
    own_style, own_script = (
        "'sha256-" + base64.b64encode(hashlib.sha256(text.encode("utf-8")).digest()).decode("ascii") + "'"
        for text in (style, script)
    )
    return (
        f"default-src 'none'; script-src {own_script}; style-src-elem {own_style}; style-src-attr 'unsafe-inline'; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    )
