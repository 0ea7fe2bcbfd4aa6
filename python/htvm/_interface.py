"""The C interface (include/htvm/htvm.h, python/native/mesh_files.h) for ctypes: as much of it as the package uses.

Names are those of the headers; tests/test_interface.py compares structs, constants and functions with them.
"""

from __future__ import annotations

import ctypes
import os
import sys
from ctypes import POINTER, Structure, c_char_p, c_double, c_float, c_int32, c_int64, c_size_t, c_uint8, c_uint16
from ctypes import c_uint32, c_uint64, c_void_p
from pathlib import Path
from typing import Any

from . import errors

HTVM_OK = 0
HTVM_AGAIN = 1
HTVM_END = 2
HTVM_BAD_INPUT = -1
HTVM_CORRUPT_STREAM = -2
HTVM_UNSUPPORTED = -3
HTVM_LIMIT = -4
HTVM_OUT_OF_MEMORY = -5
HTVM_BUFFER_TOO_SMALL = -6
HTVM_INTERNAL = -7

HTVM_REASON_NONE = 0

HTVM_MOVING_TEXCOORDS = 8

HTVM_PACKET_FLAGS_VALID = 128
HTVM_PACKET_HEADER = 32

HTVM_PROFILE_TRACKED = 0
HTVM_PROFILE_TOPOLOGY = 1
HTVM_PROFILE_PAPER = 2

HTVM_OPTION_NUMBER = 0
HTVM_OPTION_WHOLE_NUMBER = 1
HTVM_OPTION_SWITCH = 2
HTVM_OPTION_WORD = 3

HTVM_UP_UNKNOWN = 0
HTVM_UP_X = 1
HTVM_UP_MINUS_X = 2
HTVM_UP_Y = 3
HTVM_UP_MINUS_Y = 4
HTVM_UP_Z = 5
HTVM_UP_MINUS_Z = 6

# Handles are opaque.
htvm_decoder = c_void_p
htvm_encoder = c_void_p
htvm_encoder_options = c_void_p
htvm_dependencies = c_void_p
htvm_mesh_file = c_void_p


class htvm_allocator(Structure):
    _fields_ = [("user", c_void_p), ("allocate", c_void_p), ("release", c_void_p)]


class htvm_decoder_options(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("threads", c_uint32),
        ("max_vertices", c_uint32),
        ("max_triangles", c_uint32),
        ("max_joints", c_uint32),
        ("max_bones", c_uint32),
        ("max_packet_bytes", c_uint64),
        ("max_memory", c_uint64),
        ("allocator", htvm_allocator),
        ("run_tasks", c_void_p),
        ("run_tasks_user", c_void_p),
        ("detail_levels", c_uint32),
    ]


class htvm_frame_info(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("type", c_uint32),
        ("frame", c_uint32),
        ("reference", c_uint32),
        ("timestamp_us", c_int64),
        ("source_vertices", c_uint32),
        ("source_triangles", c_uint32),
        ("vertices", c_uint32),
        ("triangles", c_uint32),
        ("attributes", c_uint32),
        ("joints", c_uint32),
        ("bones", c_uint32),
        ("concealed", c_uint32),
        ("bytes", c_uint64),
        ("topology", c_uint32),
        ("sequence", c_uint32),
        ("reference_topology", c_uint32),
        ("absent", c_uint32),
        ("reason", c_uint32),
        ("reserved", c_uint32),
    ]


class htvm_mesh_view(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("vertices", c_uint32),
        ("triangles", c_uint32),
        ("topology", c_uint32),
        ("positions", POINTER(c_float)),
        ("indices", POINTER(c_uint32)),
        ("colours", POINTER(c_uint8)),
        ("normals", POINTER(c_float)),
        ("texcoords", POINTER(c_float)),
        ("presence", POINTER(c_uint8)),
    ]


class htvm_sequence_info(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("joints", c_uint32),
        ("bones", c_uint32),
        ("skeleton_tracked", c_uint32),
        ("fps_numerator", c_uint32),
        ("fps_denominator", c_uint32),
        ("unit_micrometres", c_uint32),
        ("nearest_vertices", c_uint32),
        ("lattice_step", c_double),
        ("session", c_uint64),
        ("sequence", c_uint32),
        ("stream_version", c_uint32),
        ("up", c_uint32),
        ("floor_known", c_uint32),
        ("floor", c_double),
        ("metadata", c_uint32),
        ("texture_layout", c_uint32),
        ("texture_width", c_uint32),
        ("texture_height", c_uint32),
    ]


class htvm_packet_info(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("kind", c_uint32),
        ("flags", c_uint32),
        ("frame", c_uint32),
        ("reference", c_uint32),
        ("reference_version", c_uint32),
        ("timestamp_us", c_int64),
        ("bytes", c_uint64),
    ]


