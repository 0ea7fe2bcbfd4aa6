"""What would become of a stream that is sent as datagrams, each lost by itself: computed from its packets' sizes and
references. Of the packets only headers are read (docs/bitstream.md, section 2)."""
import dataclasses
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


@dataclasses.dataclass(frozen=True)
class Repair:
    again: int = 0  # how often what is missing is sent again, a round trip each
    parity: float = 0  # datagrams more, as a part of a packet's, any of which stands in for one that is missing,
    least_parity: int = 0  # but at least so many

    def parity_of(self, count):
        return max(self.least_parity, math.ceil(self.parity * count))


REPAIRS = {"none": Repair(), "parity of a tenth, at least 1": Repair(parity=0.1, least_parity=1),
           "of a fifth, at least 2": Repair(parity=0.2, least_parity=2), "sent again once": Repair(again=1),
           "sent again twice": Repair(again=2)}


def whole(count, loss, repair):
    """The probability that a packet of so many datagrams can be put together in the end."""
    lost, spare = loss ** (1 + repair.again), repair.parity_of(count)
    return sum(math.comb(count + spare, missing) * lost ** missing * (1 - lost) ** (count + spare - missing)
               for missing in range(spare + 1))


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


def parity_bytes(data, repair):
    """How many more bytes the parity takes, as a part. A parity datagram is as large as the packet's largest."""
    sizes = [packet_bytes(packet) for frame in frames_of(data) for packet in frame]
    return sum(repair.parity_of(datagrams(size)) * min(DATAGRAM_BYTES, size) for size in sizes) / sum(sizes)


def report(data, losses, say):
    say("  packets            number  bytes p50     p99     max   datagrams p50  max")
    for name, number, median, most, largest, count, most_count in sizes_by_kind(data):
        say(f"  {name:16} {number:8} {median:10.0f} {most:7.0f} {largest:7} {count:15} {most_count:4}")
    say("  frames shown with repair: " + " ".join(f"{f'at {loss:g} % lost':>14}" for loss in losses))
    for name, repair in REPAIRS.items():
        more = f" (+{100 * parity_bytes(data, repair):.0f} % bytes)" if repair.least_parity else ""
        say(f"  {name + more:46}" + " ".join(f"{100 * shown(data, loss / 100, repair):12.2f} %" for loss in losses))
