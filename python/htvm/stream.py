"""Reading streams: frames one after the other, or from any frame on."""

from __future__ import annotations

import ctypes
import dataclasses
import io
import mmap
import operator
import os
import stat
import threading
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, BinaryIO, Iterator, List, Optional, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from . import _interface as c
from .errors import BadInput, CorruptStream, Error
from .mesh import Mesh, copied, copied_attribute, copied_presence
from .skeleton import Skeleton

Source = Union[str, "os.PathLike[str]", bytes, bytearray, memoryview, BinaryIO]

up_axes = {
    c.HTVM_UP_X: "x", c.HTVM_UP_MINUS_X: "-x", c.HTVM_UP_Y: "y",
    c.HTVM_UP_MINUS_Y: "-y", c.HTVM_UP_Z: "z", c.HTVM_UP_MINUS_Z: "-z",
}


def reason_of(info: c.htvm_frame_info) -> Optional[str]:
    if info.reason == c.HTVM_REASON_NONE:
        return None
    name: bytes = c.library.htvm_frame_reason_name(info.reason)
    return name.decode()


@dataclass(eq=False)
class Frame(Mesh):
    """A decoded mesh. Its arrays stay as they are when the next frame is decoded.

    Frames with the same topology have the same triangles and texture coordinates: these are one read-only array, which
    they share. Frames with the same reference_topology have the same vertices at the same places, and share texture
    coordinates; those that show a part of that mesh (presence) have only the triangles whose three vertices are there.
    `copy` gives a frame with arrays of its own, `shown` one without the vertices that are not there.
    """

    number: int = 0  # in the whole stream, from 0
    timestamp_us: int = 0  # microseconds
    kind: str = ""  # "I", "EP", "P", "T" or "TP": docs/glossary.md
    reason: Optional[str] = None  # why an I- or TP-frame was sent, "due" or "region": docs/bitstream.md, 8.20; None: not told
    bytes: int = 0  # of its packet
    # The same for frames of one iteration if they have the same triangles and texcoords; but where the texture is one
    # camera's film, each frame has texcoords of its own.
    topology: int = 0
    reference_topology: int = 0  # likewise, the same if they have the same vertices and texcoords
    presence: Optional[NDArray[np.bool_]] = None  # (n,): which vertices are there; None: all. The others are in no triangle
    joints: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 3)))  # (j, 3), millimetres
    orientations: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 3, 3)))  # (b, 3, 3), of the bones

    @property
    def timestamp(self) -> float:
        """Seconds."""
        return self.timestamp_us / 1e6

    def shown(self) -> "Frame":
        """The frame without the vertices that no triangle names, where some are not there; else the frame itself."""
        if self.presence is None:
            return self
        kept, triangles = np.unique(self.triangles, return_inverse=True)
        rows = {name: None if getattr(self, name) is None else getattr(self, name)[kept]
                for name in ("positions", "colours", "normals", "texcoords")}
        return dataclasses.replace(
            self, triangles=triangles.reshape(-1, 3).astype(np.uint32), presence=None, **rows)


@dataclass(frozen=True)
class Sequence:
    """What the sequence header says of all its frames."""

    fps: Fraction  # frames per second; the frames' timestamps may say otherwise
    up: Optional[str]  # where the head is: "x", "-x", "y", "-y", "z", "-z"; None: unknown
    floor: Optional[float]  # millimetres: the floor's coordinate on the axis that is up; None: unknown
    unit_micrometres: int  # the unit in which the capture was given; meshes are in millimetres in any case
    lattice_step: float  # millimetres: decoded positions are multiples of it, from an origin
    metadata: dict[str, str]  # "title", "rights", "timecode" and others
    global_shift: Tuple[int, int, int]  # millimetres: added to positions, it gives the capture's own coordinates back
    skeleton: Optional[Skeleton]  # None: the capture had none
    session: int  # of the live publisher; 0: none
    stream_version: int


@dataclass(frozen=True)
class _Packet:
    info: Optional[c.htvm_packet_info]  # None: bytes that are no packet
    offset: int
    size: int
    number: Optional[int] = None  # of a frame: in the whole stream

    @property
    def timestamp_us(self) -> int:
        return int(self.info.timestamp_us) if self.info is not None else 0

    def text(self) -> str:
        return f"the packet at byte {self.offset}" if self.number is None else f"frame {self.number}"


def _address(data: NDArray[np.uint8], offset: int) -> Any:
    return ctypes.cast(data.ctypes.data + offset, ctypes.POINTER(ctypes.c_uint8))


