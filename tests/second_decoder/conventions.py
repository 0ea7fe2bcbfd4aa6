"""Chapter 1 of docs/bitstream.md, the conventions: integer arithmetic, vectors, fields of bytes; and the two
kinds of error (chapter 10)."""
import struct

L = 1 << 24  # the lattice's limit


class Corrupt(Exception):
    """The bytes contradict themselves."""


class Unsupported(Exception):
    """The bytes are fine, but this decoder cannot read them."""


def check(condition, message):
    if not condition:
        raise Corrupt(message)


def tdiv(a, b):
    quotient = abs(a) // abs(b)
    return quotient if (a >= 0) == (b >= 0) else -quotient


def trem(a, b):
    return a - b * tdiv(a, b)


def rdiv(a, b):
    return (a + b // 2) // b if a >= 0 else -((-a + b // 2) // b)


def clamp(x, low, high):
    return low if x < low else high if x > high else x


def add(a, b):
    return tuple(x + y for x, y in zip(a, b))


def sub(a, b):
    return tuple(x - y for x, y in zip(a, b))


def squared_distance(a, b):
    return sum((x - y) * (x - y) for x, y in zip(a, b))


class Bytes:
    """Reads little-endian fields."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, n):
        check(n <= len(self.data) - self.at, "it ends too early")
        self.at += n
        return self.data[self.at - n : self.at]

    def rest(self):
        return self.take(len(self.data) - self.at)

    def field(self, code):
        return struct.unpack("<" + code, self.take(struct.calcsize("<" + code)))[0]

    def varint(self):
        value = 0
        for shift in range(0, 70, 7):
            byte = self.field("B")
            check(shift < 63 or byte <= 1, "a varint is too long")
            value |= (byte & 0x7F) << shift
            if byte < 0x80:
                return value

    def svarint(self):
        value = self.varint()
        return -(value + 1) // 2 if value & 1 else value // 2
