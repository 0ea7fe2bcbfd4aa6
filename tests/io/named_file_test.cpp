#include "io/named_file.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <fstream>

namespace htvm {
namespace {

namespace fs = std::filesystem;

class NamedFile : public testing::Test {
protected:
    void SetUp() override {
        std::string made = (fs::temp_directory_path() / "htvm_named_XXXXXX").string();
        ASSERT_NE(mkdtemp(made.data()), nullptr);
        folder = fs::path(made) / "inside";
        fs::create_directories(folder / "Textures");
        for (const char* name : {"a.png", "te x.png", "take #3.png", "50%.png", "Textures/Skin.PNG", "../outside.png"})
            std::ofstream(folder / name) << name;
    }
    void TearDown() override { fs::remove_all(folder.parent_path()); }
    // From the folder; empty: none was found.
    std::string found(const std::string& name) {
        const auto path = files.find(folder, name);
        return path ? path->lexically_relative(folder).string() : "";
    }
    fs::path folder;
    NamedFiles files;
};

TEST_F(NamedFile, ByItsName) {
    for (const char* name : {"a.png", "te x.png", "take #3.png", "50%.png", "Textures/Skin.PNG"})
        EXPECT_EQ(found(name), name);
    EXPECT_EQ(found("b.png"), "");
    EXPECT_EQ(found(""), "");
    EXPECT_EQ(found("Textures"), "") << "a folder";
    EXPECT_EQ(found(std::string("a.png\0b", 7)), "");
    EXPECT_EQ(found(std::string(100000, 'a')), "");
}

TEST_F(NamedFile, APathLeadsInsideOfTheFolderOutsideOrNowhere) {
    fs::create_symlink("../outside.png", folder / "link.png");
    fs::create_symlink("a.png", folder / "here.png");
    EXPECT_EQ(named_place(folder, folder / "Textures/../a.png"), NamedPlace::inside);
    EXPECT_EQ(named_place(folder, folder / "here.png"), NamedPlace::inside);
    EXPECT_EQ(named_place(folder, folder / "../outside.png"), NamedPlace::outside);
    EXPECT_EQ(named_place(folder, folder / "link.png"), NamedPlace::outside);
    EXPECT_EQ(named_place(folder, folder / "gone.png"), NamedPlace::nowhere);
    EXPECT_EQ(named_place(folder, folder / "Textures"), NamedPlace::nowhere) << "a folder is no file";
}

TEST_F(NamedFile, InEitherCase) {
    EXPECT_EQ(found("A.PNG"), "a.png");
    EXPECT_EQ(found("textures/skin.png"), "Textures/Skin.PNG");
    std::ofstream(folder / "A.png") << "another";
    EXPECT_EQ(found("A.png"), "A.png") << "its very letters come first";
    EXPECT_EQ(found("a.png"), "a.png");
}

TEST_F(NamedFile, WithQuotesPercentCodesAndComments) {
    EXPECT_EQ(found("\"te x.png\""), "te x.png");
    EXPECT_EQ(found("te%20x.png"), "te x.png");
    EXPECT_EQ(found("take%20%233.png"), "take #3.png");
    EXPECT_EQ(found("a.png # the skin"), "a.png");
}

TEST_F(NamedFile, PathsOfOtherMachinesByTheirEnd) {
    EXPECT_EQ(found("C:\\Users\\me\\out\\a.png"), "a.png");
    EXPECT_EQ(found("C:\\Users\\me\\textures\\skin.png"), "Textures/Skin.PNG");
    EXPECT_EQ(found("/home/me/a.png"), "a.png");
    EXPECT_EQ(found("Textures/../a.png"), "Textures/../a.png");
}

TEST_F(NamedFile, NothingOutsideOfTheFolder) {
    EXPECT_EQ(found("../outside.png"), "");
    EXPECT_EQ(found("../OUTSIDE.png"), "");
    EXPECT_EQ(found((folder.parent_path() / "outside.png").string()), "");
    fs::create_symlink(folder.parent_path() / "outside.png", folder / "link.png");
    EXPECT_EQ(found("link.png"), "");
}

}  // namespace
}  // namespace htvm