class _Dependencies:
    """Numbers the frames of all sequences, and tells which packets a frame and those behind it need."""

    def __init__(self) -> None:
        self._handle = c.htvm_dependencies()
        status = c.library.htvm_dependencies_create(None, self._handle)
        if status != c.HTVM_OK:
            raise c.error_of(status)

    def __del__(self) -> None:
        c.library.htvm_dependencies_destroy(self._handle)

    def push(self, info: c.htvm_packet_info) -> None:
        status = c.library.htvm_dependencies_push(self._handle, info, None)
        if status != c.HTVM_OK:
            raise c.error_of(status)

    def frame(self) -> Optional[int]:
        """The number of the packet pushed last, if it is a frame."""
        number = ctypes.c_uint32()
        status = c.library.htvm_dependencies_frame(self._handle, number)
        return number.value if status == c.HTVM_OK else None

    def needed(self) -> List[int]:
        """Places of what the newest frame needs, and of what those behind it need, in the order to decode them."""
        places: List[int] = []
        for list_ in (c.library.htvm_dependencies_closure, c.library.htvm_dependencies_kept):
            count = ctypes.c_size_t()
            list_(self._handle, None, 0, count)
            array = (ctypes.c_uint64 * count.value)()
            list_(self._handle, array, count, count)
            places.extend(array)
        # The sequence header comes first, even if it is a repetition from behind what is needed.
        return places[:1] + sorted(set(places[1:]) - set(places[:1]))


class _Packets:
    """The packets of a source, found by their headers, in order."""

    # What packets begin with (docs/bitstream.md, section 2).
    _sync = b"HTVP"
    # How many bytes at a time are read, and searched for the next packet behind damage.
    _window = 1 << 20
    # How many bytes of a file object are searched before they are given up.
    _step = 1 << 12

    def __init__(self, data: NDArray[np.uint8], file: Optional[BinaryIO], most_bytes: int) -> None:
        self.data = data  # all there is, or with a file, what was read and not taken yet
        self.list: List[_Packet] = []  # those found; with a file, none is kept
        self._file = file
        self._most_bytes = most_bytes  # of a packet; larger ones are damage
        self._offset = 0  # of the next packet
        self._begin = 0  # of data
        self._dependencies = _Dependencies()
        self._lock = threading.Lock()

    @property
    def forward_only(self) -> bool:
        return self._file is not None

    def _have(self, end: int) -> bool:
        """Reads up to `end`, if the source has so much."""
        have, pieces = self._begin + len(self.data), [self.data]
        # In pieces, as a damaged header may claim more than the source has.
        while self._file is not None and have < end:
            more = self._file.read(min(end - have, self._window))
            if not more:
                break
            pieces.append(np.frombuffer(more, np.uint8))
            have += len(more)
        if len(pieces) > 1:
            self.data = np.concatenate(pieces)
        return have >= end

    def _header_at(self, offset: int) -> Optional[c.htvm_packet_info]:
        if not self._have(offset + c.HTVM_PACKET_HEADER):
            return None
        info = c.htvm_packet_info()
        at = offset - self._begin
        status = c.library.htvm_packet_header_read(
            _address(self.data, at), c.HTVM_PACKET_HEADER, info, ctypes.sizeof(info))
        if status != c.HTVM_OK or info.bytes > self._most_bytes:
            return None
        if not info.flags & c.HTVM_PACKET_FLAGS_VALID and self._have(offset + info.bytes):
            # Streams of version 1: what they do not tell is derived from the whole packet.
            whole = c.htvm_packet_info()
            if c.library.htvm_packet_read(
                    _address(self.data, at), info.bytes, whole, ctypes.sizeof(whole)) == c.HTVM_OK:
                return whole
        return info

    def _find(self, offset: int) -> int:
        """Where the next packet's header begins, at or behind the offset; else as far as was searched."""
        while self._have(offset + c.HTVM_PACKET_HEADER):
            if self.forward_only:
                self._have(offset + self._step)
            window = self.data[offset - self._begin:][:self._window].tobytes()
            candidate = window.find(self._sync)
            while candidate >= 0:
                if self._header_at(offset + candidate) is not None:
                    return offset + candidate
                candidate = window.find(self._sync, candidate + 1)
            offset += len(window) - len(self._sync) + 1
            if self.forward_only:
                return offset
        return self._begin + len(self.data)

    def next(self) -> Optional[_Packet]:
        """The next packet, or bytes that are none; None at the end."""
        if self.forward_only:
            self.data, self._begin = self.data[self._offset - self._begin:], self._offset
        offset = self._offset
        if not self._have(offset + 1):
            if offset == 0:
                raise CorruptStream("this is not an htvm stream: it is empty")
            return None
        info = self._header_at(offset)
        if info is None or not self._have(offset + info.bytes):
            end = self._find(offset + 1) if info is None else self._begin + len(self.data)
            packet = _Packet(None, offset, end - offset)
        else:
            self._dependencies.push(info)
            packet = _Packet(info, offset, info.bytes, self._dependencies.frame())
        self._offset += packet.size
        if offset == 0 and info is None and self._header_at(self._offset) is None:
            raise CorruptStream("this is not an htvm stream")
        if not self.forward_only:
            self.list.append(packet)
        return packet

    def at(self, place: int) -> Optional[_Packet]:
        """Of a source that is not read forward alone. Iterators share what is found."""
        if place >= len(self.list):
            with self._lock:
                while place >= len(self.list):
                    if self.next() is None:
                        return None
        return self.list[place]

    def bytes_of(self, packet: _Packet) -> NDArray[np.uint8]:
        at = packet.offset - self._begin
        return self.data[at:at + packet.size]

    def start_for(self, first: int) -> Tuple[List[int], int]:
        """Places of the packets that frame `first` and those behind it need of what comes before it, and its own."""
        dependencies = _Dependencies()
        pushed = []
        for place, packet in enumerate(self.each()):
            if packet.info is None:
                continue
            dependencies.push(packet.info)
            pushed.append(place)
            if packet.number is not None and packet.number >= first:
                return [pushed[n] for n in dependencies.needed() if pushed[n] < place], place
        return [], len(self.list)

    def each(self) -> Iterator[_Packet]:
        place = 0
        while (packet := self.at(place)) is not None:
            yield packet
            place += 1


