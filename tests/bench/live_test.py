"""What the measurements of live streams rest on: python3 live_test.py (needs numpy)."""
import math
import os
import sys
import unittest
import zlib

LIVE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "bench", "live")
sys.path[:0] = [LIVE, os.path.join(LIVE, "lossy_line")]
sys.dont_write_bytecode = True

import numpy as np  # noqa: E402

import arrivals  # noqa: E402
import datagrams  # noqa: E402
import publish  # noqa: E402
import router  # noqa: E402

CONFORMANCE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "data", "conformance")
TRACKED = 7


def noted(*rows):
    """Of (viewer, kind, frame, sent, arrived), times in milliseconds."""
    out = np.zeros(len(rows), arrivals.ARRIVAL)
    for place, (viewer, kind, frame, sent, arrived) in enumerate(rows):
        out[place] = (arrived * 1000, sent * 1000, viewer, frame, 100, kind, 0, [0, 0])
    return out


class Percentiles(unittest.TestCase):
    def test_are_values_that_occurred_and_so_many_do_not_exceed(self):
        self.assertEqual(50, arrivals.percentile(range(1, 101), 50))
        self.assertEqual(99, arrivals.percentile(range(1, 101), 99))
        self.assertEqual(100, arrivals.percentile(range(1, 101), 99.5))
        self.assertEqual(7, arrivals.percentile([7], 99))

    def test_of_nothing_are_no_number(self):
        self.assertNotEqual(arrivals.percentile([], 50), arrivals.percentile([], 50))


class WhatViewersMissed(unittest.TestCase):
    def test_gaps_and_what_never_came_count_but_not_what_was_before_the_first(self):
        got = [(0, TRACKED, frame, 0, 0) for frame in (1, 2, 3, 4, 5, 6)]
        late = [(1, TRACKED, frame, 0, 0) for frame in (3, 6)]  # 4 and 5 are missing
        ended = [(2, TRACKED, frame, 0, 0) for frame in (1, 2, 3, 4)]  # 5 and 6 are missing
        self.assertEqual((4, 2), arrivals.missing(noted(*got, *late, *ended)))

    def test_nobody_missed_anything_of_nothing(self):
        self.assertEqual((0, 0), arrivals.missing(noted()))


class Stalls(unittest.TestCase):
    def test_are_pauses_of_more_than_a_second_to_the_end_too(self):
        rows = noted((0, TRACKED, 1, 0, 0), (0, TRACKED, 2, 0, 1000), (0, TRACKED, 3, 0, 2500),
                     (1, TRACKED, 1, 0, 1900))
        self.assertEqual([1.5, 2.5, 3.1], sorted(np.round(arrivals.stalls(rows, 5_000_000), 6)))


class Joining(unittest.TestCase):
    def test_is_told_to_the_first_picture_and_to_the_first_that_came_at_once(self):
        rows = noted((0, arrivals.CONNECTING, 0, 0, 1000), (0, 1, 0, 0, 1100), (0, arrivals.INTRA, 1, 400, 1200),
                     (0, TRACKED, 2, 900, 1300), (0, TRACKED, 3, 1390, 1400),
                     # joins again, and leaves before anything came live
                     (0, arrivals.CONNECTING, 0, 0, 2000), (0, arrivals.INTRA, 4, 1500, 2100),
                     (0, arrivals.CONNECTING, 0, 0, 3000), (0, arrivals.INTRA, 5, 3000, 3050),
                     (0, arrivals.CONNECTING, 0, 0, 4000))
        pictures, lives, in_vain = arrivals.joins(rows, 4_000_000)
        self.assertEqual([0.2, 0.05], list(np.round(pictures, 6)))
        self.assertEqual([0.4, 0.05], list(np.round(lives, 6)))
        self.assertEqual(1, in_vain)


