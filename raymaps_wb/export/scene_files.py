# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files that a study speaks of: what they are called in the scene, and their copies beside it."""

import hashlib
import os
import shutil

from raymaps_wb.errors import ExportError
from raymaps_wb.objects.files import absolute_path

BLOCK = 1 << 20


class FileName(str):
    """A file in a scene: its name in the folder of copies; the writer puts the folder before it."""

    __slots__ = ()


class MapName(str):
    """A Ray Map in a scene; the writer puts its place relative to the scene instead."""

    __slots__ = ()


class SceneFiles:
    """All files that a scene speaks of, each once.

    Attributes
    ----------
    files : dict of FileName to absolute path
    maps : dict of MapName to absolute path of the folder
    """

    def __init__(self):
        self.files: dict[FileName, str] = {}
        self.maps: dict[MapName, str] = {}

    def add(self, document, path, where, what):
        """The name of a file in the scene.

        Raises
        ------
        ExportError
            If there is no such file, or none was chosen.
        """
        path = existing_file(document, path, where, what)
        for name, known in self.files.items():
            if known == path:
                return name
        stem, ending = os.path.splitext(os.path.basename(path))
        stem = "".join(c if c.isalnum() or c in "-_." else "_" for c in stem)[:80] or "file"
        taken = {name.lower() for name in self.files}
        name, n = FileName(stem + ending), 1
        while name.lower() in taken:
            n += 1
            name = FileName(f"{stem}_{n}{ending}")
        self.files[name] = path
        return name

    def add_map(self, document, path, where):
        """The name of a Ray Map in the scene; raises `ExportError` if there is none."""
        if not path:
            raise ExportError(f"{where}: it starts from a Ray Map and has none; choose its folder.")
        path = absolute_path(document, path)
        if not os.path.isfile(os.path.join(path, "manifest.json")):
            raise ExportError(f"{where}: '{path}' is not a Ray Map, or is not there any more; choose its folder again.")
        name = MapName(os.path.basename(os.path.normpath(path)))
        while self.maps.get(name, path) != path:
            name = MapName(name + "_")
        self.maps[name] = path
        return name

    def digests(self, known=None):
        """SHA-256 of each file by name, in hexadecimal; ``known`` keeps those of files that did not change."""
        known = {} if known is None else known
        found = {str(name): _digest(path, known) for name, path in self.files.items()}
        for name, path in self.maps.items():
            found[str(name)] = _digest(os.path.join(path, "manifest.json"), known)
        return found

    def copy(self, folder, stem):
        """Copy the files into ``STEM.files`` of a folder; one that is there and is the same stays."""
        if not self.files:
            return
        target = os.path.join(folder, stem + ".files")
        os.makedirs(target, exist_ok=True)
        for name, path in self.files.items():
            copied = os.path.join(target, name)
            if _is_same(path, copied):
                continue
            shutil.copy2(path, copied + ".part")
            os.replace(copied + ".part", copied)

    def placed(self, data, folder, stem):
        """Scene data in which files and maps are named as they are to be found from a folder."""
        if isinstance(data, FileName):
            return f"{stem}.files/{data}"
        if isinstance(data, MapName):
            return _relative(self.maps[data], folder)
        if isinstance(data, dict):
            return {key: self.placed(value, folder, stem) for key, value in data.items()}
        if isinstance(data, list):
            return [self.placed(value, folder, stem) for value in data]
        return data


def existing_file(document, path, where, what):
    """Absolute path of a file of a document; raises `ExportError` if it is not there, or none was chosen."""
    if not path:
        raise ExportError(f"{where}: it needs a file ({what}); choose one.")
    path = absolute_path(document, path)
    if not os.path.isfile(path):
        raise ExportError(f"{where}: the file '{path}' ({what}) is not there; put it back, or choose another.")
    return path


def _relative(path, folder):
    try:
        return os.path.relpath(path, folder).replace(os.sep, "/")
    except ValueError:  # on another drive
        return path.replace(os.sep, "/")


def _is_same(path, copied):
    if not os.path.isfile(copied):
        return False
    if os.path.samefile(path, copied):
        return True
    a, b = os.stat(path), os.stat(copied)
    return (a.st_size, a.st_mtime_ns) == (b.st_size, b.st_mtime_ns)


def _digest(path, known):
    try:
        status = os.stat(path)
        state = (status.st_size, status.st_mtime_ns)
        if known.get(path, ((), ""))[0] != state:
            digest = hashlib.sha256()
            with open(path, "rb") as file:
                while block := file.read(BLOCK):
                    digest.update(block)
            known[path] = (state, digest.hexdigest())
    except OSError as error:
        raise ExportError(f"File '{path}' can't be read: {error.strerror or error}.") from error
    return known[path][1]
