#include "io/sequence_names.h"

#include <algorithm>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace htvm {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using Names = std::vector<std::string>;

TEST(NaturalOrder, ComparesRunsOfDigitsAsNumbers) {
    EXPECT_TRUE(natural_less("f2.ply", "f10.ply"));
    EXPECT_FALSE(natural_less("f10.ply", "f2.ply"));
    EXPECT_TRUE(natural_less("f2a10", "f2a11"));
    EXPECT_TRUE(natural_less("a9", "b1"));
    EXPECT_TRUE(natural_less("f", "f0"));
    EXPECT_TRUE(natural_less("f1", "f01"));
    EXPECT_TRUE(natural_less("f01b", "f1c"));
    EXPECT_TRUE(natural_less("f99999999999999999999", "f100000000000000000000"));
    EXPECT_FALSE(natural_less("f01", "f01"));
    EXPECT_FALSE(natural_less("", ""));
}

TEST(NaturalOrder, IsAStrictWeakOrderOverShortNames) {
    std::vector<std::string> names{""};
    for (std::size_t from = 0, length = 0; length < 4; ++length) {
        const std::size_t to = names.size();
        for (; from < to; ++from) {
            for (const char c : {'0', '1', 'a'}) names.push_back(names[from] + c);
        }
    }
    for (const auto& a : names) {
        EXPECT_FALSE(natural_less(a, a));
        for (const auto& b : names) {
            if (a != b) {
                EXPECT_NE(natural_less(a, b), natural_less(b, a)) << a << " " << b;
            }
            if (!natural_less(a, b)) continue;
            for (const auto& c : names) {
                if (natural_less(b, c) && !natural_less(a, c)) ADD_FAILURE() << a << " " << b << " " << c;
            }
        }
    }
}

// The names in the order of the frames.
Names ordered(const Names& names) {
    const auto order = order_of_frames(names, ".ply");
    EXPECT_TRUE(order) << order.error().message;
    Names out;
    if (order)
        for (const auto place : order->places) out.push_back(names[place]);
    return out;
}

std::vector<std::uint64_t> numbers_of(const Names& names) {
    const auto order = order_of_frames(names, ".ply");
    EXPECT_TRUE(order) << order.error().message;
    return order ? order->numbers : std::vector<std::uint64_t>{};
}

std::vector<std::string> remarks_on(const Names& names) {
    std::vector<std::string> out;
    if (const auto order = order_of_frames(names, ".ply"))
        for (const auto& remark : order->remarks) out.push_back(remark.about);
    return out;
}

std::string error_of(const Names& names) {
    const auto order = order_of_frames(names, ".ply");
    return order ? "no error" : order.error().message;
}

TEST(TextOrder, IsThatOfShells) {
    EXPECT_TRUE(is_text_order(Names{"f1", "f10", "f2"}));
    EXPECT_TRUE(is_text_order(Names{"a.ply", "B.ply", "c.ply"})) << "letters in any case";
    EXPECT_TRUE(is_text_order(Names{"f10.ply", "f1.ply", "f2.ply"})) << "points are passed over in some languages";
    EXPECT_FALSE(is_text_order(Names{"f2", "f10", "f1"}));
}

TEST(KindsOfNames, DifferInMoreThanNumbers) {
    const auto kinds = kinds_of_names(Names{"a_1", "b_1", "A_2", "template", "100%_3"}, ".ply");
    ASSERT_EQ(kinds.size(), 4u);
    EXPECT_THAT(kinds[0].places, ElementsAre(0u, 2u));
    EXPECT_EQ(kinds[0].pattern, "a_%d.ply");
    EXPECT_EQ(kinds[1].pattern, "b_1.ply");
    EXPECT_EQ(kinds_of_names(Names{"50%_1", "50%_2"}, "")[0].pattern, "50%%_%d");
    EXPECT_EQ(kinds_of_names(Names{"1_2", "2_3"}, "")[0].pattern, "*_*");
}

