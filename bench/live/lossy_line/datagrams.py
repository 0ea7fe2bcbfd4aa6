"""What would become of a stream that is sent as datagrams, each lost by itself: computed from its packets' sizes and
references. Of the packets only headers are read (docs/bitstream.md, section 2)."""
import math
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from arrivals import percentile  # noqa: E402
from publish import CHECKSUM_BYTES, FRAMES, HEADER_BYTES, frames_of  # noqa: E402

DATAGRAM_BYTES = 1200  # passes everywhere, headers of IP, UDP and QUIC besides
NAMES = {1: "sequence header", 2: "I-frames", 3: "EP-frames", 4: "codebooks", 6: "P-frames", 7: "T-frames", 10: "audio"}


def packet_bytes(packet):
    return HEADER_BYTES + packet[0][-1] + CHECKSUM_BYTES


def datagrams(size):
    return math.ceil(size / DATAGRAM_BYTES)


def sizes_by_kind(data):
    """[(name, packets, median, 99th percentile and largest size in bytes, median and largest number of datagrams)]."""
    sizes = {}
    for frame in frames_of(data):
        for packet in frame:
            sizes.setdefault(packet[0][1], []).append(packet_bytes(packet))
    return [(NAMES[kind], len(of_kind), percentile(of_kind, 50), percentile(of_kind, 99), max(of_kind),
             datagrams(percentile(of_kind, 50)), datagrams(max(of_kind))) for kind, of_kind in sorted(sizes.items())]


def whole(count, loss, repair):
    """The probability that all of a packet's datagrams are there in the end. repair: "none"; "parity": one more
    datagram, from which any one of them follows; or how often those that are missing are sent again."""
    if repair == "parity":
        return (1 - loss) ** count * (1 + count * loss)  # of count + 1, at most one is lost
    again = 0 if repair == "none" else repair
    return (1 - loss ** (1 + again)) ** count


def shown(data, loss, repair):
    """The part of the frames that can be decoded: they are whole, and what they refer to can be decoded."""
    decodable, sum_ = {}, 0.0
    frames = frames_of(data)
    for frame in frames:
        part = 1.0
        for packet in frame:
            _, kind, _, _, number, reference, _, _ = packet[0]
            if kind in FRAMES:  # others are sent until they are acknowledged
                part *= whole(datagrams(packet_bytes(packet)), loss, repair)
                part *= decodable.get(reference, 0.0) if reference != number else 1.0
                decodable[number] = part
        sum_ += part
    return sum_ / len(frames)


def parity_overhead(data):
    """How many more bytes one parity datagram for each packet takes, as a part."""
    sizes = [packet_bytes(packet) for frame in frames_of(data) for packet in frame]
    return sum(min(DATAGRAM_BYTES, size) for size in sizes) / sum(sizes)


def report(data, losses, round_trip_ms, say):
    say("  packets            number  bytes p50     p99     max   datagrams p50  max")
    for name, number, median, most, largest, count, most_count in sizes_by_kind(data):
        say(f"  {name:16} {number:8} {median:10.0f} {most:7.0f} {largest:7} {count:15} {most_count:4}")
    say(f"  frames shown   no repair   parity (+{100 * parity_overhead(data):.0f} % bytes)   sent again once "
        f"(+{round_trip_ms:g} ms)   twice (+{2 * round_trip_ms:g} ms)")
    for loss in losses:
        none, parity, once, twice = (100 * shown(data, loss / 100, repair) for repair in ("none", "parity", 1, 2))
        say(f"  {loss:8g} % lost {none:8.1f} % {parity:17.1f} % {once:23.1f} % {twice:18.2f} %")