class htvm_skeleton(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("joints", c_uint32),
        ("bones", c_uint32),
        ("bone_joints", POINTER(c_uint16)),
        ("joint_names", POINTER(c_char_p)),
        ("radii", POINTER(c_double)),
    ]


class htvm_option_info(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("kind", c_uint32),
        ("name", c_char_p),
        ("group", c_char_p),
        ("unit", c_char_p),
        ("meaning", c_char_p),
        ("zero", c_char_p),
        ("least", c_double),
        ("most", c_double),
        ("default_value", c_double),
        ("words", c_uint32),
        ("serves", c_uint32),
    ]


class htvm_mesh(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("vertices", c_uint32),
        ("triangles", c_uint32),
        ("reserved", c_uint32),
        ("positions", POINTER(c_float)),
        ("indices", POINTER(c_uint32)),
        ("colours", POINTER(c_uint8)),
        ("normals", POINTER(c_float)),
        ("texcoords", POINTER(c_float)),
    ]


class htvm_pose(Structure):
    _fields_ = [
        ("struct_size", c_uint32),
        ("reserved", c_uint32),
        ("joints", POINTER(c_double)),
        ("orientations", POINTER(c_double)),
        ("tracked", POINTER(c_uint8)),
    ]


htvm_status = c_int32

# Each function's result and parameters.
functions: dict[str, tuple[Any, list[Any]]] = {
    "htvm_version_string": (c_char_p, []),
    "htvm_stream_version": (c_uint32, []),
    "htvm_status_text": (c_char_p, [htvm_status]),
    "htvm_frame_kind_name": (c_char_p, [c_uint32]),
    "htvm_frame_kind_letter": (c_char_p, [c_uint32]),
    "htvm_frame_reason_name": (c_char_p, [c_uint32]),
    "htvm_decoder_options_init": (htvm_status, [POINTER(htvm_decoder_options), c_size_t]),
    "htvm_decoder_create": (htvm_status, [POINTER(htvm_decoder_options), POINTER(htvm_decoder)]),
    "htvm_decoder_destroy": (None, [htvm_decoder]),
    "htvm_decoder_last_error": (c_char_p, [htvm_decoder]),
    "htvm_decoder_send_packet": (htvm_status, [htvm_decoder, POINTER(c_uint8), c_size_t]),
    "htvm_decoder_receive_frame": (htvm_status, [htvm_decoder, POINTER(htvm_frame_info), c_size_t]),
    "htvm_decoder_view": (htvm_status, [htvm_decoder, POINTER(htvm_mesh_view), c_size_t]),
    "htvm_decoder_copy_joints": (htvm_status, [htvm_decoder, POINTER(c_double), c_size_t]),
    "htvm_decoder_copy_orientations": (htvm_status, [htvm_decoder, POINTER(c_double), c_size_t]),
    "htvm_decoder_sequence": (htvm_status, [htvm_decoder, POINTER(htvm_sequence_info), c_size_t]),
    "htvm_decoder_joint_name": (htvm_status, [htvm_decoder, c_uint32, c_char_p, c_size_t]),
    "htvm_decoder_bone": (
        htvm_status, [htvm_decoder, c_uint32, POINTER(c_uint32), POINTER(c_uint32), POINTER(c_double)]),
    "htvm_decoder_metadata": (htvm_status, [htvm_decoder, c_uint32, c_char_p, c_size_t, c_char_p, c_size_t]),
    "htvm_decoder_global_shift": (htvm_status, [htvm_decoder, POINTER(c_int64)]),
    "htvm_packet_read": (htvm_status, [POINTER(c_uint8), c_size_t, POINTER(htvm_packet_info), c_size_t]),
    "htvm_packet_header_read": (htvm_status, [POINTER(c_uint8), c_size_t, POINTER(htvm_packet_info), c_size_t]),
    "htvm_dependencies_create": (htvm_status, [POINTER(htvm_allocator), POINTER(htvm_dependencies)]),
    "htvm_dependencies_destroy": (None, [htvm_dependencies]),
    "htvm_dependencies_push": (htvm_status, [htvm_dependencies, POINTER(htvm_packet_info), POINTER(c_uint64)]),
    "htvm_dependencies_closure": (
        htvm_status, [htvm_dependencies, POINTER(c_uint64), c_size_t, POINTER(c_size_t)]),
    "htvm_dependencies_kept": (htvm_status, [htvm_dependencies, POINTER(c_uint64), c_size_t, POINTER(c_size_t)]),
    "htvm_dependencies_frame": (htvm_status, [htvm_dependencies, POINTER(c_uint32)]),
    "htvm_encoder_options_create": (htvm_status, [c_uint32, POINTER(htvm_allocator), POINTER(htvm_encoder_options)]),
    "htvm_encoder_options_destroy": (None, [htvm_encoder_options]),
    "htvm_encoder_options_last_error": (c_char_p, [htvm_encoder_options]),
    "htvm_encoder_options_set": (htvm_status, [htvm_encoder_options, c_char_p, c_char_p]),
    "htvm_encoder_options_set_number": (htvm_status, [htvm_encoder_options, c_char_p, c_double]),
    "htvm_encoder_options_get_number": (htvm_status, [htvm_encoder_options, c_char_p, POINTER(c_double)]),
    "htvm_encoder_options_set_skeleton": (htvm_status, [htvm_encoder_options, POINTER(htvm_skeleton)]),
    "htvm_encoder_options_add_metadata": (htvm_status, [htvm_encoder_options, c_char_p, c_char_p]),
    "htvm_encoder_options_set_floor": (htvm_status, [htvm_encoder_options, c_double]),
    "htvm_encoder_options_set_global_shift": (htvm_status, [htvm_encoder_options, POINTER(c_int64)]),
    "htvm_encoder_option_count": (c_uint32, []),
    "htvm_encoder_option": (htvm_status, [c_uint32, c_uint32, POINTER(htvm_option_info), c_size_t]),
    "htvm_encoder_option_word": (c_char_p, [c_uint32, c_uint32]),
    "htvm_quality_steps": (None, [c_double, POINTER(c_double), POINTER(c_double)]),
    "htvm_encoder_create": (htvm_status, [htvm_encoder_options, POINTER(htvm_encoder), c_char_p, c_size_t]),
    "htvm_encoder_destroy": (None, [htvm_encoder]),
    "htvm_encoder_last_error": (c_char_p, [htvm_encoder]),
    "htvm_encoder_send_mesh": (
        htvm_status, [htvm_encoder, POINTER(htvm_mesh), POINTER(htvm_pose), c_int64, ctypes.c_int]),
    "htvm_encoder_set_bitrate": (htvm_status, [htvm_encoder, c_double]),
    "htvm_encoder_set_effort": (htvm_status, [htvm_encoder, c_uint32]),
    "htvm_encoder_finish": (htvm_status, [htvm_encoder]),
    "htvm_encoder_receive_packet": (htvm_status, [htvm_encoder, POINTER(c_uint8), c_size_t, POINTER(c_size_t)]),
    "htvm_encoder_front_index": (htvm_status, [htvm_encoder, POINTER(c_uint8), c_size_t, POINTER(c_size_t)]),
    "htvm_encoder_last_frame": (htvm_status, [htvm_encoder, POINTER(htvm_frame_info), c_size_t]),
    "htvm_mesh_file_read": (htvm_status, [c_char_p, c_char_p, POINTER(htvm_mesh_file), c_char_p, c_size_t]),
    "htvm_mesh_file_destroy": (None, [htvm_mesh_file]),
    "htvm_mesh_file_view": (htvm_status, [htvm_mesh_file, POINTER(htvm_mesh_view), c_size_t]),
    "htvm_mesh_file_write": (htvm_status, [c_char_p, c_char_p, POINTER(htvm_mesh), c_char_p, c_size_t]),
}


