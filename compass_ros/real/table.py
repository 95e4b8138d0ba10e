"""What a study hands back: sentences and tables, as Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from compass_ros.reporting.markdown import markdown_table


@dataclass(frozen=True)
class Table:
    """One table; cells are text, as they shall be read."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def markdown(self) -> str:
        return f"### {self.title}\n\n{markdown_table(self.columns, self.rows)}"


@dataclass(frozen=True)
class Study:
    """The result of one study."""

    name: str
    findings: tuple[str, ...]
    """Sentences, the main one first."""
    tables: tuple[Table, ...]

    def markdown(self) -> str:
        parts = [f"## {self.name}", "\n".join(f"- {finding}" for finding in self.findings)]
        return "\n\n".join(parts + [table.markdown() for table in self.tables]) + "\n"


def several(numbers: Sequence[float], digits: int = 1) -> str:
    """`3.8, 12.5`."""
    return ", ".join(f"{number:.{digits}f}" for number in numbers)


def with_error(value: float, std: float) -> str:
    """`0.0443 ± 0.0003`: two digits of the error decide how many of the value are shown."""
    return f"{value:.2g} ± {std:.1g}" if std <= 0 else _rounded(value, std)


def _rounded(value: float, std: float) -> str:
    exponent = int(f"{std:.1e}".rpartition("e")[2])
    digits = max(1 - exponent, 0)
    if digits <= 6:
        return f"{value:.{digits}f} ± {std:.{digits}f}"
    return f"({value * 10**6:.{digits - 6}f} ± {std * 10**6:.{digits - 6}f})e-6"
