"""Builds the wheel, the package with the shared library inside, and the source distribution. Nothing in a wheel depends
on the version of Python, so one serves all; its name says for which systems it is, by the library (library_tag.py).
Called by pip as a build backend (PEP 517), or as a program:

    python3 htvm_wheel.py LIBRARY FOLDER     the wheel. LIBRARY: libhtvm.so or htvm.dll, as CMake's target htvm_python
                                             makes it; for pip, HTVM_LIBRARY names it, or CMake is run
    python3 htvm_wheel.py --source FOLDER    the source distribution

HTVM_LIVE_LIBRARY names libhtvm_c_live.so, for live streams; without it the package asks for it only where it is used.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import io
import os
import re
import shlex
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from pathlib import Path
from typing import Any, Dict, List, Optional

sys.path.insert(0, str(Path(__file__).resolve().parent))
from library_tag import library_name, platform_tag  # noqa: E402

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
             *(f"Classifier: {told}" for told in classifiers()),
             f"Requires-Python: {told['requires-python']}", *(f"Requires-Dist: {need}" for need in requires),
             "Description-Content-Type: text/markdown", ""]
    return "\n".join(lines) + "\n" + (project / "docs/python.md").read_text()


def classifiers() -> List[str]:
    text = (here / "pyproject.toml").read_text().split("classifiers = [")[1].split("]")[0]
    return re.findall(r'"(.*)"', text)


def write_wheel(library: Path, folder: Path) -> str:
    """Returns the wheel's name."""
    code = library.read_bytes()
    platform = platform_tag(code)
    tag = "py3-none-" + platform
    name = f"htvm-{version()}-{tag}.whl"
    info = f"htvm-{version()}.dist-info"
    files: Dict[str, bytes] = {f"htvm/{path.name}": path.read_bytes()
                               for path in sorted((here / "htvm").iterdir()) if path.suffix in (".py", ".typed")}
    files[f"htvm/{library_name(platform)}"] = code
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
            entry.external_attr = (0o755 if path.endswith((".so", ".dll")) else 0o644) << 16
            wheel.writestr(entry, data, zipfile.ZIP_DEFLATED)
    return name


def _digest(data: bytes) -> str:
    return base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()


# What the library and the package are built from.
source_folders = ["cmake", "include", "python", *(f"src/{floor}" for floor in ("core", "entropy", "codec", "surface", "c_api", "io"))]
source_files = ["CMakeLists.txt", "LICENSE", "README.md", "docs/python.md"]
source_endings = {".cpp", ".h", ".hpp", ".cmake", ".in", ".map", ".py", ".typed", ".txt", ".md", ".toml", ""}


def source_distribution() -> Dict[str, bytes]:
    """Its files by name. Its root is the project's, with pyproject.toml where pip looks for it."""
    paths = [project / name for name in source_files]
    for folder in source_folders:
        paths += [path for path in (project / folder).rglob("*")
                  if path.is_file() and path.suffix in source_endings and "__pycache__" not in path.parts]
    files = {path.relative_to(project).as_posix(): path.read_bytes() for path in paths}
    here_is_root = files["python/pyproject.toml"].replace(b'backend-path = ["."]', b'backend-path = ["python"]')
    files["pyproject.toml"] = here_is_root
    files["PKG-INFO"] = metadata().encode()
    return files


def write_source(folder: Path) -> str:
    """Returns the archive's name. The same files give the same bytes."""
    stem = f"htvm-{version()}"
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w", format=tarfile.PAX_FORMAT) as archive:
        for name, data in sorted(source_distribution().items()):
            entry = tarfile.TarInfo(f"{stem}/{name}")
            entry.size, entry.mode = len(data), 0o644
            archive.addfile(entry, io.BytesIO(data))
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{stem}.tar.gz").write_bytes(gzip.compress(packed.getvalue(), mtime=0))
    return f"{stem}.tar.gz"


def build_library(folder: Path) -> Path:
    """By CMake, with the arguments in CMAKE_ARGS."""
    options = {"CMAKE_BUILD_TYPE": "Release", "HTVM_BUILD_PYTHON": "ON", "HTVM_BUILD_TOOLS": "OFF", "HTVM_BUILD_TESTS": "OFF",
               "HTVM_BUILD_BENCHMARKS": "OFF", "HTVM_INSTALL": "OFF"}
    subprocess.run(["cmake", "-S", str(project), "-B", str(folder), *(f"-D{name}={value}" for name, value in options.items()),
                    *shlex.split(os.environ.get("CMAKE_ARGS", ""))], check=True)
    subprocess.run(["cmake", "--build", str(folder), "--target", "htvm_python", "--parallel"], check=True)
    return next(path for name in ("libhtvm.so", "htvm.dll", "libhtvm.dll") for path in (folder / "python").glob(name))


def build_wheel(wheel_directory: str, config_settings: Any = None, metadata_directory: Optional[str] = None) -> str:
    library = os.environ.get("HTVM_LIBRARY")
    if library:
        return write_wheel(Path(library), Path(wheel_directory))
    with tempfile.TemporaryDirectory() as folder:
        return write_wheel(build_library(Path(folder)), Path(wheel_directory))


def build_sdist(sdist_directory: str, config_settings: Any = None) -> str:
    return write_source(Path(sdist_directory))


if __name__ == "__main__":
    if len(sys.argv) != 3:
        raise SystemExit("usage: htvm_wheel.py LIBRARY FOLDER, or htvm_wheel.py --source FOLDER")
    made = write_source(Path(sys.argv[2])) if sys.argv[1] == "--source" else write_wheel(Path(sys.argv[1]), Path(sys.argv[2]))
    print(made)
