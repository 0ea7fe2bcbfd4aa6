"""Chapters 2 to 4 of docs/bitstream.md: packets, the sequence header, the frame payload.
Nothing in here is entropy-coded."""
import struct
import zlib

from conventions import Bytes, L, Unsupported, check


# ---------------------------------------------------------------------------------------------- 2. packets

SEQUENCE, INTRA, ENHANCED, CODEBOOK, INDEX, PREDICTED, TRACKED, AUDIO, PATCHED, PICTURE = 1, 2, 3, 4, 5, 6, 7, 10, 11, 12
REFERRED, OF_TRACKED_MESH, FLAGS_VALID = 1, 32, 128  # flags


class Packet:
    def referred(self):
        """Whether later frames may refer to this I-, T- or TP-frame (2.1)."""
        return not self.flags & FLAGS_VALID or self.flags & REFERRED != 0

    def of_tracked_mesh(self):
        """Whether this I-frame's positions are not smoothed (2.1)."""
        return self.flags & FLAGS_VALID and self.flags & OF_TRACKED_MESH


def packets(data, max_payload=1 << 28):
    """Every whole packet of a stream; damage is skipped."""
    at = 0
    while True:
        at = data.find(b"HTVP", at)
        if at < 0 or at + 32 > len(data):
            return
        packet = Packet()
        (packet.kind, packet.flags, packet.frame, packet.reference, packet.timestamp, size, crc) = struct.unpack(
            "<BB2xIIqII", data[at + 4 : at + 32]
        )
        if zlib.crc32(data[at + 4 : at + 28]) != crc or size > max_payload:
            at += 1
            continue
        packet.payload = data[at + 32 : at + 32 + size]
        tail = data[at + 32 + size : at + 36 + size]
        if len(tail) < 4 or struct.unpack("<I", tail)[0] != zlib.crc32(packet.payload):
            at += 32
            continue
        packet.offset = at
        yield packet
        at += 36 + size


# ---------------------------------------------------------------------------------------------- 3. sequence header


class Header:
    pass


def read_sequence_header(payload):
    read = Bytes(payload)
    header = Header()
    check(read.take(4) == b"htvm", "this is no htvm stream")
    version = read.field("H")
    if not 1 <= version <= 8:
        raise Unsupported("version %d; this decoder reads 1 to 8" % version)
    header.version = version
    header.bits = read.field("B")
    header.origin = [read.field("i") for _ in range(3)]
    header.fps = (read.field("I"), read.field("I"))
    header.unit = read.field("I")
    header.m = read.field("B")
    header.weight_width = read.field("I")
    header.tracked = read.field("B") != 0
    joints = read.field("H")
    check(header.bits <= 16 and min(header.fps) > 0 and header.unit > 0, "a field is out of range")
    check(header.weight_width <= L, "a field is out of range")
    check(1 <= header.m <= 64 and joints <= 1024, "a field is out of range")
    header.joints = [read.take(read.field("B")) for _ in range(joints)]
    bones = read.field("H")
    check(1 <= bones <= 1024, "a wrong number of bones")
    header.bones, header.radii = [], []
    for _ in range(bones):
        bone = (read.field("H"), read.field("H"))
        radius = read.field("I")
        check(max(bone) < joints and radius <= L, "a bone is out of range")
        header.bones.append(bone)
        header.radii.append(radius)
    header.node_spacing = read.field("I") if version > 1 or len(read.data) - read.at >= 4 else 0
    check(header.node_spacing <= L, "the nodes' spacing is out of range")
    header.session, header.metadata, header.global_shift, optional = 0, [], (0, 0, 0), 0
    if version > 1:
        header.session = read.field("Q")
        header.up, optional = read.field("B"), read.field("B")
        check(header.up <= 6, "there is no such axis")
        if optional & 1:
            header.floor = read.field("i")
            check(abs(header.floor) <= L and header.up > 0, "the floor is out of range")
        if optional & 2:
            header.metadata = read_metadata(read)
    header.layout, header.picture = 0, (0, 0)
    if version >= 6:
        header.layout, header.picture = read.varint(), (read.varint(), read.varint())
        if header.layout > (3 if version >= 8 else 2):
            raise Unsupported("texture layout %d" % header.layout)
        sizes = range(1, 4097) if header.layout > 0 else [0]
        check(all(side in sizes for side in header.picture), "the size of the pictures is out of range")
    if optional & 4:
        header.global_shift = tuple(read.field("q") for _ in range(3))
        check(all(abs(c) < 2**53 for c in header.global_shift), "the global shift is out of range")
    header.bytes = payload
    return header


def read_metadata(read):
    entries = []
    for _ in range(read.field("B")):
        key = read.take(read.field("B"))
        value = read.take(read.field("H"))
        check(key and len(value) <= 4095, "a key without bytes, or a value of too many")
        for text in (key, value):
            try:
                text.decode("utf-8")
            except UnicodeDecodeError:
                check(False, "metadata is not UTF-8")
            check(b"\0" not in text, "metadata has a zero in it")
        entries.append((key, value))
    check(sum(len(key) + len(value) for key, value in entries) <= 16384, "there is too much metadata")
    return entries


# ---------------------------------------------------------------------------------------------- 4. frame payload

(POSE, TRANSFORMS, GEOMETRY, COLOUR, NORMALS, TEXCOORDS, MAPPING, FANS, DISTANCE_ORDERS, EXTERNAL,
 CODED_BONES, TRACKED_RUN, REMOVED, BORDER, CHARTS, PRESENCE, REASON, LEVELS, LEVEL_COLOURS) = range(1, 20)

REASONS = "none", "due", "patches", "surface", "region", "strays", "border", "texture", "rate", "cut"  # 8.20


class Frame:
    def layer(self, number):
        return self.layers.get(number, b"")

    def reason(self):
        """Why an I- or TP-frame was sent (8.20)."""
        layer = self.layer(REASON)
        return REASONS[layer[0] if len(layer) == 1 and layer[0] < len(REASONS) else 0]


def read_frame_payload(payload):
    read = Bytes(payload)
    fields = [read.varint() for _ in range(9)]
    check(max(fields) < 1 << 31, "a number is out of range")
    frame = Frame()
    frame.captured = fields[0:2]
    frame.vertices, frame.triangles, frame.geometry_step, frame.colour_step = fields[2:6]
    frame.intra_coder, frame.geometry_codebook, frame.colour_codebook = fields[6:9]
    check(1 <= frame.geometry_step <= 1 << 24 and 1 <= frame.colour_step <= 255, "a step is out of range")
    table = []
    for _ in range(read.field("B")):
        table.append((read.field("B"), read.varint()))
    frame.layers = {}
    for number, size in table:
        layer = read.take(size)
        if number < 20:
            check(number not in frame.layers, "a layer comes twice")
            frame.layers[number] = layer
    return frame


def read_coded_frame(packet):
    """The payload of an I-, EP- or TP-frame, which has a least size."""
    frame = read_frame_payload(packet.payload)
    least = max(-(-frame.vertices // 64), -(-frame.triangles // 128))
    check(len(packet.payload) >= least, "the payload is too short for so many vertices or triangles")
    return frame
