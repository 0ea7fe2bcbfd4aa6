import io
import subprocess

import numpy as np
import pytest
from conftest import encode, needs_program, program, sheet

import htvm


def test_what_is_encoded_decodes_to_nearly_the_same():
    stream = b"".join(encode(3, quality=90, tracked_simplify=0, key_interval=1))
    for number, frame in enumerate(htvm.open(stream)):
        original = sheet(number)
        distances = np.linalg.norm(frame.positions[:, None] - original.positions, axis=2).min(axis=1)
        assert distances.max() < 1 and len(frame.positions) == len(original.positions)


def test_timestamps_follow_the_frame_rate_without_drifting():
    times = htvm.open(b"".join(encode(4, fps="30000/1001"))).timestamps_us
    assert list(times) == [0, 33367, 66733, 100100]
    encoder = htvm.Encoder(fps=25)
    packets = encoder.push(sheet(0), timestamp_us=5000) + encoder.push(sheet(1)) + encoder.finish()
    assert list(htvm.open(b"".join(packets)).timestamps_us) == [5000, 45000]


def test_an_intra_frame_can_be_asked_for():
    encoder = htvm.Encoder(subject_size=1000)
    encoder.push(sheet(0))
    encoder.push(sheet(1))
    assert encoder.last_frame.kind == "T" and encoder.last_frame.reason is None
    encoder.push(sheet(2), force_intra=True)
    last = encoder.last_frame
    assert (last.number, last.kind, last.timestamp_us) == (2, "I", 66667) and last.bytes > 0
    assert last.reason == "due"


def test_options_have_their_names_with_underscores_for_dots():
    for option in htvm.encoder_options("tracked"):
        if option.serves and not option.name.startswith("rate."):
            htvm.Encoder(**{option.name.replace(".", "_"): option.default})
    assert {o.name: o.default for o in htvm.encoder_options()}["key_interval"] == 300
    assert {o.name: o.words for o in htvm.encoder_options()}["tracked.references"] == ("intra", "previous")


@needs_program
@pytest.mark.parametrize("quality", [None, 60])
def test_defaults_make_the_file_of_the_command_line_without_groups(tmp_path, quality):
    asked = [] if quality is None else ["-q", str(quality)]
    with htvm.Encoder(tmp_path / "python.htvm", quality=quality) as encoder:
        for number in range(6):
            htvm.write_mesh(tmp_path / f"{number}.ply", sheet(number), unit="mm")
            encoder.push(sheet(number))
    subprocess.run([program, "encode", *(tmp_path / f"{number}.ply" for number in range(6)), "--unit", "mm", *asked,
                    "--group", "1", "-o", tmp_path / "program.htvm", "--quiet"], check=True)
    assert (tmp_path / "python.htvm").read_bytes() == (tmp_path / "program.htvm").read_bytes()


@pytest.mark.parametrize("options, sentence", [
    (dict(key_intervall=3), "key_interval"),
    (dict(key_interval=0), "1 to 1000000"),
    (dict(tracked_references="both"), "intra"),
    (dict(topology_still_below=3), "still_below"),
    (dict(quality=101), "0 to 100"),
    (dict(quality=50, rate_bits_per_second=80e3), "quality does nothing with rate.bits_per_second"),
    (dict(profile="best"), "tracked, topology, paper"),
    (dict(fps=0), "fps must be above 0"),
    (dict(metadata={"title": "x" * 5000}), "metadata|title"),
])
def test_wrong_options_are_refused_with_a_sentence(options, sentence):
    with pytest.raises(htvm.BadInput, match=sentence):
        htvm.Encoder(**options)


def test_a_file_is_there_when_it_is_complete(tmp_path, stream):
    path = tmp_path / "sheet.htvm"
    path.write_text("an earlier file")
    with htvm.Encoder(path, key_interval=4, subject_size=1000) as encoder:
        for number in range(12):
            encoder.push(sheet(number))
        assert path.read_text() == "an earlier file"
    assert list(htvm.open(path).numbers) == list(range(12))
    assert [entry.name for entry in tmp_path.iterdir()] == ["sheet.htvm"]


