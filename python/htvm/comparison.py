"""Errors of decoded meshes, measured by the program ``htvm``: its metrics need libraries that a wheel cannot carry."""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from typing import Any, Dict, Iterable, List, Optional, Sequence, Union

import numpy as np
from numpy.typing import NDArray

from . import errors
from .mesh import Mesh, write_mesh

Meshes = Union[str, "os.PathLike[str]", Mesh, Iterable[Mesh]]

# Exit codes of the program (docs/use.md).
_kinds = {
    1: errors.BadInput, 2: errors.BadInput, 3: errors.CorruptStream, 4: errors.Unsupported, 5: errors.LimitExceeded,
}


@dataclass(frozen=True)
class Comparison:
    """What ``htvm compare --json`` prints: errors of the whole sequence and of each frame, in nested dictionaries."""

    sequence: Dict[str, Any]
    frames: List[Dict[str, Any]]

    def values(self, name: str) -> NDArray[np.float64]:
        """A number of every frame: "m2.rms_mm", "m1.largest_mm", "cloud.d1_db", "decoded_vertices".

        A PSNR without any difference is infinite. KeyError: it was not measured.
        """
        return np.array([_value(frame, name) for frame in self.frames])

    def value(self, name: str) -> float:
        """The same of the whole sequence."""
        return _value(self.sequence, name)


def _value(measured: Any, name: str) -> float:
    for part in name.split("."):
        if part not in measured:
            raise KeyError(f"{name} was not measured; here is {', '.join(measured)}")
        measured = measured[part]
    return math.inf if measured is None else float(measured)


def find_program(program: Optional[str] = None) -> str:
    """The program htvm: as given, else HTVM_PROGRAM, else on the PATH."""
    name = program or os.environ.get("HTVM_PROGRAM") or "htvm"
    found = shutil.which(name)
    if found is None:
        raise errors.ProgramError(
            f"the program '{name}' was not found: install htvm's programs (docs/install.md), or set HTVM_PROGRAM")
    return found


def compare(
    original: Meshes,
    decoded: Meshes,
    *,
    metrics: Sequence[str] = ("m1", "m2"),
    frames: Optional[int] = None,
    unit: str = "auto",
    program: Optional[str] = None,
    arguments: Sequence[str] = (),
) -> Comparison:
    """Measures decoded meshes against their originals, by running ``htvm compare``.

    original, decoded: a mesh file, a folder or a pattern of them, for decoded also a stream; or meshes in memory
    metrics: of "m1" (vertices), "m2" (surfaces), "regions", "coverage" (of open captures), "texcoords", "d1", "d2" (point clouds), "m3" (pictures), "flicker", "topology"
    frames: at most so many
    unit: of files that are not streams; meshes in memory are in millimetres
    program: the program, if it is neither on the PATH nor in HTVM_PROGRAM
    arguments: further options of ``htvm compare``, such as ["--samples", "100000"]

    Raises ProgramError if the program is not there, and the same errors as the program's exit codes tell.
    """
    found = find_program(program)
    with tempfile.TemporaryDirectory(prefix="htvm_") as folder:
        sides = []
        for name, side, other in (("original", original, decoded), ("decoded", decoded, original)):
            if isinstance(side, (str, os.PathLike)):
                sides.append(os.fspath(side))
            else:
                sides.append(_written(os.path.join(folder, name), side, _unit_in_memory(unit, other)))
        if not all(isinstance(side, (str, os.PathLike)) for side in (original, decoded)):
            unit = "mm" if unit == "auto" else unit
        command = [found, "compare", *sides, "--json", "--only", ",".join(metrics), "--unit", unit, *arguments]
        if frames is not None:
            command += ["--frames", str(frames)]
        result = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", errors="replace")
    if result.returncode != 0:
        lines = [line for line in result.stderr.splitlines() if line.strip()] or ["it said nothing"]
        raise _kinds.get(result.returncode, errors.ProgramError)("htvm compare: " + lines[-1])
    told = json.loads(result.stdout)
    return Comparison(told["sequence"], told["frames"])


def _unit_in_memory(unit: str, other: Meshes) -> str:
    """In which unit meshes are written to be compared with `other`."""
    of_files = isinstance(other, (str, os.PathLike)) and not os.fspath(other).endswith(".htvm")
    if of_files and unit == "auto":
        raise errors.BadInput("meshes in memory are compared with files: name the files' unit, such as unit=\"mm\"")
    return "mm" if unit == "auto" else unit


def _written(folder: str, meshes: Union[Mesh, Iterable[Mesh]], unit: str) -> str:
    os.mkdir(folder)
    for number, mesh in enumerate([meshes] if isinstance(meshes, Mesh) else meshes):
        write_mesh(os.path.join(folder, f"{number:05}.ply"), mesh, unit)
    return folder
