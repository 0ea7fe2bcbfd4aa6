import io
import os
import threading
import zlib
from fractions import Fraction

import numpy as np
import pytest
from conftest import conformance, encode, sheet

import htvm

streams = sorted(conformance.glob("*.htvm"))


def digest(frame):
    arrays = (frame.positions, frame.triangles, frame.colours, frame.normals, frame.texcoords)
    return zlib.crc32(b"".join(array.tobytes() for array in arrays if array is not None))


def numbered_on(lines):
    """The lines of a file of digests, with the frames of later sequences numbered on from those before."""
    offset = highest = 0
    for line in lines:
        own, rest = line.split(" ", 1)
        if offset + int(own) < highest:
            offset = highest
        highest = offset + int(own) + 1
        yield f"{offset + int(own)} {rest}"


@pytest.mark.parametrize("path", streams, ids=lambda path: path.stem)
def test_conformance_streams_decode_to_the_same_bits(path):
    lines = [f"{frame.number} {frame.kind[0]} {len(frame.positions)} {len(frame.triangles)} {digest(frame):08x}"
             for frame in htvm.open(path)]
    assert lines == list(numbered_on(path.with_suffix(".digests").read_text().splitlines()))


def test_a_path_bytes_and_a_file_object_give_the_same_frames(stream, tmp_path):
    path = tmp_path / "sheet.htvm"
    path.write_bytes(stream)
    expected = [digest(frame) for frame in htvm.open(path)]
    assert len(expected) == 12
    with path.open("rb") as file:
        for source in (str(path), stream, bytearray(stream), memoryview(stream), io.BytesIO(stream), file):
            assert [digest(frame) for frame in htvm.open(source)] == expected


def test_a_pipe_gives_frames_as_they_come():
    read, write = os.pipe()
    with open(read, "rb") as source, open(write, "wb", buffering=0) as sink:
        frames = iter(htvm.open(source))
        encoder = htvm.Encoder(subject_size=1000)
        for number in range(3):
            for packet in encoder.push(sheet(number)):
                sink.write(packet)
            assert next(frames).number == number
        assert frames.sequence.fps == 30


def test_arrays_have_the_shapes_and_types_that_are_promised(stream):
    frame = next(iter(htvm.open(stream)))
    assert frame.positions.dtype == np.float32 and frame.positions.shape[1] == 3
    assert frame.triangles.dtype == np.uint32 and frame.triangles.shape[1] == 3
    assert frame.colours.dtype == np.uint8 and frame.colours.shape == frame.positions.shape
    assert frame.normals is None and frame.texcoords is None
    frame = next(iter(htvm.open(conformance / "no_skeleton_all_attributes.htvm")))
    assert frame.normals.shape == frame.positions.shape and frame.texcoords.shape == (len(frame.positions), 2)
    frame = next(iter(htvm.open(conformance / "person_2.htvm")))
    assert frame.joints.shape[1:] == (3,) and frame.orientations.shape[1:] == (3, 3)
    assert np.allclose(frame.orientations @ frame.orientations.transpose(0, 2, 1), np.eye(3), atol=1e-6)


def test_frames_that_are_kept_stay_as_they_are(stream):
    one_by_one = [frame.positions.copy() for frame in htvm.open(stream)]
    for kept, copied in zip(list(htvm.open(stream)), one_by_one):
        assert np.array_equal(kept.positions, copied)


def test_frames_of_a_topology_share_their_triangles_which_cannot_be_written_to(stream):
    frames = list(htvm.open(stream))
    assert [frame.kind for frame in frames] == ["I", "T", "T", "T"] * 3
    assert frames[1].triangles is frames[0].triangles and frames[1].topology == frames[0].topology
    assert frames[4].topology != frames[0].topology
    with pytest.raises(ValueError):
        frames[0].triangles[0] = 0
    frames[0].copy().triangles[0] = 0


def test_a_frame_says_why_it_was_sent():
    told = {frame.number: (frame.kind, frame.reason) for frame in htvm.open(conformance / "reasons_4.htvm")
            if frame.kind != "T"}
    assert told == {0: ("I", None), 2: ("TP", "region"), 4: ("I", "due"), 8: ("I", None)}