@needs_program
def test_a_file_begins_with_the_index_that_htvm_writes(tmp_path, stream):
    with htvm.Encoder(tmp_path / "python.htvm", key_interval=4, subject_size=1000) as encoder:
        for number in range(12):
            encoder.push(sheet(number))
    (tmp_path / "plain.htvm").write_bytes(stream)
    subprocess.run([program, "index", tmp_path / "plain.htvm", "--bounds", "-o", tmp_path / "indexed.htvm"], check=True)
    assert (tmp_path / "python.htvm").read_bytes() == (tmp_path / "indexed.htvm").read_bytes()


def test_what_fails_leaves_the_file_that_was_there(tmp_path):
    path = tmp_path / "sheet.htvm"
    path.write_text("an earlier file")
    with pytest.raises(KeyboardInterrupt):
        with htvm.Encoder(path) as encoder:
            encoder.push(sheet(0))
            raise KeyboardInterrupt
    assert path.read_text() == "an earlier file"
    assert [entry.name for entry in tmp_path.iterdir()] == ["sheet.htvm"]


def test_a_file_object_gets_the_packets_and_stays_open(stream):
    file = io.BytesIO()
    with htvm.Encoder(file, key_interval=4, subject_size=1000) as encoder:
        returned = [packet for number in range(12) for packet in encoder.push(sheet(number))]
    assert file.getvalue() == stream and stream.startswith(b"".join(returned))


def test_a_bitrate_changes_while_frames_are_pushed():
    encoder = htvm.Encoder(subject_size=1000, rate_bits_per_second=80e3, key_interval=1)

    def size_of(first, last):
        return sum(len(packet) for number in range(first, last) for packet in encoder.push(sheet(number)))

    size_of(0, 30)
    before = size_of(30, 60)
    encoder.set_bitrate(40e3)
    size_of(60, 75)
    assert size_of(75, 105) < 0.7 * before
    with pytest.raises(htvm.BadInput, match="rate.bits_per_second"):
        htvm.Encoder(subject_size=1000).set_bitrate(1e6)
    with pytest.raises(htvm.BadInput, match="not 'fast'"):
        encoder.set_bitrate("fast")


def test_the_effort_is_a_whole_number_up_to_nine():
    encoder = htvm.Encoder(subject_size=1000)
    for effort in (0, 9, 5):
        encoder.set_effort(effort)
    for wrong in (-1, 10, 2.5, "fast"):
        with pytest.raises(htvm.BadInput, match="whole number from 0 to 9"):
            encoder.set_effort(wrong)


def test_a_mesh_that_cannot_be_coded_is_left_out():
    encoder = htvm.Encoder(subject_size=1000)
    packets = encoder.push(sheet(0))
    bad = sheet(1)
    bad.triangles[0, 0] = 100000
    with pytest.raises(htvm.BadInput, match="100000"):
        encoder.push(bad)
    with pytest.raises(htvm.BadInput, match="[Tt]imestamp"):
        encoder.push(sheet(1), timestamp_us=-5)
    packets += encoder.push(sheet(2)) + encoder.finish()
    assert len(htvm.open(b"".join(packets))) == 2
    with pytest.raises(htvm.BadInput, match="finished"):
        encoder.push(sheet(3))


def test_poses_must_fit_the_skeleton():
    encoder = htvm.Encoder(skeleton=htvm.Skeleton(["a", "b"], [(0, 1)]))
    with pytest.raises(htvm.BadInput, match=r"joints must have the shape \(2, 3\)"):
        encoder.push(sheet(0), htvm.Pose([[0, 0, 0]]))
    with pytest.raises(htvm.BadInput, match="skeleton that the encoder was not given"):
        htvm.Encoder().push(sheet(0), htvm.Pose([[0, 0, 0]]))


def test_arrays_that_were_assigned_later_are_checked_too():
    mesh = sheet(0)
    mesh.positions = mesh.positions.astype(np.float64)[::-1]
    assert htvm.Encoder(subject_size=1000).push(mesh)
    mesh.positions = mesh.positions[:, :2]
    with pytest.raises(htvm.BadInput, match="shape"):
        htvm.Encoder().push(mesh)


def test_a_decoded_frame_can_be_encoded(stream):
    frame = next(iter(htvm.open(stream)))
    assert htvm.Encoder(subject_size=1000).push(frame)
