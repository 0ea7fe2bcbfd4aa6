#include "io/timestamps.h"

#include <cstdlib>
#include <fstream>

#include "gmock/gmock.h"

namespace htvm {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr FrameRate ntsc = {30000, 1001}, film = {24, 1}, unknown = {};

std::int64_t time_of(std::string_view text, const FrameRate& rate = unknown) {
    const auto time = parse_time(text, rate);
    EXPECT_TRUE(time) << text << ": " << (time ? "" : time.error().message);
    return time.value_or(-1);
}

TEST(FrameRate, IsANumberOrAFraction) {
    const auto of = [](std::string_view text) {
        const auto rate = parse_frame_rate(text).value_or(FrameRate{});
        return std::pair(rate.numerator, rate.denominator);
    };
    EXPECT_EQ(of("30"), std::pair(30000u, 1000u));
    EXPECT_EQ(of("29.97"), std::pair(29970u, 1000u));
    EXPECT_EQ(of("30000/1001"), std::pair(30000u, 1001u));
    for (const char* bad : {"", "0", "-5", "nan", "30/0", "0/1", "1/2/3", "5000000000/1", "x"})
        EXPECT_FALSE(parse_frame_rate(bad)) << bad;
}

TEST(Time, IsSecondsUnlessItSaysOtherwise) {
    EXPECT_EQ(time_of("1.25"), 1250000);
    EXPECT_EQ(time_of(" 1.25 s"), 1250000);
    EXPECT_EQ(time_of("-0.5"), -500000);
    EXPECT_EQ(time_of("1250ms"), 1250000);
    EXPECT_EQ(time_of("1250000 us"), 1250000);
    EXPECT_EQ(time_of("01:02:03.5"), 3723500000);
    for (const char* bad : {"", "x", "1e30", "nan", "1:2", "00:61:00", "00:00:60", "1:2:3:4:5", "5 h"})
        EXPECT_FALSE(parse_time(bad, film)) << bad;
}

TEST(Time, NumbersTooLargeForSecondsAreFinerUnits) {
    for (const char* text : {"1700000000.125", "1700000000125", "1700000000125000", "1700000000125000000",
                             "1700000000125000000 ns", "2023-11-14T22:13:20.125Z"})
        EXPECT_EQ(time_of(text), 1700000000125000) << text;
}

TEST(Time, DatesCountFrom1970) {
    EXPECT_EQ(time_of("1970-01-01T00:00:00Z"), 0);
    EXPECT_EQ(time_of("1970-01-02"), 86400000000);
    EXPECT_EQ(time_of("1969-12-31T23:59:59.5"), -500000);
    EXPECT_EQ(time_of("2024-02-29 12:00:00"), 1709208000000000);
    EXPECT_EQ(time_of("2024-03-01T00:00Z"), 1709251200000000);
    EXPECT_EQ(time_of("2024-01-31T12:05:01.123+01:00"), time_of("2024-01-31T11:05:01.123Z"));
    EXPECT_EQ(time_of("20240131T120501.123Z"), time_of("2024-01-31 12:05:01,123"));
    for (const char* bad : {"2024-13-01", "2024-01-31T25:00:00", "2024-01-31T12:00:00+1", "2024-01-31x", "2024-01-3"})
        EXPECT_FALSE(parse_time(bad, film)) << bad;
}

TEST(Time, TimecodeCountsFramesAtTheRate) {
    EXPECT_EQ(time_of("00:00:01:12", film), 1500000);
    EXPECT_EQ(time_of("00:00:01:00", ntsc), 1001000) << "30 frames, which take a little longer than a second";
    EXPECT_FALSE(parse_time("00:00:00:24", film)) << "beyond the frames of a second";
    EXPECT_THAT(parse_time("00:00:00:05", unknown).error().message, HasSubstr("--fps"));
}

TEST(Time, DropFrameTimecodeKeepsToTheClock) {
    EXPECT_EQ(time_of("00:01:00;02", ntsc), 60060000) << "frame 1800: ;00 and ;01 are left out";
    EXPECT_EQ(time_of("01:00:00;00", ntsc), 3599996400) << "frame 107892";
    EXPECT_FALSE(parse_time("00:00:01;00", film)) << "there is none of 24 frames";
}

TEST(Time, ItsTextIsExact) {
    for (const std::int64_t time : {0ll, 1ll, 33333ll, 1250000ll, -500000ll, 1700000000123456ll})
        EXPECT_EQ(time_of(time_text(time)), time) << time_text(time);
    EXPECT_EQ(time_text(1250000), "1.25");
}

class FrameTimesFile : public testing::Test {
protected:
    void SetUp() override {
        std::string name = (std::filesystem::temp_directory_path() / "htvm_times_XXXXXX").string();
        ASSERT_NE(mkdtemp(name.data()), nullptr);
        folder = name;
    }
    void TearDown() override { std::filesystem::remove_all(folder); }
    Result<FrameTimes> read(const char* text) {
        std::ofstream(folder / "times") << text;
        return read_frame_times(folder / "times", film);
    }
    void expect_error(const char* text, const char* message) {
        const auto times = read(text);
        ASSERT_FALSE(times) << text;
        EXPECT_THAT(times.error().message, HasSubstr(message));
    }
    std::filesystem::path folder;
};

TEST_F(FrameTimesFile, ALinePerFrame) {
    const auto times = read("# camera 3\n0\r\n0.5\n\n00:00:01:12\n");
    ASSERT_TRUE(times) << times.error().message;
    EXPECT_THAT(times->microseconds, ElementsAre(0, 500000, 1500000));
    EXPECT_TRUE(times->numbers.empty());
}

TEST_F(FrameTimesFile, NumbersAndNamedColumns) {
    for (const char* text :
         {"7,0\n9,0.5\n", "frame,timestamp_us\n7,0\n9,500000\n",
          "camera\ttimecode\tframe\na\t00:00:00:00\t7\nb\t00:00:00:12\t9\n",
          "[{\"frame\": 7, \"timestamp_us\": 0}, {\"frame\": 9, \"timestamp\": 0.5}]",
          "{\"frames\": [{\"frame\": 7, \"timestamp_us\": 0}, {\"frame\": 9, \"timestamp_us\": 500000}]}"}) {
        const auto times = read(text);
        ASSERT_TRUE(times) << text << ": " << times.error().message;
        EXPECT_THAT(times->microseconds, ElementsAre(0, 500000)) << text;
        EXPECT_THAT(times->numbers, ElementsAre(7u, 9u)) << text;
    }
}

TEST_F(FrameTimesFile, AsSpreadsheetsAndLoggersWriteThem) {
    for (const char* text :
         {"\xEF\xBB\xBF"
          "frame,timestamp\r\n7,0\r\n9,0.5\r\n",
          "Frame;Time [s]\n7;0,0\n9;0,5\n", "sep=;\nFrame;Time\n7;0\n9;0,5\n", "frame\ttime_ms\r7\t0,0\r9\t500,0\r",
          "\"Frame\",\"Timestamp (us)\"\n\"7\",\"0\"\n\"9\",\"500000\"\n",
          "FRAME,TIMESTAMP_NS,note\n7,0,\"a, b\"\n9,500000000,\"c\"\n", "7 0.0\n9 0.5\n", "# a\n7, 0\n# b\n9, 0.5",
          "7;00:00:00:00\n9;00:00:00:12\n", "Bild;Zeit\n7;0\n9;0,5\n",
          "\xEF\xBB\xBF[{\"Frame\": 7, \"Timestamp_ns\": 0}, {\"Frame\": 9, \"timestampMs\": 500}]"}) {
        const auto times = read(text);
        ASSERT_TRUE(times) << text << ": " << times.error().message;
        EXPECT_THAT(times->microseconds, ElementsAre(0, 500000)) << text;
        EXPECT_THAT(times->numbers, ElementsAre(7u, 9u)) << text;
    }
    EXPECT_THAT(read("00:00:00;00\n00:00:00;12\n").error().message, HasSubstr("drop-frame"));
}

TEST_F(FrameTimesFile, JsonLists) {
    EXPECT_THAT(read("[0, 0.25, \"00:00:00:12\"]")->microseconds, ElementsAre(0, 250000, 500000));
    EXPECT_THAT(read("{\"timestamps\": [0, 0.25]}")->microseconds, ElementsAre(0, 250000));
    EXPECT_THAT(read("{\"timestamps_us\": [0, 250000]}")->microseconds, ElementsAre(0, 250000));
    EXPECT_THAT(read("{\"Timestamps_ns\": [0, 250000000]}")->microseconds, ElementsAre(0, 250000));
}

TEST_F(FrameTimesFile, WhatItsWriterWritesReadsBack) {
    const FrameTimes times = {{3, 4}, {33333, 66667}};
    const auto again = read(frame_times_csv(times).c_str());
    ASSERT_TRUE(again);
    EXPECT_EQ(again->numbers, times.numbers);
    EXPECT_EQ(again->microseconds, times.microseconds);
}

TEST_F(FrameTimesFile, ErrorsNameTheLine) {
    expect_error("0\n1\n0.5\n", "line 3: the time 0.5 is not above");
    expect_error("0\nsoon\n", "line 2: 'soon' is no time");
    expect_error("1,2,3\n", "must name them");
    expect_error("", "no times");
    expect_error("[0, null]", "entry 1");
    expect_error("{\"moments\": []}", "timestamps");
    expect_error("[0, ", "JSON");
}

}  // namespace
}  // namespace htvm
