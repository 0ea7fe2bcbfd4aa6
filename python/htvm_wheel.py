"""Builds the wheel: the package with the shared library inside. Nothing in it depends on the version of Python, so one
serves all. Called by pip as a build backend (PEP 517), or as a program:

    python3 htvm_wheel.py LIBRARY FOLDER

LIBRARY: libhtvm.so, as CMake's target htvm_python makes it; for pip, HTVM_LIBRARY names it. HTVM_LIVE_LIBRARY names
libhtvm_c_live.so, for live streams; without it the package asks for it only where it is used
"""

from __future__ import annotations

import base64
import hashlib
import os
import re
import sys
import sysconfig
import zipfile
from pathlib import Path
from typing import Any, Dict, Optional

here = Path(__file__).resolve().parent
project = here.parent


def version() -> str:
    header = (project / "include/htvm/htvm.h").read_text()
    return ".".join(re.findall(r"#define HTVM_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)", header))


def settings(section: str) -> Dict[str, str]:
    """The plain texts of a section of pyproject.toml, which Python reads by itself only from 3.11 on."""
    text = (here / "pyproject.toml").read_text().split(f"[{section}]")[1].split("\n[")[0]
    return dict(re.findall(r'^([\w-]+) = "(.*)"$', text, re.M))


def metadata() -> str:
    told = settings("project")
    requires = re.findall(r'^dependencies = \["(.*)"\]$', (here / "pyproject.toml").read_text(), re.M)
    lines = ["Metadata-Version: 2.1", f"Name: {told['name']}", f"Version: {version()}",
             f"Summary: {told['description']}", "License: Apache-2.0",
             f"Requires-Python: {told['requires-python']}", *(f"Requires-Dist: {need}" for need in requires),
             "Description-Content-Type: text/markdown", ""]
    return "\n".join(lines) + "\n" + (project / "docs/python.md").read_text()


def write_wheel(library: Path, folder: Path) -> str:
    """Returns the wheel's name."""
    tag = "py3-none-" + re.sub(r"[-.]", "_", sysconfig.get_platform())
    name = f"htvm-{version()}-{tag}.whl"
    info = f"htvm-{version()}.dist-info"
    files: Dict[str, bytes] = {f"htvm/{path.name}": path.read_bytes()
                               for path in sorted((here / "htvm").iterdir()) if path.suffix in (".py", ".typed")}
    files["htvm/libhtvm.so"] = library.read_bytes()
    if "HTVM_LIVE_LIBRARY" in os.environ:
        files["htvm/libhtvm_c_live.so"] = Path(os.environ["HTVM_LIVE_LIBRARY"]).read_bytes()
    files[f"{info}/METADATA"] = metadata().encode()
    files[f"{info}/WHEEL"] = f"Wheel-Version: 1.0\nGenerator: htvm\nRoot-Is-Purelib: false\nTag: {tag}\n".encode()
    files[f"{info}/LICENSE"] = (project / "LICENSE").read_bytes()
    record = [f"{path},sha256={_digest(data)},{len(data)}" for path, data in files.items()]
    files[f"{info}/RECORD"] = ("\n".join(record) + f"\n{info}/RECORD,,\n").encode()
    folder.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(folder / name, "w", zipfile.ZIP_DEFLATED) as wheel:
        for path, data in files.items():
            # Without the time, so that the same files give the same wheel.
            entry = zipfile.ZipInfo(path)
            entry.external_attr = (0o755 if path.endswith(".so") else 0o644) << 16
            wheel.writestr(entry, data, zipfile.ZIP_DEFLATED)
    return name


def _digest(data: bytes) -> str:
    return base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()


def build_wheel(wheel_directory: str, config_settings: Any = None, metadata_directory: Optional[str] = None) -> str:
    library = os.environ.get("HTVM_LIBRARY")
    if not library:
        raise SystemExit("Set HTVM_LIBRARY to libhtvm.so: ./dev package builds it, and the wheel")
    return write_wheel(Path(library), Path(wheel_directory))


if __name__ == "__main__":
    if len(sys.argv) != 3:
        raise SystemExit("usage: htvm_wheel.py LIBRARY FOLDER")
    print(write_wheel(Path(sys.argv[1]), Path(sys.argv[2])))