class _Decoder:
    """A decoder of packets."""

    def __init__(self, options: c.htvm_decoder_options) -> None:
        self._handle = c.htvm_decoder()
        status = c.library.htvm_decoder_create(options, self._handle)
        if status != c.HTVM_OK:
            raise c.error_of(status)
        self._last: Optional[Frame] = None

    def __del__(self) -> None:
        c.library.htvm_decoder_destroy(self._handle)

    def _check(self, status: int) -> None:
        if status != c.HTVM_OK:
            raise c.error_of(status, c.library.htvm_decoder_last_error(self._handle))

    def decode(self, packet: NDArray[np.uint8]) -> Optional[c.htvm_frame_info]:
        """The frame in the packet, then the current one; None if it holds none."""
        self._check(c.library.htvm_decoder_send_packet(self._handle, _address(packet, 0), len(packet)))
        info = c.htvm_frame_info()
        status = c.library.htvm_decoder_receive_frame(self._handle, info, ctypes.sizeof(info))
        if status == c.HTVM_AGAIN:
            return None
        self._check(status)
        return info

    def frame(self, info: c.htvm_frame_info, number: int) -> Frame:
        view = c.htvm_mesh_view()
        self._check(c.library.htvm_decoder_view(self._handle, view, ctypes.sizeof(view)))
        n, last = view.vertices, self._last
        if last is not None and last.topology == view.topology:
            triangles = last.triangles
        else:
            triangles = copied(view.indices, view.triangles, 3, np.uint32)
            triangles.flags.writeable = False
        moving = info.attributes & c.HTVM_MOVING_TEXCOORDS
        if last is not None and last.reference_topology == info.reference_topology and not moving:
            texcoords = last.texcoords
        else:
            texcoords = copied_attribute(view.texcoords, n, 2, np.float32)
            if texcoords is not None:
                texcoords.flags.writeable = False
        joints, orientations = np.empty((info.joints, 3)), np.empty((info.bones, 3, 3))
        for array, copy in ((joints, c.library.htvm_decoder_copy_joints),
                            (orientations, c.library.htvm_decoder_copy_orientations)):
            self._check(copy(self._handle, c.pointer(array, ctypes.c_double), array.size))
        self._last = Frame(
            copied(view.positions, n, 3, np.float32), triangles, copied_attribute(view.colours, n, 3, np.uint8),
            copied_attribute(view.normals, n, 3, np.float32), texcoords, number=number,
            timestamp_us=info.timestamp_us, kind=c.library.htvm_frame_kind_letter(info.type).decode(), reason=reason_of(info),
            bytes=info.bytes, topology=info.topology, reference_topology=info.reference_topology,
            presence=copied_presence(view.presence, n), joints=joints, orientations=orientations)
        return self._last

    def sequence(self) -> Optional[Sequence]:
        """None: there was no sequence header yet."""
        info = c.htvm_sequence_info()
        status = c.library.htvm_decoder_sequence(self._handle, info, ctypes.sizeof(info))
        if status == c.HTVM_AGAIN:
            return None
        self._check(status)
        return Sequence(
            fps=Fraction(info.fps_numerator, info.fps_denominator), up=up_axes.get(info.up),
            floor=info.floor if info.floor_known else None, unit_micrometres=info.unit_micrometres,
            lattice_step=info.lattice_step, metadata=dict(self._metadata(n) for n in range(info.metadata)),
            global_shift=self._global_shift(),
            skeleton=self._skeleton(info) if info.skeleton_tracked else None, session=info.session,
            stream_version=info.stream_version)

    def _global_shift(self) -> Tuple[int, int, int]:
        shift = (ctypes.c_int64 * 3)()
        self._check(c.library.htvm_decoder_global_shift(self._handle, shift))
        return shift[0], shift[1], shift[2]

    def _metadata(self, entry: int) -> Tuple[str, str]:
        key, value = ctypes.create_string_buffer(256), ctypes.create_string_buffer(4096)
        self._check(c.library.htvm_decoder_metadata(self._handle, entry, key, len(key), value, len(value)))
        return key.value.decode("utf-8", "replace"), value.value.decode("utf-8", "replace")

    def _skeleton(self, info: c.htvm_sequence_info) -> Skeleton:
        names, bones, radii = [], [], []
        for joint in range(info.joints):
            name = ctypes.create_string_buffer(256)
            self._check(c.library.htvm_decoder_joint_name(self._handle, joint, name, len(name)))
            names.append(name.value.decode("utf-8", "replace"))
        for bone in range(info.bones):
            first, second, radius = ctypes.c_uint32(), ctypes.c_uint32(), ctypes.c_double()
            self._check(c.library.htvm_decoder_bone(self._handle, bone, first, second, radius))
            bones.append((first.value, second.value))
            radii.append(radius.value)
        return Skeleton(names, bones, radii)


