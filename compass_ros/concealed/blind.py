"""`python -m compass_ros.concealed.blind FOLDER ARGUMENT...`: the command `compass`, unable to open anything in FOLDER.

The proof calibrates through this. An audit hook of the interpreter, which cannot be taken out again, refuses to open or
list the folder and to import anything of the concealed worlds; a calibration that tried would fail and count as wrong.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

_WATCHED = {"open", "os.listdir", "os.scandir", "os.rename", "os.link", "os.symlink", "shutil.copyfile"}
_PACKAGE = "compass_ros.concealed"


def refuse(folder: Path) -> None:
    """From now on this process cannot look into the folder, and learns nothing more of how worlds are made."""
    forbidden = os.path.realpath(folder)

    def hook(event: str, arguments: tuple[object, ...]) -> None:
        if event in _WATCHED:
            for path in arguments:
                if isinstance(path, (str, bytes, os.PathLike)) and _inside(path, forbidden):
                    raise PermissionError(f"{os.fsdecode(path)}: the answers are sealed for this process")
        elif event == "import" and str(arguments[0]).startswith(_PACKAGE):
            raise PermissionError(f"{arguments[0]}: the concealed worlds are sealed for this process")

    sys.addaudithook(hook)


def _inside(path: str | bytes | os.PathLike[str], folder: str) -> bool:
    real = os.path.realpath(os.fsdecode(path))
    return real == folder or real.startswith(folder + os.sep)


def main() -> None:
    """Run the command line that follows the folder."""
    folder, *arguments = sys.argv[1:]
    sys.argv = ["compass", *arguments]
    from compass_ros.cli import main as compass

    refuse(Path(folder))
    compass()


if __name__ == "__main__":
    main()
