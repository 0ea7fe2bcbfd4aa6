#!/usr/bin/env python3
"""A second htvm decoder, written from docs/bitstream.md alone: for reading, not for speed. This file is the main
program: the order of packets (chapter 2) and the digest (chapter 12); the other chapters have modules of their own.

    decoder.py STREAM.htvm      prints a line per frame: type, counts, digest (section 12 of the document)

Section numbers in the comments are the document's. Python 3.8 or later, standard library only. I-frames that Draco
coded are not decoded.
"""
import copy
import os
import struct
import sys
import zlib

from audio import read_audio
from charts import TexturedSurface, decode_corners
from conventions import Corrupt, Unsupported, check
from enhanced import decode_enhanced_mesh, decode_predicted_mesh, read_codebook
from group import FrameGroup, read_group_payload
from intra import decode_intra_mesh
from levels import decode_leveled_mesh, detail_that_stays, with_detail
from nodes import Kept, smoothed
from reference import Reference, decode_pose
from patched import decode_patched_mesh
from picture import Pictures
from presence import decode_presence_layer, shown
from projection import decode_projection_layer, texcoords
from stream import (AUDIO, CHARTS, CODEBOOK, ENHANCED, INTRA, PATCHED, PICTURE, POSE, PREDICTED, PRESENCE, SEQUENCE, TRACKED,
                    packets, read_coded_frame, read_frame_payload, read_sequence_header)
from tracked import TrackedReference, decode_tracked_mesh


def digest(mesh):
    """Section 12."""
    crc = 0
    arrays = (mesh.positions, "<3i"), (mesh.triangles, "<3I"), (mesh.colours, "3B")
    for values, code in arrays + ((mesh.normals, "<3i"), (mesh.texcoords, "<2i")):
        for value in values or []:
            crc = zlib.crc32(struct.pack(code, *value), crc)
    return crc


def textured_surface(header, frame, mesh, detail, before=()):
    """How the mesh is shown in a stream with charts (6.8), or None. before: coordinates that a TP-frame keeps."""
    if header.layout != 2 or (not before and CHARTS not in frame.layers):
        return None
    check(not mesh.texcoords, "it has both charts and texture coordinates")
    corners, triangles = list(before), mesh.triangles[len(before):]
    if triangles:
        corners += decode_corners(frame.layer(CHARTS), header.picture, mesh.positions, triangles)
    return TexturedSurface(len(mesh.positions), mesh.triangles, corners, detail) if corners else None


def intra_presence(header, packet, frame, mesh):
    """Which vertices of an I-frame are there (8.19), None before version 7."""
    if header.version < 7:
        return None
    vertices = len(mesh.positions)
    if not packet.referred() or PRESENCE not in frame.layers:
        return [1] * vertices
    return decode_presence_layer(frame.layer(PRESENCE), vertices, mesh.triangles)


def intra_projection(header, frame, mesh):
    """How the camera saw an I-frame (6.10), or None."""
    if header.layout != 3 or CHARTS not in frame.layers:
        return None
    check(not mesh.texcoords, "it has both a projection and texture coordinates")
    return decode_projection_layer(frame.layer(CHARTS))


LEVELED = 2  # an intra coder


def intra_mesh(frame):
    """An I-frame's mesh, the step of its positions, and its detail, or None."""
    if frame.intra_coder == LEVELED:
        mesh, detail = decode_leveled_mesh(frame)
        return mesh, 1, detail
    return decode_intra_mesh(frame), frame.geometry_step, None


def projected(mesh, projection):
    """The mesh with the texture coordinates of its frame's projection (6.10), if it has one."""
    if projection is None:
        return mesh
    out = copy.copy(mesh)
    out.texcoords = texcoords(projection, mesh.positions)
    return out


