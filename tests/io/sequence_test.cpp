#include "io/sequence.h"

#include <cstdlib>
#include <fstream>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace htvm {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

class Sequence : public testing::Test {
protected:
    void SetUp() override {
        std::string name = (std::filesystem::temp_directory_path() / "htvm_sequence_XXXXXX").string();
        ASSERT_NE(mkdtemp(name.data()), nullptr);
        folder = name;
    }
    void TearDown() override { std::filesystem::remove_all(folder); }
    void touch(std::initializer_list<const char*> names) {
        for (const char* name : names) std::ofstream(folder / name) << "x";
    }
    std::vector<std::string> found(const std::string& last) {
        const auto files = find_sequence((folder / last).string());
        EXPECT_TRUE(files) << files.error().message;
        std::vector<std::string> names;
        if (files) {
            for (const auto& path : files->paths) names.push_back(path.filename().string());
        }
        return names;
    }
    std::string error(const std::string& last) {
        const auto files = find_sequence((folder / last).string());
        EXPECT_FALSE(files);
        return files ? "" : files.error().message;
    }
    std::filesystem::path folder;
};

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

TEST(Glob, StarIsAnyCharactersAndQuestionMarkOne) {
    EXPECT_TRUE(glob_matches("*.ply", "a.ply"));
    EXPECT_TRUE(glob_matches("*", ""));
    EXPECT_TRUE(glob_matches("a*b*c", "axxbxbxc"));
    EXPECT_TRUE(glob_matches("?.ply", "a.ply"));
    EXPECT_FALSE(glob_matches("?.ply", ".ply"));
    EXPECT_FALSE(glob_matches("a*b", "axbx"));
    EXPECT_FALSE(glob_matches("", "a"));
    EXPECT_TRUE(glob_matches("", ""));
    EXPECT_FALSE(glob_matches("*a*a*a*a*a*a*a*a*a*b", std::string(2000, 'a')));
}

TEST_F(Sequence, AFolderIsItsMeshFilesInNaturalOrder) {
    touch({"f10.ply", "f2.ply", "f1.ply", "notes.txt", ".hidden.ply"});
    std::filesystem::create_directory(folder / "f3.ply");
    EXPECT_THAT(found(""), ElementsAre("f1.ply", "f2.ply", "f10.ply"));
}

TEST_F(Sequence, AFileIsItself) {
    touch({"f%d.ply", "f1.ply"});
    EXPECT_THAT(found("f1.ply"), ElementsAre("f1.ply"));
    EXPECT_THAT(found("f%d.ply"), ElementsAre("f%d.ply")) << "an existing name is not a pattern";
}

TEST_F(Sequence, AGlobIsTheMeshFilesThatMatch) {
    touch({"f10.ply", "f2.ply", "g1.ply", "f1.txt", "f1.obj"});
    EXPECT_THAT(found("f*.ply"), ElementsAre("f2.ply", "f10.ply"));
    EXPECT_THAT(found("f?.ply"), ElementsAre("f2.ply"));
    EXPECT_THAT(found("*.obj"), ElementsAre("f1.obj"));
}

TEST(PlacesInTime, AMissingNumberIsAMissingFrame) {
    const auto places = [](std::vector<std::uint64_t> numbers) {
        return places_in_time({std::vector<std::filesystem::path>(numbers.size()), numbers});
    };
    EXPECT_THAT(places({4, 5, 7, 8}), ElementsAre(0, 1, 3, 4));
    EXPECT_THAT(places({0, 10, 20, 40}), ElementsAre(0, 1, 2, 4)) << "every tenth was kept, and one is missing";
    EXPECT_THAT(places({0, 33, 67, 100, 133}), ElementsAre(0, 1, 2, 3, 4)) << "times of a clock";
    EXPECT_THAT(places({1, 2, 3, 100}), ElementsAre(0, 1, 2, 3)) << "more would be missing than there are";
    EXPECT_THAT(places_in_time({std::vector<std::filesystem::path>(3), {}}), ElementsAre(0, 1, 2)) << "no numbers";
}

