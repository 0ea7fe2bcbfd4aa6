#include "io/output_file.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "gmock/gmock.h"

namespace htvm {
namespace {

namespace fs = std::filesystem;

class Output : public testing::Test {
protected:
    void SetUp() override {
        std::string name = (fs::temp_directory_path() / "htvm_output_XXXXXX").string();
        ASSERT_NE(mkdtemp(name.data()), nullptr);
        folder = name;
        std::ofstream(folder / "file") << "before";
    }
    void TearDown() override { fs::remove_all(folder); }
    std::string text(const char* name) {
        std::stringstream out;
        out << std::ifstream(folder / name).rdbuf();
        return out.str();
    }
    static Result<void> write(OutputFile& file, std::string_view words) {
        return file.write({reinterpret_cast<const std::uint8_t*>(words.data()), words.size()});
    }
    fs::path folder;
};

TEST_F(Output, IsInItsPlaceOnceItIsFinished) {
    auto file = OutputFile::create(folder / "file");
    ASSERT_TRUE(file && write(*file, "after"));
    EXPECT_EQ(text("file"), "before");
    ASSERT_TRUE(file->finish());
    EXPECT_EQ(text("file"), "after");
    EXPECT_FALSE(fs::exists(folder / "file.partial"));
}

TEST_F(Output, IsThereBesideItsPlaceOnceItIsFlushed) {
    auto file = OutputFile::create(folder / "file");
    ASSERT_TRUE(file && write(*file, "after") && file->flush());
    EXPECT_EQ(text("file.partial"), "after");
    EXPECT_EQ(text("file"), "before");
}

TEST_F(Output, OfSomebodyElseStaysTheirsWhereRootReplacesIt) {
    if (geteuid() != 0) GTEST_SKIP() << "only root can give files away";
    constexpr uid_t somebody = 12345;
    ASSERT_EQ(chown((folder / "file").c_str(), somebody, somebody), 0);
    auto file = OutputFile::create(folder / "file");
    ASSERT_TRUE(file && write(*file, "after") && file->finish());
    EXPECT_EQ(text("file"), "after");
    struct stat now {};
    ASSERT_EQ(stat((folder / "file").c_str(), &now), 0);
    EXPECT_EQ(now.st_uid, somebody);
    EXPECT_EQ(now.st_gid, somebody);
}

TEST_F(Output, LeavesNothingWhereItIsNotFinished) {
    {
        auto file = OutputFile::create(folder / "file");
        ASSERT_TRUE(file && write(*file, "after"));
    }
    EXPECT_EQ(text("file"), "before");
    EXPECT_FALSE(fs::exists(folder / "file.partial"));
}

TEST_F(Output, StaysBesideItsPlaceWhereItIsKept) {
    auto file = OutputFile::create(folder / "file");
    ASSERT_TRUE(file && write(*file, "half"));
    EXPECT_EQ(file->keep(), folder / "file.partial");
    EXPECT_EQ(text("file"), "before");
    EXPECT_EQ(text("file.partial"), "half");
}

TEST_F(Output, AFullDiskIsAnErrorOfItsOwnKind) {
    EXPECT_EQ(write_file("/dev/full", "x").error().kind, ErrorKind::disk_full);
    const auto nowhere = write_file(folder / "no" / "file", "x");
    ASSERT_FALSE(nowhere);
    EXPECT_EQ(nowhere.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(nowhere.error().message, testing::HasSubstr("make it first"));
}

}  // namespace
}  // namespace htvm