def test_a_frame_says_which_vertices_are_there():
    frames = list(htvm.open(conformance / "presence_7.htvm"))
    assert {frame.presence is None for frame in frames} == {True, False}
    first = {}
    for frame in frames:
        of_reference = first.setdefault(frame.reference_topology, frame)
        assert len(frame.positions) == len(of_reference.positions)
        assert (frame.texcoords is None) == (of_reference.texcoords is None)
        assert frame.texcoords is None or np.array_equal(frame.texcoords, of_reference.texcoords)
        assert (frame.topology == frame.reference_topology) == (frame.presence is None)
        if frame.presence is not None:
            assert frame.presence.shape == (len(frame.positions),) and not frame.presence.all()
            assert frame.presence[frame.triangles].all()


def test_shown_leaves_out_what_no_triangle_names():
    frame = next(f for f in htvm.open(conformance / "presence_7.htvm") if f.presence is not None)
    shown = frame.shown()
    assert shown.presence is None and shown.number == frame.number
    assert sorted(np.unique(shown.triangles)) == list(range(len(shown.positions)))
    assert len(shown.positions) < len(frame.positions)
    for name in ("positions", "colours", "normals", "texcoords"):
        rows = getattr(frame, name)
        assert rows is None or np.array_equal(rows[frame.triangles], getattr(shown, name)[shown.triangles])
    whole = next(f for f in htvm.open(conformance / "presence_7.htvm") if f.presence is None)
    assert whole.shown() is whole


@pytest.mark.parametrize("path", streams, ids=lambda path: path.stem)
def test_any_frame_can_be_the_first(path):
    stream = htvm.open(path)
    expected = {frame.number: digest(frame) for frame in stream}
    for first in list(stream.numbers)[::3]:
        found = {frame.number: digest(frame) for frame in stream.frames(int(first), 2)}
        assert found == {n: expected[n] for n in sorted(expected) if n >= first and n in found}
        assert len(found) == min(2, sum(n >= first for n in expected))


def test_seeking_decodes_only_what_is_needed(stream, monkeypatch):
    decoded = []
    decode = htvm.stream._Decoder.decode
    monkeypatch.setattr(htvm.stream._Decoder, "decode",
                        lambda self, packet: decoded.append(len(packet)) or decode(self, packet))
    assert htvm.open(stream)[8].kind == "I"
    assert len(decoded) == 2, "the sequence header and the frame"


def test_a_stream_is_indexed_by_frame_number(stream):
    opened = htvm.open(stream)
    assert len(opened) == 12 and list(opened.numbers) == list(range(12))
    assert opened.timestamps_us[3] == 100000
    assert digest(opened[7]) == digest(list(opened)[7]) and opened[7].number == 7
    for number in (12, -1):
        with pytest.raises(IndexError):
            opened[number]
    assert [frame.number for frame in opened.frames(10)] == [10, 11]
    assert list(opened.frames(99)) == []


def test_joined_streams_are_numbered_on(stream):
    joined = htvm.open(stream + stream)
    assert list(joined.numbers) == list(range(24))
    assert [frame.number for frame in joined.frames(11, 2)] == [11, 12]
    assert digest(joined[20]) == digest(htvm.open(stream)[8])


def test_a_file_object_is_read_once_and_has_no_random_access(stream):
    opened = htvm.open(io.BytesIO(stream))
    for call in (lambda: opened[3], lambda: opened.numbers, lambda: opened.sequence):
        with pytest.raises(htvm.BadInput, match="file object"):
            call()
    with pytest.raises(TypeError, match="file object"):
        len(opened)
    assert [frame.number for frame in opened.frames(5, 2)] == [5, 6]
    with pytest.raises(htvm.BadInput, match="only once"):
        iter(opened)
    assert len(list(htvm.open(io.BytesIO(stream)))) == 12


def test_the_sequence_header_is_told():
    skeleton = htvm.Skeleton(["pelvis", "neck", "head"], [(0, 1), (1, 2)], [100, 50])
    encoder = htvm.Encoder(fps="30000/1001", skeleton=skeleton, up="-z", floor=12.5, global_shift=(500000000, -1, 4649776000),
                           unit_micrometres=10000,
                           metadata={"title": "Ein Gang", "rights": "©"}, subject_size=1000)
    packets = encoder.push(sheet(0), htvm.Pose([[50, 10, 0], [50, 60, 0], [50, 100, 0]]))
    sequence = htvm.open(b"".join(packets)).sequence
    assert sequence.fps == Fraction(30000, 1001)
    assert (sequence.up, sequence.floor, sequence.unit_micrometres) == ("-z", 12.5, 10000)
    assert sequence.global_shift == (500000000, -1, 4649776000)
    assert sequence.metadata == {"title": "Ein Gang", "rights": "©"}
    assert sequence.skeleton.joint_names == ["pelvis", "neck", "head"]
    assert sequence.skeleton.bones == [(0, 1), (1, 2)]
    assert np.allclose(sequence.skeleton.radii, [100, 50], rtol=0.01)
    assert htvm.open(b"".join(encode(1))).sequence.skeleton is None


