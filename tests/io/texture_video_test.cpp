#include "io/texture_video.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/wait.h>

#include <cerrno>
#include <fstream>

#include "io/child_program.h"

namespace htvm {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

// Eight pictures of 16 x 8 pixels: picture k is grey, of 20 k + 10.
class TextureVideoTest : public testing::Test {
protected:
    void SetUp() override {
        std::string made = (fs::temp_directory_path() / "htvm_video_XXXXXX").string();
        ASSERT_NE(mkdtemp(made.data()), nullptr);
        folder = made;
        const auto program =
            start_program({"ffmpeg", "-nostdin", "-loglevel", "error", "-f", "lavfi", "-i", "color=size=16x8:rate=30",
                           "-vf", "format=gbrp,geq=r='20*N+10':g='20*N+10':b='20*N+10',format=bgr0", "-frames:v", "8",
                           "-c:v", "ffv1", (folder / "grey.mkv").string()},
                          {no_stream, no_stream, our_stream});
        if (program == 0) GTEST_SKIP() << "ffmpeg is not installed";
        ASSERT_TRUE(ends_well(program));
    }
    void TearDown() override { fs::remove_all(folder); }

    // The level of a picture all of which is grey; -1 if there is no such picture.
    static int level(TextureVideo& video, std::size_t number) {
        const auto picture = video.picture(number);
        if (!picture || picture->width != 16 || picture->height != 8 || picture->rgb.size() != 3 * 16 * 8) return -1;
        for (const auto value : picture->rgb)
            if (value != picture->rgb[0]) return -1;
        return picture->rgb[0];
    }
    fs::path folder;
};

TEST_F(TextureVideoTest, GivesPicturesInAnyOrderOfAskingForThem) {
    auto video = TextureVideo::open(folder / "grey.mkv");
    ASSERT_TRUE(video) << video.error().message;
    for (const int number : {0, 1, 2, 5, 7, 3, 4, 0})
        EXPECT_EQ(level(*video, static_cast<std::size_t>(number)), 20 * number + 10);
}

TEST_F(TextureVideoTest, CopiesReadByThemselves) {
    auto video = TextureVideo::open(folder / "grey.mkv");
    ASSERT_TRUE(video);
    EXPECT_EQ(level(*video, 3), 70);
    auto copy = *video;
    EXPECT_EQ(level(copy, 0), 10);
    EXPECT_EQ(level(*video, 4), 90);
    EXPECT_EQ(level(copy, 1), 30);
}

TEST_F(TextureVideoTest, BehindItsEndThereIsNothingAndBeforeStillIs) {
    auto video = TextureVideo::open(folder / "grey.mkv");
    ASSERT_TRUE(video);
    for (const std::size_t number : {std::size_t{8}, std::size_t{1} << 60, std::size_t{8}}) {
        const auto picture = video->picture(number);
        ASSERT_FALSE(picture);
        EXPECT_EQ(picture.error().message, (folder / "grey.mkv").string() + " has 8 pictures");
    }
    EXPECT_EQ(level(*video, 7), 150);
}

TEST_F(TextureVideoTest, AnEarlyEndLeavesNoProcess) {
    {
        auto video = TextureVideo::open(folder / "grey.mkv");
        ASSERT_TRUE(video);
        EXPECT_EQ(level(*video, 0), 10);
        const auto copy = *video;
    }
    EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1);
    EXPECT_EQ(errno, ECHILD);
}

TEST_F(TextureVideoTest, WhatIsDamagedIsAnErrorSinceItWouldShiftWhatFollows) {
    fs::resize_file(folder / "grey.mkv", fs::file_size(folder / "grey.mkv") * 2 / 3);
    auto video = TextureVideo::open(folder / "grey.mkv");
    const auto picture = video ? video->picture(7) : tl::unexpected(video.error());
    ASSERT_FALSE(picture);
    EXPECT_EQ(picture.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(picture.error().message, HasSubstr("File ended prematurely"));
}

TEST_F(TextureVideoTest, WhatIsNoneIsSaid) {
    EXPECT_THAT(TextureVideo::open(folder).error().message, HasSubstr("is no file"));
    std::ofstream(folder / "text.mp4") << "nonsense";
    const auto text = TextureVideo::open(folder / "text.mp4");
    EXPECT_EQ(text.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(text.error().message, HasSubstr("text.mp4 is no video that ffmpeg can decode"));
    const auto without = TextureVideo::open(folder / "grey.mkv", "no_such_program");
    EXPECT_EQ(without.error().kind, ErrorKind::unsupported);
    EXPECT_THAT(without.error().message, HasSubstr("install ffmpeg"));
    // Whatever it is that runs: it is not waited for, and what it says is no size.
    EXPECT_THAT(TextureVideo::open(folder / "grey.mkv", "yes").error().message, HasSubstr("can decode"));
}

TEST(TextureVideo, IsKnownByItsName) {
    for (const char* name : {"a.mp4", "b.MOV", "folder/c.mkv", "d.webm"}) EXPECT_TRUE(is_video_file_name(name));
    for (const char* name : {"a.png", "mp4", "a.mp4/b", "tex_%05d.jpg", ""}) EXPECT_FALSE(is_video_file_name(name));
}

}  // namespace
}  // namespace htvm
