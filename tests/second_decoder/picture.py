"""Chapter 14 of docs/bitstream.md: packets of texture pictures. What AV1, VP9, H.264 and the coders of images code is not
decoded.

  picture.py STREAM.htvm    prints the pictures as tests/data/conformance/pictures_6.pictures has them, but for the digest of
                            what is decoded
"""
import sys
import zlib

from conventions import Bytes, check

VIDEO, IMAGES = (1, 2, 3), (16, 17, 18)
MATRICES = (1, 6)


class Picture:
    pass


def read_picture(packet):
    """None where the coder or the matrix is unknown."""
    read = Bytes(packet.payload)
    picture = Picture()
    picture.coder, colours = read.field("B"), read.field("B")
    if picture.coder not in VIDEO + IMAGES:
        return None
    picture.width, picture.height = read.varint(), read.varint()
    picture.gains = [read.field("H") for _ in range(3)]
    check(1 <= picture.width <= 4096 and 1 <= picture.height <= 4096, "a picture's width or height is out of range")
    if picture.coder in VIDEO and colours & 15 not in MATRICES:
        return None
    picture.matrix, picture.full_range = (colours & 15, colours & 16 != 0) if picture.coder in VIDEO else (0, False)
    picture.coded = read.data[read.at :]
    check(picture.coded, "a picture has nothing in it")
    check(picture.coder in VIDEO or packet.reference == packet.frame, "an image file that needs another picture")
    return picture


class Pictures:
    """Those of a sequence, in order: each behind its frame, and the one that it needs before it."""

    def __init__(self):
        self.frame = self.last = None

    def take(self, packet):
        picture = read_picture(packet)
        if picture is None:
            return
        check(packet.frame == self.frame, "a picture is not behind its frame")
        check(packet.reference in (packet.frame, self.last), "the picture that it needs is not there")
        if packet.referred():
            self.last = packet.frame


def main(path):
    from stream import PICTURE, packets

    with open(path, "rb") as file:
        data = file.read()
    for packet in packets(data):
        if packet.kind != PICTURE:
            continue
        picture = read_picture(packet)
        if picture is None:
            print("%d unknown" % packet.frame)
            continue
        print(packet.frame, picture.coder, picture.width, picture.height, *picture.gains, picture.matrix,
              int(picture.full_range), "%08x" % zlib.crc32(picture.coded))


if __name__ == "__main__":
    main(*sys.argv[1:])