class Frames:
    """An iterator over frames. After an exception, next() goes on behind what caused it."""

    def __init__(self, packets: _Packets, decoder: _Decoder, first: int, count: Optional[int]) -> None:
        self._packets, self._decoder, self._first, self._left = packets, decoder, first, count
        self._needed: List[int] = []
        self._place = 0
        if first > 0 and not packets.forward_only:
            self._needed, self._place = packets.start_for(first)

    @property
    def sequence(self) -> Optional[Sequence]:
        """What the sequence header of the last frame says; None before the first."""
        return self._decoder.sequence()

    def __iter__(self) -> "Frames":
        return self

    def __next__(self) -> Frame:
        while self._left != 0:
            needed = bool(self._needed)
            packet = self._next_packet()
            if packet is None:
                break
            if packet.info is None:
                raise CorruptStream(f"{packet.size} bytes from byte {packet.offset} on are damaged, cut short, or a "
                                    "packet larger than max_packet_bytes")
            try:
                info = self._decoder.decode(self._packets.bytes_of(packet))
                if info is None or packet.number is None or needed or packet.number < self._first:
                    continue
                if self._left is not None:
                    self._left -= 1
                return self._decoder.frame(info, packet.number)
            except Error as error:
                raise type(error)(f"{packet.text()}: {error}") from None
        raise StopIteration

    def _next_packet(self) -> Optional[_Packet]:
        if self._needed:
            return self._packets.at(self._needed.pop(0))
        self._place += 1
        return self._packets.next() if self._packets.forward_only else self._packets.at(self._place - 1)


