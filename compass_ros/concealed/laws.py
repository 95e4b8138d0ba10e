"""All laws by name: those whose effect the library knows, and those from outside it."""

from __future__ import annotations

from types import MappingProxyType

from compass_ros.concealed import camera, command, contacts, drag, fields, friction, outsiders
from compass_ros.errors import ConfigError, nearest

KNOWN = MappingProxyType(
    {law.name: law for part in (fields, drag, friction, contacts, command, camera) for law in part.LAWS}
)
OUTSIDE = MappingProxyType({law.name: law for law in outsiders.LAWS})
LAWS = MappingProxyType({**KNOWN, **OUTSIDE})


def known(name: str) -> str:
    """The name itself. Raises ConfigError with the nearest one where there is no such law."""
    if name not in LAWS:
        raise ConfigError(f"unknown effect '{name}'; a world may hold: {', '.join(LAWS)}{nearest(name, LAWS)}")
    return name
