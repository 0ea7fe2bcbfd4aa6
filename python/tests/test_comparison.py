import numpy as np
import pytest
from conftest import encode, needs_program, sheet

import htvm

@needs_program
def test_errors_of_a_stream_are_measured_frame_by_frame(tmp_path):
    for number in range(3):
        htvm.write_mesh(tmp_path / f"{number:05}.ply", sheet(number))
    for quality, most in ((20, 4), (90, 0.3)):
        path = tmp_path / f"{quality}.htvm"
        path.write_bytes(b"".join(encode(3, quality=quality, key_interval=1)))
        measured = htvm.compare(str(tmp_path / "%05d.ply"), path, unit="mm")
        assert len(measured.frames) == 3
        errors = measured.values("m2.rms_mm")
        assert errors.shape == (3,) and 0 < errors.max() < most
        assert measured.value("m2.worst_frame_mm") == pytest.approx(errors.max())
    with pytest.raises(KeyError, match="m3.full_db was not measured"):
        measured.values("m3.full_db")


@needs_program
def test_meshes_in_memory_are_measured_in_millimetres():
    flat, moved = sheet(0, bend=0), sheet(0, bend=0)
    moved.positions = moved.positions + np.float32([0, 0, 2.5])
    measured = htvm.compare(flat, [moved], metrics=["m2", "d1"])
    assert measured.values("m2.rms_mm") == pytest.approx([2.5])
    same = htvm.compare(flat, flat, metrics=["d1"])
    assert same.value("cloud.d1_db") == np.inf


@needs_program
def test_failures_of_the_program_are_exceptions(tmp_path):
    with pytest.raises(htvm.BadInput, match="htvm compare: .*nothing"):
        htvm.compare(tmp_path / "nothing", tmp_path / "nothing.htvm")
    with pytest.raises(htvm.BadInput, match="name the files' unit"):
        htvm.compare(tmp_path / "capture", sheet(0))


def test_a_missing_program_is_said_with_what_to_do(monkeypatch):
    monkeypatch.setenv("HTVM_PROGRAM", "/nowhere/htvm")
    with pytest.raises(htvm.ProgramError, match="install htvm's programs"):
        htvm.compare("a", "b")