class Stream:
    """A stream, as `open` returns it. Iterating over it decodes its frames in order.

    A file's path and bytes in memory can be read from any frame on (`frames`, ``stream[number]``), as often as wanted,
    and have a length. A file object is read once, forward, as its bytes come.
    """

    def __init__(self, packets: _Packets, file: Optional[BinaryIO], options: c.htvm_decoder_options) -> None:
        self._packets, self._file, self._options = packets, file, options
        self._used = False

    @property
    def sequence(self) -> Sequence:
        """What the first sequence header says."""
        if self._packets.forward_only:
            raise BadInput("a file object is read only once: ask the iterator for its sequence")
        decoder = _Decoder(self._options)
        for packet in self._packets.each():
            if packet.info is not None and decoder.decode(self._packets.bytes_of(packet)) is None:
                sequence = decoder.sequence()
                if sequence is not None:
                    return sequence
        raise CorruptStream("the stream has no sequence header")

    def __iter__(self) -> Frames:
        return self.frames()

    def frames(self, first: int = 0, count: Optional[int] = None) -> Frames:
        """Decodes `count` frames, or all, from number `first` on, and before them only what they need."""
        if first < 0 or (count is not None and count < 0):
            raise BadInput("first and count must not be negative")
        if self._packets.forward_only:
            if self._used:
                raise BadInput("a file object can be read only once: open its path or its bytes instead")
            self._used = True
        return Frames(self._packets, _Decoder(self._options), first, count)

    def __getitem__(self, number: int) -> Frame:
        """The frame of that number. IndexError: there is none."""
        number = operator.index(number)
        if self._packets.forward_only:
            raise BadInput("a file object has no random access: open its path or its bytes instead")
        frame = next(self.frames(number, 1), None) if number >= 0 else None
        if frame is None or frame.number != number:
            raise IndexError(f"the stream has no frame {number}")
        return frame

    def _frame_packets(self) -> List[_Packet]:
        if self._packets.forward_only:
            raise BadInput("a file object must be read to know its frames: open its path or its bytes instead")
        return [packet for packet in self._packets.each() if packet.number is not None]

    @property
    def numbers(self) -> NDArray[np.uint32]:
        """The numbers of all frames, without decoding them. Those that rate control dropped are missing."""
        return np.array([packet.number for packet in self._frame_packets()], np.uint32)

    @property
    def timestamps_us(self) -> NDArray[np.int64]:
        """The frames' timestamps in microseconds, without decoding them."""
        return np.array([packet.timestamp_us for packet in self._frame_packets()], np.int64)

    def __len__(self) -> int:
        """How many frames there are. TypeError: a file object's are not known beforehand."""
        if self._packets.forward_only:
            raise TypeError("a file object must be read to know its length")  # as list() expects it
        return len(self._frame_packets())

    def close(self) -> None:
        """Closes the file that `open` opened. A file object of the caller's stays open."""
        if self._file is not None:
            self._file.close()

    def __enter__(self) -> "Stream":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def open(
    source: Source,
    *,
    threads: int = 0,
    max_vertices: Optional[int] = None,
    max_triangles: Optional[int] = None,
    max_packet_bytes: Optional[int] = None,
    max_memory: Optional[int] = None,
    detail_levels: Optional[int] = None,
) -> Stream:
    """Opens a stream: a path, bytes, or a binary file object such as a pipe or a socket's file.

    threads: that work at the same time; 0: one per core
    max_vertices, max_triangles, max_packet_bytes, max_memory: limits above which a frame is refused; None: the defaults
    of htvm.h, 2^22, 2^23, 2^28 and 2^32
    detail_levels: how many levels of detail are shown below the mesh that frames refer to, where a stream has any; None:
    all

    Raises CorruptStream if it is no htvm stream, and the errors of the operating system.
    """
    options = c.htvm_decoder_options()
    status = c.library.htvm_decoder_options_init(options, ctypes.sizeof(options))
    if status != c.HTVM_OK:
        raise c.error_of(status)
    given = {
        "threads": threads, "max_vertices": max_vertices, "max_triangles": max_triangles,
        "max_packet_bytes": max_packet_bytes, "max_memory": max_memory,
        "detail_levels": detail_levels,
    }
    for name, value in given.items():
        if value is None:
            continue
        if not 0 <= operator.index(value) < 1 << 8 * getattr(c.htvm_decoder_options, name).size:
            raise BadInput(f"{name} is out of range: {value}")
        setattr(options, name, value)
    file = None
    if isinstance(source, (bytes, bytearray, memoryview)):
        packets = _Packets(np.frombuffer(source, np.uint8), None, options.max_packet_bytes)
    elif isinstance(source, (str, os.PathLike)):
        packets, file = _packets_of_file(source, options.max_packet_bytes)
    else:
        packets = _Packets(np.empty(0, np.uint8), source, options.max_packet_bytes)
    if not packets.forward_only:
        packets.at(0)
    return Stream(packets, file, options)


def _packets_of_file(
    path: Union[str, "os.PathLike[str]"], most_bytes: int
) -> Tuple[_Packets, Optional[BinaryIO]]:
    file = io.open(path, "rb")
    status = os.fstat(file.fileno())
    if not stat.S_ISREG(status.st_mode):
        return _Packets(np.empty(0, np.uint8), file, most_bytes), file
    with file:
        data: Union[mmap.mmap, bytes] = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) if status.st_size else b""
    return _Packets(np.frombuffer(data, np.uint8), None, most_bytes), None
