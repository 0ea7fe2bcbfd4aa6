"""Publishing and watching live streams through a hub (docs/live.md)."""

from __future__ import annotations

import ctypes
import io
import os
from pathlib import Path
from typing import Any, Optional, Union

from . import _interface as c
from .errors import BadInput


class _Options(ctypes.Structure):
    _fields_ = [
        ("struct_size", ctypes.c_uint32),
        ("insecure", ctypes.c_uint32),
        ("token", ctypes.c_char_p),
        ("certificates", ctypes.c_char_p),
    ]


class _State(ctypes.Structure):
    _fields_ = [
        ("struct_size", ctypes.c_uint32),
        ("connected", ctypes.c_uint32),
        ("connections", ctypes.c_uint64),
        ("sent_packets", ctypes.c_uint64),
        ("sent_bytes", ctypes.c_uint64),
        ("dropped_frames", ctypes.c_uint64),
        ("queue_bytes", ctypes.c_uint64),
        ("viewers", ctypes.c_uint64),
    ]


_handle = ctypes.c_void_p
_create = [ctypes.c_char_p, ctypes.POINTER(_Options), ctypes.POINTER(_handle), ctypes.c_char_p, ctypes.c_size_t]
_functions = {
    "htvm_live_options_init": (ctypes.c_int32, [ctypes.POINTER(_Options), ctypes.c_size_t]),
    "htvm_publisher_create": (ctypes.c_int32, _create),
    "htvm_publisher_destroy": (None, [_handle]),
    "htvm_publisher_send": (ctypes.c_int32, [_handle, ctypes.c_char_p, ctypes.c_size_t]),
    "htvm_publisher_wants_key_frame": (ctypes.c_int, [_handle]),
    "htvm_publisher_get_state": (ctypes.c_int32, [_handle, ctypes.POINTER(_State), ctypes.c_size_t]),
    "htvm_publisher_finish": (ctypes.c_int32, [_handle, ctypes.c_int, ctypes.c_uint32]),
    "htvm_publisher_last_error": (ctypes.c_char_p, [_handle]),
    "htvm_watcher_create": (ctypes.c_int32, _create),
    "htvm_watcher_destroy": (None, [_handle]),
    "htvm_watcher_receive": (
        ctypes.c_int32,
        [_handle, ctypes.c_uint32, ctypes.POINTER(ctypes.c_void_p), ctypes.POINTER(ctypes.c_size_t)]),
    "htvm_watcher_stop": (None, [_handle]),
    "htvm_watcher_last_error": (ctypes.c_char_p, [_handle]),
}
_library: Any = None


def _load() -> Any:
    """The library for live streams, which needs OpenSSL: loaded where it is first used."""
    global _library
    if _library is None:
        path = os.environ.get("HTVM_LIVE_LIBRARY") or str(Path(__file__).with_name("libhtvm_c_live.so"))
        try:
            library = ctypes.CDLL(path)
        except OSError as error:
            raise ImportError(
                f"htvm's library for live streams cannot be loaded ({error}). Set HTVM_LIVE_LIBRARY to the path of "
                "libhtvm_c_live.so") from error
        for name, (result, parameters) in _functions.items():
            function = getattr(library, name)
            function.restype = result
            function.argtypes = parameters
        _library = library
    return _library


def _made(kind: str, url: str, token: Optional[str], certificates: Optional[str], insecure: bool) -> Any:
    library = _load()
    options = _Options()
    library.htvm_live_options_init(options, ctypes.sizeof(options))
    options.insecure = int(insecure)
    options.token = token.encode() if token else None
    options.certificates = os.fsencode(certificates) if certificates else None
    handle, text = _handle(), ctypes.create_string_buffer(512)
    status = getattr(library, f"htvm_{kind}_create")(url.encode(), options, handle, text, len(text))
    if status != c.HTVM_OK:
        raise c.error_of(status, text.value)
    return handle


