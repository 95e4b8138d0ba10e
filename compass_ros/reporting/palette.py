"""One set of colours for the report, its figures and the figures of the documentation.

Models differ in lightness, hue and line, so that they stay apart in print and for colour-blind readers.
"""

from __future__ import annotations

from collections.abc import Mapping

LIGHT: Mapping[str, str] = {
    "page": "#f7f7f5",
    "surface": "#ffffff",
    "sunken": "#f1f1ee",
    "ink": "#1a1d21",
    "soft": "#5b636e",
    "faint": "#717a85",
    "line": "#e2e2dd",
    "grid": "#ecece8",
    "real": "#1a1d21",
    "nominal": "#b9702a",
    "calibrated": "#2b66cf",
    "with_effects": "#0b8a70",
    "heat": "#2b4f9e",
    "good": "#17734a",
    "note": "#4a5563",
    "care": "#945a00",
    "bad": "#b3302a",
}

DARK: Mapping[str, str] = {
    "page": "#101214",
    "surface": "#17191d",
    "sunken": "#1e2126",
    "ink": "#e9eaec",
    "soft": "#a7aeb8",
    "faint": "#8b939e",
    "line": "#2c3037",
    "grid": "#24282e",
    "real": "#f2f3f4",
    "nominal": "#dd9a55",
    "calibrated": "#7ea9f7",
    "with_effects": "#3ac9a8",
    "heat": "#7ea9f7",
    "good": "#4fc28b",
    "note": "#a7aeb8",
    "care": "#e0a63f",
    "bad": "#f27d72",
}


def css_variables(palette: Mapping[str, str]) -> str:
    """`--ink: #1a1d21; ...` for a rule of a style sheet."""
    return " ".join(f"--{name.replace('_', '-')}: {value};" for name, value in palette.items())
