"""Compressed human time-varying meshes: one triangle mesh per frame, as NumPy arrays.

    import htvm

    for frame in htvm.open("person.htvm"):
        print(frame.number, frame.positions.shape)

    with htvm.Encoder("out.htvm", quality=50) as encoder:
        for mesh in meshes:
            encoder.push(mesh)

    for frame in htvm.open(htvm.watch("wss://hub.example/watch/anna")):
        print(frame.number, frame.positions.shape)

Lengths are millimetres, timestamps microseconds. docs/python.md is the manual. A stream's iterators and an encoder are
used by one thread at a time; different ones may be used at the same time, and the library works without Python's lock.
"""

from . import _interface
from .comparison import Comparison, compare
from .encoder import EncodedFrame, Encoder, EncoderOption, encoder_options
from .errors import (BadInput, CorruptStream, Error, InternalError, LimitExceeded, OutOfMemory, ProgramError,
                     Unsupported)
from .live import Publisher, watch
from .mesh import Mesh, read_mesh, write_mesh
from .skeleton import Pose, Skeleton
from .stream import Frame, Frames, Sequence, Stream, open

__version__: str = _interface.library.htvm_version_string().decode()
stream_version: int = _interface.library.htvm_stream_version()  # of the streams that it writes

__all__ = [
    "BadInput", "Comparison", "CorruptStream", "EncodedFrame", "Encoder", "EncoderOption", "Error", "Frame", "Frames",
    "InternalError", "LimitExceeded", "Mesh", "OutOfMemory", "Pose", "ProgramError", "Publisher", "Sequence", "Skeleton", "Stream",
    "Unsupported", "compare", "encoder_options", "open", "read_mesh", "stream_version", "watch", "write_mesh",
]