TEST(OrderOfFrames, TheNumberThatVariesIsTheFrames) {
    EXPECT_THAT(numbers_of({"levi_fr0003_qp12_qt13", "levi_fr0004_qp12_qt13"}), ElementsAre(3u, 4u));
    EXPECT_THAT(numbers_of({"0003_lod0", "0007_lod0"}), ElementsAre(3u, 7u));
    EXPECT_THAT(numbers_of({"take2_f12_cam1", "take2_f13_cam1"}), ElementsAre(12u, 13u));
    EXPECT_THAT(numbers_of({"walk"}), IsEmpty());
}

TEST(OrderOfFrames, OfSeveralThatVaryTheOneThatCountsFramesIsTaken) {
    EXPECT_THAT(ordered({"4096_f1", "4001_f2", "4444_f3", "3999_f4"}),
                ElementsAre("4096_f1", "4001_f2", "4444_f3", "3999_f4"));
    EXPECT_THAT(numbers_of({"s1_f0001", "s1_f0002", "s2_f0003", "s2_f0004"}), ElementsAre(1u, 2u, 3u, 4u));
    EXPECT_THAT(numbers_of({"20240131_120501_003_f07", "20240131_120501_036_f08", "20240131_120502_001_f09"}),
                ElementsAre(7u, 8u, 9u));
    EXPECT_THAT(remarks_on({"1_4096", "2_4001", "3_4444"}), ElementsAre("numbers-vary"));
}

TEST(OrderOfFrames, DatesAndTimesAreInTheOrderOfAllTheirNumbers) {
    const Names times = {"20240131_120459_970", "20240131_120500_003", "20240131_120500_036", "20240131_120501_003"};
    auto shuffled = times;
    std::swap(shuffled[0], shuffled[3]);
    EXPECT_EQ(ordered(shuffled), times);
    EXPECT_THAT(numbers_of(times), IsEmpty());
    EXPECT_THAT(remarks_on(times), ElementsAre("numbers-vary"));
    const Names dates = {"2024-01-31T12-05-59.960", "2024-01-31T12-06-00.000", "2024-01-31T12-06-00.040"};
    EXPECT_EQ(ordered(dates), dates);
}

TEST(OrderOfFrames, MillisecondsThatRecurAreNoFramesThatAreThereTwice) {
    Names times;
    for (int second = 10; second < 40; ++second)
        for (const char* ms : {"000", "250", "500", "750"}) times.push_back("1205" + std::to_string(second) + "_" + ms);
    EXPECT_EQ(ordered(times), times);
}

TEST(OrderOfFrames, DecimalNumbersAreOrderedAsSuch) {
    EXPECT_THAT(ordered({"f_1699999999.5", "f_1699999999.123456", "f_1700000000.25"}),
                ElementsAre("f_1699999999.123456", "f_1699999999.5", "f_1700000000.25"));
    EXPECT_THAT(ordered({"0.5", "0.25", "1.125"}), ElementsAre("0.25", "0.5", "1.125"));
    EXPECT_THAT(remarks_on({"0.5", "0.25", "1.125"}), ElementsAre("decimal-numbers"));
    EXPECT_THAT(ordered({"1.9", "1.10", "2.1"}), ElementsAre("1.9", "1.10", "2.1")) << "counted behind the point";
    EXPECT_THAT(numbers_of({"take1.0007", "take1.0008"}), ElementsAre(7u, 8u));
}

TEST(OrderOfFrames, ADashIsASignWhereSomeLackIt) {
    EXPECT_THAT(ordered({"f0", "f-2", "f1", "f-1"}), ElementsAre("f-2", "f-1", "f0", "f1"));
    EXPECT_THAT(ordered({"f-2", "f--1", "f-0"}), ElementsAre("f--1", "f-0", "f-2"));
    EXPECT_THAT(numbers_of({"f-0003", "f-0004"}), ElementsAre(3u, 4u));
    EXPECT_EQ(kinds_of_names(Names{"f-0", "f-1", "f0", "f1"}, "").size(), 2u) << "two captures";
}

