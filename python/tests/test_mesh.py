import numpy as np
import pytest
from conftest import sheet

import htvm


def test_a_mesh_takes_what_converts_and_has_arrays_of_one_kind():
    mesh = htvm.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], colours=np.full((3, 3), 255))
    assert mesh.positions.dtype == np.float32 and mesh.positions.flags.c_contiguous
    assert mesh.triangles.dtype == np.uint32 and mesh.colours.dtype == np.uint8
    assert mesh.normals is None


@pytest.mark.parametrize("arrays, sentence", [
    (dict(positions=[[0, 0]], triangles=[]), r"positions must have the shape \(n, 3\), not \(1, 2\)"),
    (dict(positions=[[0, 0, 0]], triangles=[[0, 0, -1]]), "triangles must be from 0 to"),
    (dict(positions=[[0, 0, 0]], triangles=[[0., 0., 0.]]), "triangles must be whole numbers"),
    (dict(positions=[[0, 0, 0]], triangles=[], colours=[[0, 0, 256]]), "colours must be from 0 to 255"),
    (dict(positions=[[0, 0, 0]], triangles=[], colours=[[0.5, 0.5, 0.5]]), "colours must be whole numbers"),
    (dict(positions=[[0, 0, 0]], triangles=[], normals=np.zeros((2, 3))), "1 positions, but 2 normals"),
])
def test_what_would_become_another_mesh_is_refused(arrays, sentence):
    with pytest.raises(htvm.BadInput, match=sentence):
        htvm.Mesh(**arrays)


def test_files_give_back_what_was_written(tmp_path):
    mesh = sheet(3)
    mesh.normals = np.tile(np.float32([0, 0, 1]), (len(mesh.positions), 1))
    mesh.texcoords = mesh.positions[:, :2] / 110
    htvm.write_mesh(tmp_path / "mesh.ply", mesh)
    read = htvm.read_mesh(tmp_path / "mesh.ply", unit="mm")
    for name in ("positions", "triangles", "colours", "normals", "texcoords"):
        assert np.array_equal(getattr(read, name), getattr(mesh, name)), name


def test_units_become_millimetres(tmp_path):
    tall = htvm.Mesh([[0, 0, 0], [0, 1800, 0], [500, 0, 0]], [[0, 1, 2]])
    htvm.write_mesh(tmp_path / "metres.obj", tall, unit="m")
    assert "1.8" in (tmp_path / "metres.obj").read_text()
    for unit in ("m", "auto"):
        assert np.allclose(htvm.read_mesh(tmp_path / "metres.obj", unit).positions, tall.positions)
    assert np.allclose(htvm.read_mesh(tmp_path / "metres.obj", "cm").positions, tall.positions / 100)


def test_gltf_is_in_metres_however_small_the_mesh(tmp_path):
    mesh = sheet(3)
    htvm.write_mesh(tmp_path / "mesh.glb", mesh)
    read = htvm.read_mesh(tmp_path / "mesh.glb")
    assert np.allclose(read.positions, mesh.positions, atol=1e-3) and np.array_equal(read.triangles, mesh.triangles)
    assert np.allclose(htvm.read_mesh(tmp_path / "mesh.glb", unit="mm").positions, mesh.positions / 1000, atol=1e-6)


def test_failures_name_the_file_and_are_of_their_kind(tmp_path):
    with pytest.raises(htvm.BadInput, match="nothing.ply: there is no such file"):
        htvm.read_mesh(tmp_path / "nothing.ply")
    with pytest.raises(htvm.Unsupported, match="formats that are read"):
        htvm.read_mesh(tmp_path / "mesh.stl")
    with pytest.raises(htvm.BadInput, match="unit 'mile' is not one of"):
        htvm.write_mesh(tmp_path / "mesh.ply", sheet(0), unit="mile")
    (tmp_path / "short.ply").write_bytes(b"ply\nformat ascii 1.0\nelement vertex 3\n")
    with pytest.raises(htvm.BadInput, match="short.ply"):
        htvm.read_mesh(tmp_path / "short.ply")


def test_a_copy_has_arrays_of_its_own():
    mesh = sheet(0)
    copy = mesh.copy()
    copy.positions += 1
    assert not np.shares_memory(copy.positions, mesh.positions)
    assert np.array_equal(copy.triangles, mesh.triangles)