def load() -> Any:
    """The library in this folder, as wheels have it, or the one that HTVM_LIBRARY names."""
    inside = Path(__file__).with_name("htvm.dll" if sys.platform == "win32" else "libhtvm.so")
    path = os.environ.get("HTVM_LIBRARY") or str(inside)
    try:
        library = ctypes.CDLL(path)
    except OSError as error:
        raise ImportError(
            f"htvm's library cannot be loaded ({error}). Install the wheel, or set HTVM_LIBRARY to the path of "
            f"{inside.name}; {sys.platform} needs one built for it") from error
    for name, (result, parameters) in functions.items():
        function = getattr(library, name)
        function.restype = result
        function.argtypes = parameters
    return library


library = load()

_kinds: dict[int, type[errors.Error]] = {
    HTVM_BAD_INPUT: errors.BadInput,
    HTVM_CORRUPT_STREAM: errors.CorruptStream,
    HTVM_UNSUPPORTED: errors.Unsupported,
    HTVM_LIMIT: errors.LimitExceeded,
    HTVM_OUT_OF_MEMORY: errors.OutOfMemory,
}


def error_of(status: int, text: bytes | None = None) -> errors.Error:
    """The exception for a failed call; text: what the handle says of it."""
    message = (text or library.htvm_status_text(status)).decode("utf-8", "replace")
    return _kinds.get(status, errors.InternalError)(message)


def pointer(array: Any, type_: Any) -> Any:
    """A C pointer to a NumPy array's numbers, NULL for None. The array must outlive the call."""
    return None if array is None else array.ctypes.data_as(POINTER(type_))
