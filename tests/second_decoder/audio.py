"""Chapter 13 of docs/bitstream.md: packets of audio. What Opus codes is not decoded."""
from conventions import Bytes, check

OPUS = 1


class Audio:
    pass


def opus_samples(packet):
    """At 48 kHz, as the packet's first bytes tell (RFC 6716, 3.1 and 3.2)."""
    check(packet, "an Opus packet is empty")
    configuration, code = packet[0] >> 3, packet[0] & 3
    if configuration < 12:
        length = (480, 960, 1920, 2880)[configuration % 4]
    elif configuration < 16:
        length = (480, 960)[configuration % 2]
    else:
        length = (120, 240, 480, 960)[configuration % 4]
    check(code < 3 or len(packet) > 1, "an Opus packet is cut short")
    frames = (1, 2, 2, packet[1] & 63 if code == 3 else 0)[code]
    check(1 <= length * frames <= 5760, "an Opus packet is too long, or has nothing in it")
    return length * frames


def read_audio(payload):
    """None where the coder is unknown."""
    read = Bytes(payload)
    if read.field("B") != OPUS:
        return None
    audio = Audio()
    audio.channels, audio.gain = read.field("B"), read.field("h")
    audio.skip_begin, audio.skip_end = read.varint(), read.varint()
    sizes = [read.varint() for _ in range(read.field("B"))]
    check(1 <= audio.channels <= 2 and sizes, "a number of channels or packets is out of range")
    audio.opus = [read.take(size) for size in sizes]
    audio.samples = sum(opus_samples(packet) for packet in audio.opus)
    check(audio.skip_begin + audio.skip_end <= audio.samples, "more is left out than there is")
    return audio
