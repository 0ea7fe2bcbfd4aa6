#!/usr/bin/env python3
"""Packs the Unity package as Unity's package manager takes it ("Add package from tarball"), com.htvm.player-VERSION.tgz:

    unity.py FOLDER [LIBRARY...]

It is unity/, the C# files, and the C library for the systems whose libraries are given, each put where its own header
says: libhtvm_c.so of Linux (x86-64, 64-bit ARM), of Android (64-bit ARM), htvm_c.dll of Windows, libhtvm_c.dylib of
macOS. Each file gets the .meta that Unity asks of packages; its GUID follows from its path, so that projects' references
stay. The same files give the same bytes.
"""

from __future__ import annotations

import gzip
import hashlib
import io
import json
import re
import struct
import sys
import tarfile
from pathlib import Path
from typing import Dict, List

project = Path(__file__).resolve().parent.parent


def version() -> str:
    header = (project / "include/htvm/htvm.h").read_text()
    return ".".join(re.findall(r"#define HTVM_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)", header))


def place_of(library: Path) -> str:
    """Where the library goes in the package, by what its bytes say it is for."""
    data = library.read_bytes()
    if data[:4] == b"\x7fELF":
        machine, = struct.unpack_from("<H", data, 18)
        android = b"\0liblog.so\0" in data or b"Android" in data
        folder = {(62, False): "Linux/x86_64", (183, False): "Linux/arm64", (183, True): "Android/arm64-v8a"}.get((machine, android))
        if folder:
            return f"Plugins/{folder}/libhtvm_c.so"
    if data[:2] == b"MZ":
        header, = struct.unpack_from("<I", data, 0x3C)
        if struct.unpack_from("<H", data, header + 4)[0] == 0x8664:
            return "Plugins/Windows/x86_64/htvm_c.dll"
    if data[:4] in (b"\xcf\xfa\xed\xfe", b"\xca\xfe\xba\xbe"):
        return "Plugins/macOS/libhtvm_c.dylib"
    raise SystemExit(f"{library}: there is no place in the package for such a library")


# Which of Unity's platforms loads a library: its name there, the editor's system, the processor.
platforms = {"Plugins/Linux/x86_64": ("Linux64", "Linux", "x86_64"), "Plugins/Linux/arm64": ("", "", "ARM64"),
             "Plugins/Android/arm64-v8a": ("Android", "", "ARM64"), "Plugins/Windows/x86_64": ("Win64", "Windows", "x86_64"),
             "Plugins/macOS": ("OSXUniversal", "OSX", "AnyCPU")}


def plugin_importer(folder: str) -> str:
    player, editor, processor = platforms[folder]
    text = "PluginImporter:\n  serializedVersion: 2\n  isPreloaded: 0\n  isOverridable: 0\n  platformData:\n"
    text += "  - first:\n      Any: \n    second:\n      enabled: 0\n      settings: {}\n"
    text += f"  - first:\n      Editor: Editor\n    second:\n      enabled: {int(bool(editor))}\n      settings:\n"
    text += f"        CPU: {processor if editor else 'AnyCPU'}\n        DefaultValueInitialized: true\n        OS: {editor or 'AnyOS'}\n"
    if player:
        group = "Android" if player == "Android" else "Standalone"
        text += f"  - first:\n      {group}: {player}\n    second:\n      enabled: 1\n      settings:\n        CPU: {processor}\n"
    return text


def meta(path: str, folder: bool) -> bytes:
    guid = hashlib.md5(f"com.htvm.player/{path}".encode()).hexdigest()
    text = f"fileFormatVersion: 2\nguid: {guid}\n"
    if folder:
        text += "folderAsset: yes\nDefaultImporter:\n  externalObjects: {}\n"
    elif path.endswith(".cs"):
        text += "MonoImporter:\n  serializedVersion: 2\n  defaultReferences: []\n  executionOrder: 0\n"
    elif path.startswith("Plugins/") and path.rpartition("/")[0] in platforms:
        text += plugin_importer(path.rpartition("/")[0])
    return text.encode()


def package(libraries: List[Path]) -> Dict[str, bytes]:
    """Its files by name."""
    source = project / "unity"
    files = {path.relative_to(source).as_posix(): path.read_bytes() for path in source.rglob("*") if path.is_file()}
    told = json.loads(files["package.json"])
    told["version"] = version()
    files["package.json"] = (json.dumps(told, indent=2) + "\n").encode()
    for name in ("Htvm.cs", "FrameFile.cs"):
        files[f"Runtime/{name}"] = (project / "csharp" / name).read_bytes()
    files["LICENSE.md"] = (project / "LICENSE").read_bytes()
    files["Samples~/Player/person.htvm"] = (project / "apps/htvm/demo/person.htvm").read_bytes()
    for library in libraries:
        files[place_of(library)] = library.read_bytes()
    folders = {"/".join(path.split("/")[:depth]) for path in files for depth in range(1, path.count("/") + 1)}
    metas = {f"{path}.meta": meta(path, path in folders) for path in [*files, *folders] if "~" not in path}
    return {**files, **metas}


def pack(folder: Path, libraries: List[Path]) -> str:
    """Returns the archive's name."""
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w", format=tarfile.USTAR_FORMAT) as archive:
        for name, data in sorted(package(libraries).items()):
            entry = tarfile.TarInfo(f"package/{name}")
            entry.size, entry.mode = len(data), 0o644
            archive.addfile(entry, io.BytesIO(data))
    folder.mkdir(parents=True, exist_ok=True)
    name = f"com.htvm.player-{version()}.tgz"
    (folder / name).write_bytes(gzip.compress(packed.getvalue(), mtime=0))
    return name


if __name__ == "__main__":
    if len(sys.argv) < 2:
        raise SystemExit("usage: unity.py FOLDER [LIBRARY...]")
    print(pack(Path(sys.argv[1]), [Path(name) for name in sys.argv[2:]]))
