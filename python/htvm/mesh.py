"""Meshes, and the files that hold them."""

from __future__ import annotations

import ctypes
import dataclasses
import os
from dataclasses import dataclass
from typing import Any, Optional, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _interface as c
from .errors import BadInput

Path = Union[str, "os.PathLike[str]"]


@dataclass(eq=False)
class Mesh:
    """A triangle mesh. Anything that converts to the arrays below may be given; None where there is no such attribute.

    positions: float32 (n, 3), millimetres
    triangles: uint32 (m, 3), vertex indices, counter-clockwise seen from outside
    colours: uint8 (n, 3), red, green, blue
    normals: float32 (n, 3), unit length
    texcoords: float32 (n, 2)
    """

    positions: NDArray[np.float32]
    triangles: NDArray[np.uint32]
    colours: Optional[NDArray[np.uint8]] = None
    normals: Optional[NDArray[np.float32]] = None
    texcoords: Optional[NDArray[np.float32]] = None

    def __post_init__(self) -> None:
        self.positions = _rows("positions", self.positions, np.float32, 3)
        self.triangles = _rows("triangles", self.triangles, np.uint32, 3)
        attributes = ("colours", np.uint8, 3), ("normals", np.float32, 3), ("texcoords", np.float32, 2)
        for name, type_, columns in attributes:
            given = getattr(self, name)
            if given is None:
                continue
            array = _rows(name, given, type_, columns)
            if len(array) != len(self.positions):
                raise BadInput(f"there are {len(self.positions)} positions, but {len(array)} {name}")
            setattr(self, name, array)

    def copy(self) -> "Mesh":
        """The same with arrays of its own, which may be written to."""
        arrays = {name: value.copy() for name, value in vars(self).items() if isinstance(value, np.ndarray)}
        return dataclasses.replace(self, **arrays)


def _rows(name: str, values: ArrayLike, type_: Any, columns: int) -> NDArray[Any]:
    array = np.asarray(values)
    if array.size == 0:
        return np.empty((0, columns), type_)
    if array.ndim != 2 or array.shape[1] != columns:
        raise BadInput(f"{name} must have the shape (n, {columns}), not {array.shape}")
    if np.issubdtype(type_, np.integer) and array.dtype != type_:
        # A float or a negative number would become any number.
        if not np.issubdtype(array.dtype, np.integer):
            raise BadInput(f"{name} must be whole numbers, not {array.dtype}")
        if array.min() < 0 or array.max() > np.iinfo(type_).max:
            raise BadInput(f"{name} must be from 0 to {np.iinfo(type_).max}")
    return np.ascontiguousarray(array, type_)


def as_c_mesh(mesh: Mesh) -> c.htvm_mesh:
    """For a call. Takes anything with a mesh's attributes, which may have been assigned since it was made."""
    checked = Mesh(mesh.positions, mesh.triangles, mesh.colours, mesh.normals, mesh.texcoords)
    out = c.htvm_mesh(
        ctypes.sizeof(c.htvm_mesh), len(checked.positions), len(checked.triangles), 0,
        c.pointer(checked.positions, ctypes.c_float), c.pointer(checked.triangles, ctypes.c_uint32),
        c.pointer(checked.colours, ctypes.c_uint8), c.pointer(checked.normals, ctypes.c_float),
        c.pointer(checked.texcoords, ctypes.c_float))
    out.arrays = checked  # as long as the pointers to them
    return out


def copied(numbers: Any, rows: int, columns: int, type_: Any) -> NDArray[Any]:
    """Rows that a view lends, as an array of their own."""
    if rows == 0 or not numbers:
        return np.empty((0, columns), type_)
    return np.ctypeslib.as_array(numbers, (rows, columns)).copy()


def copied_attribute(numbers: Any, rows: int, columns: int, type_: Any) -> Optional[NDArray[Any]]:
    return copied(numbers, rows, columns, type_) if numbers else None


def copied_presence(numbers: Any, rows: int) -> Optional[NDArray[np.bool_]]:
    return copied(numbers, rows, 1, np.uint8)[:, 0].astype(bool) if numbers else None


def read_mesh(path: Path, unit: str = "auto") -> Mesh:
    """Reads a mesh file (PLY, OBJ, Draco, glTF), as ``htvm encode`` does.

    unit: of the file's coordinates: "mm", "cm", "dm", "m", "in" or "ft". "auto" guesses it from the size of the mesh,
    taking it for a person (glTF is in metres); for the files of one capture it is better to name it.

    Raises BadInput, Unsupported (a format that is not read) or LimitExceeded.
    """
    text = ctypes.create_string_buffer(512)
    file = c.htvm_mesh_file()
    status = c.library.htvm_mesh_file_read(os.fsencode(path), unit.encode(), file, text, len(text))
    if status != c.HTVM_OK:
        raise c.error_of(status, text.value)
    try:
        view = c.htvm_mesh_view()
        status = c.library.htvm_mesh_file_view(file, view, ctypes.sizeof(view))
        if status != c.HTVM_OK:
            raise c.error_of(status)
        n = view.vertices
        return Mesh(
            copied(view.positions, n, 3, np.float32), copied(view.indices, view.triangles, 3, np.uint32),
            copied_attribute(view.colours, n, 3, np.uint8), copied_attribute(view.normals, n, 3, np.float32),
            copied_attribute(view.texcoords, n, 2, np.float32))
    finally:
        c.library.htvm_mesh_file_destroy(file)


def write_mesh(path: Path, mesh: Mesh, unit: str = "auto") -> None:
    """Writes a mesh, or a frame, as PLY, OBJ or .glb by the file's name, replacing any file of that name.

    unit: as above; "auto": millimetres, or what the format prescribes, which is metres for glTF
    """
    text = ctypes.create_string_buffer(512)
    status = c.library.htvm_mesh_file_write(os.fsencode(path), unit.encode(), as_c_mesh(mesh), text, len(text))
    if status != c.HTVM_OK:
        raise c.error_of(status, text.value)