TEST_F(Sequence, APatternIsTheFilesWithANumberInItsPlace) {
    touch({"f00002.drc", "f00010.drc", "f100000.drc", "f0003.drc", "f000004.drc", "fx.drc", "f00005.ply"});
    EXPECT_THAT(found("f%05d.drc"), ElementsAre("f00002.drc", "f00010.drc", "f100000.drc"));
    const auto files = find_sequence((folder / "f%05d.drc").string());
    ASSERT_TRUE(files);
    EXPECT_THAT(files->numbers, ElementsAre(2u, 10u, 100000u));
    touch({"7.obj", "11.obj", "08.obj"});
    EXPECT_THAT(found("%d.obj"), ElementsAre("7.obj", "11.obj"));
    touch({"50%_1.obj"});
    EXPECT_THAT(found("50%%_%d.obj"), ElementsAre("50%_1.obj"));
}

TEST_F(Sequence, ErrorsSayWhatWasLookedForAndWhatIsThere) {
    EXPECT_THAT(error(""), AllOf(HasSubstr(".ply, .obj, .drc, .glb, .gltf"), HasSubstr("holds no files")));
    touch({"a1.ply", "a2.ply", "a3.ply", "a4.ply", "a5.ply"});
    const auto there = HasSubstr("a1.ply, a2.ply, a3.ply and 2 others");
    EXPECT_THAT(error("b.ply"), AllOf(HasSubstr("b.ply"), there));
    EXPECT_THAT(error("b*.ply"), AllOf(HasSubstr("b*.ply"), there));
    EXPECT_THAT(error("b%05d.ply"), AllOf(HasSubstr("b%05d.ply"), there));
    EXPECT_THAT(error("absent/b.ply"), HasSubstr("no folder"));
    EXPECT_THAT(error("a%5d.ply"), HasSubstr("%05d"));
    EXPECT_THAT(error("a%d_%d.ply"), HasSubstr("once"));
    EXPECT_THAT(error("a%s.ply"), HasSubstr("%05d"));
    EXPECT_FALSE(find_sequence(""));
}

TEST_F(Sequence, AFolderOfTwoFormatsIsRefused) {
    touch({"f1.ply", "f1.obj"});
    EXPECT_THAT(error(""), AllOf(HasSubstr(".obj, .ply"), HasSubstr("*.obj")));
    EXPECT_THAT(error("f*"), HasSubstr("several formats"));
}

TEST_F(Sequence, OutputNamesComeFromAPatternAFolderOrOneName) {
    const auto path = [](const std::string& what, std::uint64_t n) {
        const auto names = mesh_output_names(what);
        EXPECT_TRUE(names) << names.error().message;
        return names ? output_path(*names, n).string() : "";
    };
    EXPECT_EQ(path("out/f_%04d.obj", 7), "out/f_0007.obj");
    EXPECT_EQ(path("out/f_%04d.obj", 123456), "out/f_123456.obj");
    EXPECT_EQ(path("%d.ply", 0), "0.ply");
    EXPECT_EQ(path("100%%_%d.ply", 3), "100%_3.ply");
    EXPECT_EQ(path("out", 12), "out/00012.ply");
    EXPECT_EQ(path("out/", 12), "out/00012.ply");
    EXPECT_EQ(path(folder.string(), 1), (folder / "00001.ply").string());
    EXPECT_EQ(path("frame.obj", 5), "frame.obj");
    EXPECT_TRUE(mesh_output_names("frame.obj")->one_file);
    EXPECT_FALSE(mesh_output_names("out")->one_file);
    EXPECT_EQ(output_path(*mesh_output_names("out", ".obj"), 1), "out/00001.obj");
    EXPECT_EQ(path("out/f_%04d.glb", 7), "out/f_0007.glb");
    EXPECT_EQ(output_path(*output_names("out", ".png"), 1), "out/00001.png");
    for (const char* bad : {"", "a.drc", "a.gltf", "a%d.stl", "a%x.ply", "a%d%d.ply", "a%d", "a%"}) {
        EXPECT_FALSE(mesh_output_names(bad)) << bad;
    }
}

TEST_F(Sequence, WhatWasWrittenUnderOutputNamesIsFoundInOrder) {
    const std::string pattern = (folder / "x%02d.ply").string();
    const auto names = mesh_output_names(pattern);
    ASSERT_TRUE(names);
    for (const std::uint64_t n : {100, 9, 10, 0}) std::ofstream(output_path(*names, n)) << "x";
    const auto files = find_sequence(pattern);
    ASSERT_TRUE(files);
    EXPECT_THAT(files->numbers, ElementsAre(0u, 9u, 10u, 100u));
}

}  // namespace
}  // namespace htvm
