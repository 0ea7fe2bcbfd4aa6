// Fan-out of a live stream: what each viewer is sent can be decoded, and slow viewers cost nobody else anything.
#include "live/client/broadcast.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

namespace htvm::live {
namespace {

using namespace std::chrono_literals;
using namespace packet_flag;

SharedPacket packet(PacketKind kind, std::uint32_t frame, std::uint32_t reference, std::uint8_t flags,
                    std::size_t bytes = 100) {
    auto out = std::make_shared<LivePacket>();
    out->header.kind = kind;
    out->header.frame = frame;
    out->header.reference = reference;
    out->header.flags = static_cast<std::uint8_t>(flags_valid | flags);
    out->bytes.resize(bytes);
    return out;
}

SharedPacket header(std::uint32_t crc = 7) { return packet(PacketKind::sequence, 0, crc, session); }
SharedPacket intra(std::uint32_t frame, std::size_t bytes = 1000) {
    return packet(PacketKind::intra, frame, frame, referred | access, bytes);
}
SharedPacket tracked(std::uint32_t frame, std::size_t bytes = 100) {
    return packet(PacketKind::tracked, frame, frame - 1, referred, bytes);
}
// One that refers to the reference alone.
SharedPacket tracked_anew(std::uint32_t frame, std::uint32_t reference, std::size_t bytes = 100) {
    return packet(PacketKind::tracked, frame, reference, referred | access, bytes);
}
SharedPacket patched(std::uint32_t frame, std::uint32_t reference, std::size_t bytes = 100) {
    return packet(PacketKind::patched, frame, reference, referred | access, bytes);
}
SharedPacket enhanced(std::uint32_t frame, std::uint32_t reference, std::size_t bytes = 100) {
    return packet(PacketKind::enhanced, frame, reference, droppable | access, bytes);
}

constexpr Broadcast::Clock::time_point start{};

struct Watching {
    Broadcast& broadcast;
    int wakes = 0;
    Broadcast::Viewer viewer;
    explicit Watching(Broadcast& live, Broadcast::Clock::time_point now = start)
        : broadcast(live), viewer(live.join([this] { ++wakes; }, now)) {}
    Watching(const Watching&) = delete;

