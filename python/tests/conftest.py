"""Meshes and streams for the tests."""

import os
import shutil
from pathlib import Path

import numpy as np
import pytest

import htvm

project = Path(__file__).resolve().parents[2]
conformance = project / "tests" / "data" / "conformance"
program = os.environ.get("HTVM_PROGRAM", "htvm")
needs_program = pytest.mark.skipif(shutil.which(program) is None, reason="the program htvm is not there")


def sheet(frame, side=12, bend=0.5):
    """A sheet of 110 mm with colours that bends a little more in every frame, so little that tracking holds."""
    x, y = np.meshgrid(np.arange(side), np.arange(side))
    z = (bend + 0.01 * frame) * (x - side / 2) ** 2
    positions = np.stack([10 * x, 10 * y, z], axis=-1).reshape(-1, 3)
    colours = np.stack([12 * x, 12 * y, np.full_like(x, 100)], axis=-1).reshape(-1, 3)
    v = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).reshape(-1, 1)
    triangles = np.concatenate([v + [0, 1, side], v + [1, side + 1, side]])
    return htvm.Mesh(positions, triangles, colours.astype(np.uint8))


def encode(count, **options):
    """The packets of a stream of sheets."""
    encoder = htvm.Encoder(subject_size=1000, **options)
    packets = []
    for frame in range(count):
        packets += encoder.push(sheet(frame))
    return packets + encoder.finish()


@pytest.fixture(scope="session")
def stream():
    """12 frames, of which every fourth is an I-frame."""
    return b"".join(encode(12, key_interval=4))