def taken_until_damage(source):
    """Numbers of the frames, and the sentences of what went wrong between them."""
    frames, numbers, sentences = iter(htvm.open(source)), [], []
    while True:
        try:
            frame = next(frames, None)
        except htvm.CorruptStream as error:
            sentences.append(str(error))
            continue
        if frame is None:
            return numbers, sentences
        numbers.append(frame.number)


@pytest.mark.parametrize("kind", [bytes, io.BytesIO])
def test_damage_is_an_exception_behind_which_iterating_goes_on(kind):
    packets = encode(9, key_interval=3)
    at = len(b"".join(packets[:5]))
    whole = b"".join(packets)
    spoilt = bytearray(whole)
    last = at + len(packets[5]) - 1
    spoilt[last] ^= 1  # in frame 4, which frame 5 refers to
    numbers, sentences = taken_until_damage(kind(bytes(spoilt)))
    assert numbers == [0, 1, 2, 3, 6, 7, 8]
    assert sentences[0].startswith("frame 4: ") and sentences[1].startswith("frame 5: ")
    numbers, sentences = taken_until_damage(kind(whole[:at] + b"garbage" * 9 + whole[at:]))
    assert numbers == list(range(9)) and sentences == [f"63 bytes from byte {at} on are damaged, cut short, or a "
                                                   "packet larger than max_packet_bytes"]
    numbers, sentences = taken_until_damage(kind(whole[:last]))
    assert numbers == [0, 1, 2, 3] and "cut short" in sentences[0]


def test_what_is_no_stream_is_refused_at_once(tmp_path):
    for nothing in (b"", b"solid sphere", bytes(100000)):
        with pytest.raises(htvm.CorruptStream, match="not an htvm stream"):
            htvm.open(nothing)
        (tmp_path / "file").write_bytes(nothing)
        with pytest.raises(htvm.CorruptStream, match="not an htvm stream"):
            htvm.open(tmp_path / "file")
        with pytest.raises(htvm.CorruptStream, match="not an htvm stream"):
            next(iter(htvm.open(io.BytesIO(nothing))))
    with pytest.raises(FileNotFoundError):
        htvm.open(tmp_path / "none.htvm")


def test_limits_of_the_decoder_are_kept(stream):
    with pytest.raises(htvm.LimitExceeded, match="^frame 0: "):
        list(htvm.open(stream, max_vertices=10))
    with pytest.raises(htvm.BadInput, match="max_vertices is out of range"):
        htvm.open(stream, max_vertices=-1)


def test_a_header_that_claims_much_is_not_believed(stream):
    """A source says how much it was asked for; the largest packet of the stream has less than 3000 bytes."""
    class Source(io.BytesIO):
        asked = []

        def read(self, size=-1):
            self.asked.append(size)
            return super().read(size)

    with pytest.raises(htvm.CorruptStream, match="larger than max_packet_bytes"):
        list(htvm.open(stream, max_packet_bytes=200))
    with pytest.raises(htvm.CorruptStream, match="larger than max_packet_bytes"):
        list(htvm.open(Source(stream), max_packet_bytes=200))
    assert max(Source.asked) <= 1 << 20


@pytest.mark.parametrize("kind", [bytes, io.BytesIO])
def test_a_search_behind_damage_takes_time_in_proportion(stream, kind):
    """Many beginnings of packets that are none."""
    numbers, sentences = taken_until_damage(kind(stream + b"HTVP" * 200000 + stream))
    assert numbers == list(range(24)) and sentences


def test_iterators_do_not_disturb_each_other(stream):
    opened = htvm.open(stream)
    expected = [digest(frame) for frame in opened]
    results = {}

    def decode(name):
        results[name] = [digest(frame) for frame in opened]

    opened = htvm.open(stream)  # what iterators share is found by all of them
    threads = [threading.Thread(target=decode, args=(name,)) for name in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(results[name] == expected for name in range(4))
    together = [(a.number, b.number) for a, b in zip(opened.frames(2), opened.frames(7))]
    assert together == [(n, n + 5) for n in range(2, 7)]
