"""The files that a scene is made of: its XML, others that it includes or attaches, meshes, textures, skins.

MuJoCo's own `mju_getXMLDependencies` names files that do not exist where `meshdir` is set in another document, and
stops at includes that the loader finds; MjSpec keeps names, not places. So they are looked for where the loader looks.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_DOCUMENT = re.compile(r"<(?:include|model)\b[^>]*?\bfile\s*=\s*[\"'](.*?)[\"']", re.DOTALL)
_FOLDER = re.compile(r"\b(?:mesh|texture|asset)dir\s*=\s*[\"'](.*?)[\"']")
_FILE = re.compile(r"\bfile(?:name|right|left|up|down|front|back)?\s*=\s*[\"'](.*?)[\"']")


@dataclass(frozen=True)
class SceneFiles:
    """Every document of a scene, and where the files that they name may lie."""

    documents: tuple[Path, ...]
    """The scene's XML, then what it includes or attaches, each once, in order of mention."""
    folders: tuple[str, ...]
    """Folders that the documents' compiler settings name, as written."""
    names: tuple[str, ...]
    """Files that the documents name, each once, in order of mention; the documents among them."""

    def find(self, name: str, folder: str = "") -> Path | None:
        """Where a file of that name lies; `folder`: of its kind's compiler setting. None where it is nowhere.

        As MuJoCo looks: beside the scene before beside the document that names it, in the folder before outside of it;
        without the path that a URDF has in front of it at last.
        """
        roots = dict.fromkeys(document.parent for document in self.documents)
        inside = dict.fromkeys((folder, *self.folders, ""))
        places = [root / of / file for file in (name, Path(name).name) for root in roots for of in inside]
        return next((place for place in places if place.is_file()), None)

    @property
    def further(self) -> tuple[Path, ...]:
        """All files but the scene's XML that exist, each once."""
        found = [self.find(name) for name in self.names]
        return tuple(dict.fromkeys([*self.documents[1:], *(f for f in found if f and f not in self.documents)]))


def scene_files(scene: Path) -> SceneFiles:
    """What a scene's documents name. A document that cannot be read is left for MuJoCo to complain about."""
    documents: list[Path] = []
    texts: list[str] = []
    waiting = [scene]
    while waiting:
        document = waiting.pop(0)
        if document in documents or not document.is_file():
            continue
        documents.append(document)
        texts.append(_COMMENT.sub("", document.read_text(encoding="utf-8", errors="replace")))
        for name in _DOCUMENT.findall(texts[-1]):
            near = [folder / name for folder in (document.parent, scene.parent)]
            waiting += [next((place for place in near if place.is_file()), near[0])]
    folders, names = ([n for text in texts for n in of.findall(text)] for of in (_FOLDER, _FILE))
    return SceneFiles(tuple(documents), tuple(dict.fromkeys(folders)), tuple(dict.fromkeys(names)))
