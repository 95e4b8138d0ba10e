"""Where the suite keeps what it writes when nobody names a folder."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

NAME = "compass_ros"


def data_home() -> Path:
    """An absolute folder that does not depend on the working directory; it need not exist.

    $ROS_HOME/compass_ros where that is set, else $XDG_DATA_HOME/compass_ros, else ~/.local/share/compass_ros (XDG Base
    Directory Specification). Without HOME the home is that of the user database; for a user whom that does not know
    either, as in some containers, it is the folder for temporary files.
    """
    for variable in ("ROS_HOME", "XDG_DATA_HOME"):
        given = Path(os.environ.get(variable, ""))
        if given.is_absolute():
            return given / NAME
    try:
        return Path(os.environ.get("HOME") or _home_of_user(), ".local", "share", NAME).absolute()
    except KeyError:
        return Path(tempfile.gettempdir(), f"{NAME}-{os.getuid()}")


def _home_of_user() -> str:
    import pwd  # not on every system

    return pwd.getpwuid(os.getuid()).pw_dir


def placed(given: str, default: Path) -> Path:
    """A folder that a person named, absolute; `default` where the name is empty."""
    return Path(given).expanduser().absolute() if given else default