class Lines(unittest.TestCase):
    def test_add_the_time_of_sending_and_the_delay(self):
        line = router.Line(router.Settings(megabits=1, delay_ms=25), "down")
        self.assertAlmostEqual(100.035, line.arrival(100, 1250))  # 10 ms at 1 Mbit/s
        self.assertAlmostEqual(100.045, line.arrival(100, 1250))  # behind the first
        self.assertAlmostEqual(200.035, line.arrival(200, 1250))

    def test_drop_what_their_queue_does_not_hold(self):
        line = router.Line(router.Settings(megabits=1, queue_ms=100, delay_ms=0), "down")
        arrived = [line.arrival(0, 1250) for _ in range(20)]
        self.assertEqual(11, sum(arrival is not None for arrival in arrived))
        self.assertEqual(9, line.counters()["overflowed"])
        self.assertIsNotNone(line.arrival(0.05, 1250))

    def test_lose_the_part_they_are_told_and_the_same_packets_again(self):
        def lost(seed, direction):
            line = router.Line(router.Settings(loss=0.03, seed=seed), direction)
            return [number for number in range(20000) if line.arrival(number, 100) is None]
        self.assertAlmostEqual(0.03 * 20000, len(lost(1, "down")), delta=4 * (0.03 * 0.97 * 20000) ** 0.5)
        self.assertEqual(lost(1, "down"), lost(1, "down"))
        self.assertNotEqual(lost(1, "down"), lost(2, "down"))
        self.assertNotEqual(lost(1, "down"), lost(1, "up"))


class Datagrams(unittest.TestCase):
    # I-frame of 3 datagrams, T-frames of one each
    FRAMES = ((1, 0, 0, 40), (2, 0, 0, 3000), (7, 1, 0, 100), (7, 2, 1, 100))

    @staticmethod
    def stream(*frames):
        """Of (kind, number, reference, payload bytes)."""
        return b"".join(publish.renumbered(((b"HTVP", kind, 128, 0, number, reference, 0, size), bytes(size + 4)), 0, 0)
                        for kind, number, reference, size in frames)

    def test_a_frame_is_shown_if_all_it_needs_is_whole(self):
        self.assertAlmostEqual((0.9 ** 3 + 0.9 ** 4 + 0.9 ** 5) / 3,
                               datagrams.shown(self.stream(*self.FRAMES), 0.1, datagrams.Repair()))

    def test_sending_again_squares_the_loss(self):
        self.assertAlmostEqual((0.99 ** 3 + 0.99 ** 4 + 0.99 ** 5) / 3,
                               datagrams.shown(self.stream(*self.FRAMES), 0.1, datagrams.Repair(again=1)))

    def test_parity_stands_in_for_as_many_as_there_are(self):
        self.assertAlmostEqual(0.9 ** 4 + 4 * 0.1 * 0.9 ** 3,
                               datagrams.whole(3, 0.1, datagrams.Repair(parity=0.1, least_parity=1)))
        self.assertAlmostEqual(sum(math.comb(24, lost) * 0.1 ** lost * 0.9 ** (24 - lost) for lost in range(5)),
                               datagrams.whole(20, 0.1, datagrams.Repair(parity=0.2, least_parity=1)))

    def test_parity_is_as_large_as_the_largest_piece(self):
        stream = self.stream((2, 0, 0, 3000), (7, 1, 0, 100))
        self.assertAlmostEqual((1200 + 136) / (3036 + 136),
                               datagrams.parity_bytes(stream, datagrams.Repair(least_parity=1)))


class PublishedPackets(unittest.TestCase):
    @staticmethod
    def stream():
        for name in sorted(os.listdir(CONFORMANCE)):
            if name.endswith(".htvm"):
                with open(os.path.join(CONFORMANCE, name), "rb") as file:
                    yield file.read()

    def test_are_those_of_the_file_with_other_numbers_and_times(self):
        for data in self.stream():
            for packet in publish.packets_of(data):
                again, = publish.packets_of(publish.renumbered(packet, 1000, 5))
                self.assertEqual(packet[1], again[1])
                self.assertEqual(packet[0][4] + 1000, again[0][4])
                self.assertEqual(5, again[0][6])

    def test_have_sound_headers_and_unchanged_ones_are_the_files_bytes(self):
        for data in self.stream():
            packets = list(publish.packets_of(data))
            same = b"".join(publish.renumbered(packet, 0, packet[0][6]) for packet in packets)
            self.assertEqual(zlib.crc32(data), zlib.crc32(same))


if __name__ == "__main__":
    unittest.main()