TEST(OrderOfFrames, SeveralFilesOfEachNumberAreRefused) {
    EXPECT_THAT(error_of({"f1_lod0", "f1_lod1", "f2_lod0", "f2_lod1", "f3_lod0", "f3_lod1"}),
                AllOf(HasSubstr("3 \"f*_lod0.ply\""), HasSubstr("3 \"f*_lod1.ply\""),
                      HasSubstr("as with --ignore \"f*_lod1.ply\"")));
    EXPECT_THAT(error_of({"f 1 (1)", "f 1 (2)", "f 2 (1)", "f 2 (2)", "f 3 (1)", "f 3 (2)"}),
                HasSubstr("--ignore \"f * (2).ply\""))
        << "copies without what they are copies of";
    EXPECT_THAT(error_of({"1", "001", "2"}), AllOf(HasSubstr("1.ply"), HasSubstr("001.ply")));
}

TEST(OrderOfFrames, NumbersThatBeginAnewAreWarnedOf) {
    const Names takes = {"cam1_0001", "cam1_0002", "cam1_0003", "cam2_0001", "cam2_0002", "cam2_0003"};
    EXPECT_EQ(ordered(takes), takes);
    const auto order = order_of_frames(takes, ".ply");
    ASSERT_EQ(order->remarks.size(), 1u);
    EXPECT_TRUE(order->remarks[0].is_loss);
    EXPECT_THAT(order->remarks[0].text, HasSubstr("begin anew at cam2_0001.ply"));
}

TEST(OrderOfFrames, LongNumbersAreOrderedThoughTheyCannotBeCounted) {
    EXPECT_THAT(ordered({"100000000000000000000", "99999999999999999999"}),
                ElementsAre("99999999999999999999", "100000000000000000000"));
    EXPECT_THAT(numbers_of({"100000000000000000000", "99999999999999999999"}), IsEmpty());
}

TEST(OrderByFirstNumber, ServesNamesThatGoOnDifferently) {
    const auto order = order_by_first_number(Names{"0002_run", "0001_walk", "0003_run"});
    ASSERT_TRUE(order);
    EXPECT_THAT(order->places, ElementsAre(1u, 0u, 2u));
    EXPECT_FALSE(order_by_first_number(Names{"1_a", "1_b", "2_a"}));
    EXPECT_FALSE(order_by_first_number(Names{"1_a", "b_2"}));
    EXPECT_FALSE(order_by_first_number(Names{"1_a", "b"}));
}

TEST(FrameStep, IsWhatNumbersStepByMostOften) {
    using Numbers = std::vector<std::uint64_t>;
    EXPECT_EQ(frame_step(Numbers{4, 5, 7, 8}), 1u);
    EXPECT_EQ(frame_step(Numbers{0, 10, 20, 40}), 10u);
    EXPECT_EQ(frame_step(Numbers{0, 33, 67, 100, 133}), std::nullopt);
    EXPECT_EQ(frame_step(Numbers{1, 2, 3, 100}), std::nullopt);
}

TEST(Copies, AreToldByTheirMarks) {
    for (const char* copy : {"f_3 (1)", "f_3(2)", "f_3 - Copy", "f_3 - Copy (2)", "f_3_copy", "f_3 copy", "f_3 copy 2",
                             "Copy of f_3", "f_3 - Kopie", "f_3.bak", "f_3_old"})
        EXPECT_EQ(original_of_copy(copy), "f_3") << copy;
    for (const char* other : {"f_3", "f_3)", "(1)", "copy", "f_(3", ""}) EXPECT_FALSE(original_of_copy(other)) << other;
    EXPECT_TRUE(is_unfinished_name("f_3.tmp"));
    EXPECT_TRUE(is_unfinished_name("~$f_3"));
    EXPECT_FALSE(is_unfinished_name("f_3"));
}

}  // namespace
}  // namespace htvm
