"""Writing streams."""

from __future__ import annotations

import ctypes
import os
import shutil
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, BinaryIO, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike

from . import _interface as c
from .errors import BadInput
from .mesh import Mesh, as_c_mesh
from .skeleton import Pose, Skeleton
from .stream import reason_of

_profiles = {
    "tracked": c.HTVM_PROFILE_TRACKED, "topology": c.HTVM_PROFILE_TOPOLOGY, "paper": c.HTVM_PROFILE_PAPER,
}

Value = Union[str, bool, int, float]


@dataclass(frozen=True)
class EncoderOption:
    """An option of the encoder. docs/options.md lists them too."""

    name: str  # "tracked.node_spacing"; as a keyword, with _ in place of the dot
    group: str
    unit: str  # "mm", "frames"; "": none
    meaning: str
    zero: str  # what 0 means, if it has a special meaning
    least: float
    most: float
    default: Value
    words: Tuple[str, ...]  # the values of an option whose value is a word
    serves: bool  # whether it has an effect in the profile


@dataclass(frozen=True)
class EncodedFrame:
    """What became of a mesh."""

    number: int
    kind: str  # "I", "EP", "P", "T" or "TP"
    timestamp_us: int
    vertices: int  # of the decoded mesh
    triangles: int
    bytes: int
    reason: Optional[str] = None  # why an I- or TP-frame was sent, as `Frame.reason`


def _profile_number(profile: str) -> int:
    if profile not in _profiles:
        raise BadInput(f"there is no profile '{profile}': it is one of {', '.join(_profiles)}")
    return _profiles[profile]


def encoder_options(profile: str = "tracked") -> List[EncoderOption]:
    """All options of an encoder, with their defaults in the profile."""
    out = []
    for option in range(c.library.htvm_encoder_option_count()):
        info = c.htvm_option_info()
        status = c.library.htvm_encoder_option(option, _profile_number(profile), info, ctypes.sizeof(info))
        if status != c.HTVM_OK:
            raise c.error_of(status)
        words = tuple(c.library.htvm_encoder_option_word(option, word).decode() for word in range(info.words))
        default: Value = info.default_value
        if info.kind == c.HTVM_OPTION_WORD:
            default = words[int(info.default_value)]
        elif info.kind == c.HTVM_OPTION_SWITCH:
            default = bool(info.default_value)
        elif info.kind == c.HTVM_OPTION_WHOLE_NUMBER:
            default = int(info.default_value)
        out.append(EncoderOption(
            info.name.decode(), info.group.decode(), info.unit.decode(), info.meaning.decode(), info.zero.decode(),
            info.least, info.most, default, words, bool(info.serves)))
    return out


class _Options:
    """The handle on which options are set."""

    def __init__(self, profile: str) -> None:
        self.handle = c.htvm_encoder_options()
        status = c.library.htvm_encoder_options_create(_profile_number(profile), None, self.handle)
        if status != c.HTVM_OK:
            raise c.error_of(status)

    def __del__(self) -> None:
        c.library.htvm_encoder_options_destroy(self.handle)

    def check(self, status: int) -> None:
        if status != c.HTVM_OK:
            raise c.error_of(status, c.library.htvm_encoder_options_last_error(self.handle))

    def set(self, name: str, value: Value) -> None:
        if isinstance(value, str):
            self.check(c.library.htvm_encoder_options_set(self.handle, name.encode(), value.encode()))
        else:
            self.check(c.library.htvm_encoder_options_set_number(self.handle, name.encode(), float(value)))

    def get(self, name: str) -> float:
        value = ctypes.c_double()
        self.check(c.library.htvm_encoder_options_get_number(self.handle, name.encode(), value))
        return value.value

    def set_skeleton(self, skeleton: Skeleton) -> None:
        bones = np.asarray(skeleton.bones, np.uint16).reshape(-1, 2)
        names = (ctypes.c_char_p * max(len(skeleton.joint_names), 1))(*[n.encode() for n in skeleton.joint_names])
        radii = None if skeleton.radii is None else np.ascontiguousarray(skeleton.radii, np.float64)
        if radii is not None and len(radii) != len(bones):
            raise BadInput(f"there are {len(bones)} bones, but {len(radii)} radii")
        given = c.htvm_skeleton(
            ctypes.sizeof(c.htvm_skeleton), len(skeleton.joint_names), len(bones),
            c.pointer(bones, ctypes.c_uint16), names, c.pointer(radii, ctypes.c_double))
        self.check(c.library.htvm_encoder_options_set_skeleton(self.handle, given))


