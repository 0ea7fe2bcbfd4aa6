#include "ladder_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace htvm::app {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

// A folder of its own for each test.
class FilesOfLadder : public testing::Test {
protected:
    FilesOfLadder() {
        folder_ = fs::temp_directory_path() /
                  (std::string("htvm_ladder_") + testing::UnitTest::GetInstance()->current_test_info()->name());
        fs::remove_all(folder_);
        fs::create_directories(folder_);
    }
    ~FilesOfLadder() override { fs::remove_all(folder_); }

    std::string place(const std::string& name) const { return (folder_ / name).string(); }
    void write(const std::string& name, const std::string& text) const {
        std::ofstream(place(name), std::ios::binary) << text;
    }
    static std::string message(const std::vector<std::string>& named) {
        const auto files = files_of_ladder(named);
        return files ? "no error" : files.error().message;
    }

    fs::path folder_;
};

const std::string list =
    "#EXTM3U\n#EXT-X-STREAM-INF:BANDWIDTH=900000,AVERAGE-BANDWIDTH=500000\nperson-2.m3u8\n"
    "#EXT-X-STREAM-INF:BANDWIDTH=1000000,AVERAGE-BANDWIDTH=300000\nperson-1.m3u8\n";

TEST_F(FilesOfLadder, FilesThatAreNamedStayInTheirOrder) {
    EXPECT_EQ(*files_of_ladder({"b.htvm", "a.htvm"}), (std::vector<std::string>{"b.htvm", "a.htvm"}));
}

TEST_F(FilesOfLadder, AListOfPlaylistsHasThemByTheirMeanRates) {
    write("person.m3u8", list);
    EXPECT_EQ(*files_of_ladder({place("person.m3u8")}),
              (std::vector<std::string>{place("person-1.m3u8"), place("person-2.m3u8")}));
}

TEST_F(FilesOfLadder, AFolderHasThoseOfTheListOfPlaylistsInIt) {
    write("person.m3u8", list);
    write("person-1.m3u8", "#EXTM3U\n");
    write("map-0.mp4", "of a segment");
    write("map-1.mp4", "of another");
    EXPECT_EQ(*files_of_ladder({folder_.string()}),
              (std::vector<std::string>{place("person-1.m3u8"), place("person-2.m3u8")}));
}

TEST_F(FilesOfLadder, AFolderWithoutAListHasItsStreamsBySize) {
    write("a.htvm", "the largest");
    write("b.mp4", "small");
    write("c.htvm", "middling");
    write("d.txt", "none");
    EXPECT_EQ(*files_of_ladder({folder_.string()}),
              (std::vector<std::string>{place("b.mp4"), place("c.htvm"), place("a.htvm")}));
}

TEST_F(FilesOfLadder, WhatIsNoLadderIsRefusedInWords) {
    write("person.m3u8", list);
    write("alone.m3u8", "#EXTM3U\n#EXTINF:1,\na.m4s\n");
    EXPECT_THAT(message({place("alone.m3u8")}), HasSubstr("alone.m3u8 is no ladder: name two files or more"));
    EXPECT_THAT(message({"person.htvm"}), HasSubstr("person.htvm is no ladder"));
    EXPECT_THAT(message({"a.htvm", "a.htvm"}), HasSubstr("a file is named twice"));
    EXPECT_THAT(message({"1", "2", "3", "4", "5", "6", "7", "8", "9"}),
                HasSubstr("9 files are too many: a hub takes 8 rungs"));
    EXPECT_THAT(message({place("nothing.m3u8")}), HasSubstr("nothing.m3u8"));
    write("other.m3u8", list);
    EXPECT_THAT(message({folder_.string()}), HasSubstr("has several ladders"));
}

TEST_F(FilesOfLadder, AListNamesNothingOutsideItsFolder) {
    write("person.m3u8", "#EXTM3U\n#EXT-X-STREAM-INF:BANDWIDTH=1\n../../etc/passwd\n");
    EXPECT_THAT(message({place("person.m3u8")}), HasSubstr("names a playlist that is not beside it: ../../etc/passwd"));
}

}  // namespace
}  // namespace htvm::app
