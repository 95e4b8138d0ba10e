"""report.html: one file that opens without a network, in any browser of the last years, on a phone too."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from compass_ros.reporting.atomic import write_text
from compass_ros.reporting.drawing import figure_data
from compass_ros.reporting.extras import ReportExtras
from compass_ros.reporting.palette import DARK, LIGHT, css_variables
from compass_ros.reporting.view.page import view
from compass_ros.types import Result

SCRIPTS = ("plot.js", "episodes.js", "calibration.js", "missing.js", "page.js")
"""In this order; together they are one function of their own, after plotly."""

POLICY = "default-src 'none'; img-src data: blob:; style-src 'unsafe-inline';"


def write_report(result: Result, path: Path, extras: ReportExtras | None = None) -> None:
    """Write the report; the file is whole or not there. Raises ConfigError when it cannot be written."""
    write_text(Path(path), render(result, extras or ReportExtras()))


def render(result: Result, extras: ReportExtras) -> str:
    """The page as text. Whatever a bag or a cell calls its things is shown and never executed.

    Three guards: the template escapes all that it prints; the figures' numbers travel as JSON without a `<`; and the
    page's own security policy lets only the two scripts run whose hashes it names, and loads nothing.
    """
    return page("report.html.j2", SCRIPTS, figure_data(result, extras), view(result, extras))


def page(template: str, scripts: tuple[str, ...], data: Any, shown: Mapping[str, Any]) -> str:
    """A template of the report's style with what it prints, and the numbers that its scripts draw."""
    environment = Environment(
        loader=PackageLoader("compass_ros.reporting"), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    plotly, script = _plotly(), _script(scripts)
    return environment.get_template(template).render(
        **shown,
        policy=f"{POLICY} script-src {content_hash(plotly)} {content_hash(script)}",
        style=Markup(style()),
        plotly=Markup(plotly),
        script=Markup(script),
        data=Markup(embedded_json(data)),
    )


def embedded_json(data: Any) -> str:
    """JSON that is safe inside a script element: no `<`, `>` or `&`, and no line separators of old JavaScript."""
    text = json.dumps(data, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def content_hash(script: str) -> str:
    """The source expression of a content security policy for an inline script."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"


def template_text(name: str) -> str:
    return resources.files("compass_ros.reporting").joinpath("templates", name).read_text(encoding="utf-8")


@cache
def _plotly() -> str:
    """Plotly's own bundle, as the wheel carries it. Contains no end of a script element."""
    return resources.files("plotly").joinpath("package_data", "plotly.min.js").read_text(encoding="utf-8").strip()


@cache
def _script(scripts: tuple[str, ...]) -> str:
    body = "\n".join(template_text(name) for name in scripts)
    return f'(() => {{\n"use strict";\n{body}\n}})();'


@cache
def style() -> str:
    light, dark = css_variables(LIGHT), css_variables(DARK)
    themes = (
        f":root {{ color-scheme: light; {light} }}\n"
        f"@media (prefers-color-scheme: dark) {{ :root:not([data-theme=light]) {{ color-scheme: dark; {dark} }} }}\n"
        f":root[data-theme=dark] {{ color-scheme: dark; {dark} }}\n"
    )
    return themes + template_text("report.css")
