"""What can go wrong, as exceptions: one for each kind of error that the library distinguishes."""

from __future__ import annotations


class Error(Exception):
    """Any failure of htvm. The text is one sentence: what, where, and what to do where that is known."""


class BadInput(Error, ValueError):
    """An argument, an option, a mesh or a file is not what it must be."""


class CorruptStream(Error):
    """The stream is damaged or ends too early. Frames behind the damage may still be decoded."""


class Unsupported(Error):
    """Valid, but not supported by this version."""


class LimitExceeded(Error):
    """Larger than a configured limit, such as ``max_memory``."""


class OutOfMemory(Error, MemoryError):
    """An allocation failed."""


class InternalError(Error):
    """A bug in htvm: please report it."""


class ProgramError(Error):
    """The program ``htvm``, which `compare` runs, was not found or failed."""