    std::vector<SharedPacket> take() {
        std::vector<SharedPacket> out;
        while (auto next = broadcast.next(viewer)) out.push_back(next);
        return out;
    }
    // The frames' numbers, -1 for a sequence header.
    std::vector<int> take_numbers() {
        std::vector<int> out;
        for (const auto& packet : take())
            out.push_back(packet->header.kind == PacketKind::sequence ? -1 : static_cast<int>(packet->header.frame));
        return out;
    }
};

using Numbers = std::vector<int>;

TEST(Broadcast, AViewerFromTheBeginningGetsEverything) {
    Broadcast broadcast;
    Watching viewer(broadcast);
    broadcast.push(header(), start);
    for (std::uint32_t i = 0; i < 4; ++i) broadcast.push(i == 0 ? intra(0) : tracked(i), start);
    EXPECT_EQ(viewer.take_numbers(), (Numbers{-1, 0, 1, 2, 3}));
}

TEST(Broadcast, ALateViewerGetsWhatTheNewestFrameNeedsAndThenEverything) {
    Broadcast broadcast;
    broadcast.push(header(), start);
    for (const auto& next : {intra(0), tracked(1), intra(2), tracked(3), tracked(4)}) broadcast.push(next, start);
    Watching viewer(broadcast);
    EXPECT_EQ(viewer.wakes, 1);
    EXPECT_EQ(viewer.take_numbers(), (Numbers{-1, 2, 3, 4}));
    broadcast.push(tracked(5), start);
    EXPECT_EQ(viewer.take_numbers(), Numbers{5});
    EXPECT_EQ(viewer.wakes, 2);
}

TEST(Broadcast, OfFramesThatNothingRefersToALateViewerGetsTheNewestAlone) {
    Broadcast broadcast;
    broadcast.push(header(), start);
    for (const auto& next : {intra(0), enhanced(1, 0), enhanced(2, 0)}) broadcast.push(next, start);
    Watching viewer(broadcast);
    EXPECT_EQ(viewer.take_numbers(), (Numbers{-1, 0, 2}));
}

TEST(Broadcast, ARepeatedHeaderComesFirst) {
    Broadcast broadcast;
    for (const auto& next : {header(), intra(0), tracked(1), header(), tracked(2)}) broadcast.push(next, start);
    Watching viewer(broadcast);
    EXPECT_EQ(viewer.take_numbers(), (Numbers{-1, 0, 1, 2}));
}

TEST(Broadcast, ASlowViewerGoesOnAtTheNextIntraFrame) {
    Broadcast broadcast({.bytes = 2000, .wait = 10s, .most_missed = 1});
    Watching slow(broadcast), quick(broadcast);
    broadcast.push(header(), start);
    broadcast.push(intra(0), start);
    for (std::uint32_t i = 1; i <= 20; ++i) broadcast.push(tracked(i), start);
    EXPECT_LE(broadcast.waiting_bytes(slow.viewer), 2000u);
    EXPECT_EQ(broadcast.counters(slow.viewer).fallen_behind, 1u);
    EXPECT_EQ(slow.take_numbers(), Numbers{});  // what waited was late
    broadcast.push(tracked(21), start);
    EXPECT_EQ(slow.take_numbers(), Numbers{});
    broadcast.push(intra(22), start);
    broadcast.push(tracked(23), start);
    EXPECT_EQ(slow.take_numbers(), (Numbers{-1, 22, 23}));
    EXPECT_EQ(broadcast.counters(slow.viewer).dropped_frames, 22u);
    EXPECT_EQ(broadcast.counters(quick.viewer).fallen_behind, 1u);  // it took nothing either
}

TEST(Broadcast, WhatWaitsTooLongIsDroppedHoweverSmall) {
    Broadcast broadcast({.wait = 1000ms, .most_missed = 0});
    Watching viewer(broadcast);
    broadcast.push(header(), start);
    broadcast.push(intra(0), start);
    EXPECT_EQ(viewer.take_numbers(), (Numbers{-1, 0}));
    broadcast.push(tracked(1), start);
    broadcast.push(tracked(2), start + 1000ms);
    EXPECT_EQ(broadcast.counters(viewer.viewer).fallen_behind, 0u);
    broadcast.push(tracked(3), start + 1001ms);
    EXPECT_EQ(broadcast.counters(viewer.viewer).fallen_behind, 1u);
    EXPECT_EQ(broadcast.waiting_bytes(viewer.viewer), 0u);
}

TEST(Broadcast, AViewerWhoMissedFewFramesIsSentThem) {
    Broadcast broadcast({.bytes = 450, .wait = 10s, .most_missed = 4});
    Watching viewer(broadcast);
    broadcast.push(header(), start);
    broadcast.push(intra(0, 300), start);
    EXPECT_EQ(viewer.take_numbers(), (Numbers{-1, 0}));
    for (std::uint32_t i = 1; i <= 4; ++i) broadcast.push(tracked(i), start);
    // The fifth does not fit, and what was dropped for it does not fit with it: then they are sent as long as they do.
    broadcast.push(tracked(5, 20), start);
    EXPECT_EQ(broadcast.counters(viewer.viewer).fallen_behind, 0u);
    broadcast.push(tracked(6, 200), start);
    EXPECT_EQ(broadcast.counters(viewer.viewer).fallen_behind, 1u);
    EXPECT_EQ(viewer.take_numbers(), Numbers{});
    broadcast.push(intra(7, 300), start);
    EXPECT_EQ(viewer.take_numbers(), Numbers{7});
}

TEST(Broadcast, ASlowViewerGoesOnAtATrackedFrameThatNeedsTheReferenceAlone) {
    Broadcast broadcast({.bytes = 2000, .wait = 10s, .most_missed = 1});
    Watching viewer(broadcast);
    for (const auto& next : {header(), intra(0), patched(1, 0)}) broadcast.push(next, start);
    EXPECT_EQ(viewer.take_numbers(), (Numbers{-1, 0, 1}));
    for (std::uint32_t i = 2; i <= 9; ++i) broadcast.push(tracked(i, 400), start);
    EXPECT_FALSE(broadcast.follows(viewer.viewer));
    EXPECT_EQ(viewer.take_numbers(), Numbers{});
    broadcast.push(tracked_anew(10, 1), start);
    broadcast.push(tracked(11), start);
    EXPECT_EQ(viewer.take_numbers(), (Numbers{10, 11}));
}

TEST(Broadcast, MissedReferencesAreSentHoweverManySinceTheNextIntraFrameMayBeFar) {
    Broadcast broadcast({.bytes = 650, .wait = 1s, .most_missed = 1});
    Watching viewer(broadcast);
    for (const auto& next : {header(), intra(0)}) broadcast.push(next, start);
    EXPECT_EQ(viewer.take_numbers(), (Numbers{-1, 0}));
    for (std::uint32_t i = 1; i <= 4; ++i) broadcast.push(patched(i, i - 1), start);
    broadcast.push(patched(5, 4), start + 2s);
    EXPECT_EQ(broadcast.counters(viewer.viewer).fallen_behind, 1u);
    EXPECT_EQ(viewer.take_numbers(), (Numbers{1, 2, 3, 4, 5}));
    // But not more of them than may wait.
    for (std::uint32_t i = 6; i <= 12; ++i) broadcast.push(patched(i, i - 1), start + 2s);
    EXPECT_FALSE(broadcast.follows(viewer.viewer));
    EXPECT_EQ(viewer.take_numbers(), Numbers{});
}

TEST(Broadcast, ALateViewerIsSentTheReferencesAndTheTrackedFramesSinceTheLastOneThatNeedsNone) {
    Broadcast broadcast;
    for (const auto& next : {header(), intra(0), tracked(1), patched(2, 0), tracked(3), tracked_anew(4, 2), tracked(5)})
        broadcast.push(next, start);
    Watching viewer(broadcast);
    EXPECT_EQ(viewer.take_numbers(), (Numbers{-1, 0, 2, 4, 5}));
}

TEST(Broadcast, FramesThatNothingRefersToAreDroppedOneByOne) {
    Broadcast broadcast({.bytes = 350, .wait = 10s});
    Watching viewer(broadcast);
    broadcast.push(header(), start);
    broadcast.push(intra(0), start);
    EXPECT_EQ(viewer.take_numbers(), (Numbers{-1, 0}));
    for (std::uint32_t i = 1; i <= 5; ++i) broadcast.push(enhanced(i, 0), start);
    EXPECT_EQ(viewer.take_numbers(), (Numbers{1, 2, 3}));
    EXPECT_EQ(broadcast.counters(viewer.viewer).dropped_frames, 2u);
    EXPECT_EQ(broadcast.counters(viewer.viewer).fallen_behind, 0u);
    broadcast.push(enhanced(6, 0), start);
    EXPECT_EQ(viewer.take_numbers(), Numbers{6});
}

TEST(Broadcast, AFrameLargerThanTheBoundIsSentAlone) {
    Broadcast broadcast({.bytes = 500, .wait = 10s});
    Watching viewer(broadcast);
    broadcast.push(header(), start);
    broadcast.push(intra(0, 5000), start);
    EXPECT_EQ(viewer.take_numbers(), (Numbers{-1, 0}));
}

TEST(Broadcast, FramesThatNobodyCanDecodeAreCountedAndGoNoFurther) {
    Broadcast broadcast;
    Watching viewer(broadcast);
    for (const auto& next : {header(), tracked(5), tracked(6), intra(7), tracked(9), tracked(8)})
        broadcast.push(next, start);
    EXPECT_EQ(viewer.take_numbers(), (Numbers{-1, 7, 8}));
    EXPECT_EQ(broadcast.undecodable_frames(), 3u);
}

TEST(Broadcast, WhatIsKeptForThoseWhoMayJoinIsBounded) {
    Broadcast broadcast({.kept_bytes = 3000});
    Watching viewer(broadcast);
    broadcast.push(header(), start);
    broadcast.push(intra(0), start);
    for (std::uint32_t i = 1; i <= 40; ++i) {
        broadcast.push(tracked(i), start);
        EXPECT_LE(broadcast.kept_bytes(), 3000u);
    }
    EXPECT_EQ(viewer.take().size(), 42u);
    Watching late(broadcast);
    EXPECT_EQ(late.take_numbers(), Numbers{});
    broadcast.push(header(), start);
    broadcast.push(intra(41), start);
    EXPECT_EQ(late.take_numbers(), (Numbers{-1, 41}));
    EXPECT_EQ(viewer.take_numbers(), (Numbers{-1, 41}));
}

TEST(Broadcast, AnotherSessionBeginsAnotherSequence) {
    Broadcast broadcast;
    for (const auto& next : {header(7), intra(0), tracked(1), header(8), intra(0), tracked(1)})
        broadcast.push(next, start);
    Watching viewer(broadcast);
    const auto taken = viewer.take();
    ASSERT_EQ(taken.size(), 3u);
    EXPECT_EQ(taken[0]->header.reference, 8u);
    EXPECT_EQ(broadcast.kept_bytes(), 100u + 1000 + 100);
}

TEST(Broadcast, IndexesGoNoFurther) {
    Broadcast broadcast;
    Watching viewer(broadcast);
    broadcast.push(packet(PacketKind::front_index, 0, 0, 0), start);
    broadcast.push(header(), start);
    broadcast.push(intra(0), start);
    broadcast.push(packet(PacketKind::index, 1, 0, 0), start);
    EXPECT_EQ(viewer.take_numbers(), (Numbers{-1, 0}));
}

// A stream of all kinds of frames; viewers take at random times, come and go. Whatever each is sent, in that order, can
// be decoded: of every frame its closure was sent before it.
TEST(Broadcast, WhateverIsDroppedWhatIsSentCanBeDecoded) {
    for (unsigned seed = 0; seed < 40; ++seed) {
        std::mt19937 random(seed);
        const auto chance = [&](unsigned percent) { return random() % 100 < percent; };
        Broadcast broadcast({.bytes = 1500, .wait = 300ms, .most_missed = seed % 4});
        struct Sent {
            std::unique_ptr<Watching> viewer;
            unsigned appetite;
            std::vector<PacketHeader> headers;
        };
        std::vector<Sent> viewers;
        auto now = start;
        std::uint32_t frame = 0, reference = 0, crc = 1;
        bool chain = false;
        std::size_t frames_sent = 0, dropped = 0;
        broadcast.push(header(crc), now);
        for (int step = 0; step < 400; ++step, now += 33ms) {
            if (chance(5) && viewers.size() < 8)
                viewers.push_back(
                    {std::make_unique<Watching>(broadcast, now), static_cast<unsigned>(random() % 100), {}});
            if (chance(2)) broadcast.push(header(chance(30) ? ++crc : crc), now);
            if (broadcast.undecodable_frames() == 0 && chance(1)) frame += 2;
            const bool first = frame == 0 || chance(6);
            if (first) reference = frame, chain = chance(60);
            const std::size_t bytes = 50 + random() % 200;
            const bool anew = chain && chance(10), patch = chain && chance(10);
            broadcast.push(first   ? intra(frame, 3 * bytes)
                           : patch ? patched(frame, reference, bytes)
                           : anew  ? tracked_anew(frame, reference, bytes)
                           : chain ? tracked(frame, bytes)
                                   : enhanced(frame, reference, bytes),
                           now);
            if (patch) reference = frame;
            if (!first && chain && chance(3)) broadcast.push(header(crc), now);
            ++frame;
            for (auto& [viewer, appetite, headers] : viewers)
                while (chance(appetite)) {
                    const auto next = broadcast.next(viewer->viewer);
                    if (!next) break;
                    headers.push_back(next->header);
                }
        }
        for (auto& [viewer, appetite, headers] : viewers) {
            for (std::size_t i = 0; i < headers.size(); ++i) {
                if (headers[i].kind == PacketKind::sequence) continue;
                ASSERT_FALSE(closure(headers, i).empty()) << "seed " << seed << ", packet " << i;
                ++frames_sent;
            }
            dropped += broadcast.counters(viewer->viewer).dropped_frames;
        }
        EXPECT_GT(frames_sent, 100u);
        EXPECT_GT(dropped, 10u);
    }
}

std::vector<std::uint64_t> places(const Broadcast& broadcast) {
    std::vector<std::uint64_t> out;
    const auto kept = broadcast.kept();
    EXPECT_TRUE(kept);
    for (const auto& placed : *kept) out.push_back(placed.place);
    return out;
}

TEST(Broadcast, WhatIsKeptIsWhatALateViewerGetsWithThePlaceOfEach) {
    Broadcast broadcast;
    for (const auto& next : {header(), intra(0), tracked(1), header(), tracked(2)}) broadcast.push(next, start);
    EXPECT_EQ(places(broadcast), (std::vector<std::uint64_t>{3, 1, 2, 4}));
    EXPECT_EQ(broadcast.next_place(), 5u);
    Broadcast small({.kept_bytes = 1050});
    for (const auto& next : {header(), intra(0), tracked(1)}) small.push(next, start);
    EXPECT_FALSE(small.kept());
}

TEST(Broadcast, WhatAPublisherSendsAgainGoesNoFurther) {
    Broadcast broadcast;
    Watching viewer(broadcast);
    const auto first = intra(0), second = tracked(1);
    for (const auto& next : {header(), first, second}) broadcast.push(next, start);
    viewer.take();
    for (const auto& next : {first, second}) EXPECT_FALSE(broadcast.push(next, start));
    EXPECT_EQ(broadcast.push(tracked(2), start), 3u);
    EXPECT_EQ(viewer.take_numbers(), Numbers{2});
}

TEST(Broadcast, TheSameFrameInTheNextSequenceIsAnother) {
    Broadcast broadcast;
    Watching viewer(broadcast);
    for (const auto& next : {header(1), intra(0), header(2), intra(0)}) broadcast.push(next, start);
    EXPECT_EQ(viewer.take_numbers(), (Numbers{-1, 0, -1, 0}));
}

TEST(Broadcast, BetweenANewHeaderAndItsFirstFrameAViewerWaits) {
    Broadcast broadcast;
    for (const auto& next : {header(1), intra(0), header(2)}) broadcast.push(next, start);
    Watching viewer(broadcast);
    EXPECT_EQ(viewer.take_numbers(), Numbers{});
    broadcast.push(intra(0), start);
    EXPECT_EQ(viewer.take_numbers(), (Numbers{-1, 0}));
}

TEST(Broadcast, AfterItForgotItsViewersGoOnWithTheNextClosure) {
    Broadcast broadcast;
    Watching viewer(broadcast);
    for (const auto& next : {header(), intra(0)}) broadcast.push(next, start);
    viewer.take();
    broadcast.forget();
    EXPECT_EQ(broadcast.next_place(), 0u);
    for (const auto& next : {header(), intra(5), tracked(6)}) broadcast.push(next, start);
    EXPECT_EQ(viewer.take_numbers(), (Numbers{-1, 5, 6}));
}

// ---- Pictures of textures -------------------------------------------------------------------------------------------

SharedPacket picture(std::uint32_t frame, std::size_t bytes = 200) {
    return packet(PacketKind::texture, frame, frame - 1, referred, bytes);
}
SharedPacket key_picture(std::uint32_t frame, std::size_t bytes = 400) {
    return packet(PacketKind::texture, frame, frame, referred | access, bytes);
}
bool is_picture(const SharedPacket& packet) { return packet->is_picture(); }

// The frames' numbers, and those of pictures with a minus one hundred.
Numbers numbers_of(const std::vector<SharedPacket>& packets) {
    Numbers out;
    for (const auto& one : packets)
        if (one->header.kind != PacketKind::sequence)
            out.push_back(static_cast<int>(one->header.frame) - (one->is_picture() ? 100 : 0));
    return out;
}

TEST(Broadcast, ALateViewerGetsThePicturesSinceTheLastKeyPicture) {
    Broadcast broadcast;
    broadcast.push(header(), start);
    for (const auto& next : {intra(0), key_picture(0), tracked(1), picture(1), tracked(2), key_picture(2), tracked(3),
                             picture(3), tracked(4)})
        broadcast.push(next, start);
    Watching viewer(broadcast);
    EXPECT_EQ(numbers_of(viewer.take()), (Numbers{0, 1, 2, -98, 3, -97, 4}));
    broadcast.push(picture(4), start);
    EXPECT_EQ(numbers_of(viewer.take()), (Numbers{-96}));
}

TEST(Broadcast, ASlowViewerLosesPicturesUpToTheNextKeyPictureAndNoMeshes) {
    Broadcast broadcast({.bytes = 3000, .wait = 10s});
    Watching slow(broadcast);
    broadcast.push(header(), start);
    broadcast.push(intra(0, 500), start);
    broadcast.push(key_picture(0), start);
    for (std::uint32_t i = 1; i <= 15; ++i) {
        broadcast.push(tracked(i), start);
        broadcast.push(picture(i), start);
    }
    auto got = slow.take();
    EXPECT_EQ(std::count_if(got.begin(), got.end(), [](const auto& one) { return one->is_frame(); }), 16);
    const auto pictures = std::count_if(got.begin(), got.end(), is_picture);
    EXPECT_LT(pictures, 16);
    EXPECT_EQ(broadcast.counters(slow.viewer).dropped_frames, 0u);
    EXPECT_EQ(broadcast.counters(slow.viewer).dropped_pictures, static_cast<std::uint64_t>(16 - pictures));
    for (const auto& next : {tracked(16), picture(16), tracked(17), key_picture(17), tracked(18), picture(18)})
        broadcast.push(next, start);
    EXPECT_EQ(numbers_of(slow.take()), (Numbers{16, 17, -83, 18, -82}));
}

TEST(Broadcast, PicturesThatWaitMakeRoomForMeshes) {
    Broadcast broadcast({.bytes = 1000, .wait = 10s});
    Watching slow(broadcast);
    broadcast.push(header(), start);
    broadcast.push(intra(0, 110), start);
    broadcast.push(key_picture(0, 250), start);
    for (std::uint32_t i = 1; i <= 6; ++i) broadcast.push(tracked(i), start);
    EXPECT_EQ(numbers_of(slow.take()), (Numbers{0, 1, 2, 3, 4, 5, 6}));
    EXPECT_EQ(broadcast.counters(slow.viewer).dropped_pictures, 1u);
    EXPECT_EQ(broadcast.counters(slow.viewer).fallen_behind, 0u);
}

TEST(Broadcast, WhoComesBackWaitsForAKeyPicture) {
    Broadcast broadcast({.bytes = 1000, .wait = 10s, .most_missed = 1});
    Watching slow(broadcast);
    broadcast.push(header(), start);
    broadcast.push(intra(0, 110), start);
    broadcast.push(key_picture(0, 120), start);
    for (std::uint32_t i = 1; i <= 10; ++i) broadcast.push(tracked(i), start);
    EXPECT_EQ(broadcast.counters(slow.viewer).fallen_behind, 1u);
    EXPECT_EQ(numbers_of(slow.take()), Numbers{});
    for (const auto& next : {intra(11, 110), picture(11, 50), tracked(12), key_picture(12, 50), tracked(13)})
        broadcast.push(next, start);
    EXPECT_EQ(numbers_of(slow.take()), (Numbers{11, 12, -88, 13}));
}

TEST(Broadcast, PicturesThatNobodyCouldDecodeGoNoFurther) {
    Broadcast broadcast;
    Watching viewer(broadcast);
    broadcast.push(header(), start);
    for (const auto& next :
         {intra(0), picture(0), tracked(1), picture(1), tracked(2), key_picture(2), tracked(3), picture(3)})
        broadcast.push(next, start);
    EXPECT_EQ(numbers_of(viewer.take()), (Numbers{0, 1, 2, -98, 3, -97}));
}

TEST(Broadcast, WherePicturesAreTooManyToBeKeptMeshesStillAre) {
    Broadcast broadcast({.kept_bytes = 3000});
    broadcast.push(header(), start);
    broadcast.push(intra(0), start);
    broadcast.push(key_picture(0), start);
    for (std::uint32_t i = 1; i <= 10; ++i) {
        broadcast.push(tracked(i), start);
        broadcast.push(picture(i), start);
    }
    EXPECT_LE(broadcast.kept_bytes(), 3000u);
    Watching viewer(broadcast);
    EXPECT_EQ(numbers_of(viewer.take()), (Numbers{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10}));
    broadcast.push(tracked(11), start);
    broadcast.push(picture(11), start);
    EXPECT_EQ(numbers_of(viewer.take()), Numbers{11});
    broadcast.push(tracked(12), start);
    broadcast.push(key_picture(12), start);
    EXPECT_EQ(numbers_of(viewer.take()), (Numbers{12, -88}));
    Watching late(broadcast);
    EXPECT_EQ(numbers_of(late.take()).back(), -88);
}

}  // namespace
}  // namespace htvm::live
