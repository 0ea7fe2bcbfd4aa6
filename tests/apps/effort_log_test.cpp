// The log of efforts, by which a run is repeated: what is written is read again, and nothing else is replaced by it.
#include "effort_log.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

namespace htvm::app {
namespace {

namespace fs = std::filesystem;

class EffortLogs : public testing::Test {
protected:
    void SetUp() override { fs::remove(path), fs::remove(partial); }
    fs::path path = fs::path(testing::TempDir()) /
                    (std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) + ".csv"),
             partial = path.string() + ".partial";
    void write(const std::string& text) { std::ofstream(path, std::ios::binary) << text; }
    static std::string text(const fs::path& file) {
        std::ifstream in(file, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    std::vector<LoggedFrame> frames() {
        const auto read = read_effort_log(path);
        return read ? read->frames : std::vector<LoggedFrame>{};
    }
    std::string error() {
        const auto read = read_effort_log(path);
        return read ? "" : read.error().message.substr(path.string().size());
    }
};

TEST_F(EffortLogs, GiveBackWhatWasDecided) {
    auto log = EffortLogWriter::create(path, 9);
    ASSERT_TRUE(log);
    for (const TimedFrame& frame :
         {TimedFrame{5, 0, 40}, {.effort = 0, .waited = 12.5, .took = 20, .left_lost = true}, {9, 1, 2}})
        ASSERT_TRUE(log->add(frame));
    ASSERT_TRUE(log->finish());
    EXPECT_EQ(frames(), (std::vector<LoggedFrame>{{5, true}, {0, false}, {9, true}}));
    EXPECT_EQ(read_effort_log(path)->asked, 9);
    EXPECT_EQ(text(path),
              "frame,effort,waited_ms,took_ms,may_repair,asked_effort\n"
              "0,5,0.000,40.000,1,9\n1,0,12.500,20.000,0,9\n2,9,1.000,2.000,1,9\n");
    EXPECT_EQ(log->keep(), fs::path());
    EXPECT_FALSE(fs::exists(partial));
}

TEST_F(EffortLogs, HaveEachFrameAsSoonAsItIsDecidedAndKeepThoseOfARunThatEndsEarly) {
    write("frame,effort\n0,3\n");
    {
        auto log = EffortLogWriter::create(path, 5);
        ASSERT_TRUE(log && log->add({4, 0, 40}));
        EXPECT_EQ(text(partial), "frame,effort,waited_ms,took_ms,may_repair,asked_effort\n0,4,0.000,40.000,1,5\n");
        EXPECT_EQ(log->keep(), partial);
    }
    EXPECT_EQ(frames(), (std::vector<LoggedFrame>{{3, true}}));
    fs::rename(partial, path);
    EXPECT_EQ(frames(), (std::vector<LoggedFrame>{{4, true}}));
}

TEST_F(EffortLogs, OfNoFrameLeaveNothing) {
    {
        auto log = EffortLogWriter::create(path, 5);
        ASSERT_TRUE(log);
        EXPECT_EQ(log->keep(), fs::path());
    }
    EXPECT_FALSE(fs::exists(path) || fs::exists(partial));
}

TEST_F(EffortLogs, ReplaceEmptyFilesAndOtherLogsAlone) {
    for (const char* may_be_replaced : {"", "frame,effort\n"}) {
        write(may_be_replaced);
        EXPECT_TRUE(EffortLogWriter::create(path, 5)) << may_be_replaced;
    }
    for (const char* may_not : {"ply\nformat ascii 1.0\n", "frame", "\n"}) {
        write(may_not);
        const auto log = EffortLogWriter::create(path, 5);
        ASSERT_FALSE(log) << may_not;
        EXPECT_EQ(log.error().message,
                  path.string() +
                      " is there already, and is no effort log, which would begin with \"frame,effort,...\": give "
                      "--effort-log another name, or remove that file");
        EXPECT_EQ(text(path), may_not);
        EXPECT_FALSE(fs::exists(partial));
    }
}

TEST_F(EffortLogs, OfEarlierVersionsAreRead) {
    write("frame,effort,waited_ms,took_ms\n0,5,0.000,40.000\n1,2,12.500,20.000\n");
    EXPECT_EQ(frames(), (std::vector<LoggedFrame>{{5, true}, {2, true}}));
    EXPECT_EQ(read_effort_log(path)->asked, 5);
    write("frame,effort,waited_ms,took_ms,repaired\n0,5,0.000,40.000,1\n1,7,12.500,20.000,0\n");
    EXPECT_EQ(frames(), (std::vector<LoggedFrame>{{5, true}, {7, false}}));
    EXPECT_EQ(read_effort_log(path)->asked, 7);
}

TEST_F(EffortLogs, MayHaveTheLineEndsOfWindows) {
    write("frame,effort,waited_ms,took_ms,may_repair,asked_effort\r\n0,5,0,40,1,8\r\n1,2,12.5,20,0,8\r\n\r\n");
    EXPECT_EQ(frames(), (std::vector<LoggedFrame>{{5, true}, {2, false}}));
    EXPECT_EQ(read_effort_log(path)->asked, 8);
    write("frame,effort\r\n0,5\r\n1,2\r\n");
    EXPECT_EQ(frames(), (std::vector<LoggedFrame>{{5, true}, {2, true}}));
}

TEST_F(EffortLogs, ThatAreNoneAreRefusedWithTheirLine) {
    const std::string what =
        " (an effort log, as --effort-log writes it, has a line \"frame,effort,...\", then one per "
        "frame)";
    write("time,effort\n0,5\n");
    EXPECT_EQ(error(), ", line 1: this is no effort log" + what);
    write("frame,effort\n0,5\n2,5\n");
    EXPECT_EQ(error(), ", line 3: frames are not numbered from 0 on" + what);
    for (const char* row : {"0,10", "0,-1", "0,4.5", "0,", "0,x"}) {
        write(std::string("frame,effort\n") + row + "\n");
        EXPECT_EQ(error(), ", line 2: an effort is 0 to 9" + what) << row;
    }
    for (const char* row : {"0,5,0,0", "0,5,0,0,1,5"}) {
        write(std::string("frame,effort,waited_ms,took_ms,may_repair\n") + row + "\n");
        EXPECT_EQ(error(), ", line 2: a column is missing, or one too many" + what) << row;
    }
    write("frame,effort,waited_ms,took_ms,may_repair\n0,5,0,0,2\n");
    EXPECT_EQ(error(), ", line 2: whether it may be repaired is 0 or 1" + what);
    write("frame,effort,asked_effort\n0,5,0\n");
    EXPECT_EQ(error(), ", line 2: the effort asked for is 1 to 9" + what);
    write("frame,effort,asked_effort\n0,5,9\n1,5,8\n");
    EXPECT_EQ(error(), ", line 3: the effort asked for is another than before" + what);
    write("frame,effort\n0\n");
    EXPECT_EQ(error(), ", line 2: there is no effort" + what);
    write("frame,effort\n");
    EXPECT_EQ(error(), ", line 2: there is no frame" + what);
}

}  // namespace
}  // namespace htvm::app