class Group:
    """An I- or TP-frame and what T-frames make of it (8.11). presence: None before version 7. detail: of the mesh
    (6.9), or None. projection: of the frame (6.10), or None."""

    def __init__(self, mesh, frame, number, step=1, kept=Kept(), textured=None, presence=None, detail=None,
                 projection=None):
        self.mesh, self.frame, self.number, self.step, self.kept = mesh, frame, number, step, kept
        self.textured, self.presence, self.detail, self.projection = textured, presence, detail, projection
        self.reference = self.state = self.last = self.group = None

    def shown(self, mesh, presence, projection):
        """A mesh of its vertices, as it is shown. presence: None before version 7. projection: of its frame."""
        mesh, presence = with_detail(self.detail, mesh, presence)
        mesh = projected(mesh, projection)
        if self.textured:
            mesh = self.textured.show(mesh)
        return mesh if presence is None else shown(mesh, presence, self.textured.copied if self.textured else ())

    def tracked_reference(self, header):
        check(header.node_spacing > 0, "the header allows no tracked frames")
        self.reference = self.reference or TrackedReference(
            self.mesh, self.frame.captured, self.step, header.node_spacing, self.kept, self.presence, self.projection)
        return self.reference

    def decode(self, packet, header):
        """The mesh of a T-frame, as it is shown."""
        mesh, state = self.decode_tracked(packet, header)
        return self.shown(mesh, state.presence if header.version >= 7 else None, getattr(state, "projection", None))

    def decode_tracked(self, packet, header):
        if header.version < 5:
            return self.decode_single(packet, header, packet.payload)
        length, frame, brought = read_group_payload(packet.payload)
        if length == 1:
            return self.decode_single(packet, header, brought[0][1])
        if frame > 1:
            check(self.group, "its group is not there")
            self.group.check_goes_on(packet, length, frame)
            return self.group.take(header.version, self.tracked_reference(header), frame, brought)
        before = self.before(packet)
        check(packet.referred(), "a group that nothing may refer to")
        group = FrameGroup(packet.frame, length, before)
        mesh, state = group.take(header.version, self.tracked_reference(header), frame, brought)
        self.group, self.state, self.last = group, group.states[length], packet.frame
        return mesh, state

    def before(self, packet):
        before = self.state if self.last == packet.reference else None
        check(before or self.number == packet.reference, "its reference is not there")
        return before

    def decode_single(self, packet, header, payload):
        before = self.before(packet)
        mesh, state = decode_tracked_mesh(payload, header.version, self.tracked_reference(header), before)
        if packet.referred():
            self.state, self.last, self.group = state, packet.frame, None
        return mesh, state

    def decode_patched(self, packet, header):
        """The mesh, the joints, and the group that follows."""
        check(self.number == packet.reference, "its reference is not there")
        check(packet.referred(), "a patched frame that nothing may refer to")
        frame = read_coded_frame(packet)
        joints, _ = decode_pose(frame.layer(POSE), len(header.joints), len(header.bones))
        mesh, presence, stay, kept, projection = decode_patched_mesh(frame, self.tracked_reference(header))
        detail = detail_that_stays(self.detail, len(self.mesh.positions), stay, mesh)
        textured = None
        if self.textured:
            stays = set(stay)
            before = [corners for triangle, corners in zip(self.mesh.triangles, self.textured.corners)
                      if stays.issuperset(triangle)]
            textured = textured_surface(header, frame, mesh, detail, before)
        group = Group(mesh, frame, packet.frame, kept=kept, textured=textured, presence=presence, detail=detail,
                      projection=projection)
        return mesh, joints, group


