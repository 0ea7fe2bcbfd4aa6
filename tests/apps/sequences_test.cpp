// Decoded frames are compared with their own originals, whatever frames are missing on either side.
#include "sequences.h"

#include <gtest/gtest.h>

#include "io/sequence.h"

namespace htvm::app {
namespace {

using Numbers = std::vector<std::uint64_t>;
using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

Numbers numbers_of(const std::vector<std::filesystem::path>& names) { return numbers_in_names(names); }

Pairs pairs_of(const Numbers& original, const Numbers& decoded) {
    Pairs out;
    for (const auto& pair : pair_by_number(original, decoded)) out.emplace_back(pair.original, pair.decoded);
    return out;
}

TEST(FramePairs, TheNumberIsTheOneThatVaries) {
    EXPECT_EQ(numbers_of({"a/take2_frame_0007.ply", "a/take2_frame_0012.ply"}), (Numbers{7, 12}));
    EXPECT_EQ(numbers_of({"00000.ply", "00003.ply"}), (Numbers{0, 3}));
    EXPECT_EQ(numbers_of({"f9_low.obj", "f10_low.obj"}), (Numbers{9, 10}));
}

TEST(FramePairs, NamesThatDifferOtherwiseHaveNoNumbers) {
    EXPECT_EQ(numbers_of({"first.ply", "second.ply"}), Numbers{});
    EXPECT_EQ(numbers_of({"a1.ply", "b2.ply"}), Numbers{});
    EXPECT_EQ(numbers_of({"1_low.ply", "2_high.ply"}), Numbers{});
    EXPECT_EQ(numbers_of({"a1.ply", "a01.ply"}), Numbers{}) << "the same number twice";
    EXPECT_EQ(numbers_of({"a99999999999999999999999.ply"}), Numbers{}) << "beyond 64 bits";
    EXPECT_EQ(numbers_of({}), Numbers{});
}

TEST(FramePairs, AFrameThatIsMissingShiftsNoOther) {
    EXPECT_EQ(pairs_of({0, 1, 2, 3, 4}, {0, 1, 3, 4}), (Pairs{{0, 0}, {1, 1}, {3, 2}, {4, 3}}));
    EXPECT_EQ(pairs_of({0, 1, 3}, {0, 1, 2, 3}), (Pairs{{0, 0}, {1, 1}, {2, 3}}));
}

TEST(FramePairs, DecodedFramesMayCountThePlacesOfTheOriginals) {
    EXPECT_EQ(pairs_of({1, 2, 3, 4}, {0, 1, 3}), (Pairs{{0, 0}, {1, 1}, {3, 2}}));
    EXPECT_EQ(pairs_of({40, 41, 42, 43}, {1, 3}), (Pairs{{1, 0}, {3, 1}})) << "the first one is missing";
    EXPECT_EQ(pairs_of({0, 2, 4}, {0, 1, 2}), (Pairs{{0, 0}, {1, 1}, {2, 2}})) << "the originals have gaps";
}

TEST(FramePairs, DecodedFramesMayCountFromAnythingElse) {
    EXPECT_EQ(pairs_of({1, 2, 3, 4}, {100, 101, 103}), (Pairs{{0, 0}, {1, 1}, {3, 2}}));
    EXPECT_EQ(pairs_of({7}, {3}), (Pairs{{0, 0}}));
}

TEST(FramePairs, NumbersAtTheEndOfTheirRangePairWithThemselves) {
    constexpr std::uint64_t most = ~std::uint64_t{0};
    EXPECT_EQ(pairs_of({0, most}, {0, most}), (Pairs{{0, 0}, {1, 1}}));
    EXPECT_EQ(pairs_of({most - 1, most}, {0, 1, 2}), (Pairs{{0, 0}, {1, 1}}));
}

TEST(FramePairs, OfStreamsGoByTime) {
    const auto pairs = [](std::vector<std::int64_t> original, std::vector<std::int64_t> decoded) {
        Pairs out;
        for (const auto& pair : pair_by_time(original, decoded)) out.emplace_back(pair.original, pair.decoded);
        return out;
    };
    EXPECT_EQ(pairs({0, 33333, 66667, 100000}, {0, 66667, 100000}), (Pairs{{0, 0}, {2, 1}, {3, 2}}));
    EXPECT_EQ(pairs({66667, 100000}, {0, 33333, 66666, 100001}), (Pairs{{0, 2}, {1, 3}})) << "rounded otherwise";
    EXPECT_EQ(pairs({0, 40000}, {1000, 41000}), Pairs{}) << "another millisecond";
}

MeshSource files(std::size_t frames, std::vector<std::int64_t> times_us = {}) {
    MeshSource out;
    out.frames = frames;
    for (std::size_t k = 0; k < frames; ++k) out.numbers.push_back(k);
    out.times_us = std::move(times_us);
    return out;
}

Pairs pairs_of_files(const MeshSource& original, const MeshSource& decoded) {
    Pairs out;
    for (const auto& pair : pair_files(original, decoded)) out.emplace_back(pair.original, pair.decoded);
    return out;
}

TEST(FramePairs, OfFilesGoByTheTimesThatBothTell) {
    const auto original = files(4, {0, 40000, 90000, 120000});
    EXPECT_EQ(pairs_of_files(original, files(3, {0, 90000, 120000})), (Pairs{{0, 0}, {2, 1}, {3, 2}}));
    EXPECT_EQ(pairs_of_files(original, files(3)), (Pairs{{0, 0}, {1, 1}, {2, 2}})) << "by number where one tells none";
    EXPECT_EQ(pairs_of_files(original, files(3, {5, 33333, 66667})), (Pairs{{0, 0}, {1, 1}, {2, 2}}))
        << "another clock";
}

TEST(FramePairs, OfFilesWithoutTimesGoByTheRateOfTheDecodedOnes) {
    EXPECT_EQ(pairs_of_files(files(6), files(4, {0, 33333, 100000, 166667})), (Pairs{{0, 0}, {1, 1}, {3, 2}, {5, 3}}));
    EXPECT_EQ(pairs_of_files(files(6), files(3, {66667, 100000, 133333})), (Pairs{{2, 0}, {3, 1}, {4, 2}}))
        << "the first two are left out";
    EXPECT_EQ(pairs_of_files(files(6), files(3, {0, 33333, 90000})), (Pairs{{0, 0}, {1, 1}, {2, 2}})) << "not regular";
    auto every_other = files(3, {0, 66667, 133333});
    every_other.numbers = {0, 2, 4};
    EXPECT_EQ(pairs_of_files(files(6), every_other), (Pairs{{0, 0}, {2, 1}, {4, 2}})) << "the originals' own numbers";
}

TEST(FramePairs, SomeOfTheOriginalsGoByTheirNumbers) {
    auto every_third = files(3);
    every_third.numbers = {0, 3, 6};
    EXPECT_EQ(pairs_of_files(every_third, files(7, {0, 40000, 80000, 120000, 160000, 200000, 240000})),
              (Pairs{{0, 0}, {1, 3}, {2, 6}}))
        << "all were encoded";
    EXPECT_EQ(pairs_of_files(every_third, files(3, {0, 40000, 80000})), (Pairs{{0, 0}, {1, 1}, {2, 2}}))
        << "these were encoded";
    EXPECT_EQ(places_beside(every_third, 7), (Numbers{0, 3, 6})) << "of a stream";
    EXPECT_EQ(places_beside(every_third, 3), (Numbers{0, 1, 2}));
    EXPECT_EQ(places_beside(every_third, 6), (Numbers{0, 1, 2})) << "fewer than the last number tells";
}

TEST(FramePairs, MayBeOutOfStepWhereDecodedFilesTellNoTimes) {
    EXPECT_TRUE(may_be_out_of_step(files(6), files(5)));
    EXPECT_FALSE(may_be_out_of_step(files(5), files(5)));
    EXPECT_FALSE(may_be_out_of_step(files(6), files(5, {0, 1, 2, 3, 4})));
    auto with_gap = files(5);
    with_gap.numbers.back() = 5;
    EXPECT_FALSE(may_be_out_of_step(files(6), with_gap)) << "the originals' own numbers";
}

TEST(FramePairs, WithoutFramesThereAreNoPairs) {
    EXPECT_EQ(pairs_of({}, {0, 1}), Pairs{});
    EXPECT_EQ(pairs_of({0, 1}, {}), Pairs{});
}

TEST(FramePairs, FramesLeftOutAreNamed) {
    const Numbers numbers = {10, 11, 12, 13, 14, 15};
    EXPECT_EQ(frames_left_out(numbers, std::vector<std::size_t>{0, 1, 2, 3, 4, 5}), "");
    EXPECT_EQ(frames_left_out(numbers, std::vector<std::size_t>{0, 2, 3, 4, 5}), "frame 11");
    EXPECT_EQ(frames_left_out(numbers, std::vector<std::size_t>{1, 3}), "frames 10, 12, 14 to 15");
    EXPECT_EQ(frames_left_out(numbers, {}), "frames 10 to 15");
}

}  // namespace
}  // namespace htvm::app