class Publisher:
    """Sends a stream to a hub while it is made: what an Encoder writes to.

        with htvm.Publisher("wss://hub.example/publish/anna", token=token) as publisher:
            encoder = htvm.Encoder(publisher, session=publisher.session)
            for mesh in rig:
                encoder.push(mesh, force_intra=publisher.wants_key_frame())
            encoder.finish()

    It never waits: what the line does not take is dropped so that the rest can be decoded, and a lost line or a restarted
    hub ends nothing. One thread at a time uses it. Leaving the block keeps the stream for whoever goes on with it;
    ``finish()`` ends it.

    url: ws://HOST[:PORT]/publish/NAME, or wss:// for TLS
    token: of whoever may publish the stream
    certificates: a PEM file of those who may vouch for the hub's; None: the system's
    insecure: takes any certificate, for tests alone
    """

    def __init__(self, url: str, *, token: Optional[str] = None, certificates: Optional[str] = None,
                 insecure: bool = False) -> None:
        self._handle: Any = None
        self._handle = _made("publisher", url, token, certificates, insecure)
        self.session = int.from_bytes(os.urandom(8), "little") >> 12 | 1  # for the encoder: drawn for this run

    def __enter__(self) -> Publisher:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __del__(self) -> None:
        if self._handle is not None:
            _library.htvm_publisher_destroy(self._handle)

    def _check(self, status: int) -> None:
        if status != c.HTVM_OK:
            raise c.error_of(status, _library.htvm_publisher_last_error(self._handle))

    def _open_handle(self) -> Any:
        if self._handle is None:
            raise BadInput("the publisher is closed")
        return self._handle

    def write(self, data: Union[bytes, bytearray]) -> int:
        """Sends whole packets, as an encoder gives them. Raises BadInput once the hub has refused the stream."""
        self._check(_load().htvm_publisher_send(self._open_handle(), bytes(data), len(data)))
        return len(data)

    def wants_key_frame(self) -> bool:
        """Whether the next frame should be an I-frame, since somebody cannot go on without one; said once a time."""
        return bool(_load().htvm_publisher_wants_key_frame(self._open_handle()))

    def _state(self) -> _State:
        state = _State()
        self._check(_load().htvm_publisher_get_state(self._open_handle(), state, ctypes.sizeof(state)))
        return state

    @property
    def connected(self) -> bool:
        return bool(self._state().connected)

    @property
    def viewers(self) -> int:
        """By the hub's last heartbeat; 0 as long as there was none."""
        return int(self._state().viewers)

    @property
    def dropped_frames(self) -> int:
        """Those that the line did not take in time, or while there was none."""
        return int(self._state().dropped_frames)

    def finish(self, timeout: float = 5.0) -> None:
        """Sends what waits and ends the stream, which viewers are told. LimitExceeded: not all of it in this time."""
        self._end(True, timeout)

    def close(self, timeout: float = 5.0) -> None:
        """Sends what waits; the hub keeps the stream for whoever goes on with it."""
        if self._handle is not None:
            self._end(False, timeout)

    def _end(self, ends: bool, timeout: float) -> None:
        handle = self._open_handle()
        try:
            self._check(_library.htvm_publisher_finish(handle, int(ends), round(1000 * timeout)))
        finally:
            self._handle = None
            _library.htvm_publisher_destroy(handle)


class _Watcher(io.RawIOBase):
    def __init__(self, handle: Any) -> None:
        self._handle = handle
        self._left = b""

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        while not self._left:
            if self._handle is None:
                return 0
            data, count = ctypes.c_void_p(), ctypes.c_size_t()
            # In short waits, so that Ctrl-C is heard.
            status = _library.htvm_watcher_receive(self._handle, 200, data, count)
            if status == c.HTVM_OK:
                self._left = ctypes.string_at(data, count.value)
            elif status == c.HTVM_END:
                return 0
            elif status != c.HTVM_AGAIN:
                raise c.error_of(status, _library.htvm_watcher_last_error(self._handle))
        size = min(len(buffer), len(self._left))
        buffer[:size] = self._left[:size]
        self._left = self._left[size:]
        return size

    def close(self) -> None:
        handle, self._handle = self._handle, None
        if handle is not None:
            _library.htvm_watcher_destroy(handle)
        super().close()


def watch(url: str, *, certificates: Optional[str] = None, insecure: bool = False) -> io.RawIOBase:
    """A live stream as a binary file object, which ends where the stream does.

        for frame in htvm.open(htvm.watch("wss://hub.example/watch/anna")):
            print(frame.number, frame.positions.shape)

    A lost line or a restarted hub ends nothing; it connects again and goes on. One thread at a time reads it.

    url: ws://HOST[:PORT]/watch/NAME, with the query of a link if the hub asks for links, or wss:// for TLS
    """
    return _Watcher(_made("watcher", url, None, certificates, insecure))
