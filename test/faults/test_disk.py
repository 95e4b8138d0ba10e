"""Disks that refuse, for real: the kernel's limit on a file, a full tmpfs, a folder without permission."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from compass_ros.episodes import read_episode, recover, write_episode
from compass_ros.episodes.recording import Recorder
from compass_ros.errors import BagError
from test.episodes.planted import PUCK1, episode, mcap_file

ROOT = Path(__file__).parents[2]
SCRIPT = [sys.executable, "-m", "test.faults.limited_disk"]
OWN_MOUNTS = ["unshare", "--user", "--map-root-user", "--mount"]


def check_failed_bag(said: list[str], bag: Path) -> None:
    """All that was taken is kept, the bag does not claim to be whole, and one command makes it so."""
    taken = int(said[0])
    assert taken > 50
    assert said[1] == "failed"
    assert said[2].endswith(f"run: compass record --recover {bag}")
    assert said[3].startswith("no episode is being recorded (episode shot failed:")
    assert not (bag / "metadata.yaml").exists()
    with pytest.raises(BagError, match="truncated"):
        read_episode(bag, PUCK1)
    assert recover(bag).messages == taken + 2
    assert read_episode(bag, PUCK1).tracks[0].value[:, 0].tolist() == list(range(taken))


@pytest.mark.parametrize("limit", [60_000, 60_111, 60_222, 60_333])
def test_a_file_that_must_not_grow(tmp_path: Path, limit: int) -> None:
    done = subprocess.run([*SCRIPT, str(tmp_path), str(limit)], cwd=ROOT, capture_output=True, text=True, check=True)
    said = done.stdout.splitlines()
    assert "File too large" in said[2]
    check_failed_bag(said, tmp_path / "shot")


def own_mounts() -> bool:
    if shutil.which("unshare") is None:
        return False
    return (
        subprocess.run(
            [*OWN_MOUNTS, "mount", "-t", "tmpfs", "none", "/tmp"], check=False, capture_output=True
        ).returncode
        == 0
    )


@pytest.mark.skipif(not own_mounts(), reason="needs user namespaces to mount a small disk")
def test_a_full_disk(tmp_path: Path) -> None:
    """A tmpfs of 100 kB; what is on it is copied out before it goes."""
    disk, out = tmp_path / "disk", tmp_path / "out"
    disk.mkdir()
    line = f'mount -t tmpfs -o size=100k none "{disk}" && {" ".join(SCRIPT)} "{disk}" && cp -r "{disk}" "{out}"'
    done = subprocess.run([*OWN_MOUNTS, "sh", "-c", line], cwd=ROOT, capture_output=True, text=True, check=True)
    said = [text.replace(str(disk), str(out)) for text in done.stdout.splitlines()]
    assert "No space left on device" in said[2]
    check_failed_bag(said, out / "shot")


@pytest.mark.skipif(not own_mounts(), reason="needs user namespaces to mount a small disk")
def test_recovery_on_a_full_disk_loses_nothing(tmp_path: Path) -> None:
    bag = write_episode(episode(), tmp_path)
    (bag / "metadata.yaml").unlink()
    file = mcap_file(bag)
    os.truncate(file, file.stat().st_size - 100)
    disk, out = tmp_path / "disk", tmp_path / "out"
    disk.mkdir()
    code = f"from compass_ros.episodes import recover; recover({str(disk / 'shot')!r})"
    line = (
        f'mount -t tmpfs -o size=200k none "{disk}" && cp -r "{bag}" "{disk}" && '
        f'! {sys.executable} -c "{code}" && cp -r "{disk}/shot" "{out}"'
    )
    done = subprocess.run([*OWN_MOUNTS, "sh", "-c", line], cwd=ROOT, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "No space left on device" in done.stderr
    before = {file.name: file.read_bytes() for file in bag.iterdir()}
    assert {file.name: file.read_bytes() for file in out.iterdir()} == before


@pytest.mark.parametrize("place", ["/proc/recordings", "/dev/null/recordings"])
def test_a_folder_that_cannot_be_made(place: str) -> None:
    with pytest.raises(BagError, match=f"{place}: cannot be written"):
        Recorder(Path(place))


AS_A_USER = ["setpriv", "--bounding-set=-dac_override"] if os.geteuid() == 0 else []
"""Root may write everywhere; without this capability it is held to permissions as users are."""


@pytest.mark.skipif(
    bool(AS_A_USER) and shutil.which("setpriv") is None, reason="root without setpriv may write anywhere"
)
def test_a_folder_without_permission(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    words = [*AS_A_USER, *SCRIPT, str(tmp_path)]
    done = subprocess.run(words, cwd=ROOT, check=False, capture_output=True, text=True)
    assert f"BagError: {tmp_path}: cannot be written: Permission denied" in done.stderr


def test_a_folder_that_goes_away(tmp_path: Path) -> None:
    folder = tmp_path / "bags"
    recorder = Recorder(folder)
    shutil.rmtree(folder)
    with pytest.raises(BagError, match="bags: No such file or directory"):
        recorder.start("", "", "", {}, 1)