def _array_of(what: str, values: Optional[ArrayLike], type_: Any, shape: Tuple[int, ...]) -> Any:
    if values is None:
        return None
    array = np.ascontiguousarray(values, type_)
    if array.shape != shape:
        raise BadInput(f"{what} must have the shape {shape}, not {array.shape}")
    return array


class Encoder:
    """Encodes meshes into packets, and stores these in a file if one is given.

        with htvm.Encoder("person.htvm", quality=50, key_interval=60) as encoder:
            for mesh in meshes:
                encoder.push(mesh)

    output: None; a path, where the complete stream is put with its index in front: until then it is beside it, and what
        fails leaves the file that was there; or a binary file object, which gets the packets and is not closed
    profile: "tracked", "topology" or "paper"
    quality: 0 to 100, see docs/options.md; None: 42, as of ``htvm encode``
    fps: frames per second: a number, a Fraction or a text such as "30000/1001"
    skeleton: of the poses that come with the meshes; None: one bone stands in
    metadata: "title", "rights", "timecode" and other texts
    floor: millimetres, its coordinate on the axis that the option ``up`` names
    global_shift: whole millimetres that were taken off the capture's coordinates, which the stream keeps
    options: by their names in docs/options.md, such as ``key_interval=60`` and ``up="y"``; those with a dot in their
        names have _ in its place: ``tracked_node_spacing=50``

    Raises BadInput if an option is unknown or out of range, or options contradict each other.
    """

    def __init__(
        self,
        output: Union[None, str, "os.PathLike[str]", BinaryIO] = None,
        *,
        profile: str = "tracked",
        quality: Optional[float] = None,
        fps: Union[int, float, str, Fraction] = 30,
        skeleton: Optional[Skeleton] = None,
        metadata: Optional[Mapping[str, str]] = None,
        floor: Optional[float] = None,
        global_shift: Optional[Sequence[int]] = None,
        **options: Value,
    ) -> None:
        self._handle = c.htvm_encoder()
        self._file: Optional[BinaryIO] = None
        self._path: Optional[str] = None  # of a file that was opened here
        self._partial: Optional[str] = None  # where it is until it is complete
        self._skeleton = skeleton
        self._due_us: Union[Fraction, int] = 0
        self._finished = False
        rate = Fraction(fps).limit_denominator(10000) if isinstance(fps, float) else Fraction(fps)
        if rate <= 0:
            raise BadInput(f"fps must be above 0, not {fps}")
        self._frame_us = Fraction(1000000) / rate
        all_options = _set_options(profile, quality, rate, skeleton, metadata, floor, global_shift, options)
        text = ctypes.create_string_buffer(512)
        status = c.library.htvm_encoder_create(all_options.handle, self._handle, text, len(text))
        if status != c.HTVM_OK:
            raise c.error_of(status, text.value)
        if output is not None:
            self._open(output)

    def _open(self, output: Any) -> None:
        if hasattr(output, "write"):
            self._file = output
            return
        path: str = os.path.realpath(output)
        self._path = path
        if os.path.exists(path) and not os.path.isfile(path):
            self._file = open(path, "wb")  # a device or a pipe
        else:
            self._file = open(path + ".partial", "w+b")
            self._partial = path + ".partial"

    def push(
        self,
        mesh: Mesh,
        pose: Optional[Pose] = None,
        timestamp_us: Optional[int] = None,
        force_intra: bool = False,
    ) -> List[bytes]:
        """Codes a frame, and returns the packets that it gave.

        mesh: a Mesh or a Frame, in millimetres
        pose: of the skeleton; None: the tracker lost it (not allowed for the first frame), or there is no skeleton
        timestamp_us: microseconds, ascending; None: one frame after the last
        force_intra: make it an I-frame

        After BadInput or LimitExceeded the frame is not part of the stream, and the next may follow.
        """
        self._check_open()
        if timestamp_us is None:
            timestamp_us = round(self._due_us)
        self._check(c.library.htvm_encoder_send_mesh(
            self._handle, as_c_mesh(mesh), self._c_pose(pose), timestamp_us, int(force_intra)))
        # Counted exactly, so that the times of frames do not drift.
        exact = self._due_us if round(self._due_us) == timestamp_us else timestamp_us
        self._due_us = exact + self._frame_us
        packets = self._receive()
        self._write(packets)
        return packets

    def set_bitrate(self, bits_per_second: float) -> None:
        """Sets the bits per second that the line carries from the next frame on; the quality follows in half a second.

        For an encoder that was made with a bitrate; else BadInput.
        """
        self._check_open()
        try:
            rate = float(bits_per_second)
        except (TypeError, ValueError):
            raise BadInput(f"a bitrate is a number of bits per second, not {bits_per_second!r}") from None
        self._check(c.library.htvm_encoder_set_bitrate(self._handle, rate))

    def set_effort(self, effort: int) -> None:
        """Sets how much is searched for each frame from the next on: 1 to 9, as the option tracked.effort.

        0 is for a frame that would be late otherwise: its motion alone is coded.
        """
        self._check_open()
        if not isinstance(effort, int) or not 0 <= effort <= 9:
            raise BadInput(f"an effort is a whole number from 0 to 9, not {effort!r}")
        self._check(c.library.htvm_encoder_set_effort(self._handle, effort))

    def finish(self) -> List[bytes]:
        """Ends the stream, and returns its last packets. A file is complete then, and in its place."""
        if self._finished:
            return []
        self._check_open()
        self._finished = True
        try:
            self._check(c.library.htvm_encoder_finish(self._handle))
            packets = self._receive()
            self._put_in_place(packets)
        finally:
            self._remove()
        return packets

    def discard(self) -> None:
        """Gives up: what was written of a file is removed. Without effect after `finish`."""
        self._finished = True
        self._remove()

    @property
    def last_frame(self) -> Optional[EncodedFrame]:
        """What became of the last mesh; None before any."""
        info = c.htvm_frame_info()
        if c.library.htvm_encoder_last_frame(self._handle, info, ctypes.sizeof(info)) != c.HTVM_OK:
            return None
        kind = c.library.htvm_frame_kind_letter(info.type).decode()
        return EncodedFrame(info.frame, kind, info.timestamp_us, info.vertices, info.triangles, info.bytes, reason_of(info))

    def __enter__(self) -> "Encoder":
        return self

    def __exit__(self, kind: Optional[type], *_: object) -> None:
        if kind is None:
            self.finish()
        else:
            self.discard()

    def __del__(self) -> None:
        if getattr(self, "_file", None) is not None:
            self._remove()
        if getattr(self, "_handle", None):
            c.library.htvm_encoder_destroy(self._handle)

    def _check(self, status: int) -> None:
        if status != c.HTVM_OK:
            raise c.error_of(status, c.library.htvm_encoder_last_error(self._handle))

    def _check_open(self) -> None:
        if self._finished:
            raise BadInput("the stream was finished: no mesh can follow")

    def _c_pose(self, pose: Optional[Pose]) -> Optional[c.htvm_pose]:
        if pose is None:
            return None
        if self._skeleton is None:
            raise BadInput("a pose needs the skeleton that the encoder was not given")
        joints, bones = len(self._skeleton.joint_names), len(self._skeleton.bones)
        arrays = (
            _array_of("a pose's joints", pose.joints, np.float64, (joints, 3)),
            _array_of("a pose's orientations", pose.orientations, np.float64, (bones, 3, 3)),
            _array_of("a pose's tracked", pose.tracked, np.uint8, (joints,)),
        )
        out = c.htvm_pose(
            ctypes.sizeof(c.htvm_pose), 0, c.pointer(arrays[0], ctypes.c_double),
            c.pointer(arrays[1], ctypes.c_double), c.pointer(arrays[2], ctypes.c_uint8))
        out.arrays = arrays  # as long as the pointers to them
        return out

    def _packet(self, function: Any) -> Optional[bytes]:
        """What one of the library's functions that give a packet has; None if there is none now."""
        size = ctypes.c_size_t()
        status = function(self._handle, None, 0, size)
        if status in (c.HTVM_AGAIN, c.HTVM_END):
            return None
        if status != c.HTVM_BUFFER_TOO_SMALL:
            self._check(status)
        packet = np.empty(size.value, np.uint8)
        self._check(function(self._handle, c.pointer(packet, ctypes.c_uint8), size, size))
        return packet.tobytes()

    def _receive(self) -> List[bytes]:
        packets: List[bytes] = []
        while (packet := self._packet(c.library.htvm_encoder_receive_packet)) is not None:
            packets.append(packet)
        return packets

    def _write(self, packets: List[bytes]) -> None:
        if self._file is not None:
            self._file.write(b"".join(packets))

    def _put_in_place(self, last: List[bytes]) -> None:
        """Ends the output. A file gets its index in front, in place of the last packet, the index at the end."""
        file, self._file = self._file, None
        if file is None:
            return
        front = self._packet(c.library.htvm_encoder_front_index) if self._partial else None
        if front is None:
            file.write(b"".join(last))
        else:
            file.write(b"".join(last[:-1]))
        if not self._partial:
            if self._path is not None:
                file.close()
            return
        with file:
            if front is not None:
                file.seek(0)
                with open(self._partial + ".indexed", "wb") as indexed:
                    indexed.write(front)
                    shutil.copyfileobj(file, indexed, 1 << 20)
        if front is not None:
            os.replace(self._partial + ".indexed", self._partial)
        os.replace(self._partial, str(self._path))
        self._partial = None

    def _remove(self) -> None:
        """What is not in its place yet."""
        file, self._file = self._file, None
        if file is not None and self._path is not None:
            file.close()
        partial, self._partial = self._partial, None
        for name in (partial, partial + ".indexed") if partial else ():
            if os.path.exists(name):
                os.remove(name)


def _set_options(
    profile: str, quality: Optional[float], rate: Fraction, skeleton: Optional[Skeleton],
    metadata: Optional[Mapping[str, str]], floor: Optional[float], global_shift: Optional[Sequence[int]],
    options: Mapping[str, Value],
) -> _Options:
    out = _Options(profile)
    if quality is not None:
        out.set("quality", quality)
    out.set("fps_numerator", rate.numerator)
    out.set("fps_denominator", rate.denominator)
    names: Dict[str, str] = {option.name.replace(".", "_"): option.name for option in encoder_options(profile)}
    for keyword, value in options.items():
        # The library says which name is the most similar.
        out.set(names.get(keyword, keyword), value)
    if skeleton is not None:
        out.set_skeleton(skeleton)
    for key, text in (metadata or {}).items():
        out.check(c.library.htvm_encoder_options_add_metadata(out.handle, key.encode(), text.encode()))
    if floor is not None:
        out.check(c.library.htvm_encoder_options_set_floor(out.handle, floor))
    if global_shift is not None:
        x, y, z = global_shift
        out.check(c.library.htvm_encoder_options_set_global_shift(out.handle, (ctypes.c_int64 * 3)(x, y, z)))
    return out