def decode_stream(data):
    """Yields (packet, header, mesh) for each frame, or (packet, None, error) for a packet that is wrong."""
    header = reference = group = None
    books = [None, None]
    highest = -1  # number of a frame since the sequence began
    pictures = Pictures()
    for packet in packets(data):
        if packet.kind in (INTRA, ENHANCED, PREDICTED, TRACKED, PATCHED):
            highest = max(highest, packet.frame)
            pictures.frame = packet.frame
        try:
            if packet.kind == SEQUENCE:
                new = read_sequence_header(packet.payload)
                repeated = header is not None and packet.payload == header.bytes
                if not repeated or (new.session == 0 and packet.frame <= highest):
                    reference, group, books, highest = None, None, [None, None], -1
                    pictures = Pictures()
                header = new
            elif packet.kind == CODEBOOK:
                book = read_codebook(packet.payload)
                if reference and reference.frame == packet.reference:
                    books[book.purpose] = book
            elif packet.kind == AUDIO:
                read_audio(packet.payload)
            elif packet.kind == PICTURE:
                pictures.take(packet)
            elif packet.kind == INTRA:
                check(header, "a frame came before any sequence header")
                frame = read_coded_frame(packet)
                joints, _ = decode_pose(frame.layer(POSE), len(header.joints), len(header.bones))
                mesh, step, detail = intra_mesh(frame)
                if frame.intra_coder != LEVELED and header.version >= 4 and header.node_spacing > 0:
                    if not packet.of_tracked_mesh():
                        mesh.positions = smoothed(mesh.positions, mesh.triangles, step, at_seams=bool(mesh.texcoords))
                    step = 1
                textured = textured_surface(header, frame, mesh, detail)
                presence = intra_presence(header, packet, frame, mesh)
                projection = intra_projection(header, frame, mesh)
                own = Group(mesh, frame, packet.frame, step, textured=textured, presence=presence, detail=detail,
                            projection=projection)
                if packet.referred():
                    reference, books, group = Reference(mesh, joints, header, packet.frame), [None, None], own
                yield packet, header, own.shown(mesh, presence, projection)
            elif packet.kind == TRACKED:
                check(group, "its reference is not there")
                yield packet, header, group.decode(packet, header)
            elif packet.kind == PATCHED:
                check(group, "its reference is not there")
                mesh, joints, group = group.decode_patched(packet, header)
                reference, books = Reference(mesh, joints, header, packet.frame), [None, None]
                yield packet, header, group.shown(mesh, group.presence, group.projection)
            elif packet.kind in (ENHANCED, PREDICTED):
                check(header, "a frame came before any sequence header")
                check(reference and reference.frame == packet.reference, "its reference is not there")
                if packet.kind == PREDICTED:
                    frame = read_frame_payload(packet.payload)
                    mesh = decode_predicted_mesh(frame, reference)
                    yield packet, header, group.shown(mesh, group.presence, group.projection)
                else:
                    frame = read_coded_frame(packet)
                    yield packet, header, projected(decode_enhanced_mesh(frame, reference, books, header.m),
                                                    group.projection)
        except (Corrupt, Unsupported) as error:
            yield packet, None, error


def main(arguments):
    if len(arguments) != 1:
        print(__doc__)
        return 2
    with open(arguments[0], "rb") as file:
        data = file.read()
    failed = not any(packets(data))
    if failed:
        print("there is no packet in it")
    for packet, header, mesh in decode_stream(data):
        if header is None:
            print("packet at %d: %s: %s" % (packet.offset, type(mesh).__name__.lower(), mesh))
            failed = True
            continue
        attributes = [name for name in ("colours", "normals", "texcoords") if getattr(mesh, name)]
        kind = {INTRA: "I", ENHANCED: "EP", PREDICTED: "P", TRACKED: "T", PATCHED: "TP"}[packet.kind]
        print("frame %d %s %d vertices %d triangles %s %08x" % (
            packet.frame, kind, len(mesh.positions), len(mesh.triangles), "+".join(attributes) or "-", digest(mesh)))
    return 1 if failed else 0


if __name__ == "__main__":
    try:
        status = main(sys.argv[1:])
        sys.stdout.flush()
    except BrokenPipeError:  # whoever was reading has read enough, as in `decoder.py STREAM.htvm | head -1`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # or Python complains when it flushes at exit
        status = 1
    sys.exit(status)
