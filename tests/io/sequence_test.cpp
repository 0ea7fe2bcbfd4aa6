#include "io/sequence.h"

#include <cstdlib>
#include <fstream>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace htvm {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class Sequence : public testing::Test {
protected:
    void SetUp() override {
        std::string name = (std::filesystem::temp_directory_path() / "htvm_sequence_XXXXXX").string();
        ASSERT_NE(mkdtemp(name.data()), nullptr);
        folder = name;
    }
    void TearDown() override { std::filesystem::remove_all(folder); }
    void touch(std::initializer_list<const char*> names) {
        for (const char* name : names) {
            std::filesystem::create_directories((folder / name).parent_path());
            std::ofstream(folder / name) << "x";
        }
    }
    // "f_0.ply" and so on, of these numbers.
    void touch_numbered(const std::string& before, const std::string& after, std::uint64_t from, std::uint64_t to) {
        for (auto k = from; k <= to; ++k) std::ofstream(folder / (before + std::to_string(k) + after)) << "x";
    }
    SequenceFiles files_of(const std::string& last, const SequenceOptions& options = {}) {
        auto files = find_sequence((folder / last).string(), options);
        EXPECT_TRUE(files) << files.error().message;
        return files ? std::move(*files) : SequenceFiles{};
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
    std::string error(const std::string& last, const SequenceOptions& options = {}) {
        const auto files = find_sequence((folder / last).string(), options);
        EXPECT_FALSE(files);
        return files ? "" : files.error().message;
    }
    std::filesystem::path folder;
};

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

TEST_F(Sequence, APatternIsTheFilesWithANumberInItsPlaceHoweverManyZerosItHas) {
    touch({"f00002.drc", "f00010.drc", "f100000.drc", "f0003.drc", "f000004.drc", "fx.drc", "f00005.ply"});
    for (const char* pattern : {"f%05d.drc", "f%d.drc"}) {
        EXPECT_THAT(found(pattern), ElementsAre("f00002.drc", "f0003.drc", "f000004.drc", "f00010.drc", "f100000.drc"));
        EXPECT_THAT(files_of(pattern).numbers, ElementsAre(2u, 3u, 4u, 10u, 100000u));
    }
    touch({"7.obj", "11.obj", "08.obj"});
    EXPECT_THAT(found("%d.obj"), ElementsAre("7.obj", "08.obj", "11.obj"));
    touch({"007.obj"});
    EXPECT_THAT(error("%d.obj"), AllOf(HasSubstr("007.obj and 7.obj"), HasSubstr("same number")));
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

TEST_F(Sequence, TheFrameIsTheNumberThatVaries) {
    touch({"levi_fr0003_qp12_qt13.obj", "levi_fr0004_qp12_qt13.obj", "levi_fr0010_qp12_qt13.obj"});
    EXPECT_THAT(files_of("").numbers, ElementsAre(3u, 4u, 10u));
    EXPECT_THAT(files_of("").remarks, IsEmpty());
}

TEST_F(Sequence, WhereSeveralNumbersVaryTheOneThatCountsIsTheFrame) {
    touch({"mesh_0001_4096.ply", "mesh_0002_4101.ply", "mesh_0003_4090.ply", "mesh_0005_4444.ply"});
    EXPECT_THAT(files_of("").numbers, ElementsAre(1u, 2u, 3u, 5u));
    ASSERT_EQ(files_of("").remarks.size(), 1u);
    EXPECT_THAT(files_of("").remarks[0].text, HasSubstr("mesh_*_4096.ply"));
    EXPECT_FALSE(files_of("").remarks[0].is_loss);
}

TEST_F(Sequence, LettersMakeTwoCaptures) {
    touch_numbered("a_", ".ply", 1, 12);
    touch_numbered("b_", ".ply", 1, 10);
    EXPECT_THAT(error(""), AllOf(HasSubstr("12 \"a_%d.ply\""), HasSubstr("10 \"b_%d.ply\"")));
    EXPECT_EQ(files_of("a_%d.ply").paths.size(), 12u);
    EXPECT_EQ(files_of("", {{"b_*"}}).paths.size(), 12u);
}

TEST_F(Sequence, AMeshThatIsNoFrameIsNamed) {
    touch_numbered("f_", ".ply", 0, 11);
    touch({"template.ply"});
    EXPECT_THAT(error(""),
                AllOf(HasSubstr("template.ply"), HasSubstr("12 frames \"f_%d.ply\""), HasSubstr("--ignore")));
    const auto files = files_of("", {{"template*"}});
    EXPECT_EQ(files.paths.size(), 12u);
    EXPECT_THAT(files.remarks, IsEmpty());
    EXPECT_THAT(files_of("f_%d.ply", {{"nothing*"}}).remarks,
                Contains(Field(&MeshRemark::text, HasSubstr("leaves out nothing"))));
}

TEST_F(Sequence, CopiesAndUnfinishedFilesAreLeftOutWithAWarning) {
    touch({"frame_0001.ply", "frame_0002.ply", "frame_0003.ply", "frame_0003 (1).ply", "frame_0003 - Copy.ply",
           "frame_0003_copy.ply", "frame_0004.tmp.ply", "._frame_0001.ply"});
    const auto files = files_of("");
    EXPECT_THAT(files.numbers, ElementsAre(1u, 2u, 3u));
    ASSERT_EQ(files.remarks.size(), 2u);
    EXPECT_THAT(files.remarks[0].text, HasSubstr("copies of other files are left out: frame_0003 (1).ply"));
    EXPECT_TRUE(files.remarks[0].is_loss);
    EXPECT_THAT(files.remarks[1].text, HasSubstr("frame_0004.tmp.ply"));
}

TEST_F(Sequence, NumbersInBracketsAreNoCopiesWhereAllHaveThem) {
    touch({"frame (1).ply", "frame (2).ply", "frame (10).ply", "frame.ply"});
    EXPECT_THAT(error(""), HasSubstr("frame.ply"));
    std::filesystem::remove(folder / "frame.ply");
    EXPECT_THAT(files_of("").numbers, ElementsAre(1u, 2u, 10u));
}

TEST_F(Sequence, TheSameNumberTwiceIsNamed) {
    touch({"1.ply", "2.ply", "001.ply"});
    EXPECT_THAT(error(""), AllOf(HasSubstr("1.ply"), HasSubstr("001.ply"), HasSubstr("same number")));
}

TEST_F(Sequence, EndingsInAnyCaseAreOneFormat) {
    touch({"1.ply", "2.PLY", "3.Ply"});
    EXPECT_THAT(found(""), ElementsAre("1.ply", "2.PLY", "3.Ply"));
}

TEST_F(Sequence, AFolderForEachFrame) {
    touch({"frame_0001/mesh.obj", "frame_0002/mesh.obj", "frame_0004/other.obj", "textures/a.png", "frame_0001/a.png"});
    const auto files = files_of("");
    EXPECT_THAT(files.numbers, ElementsAre(1u, 2u, 4u));
    EXPECT_EQ(files.paths[2], folder / "frame_0004" / "other.obj");
    touch({"frame_0001/collision.obj", "frame_0002/collision.obj"});
    EXPECT_THAT(error(""), AllOf(HasSubstr("frame_0001 with 2 (collision.obj, mesh.obj)"), HasSubstr("hold one mesh")));
    std::filesystem::rename(folder / "frame_0004/other.obj", folder / "frame_0004/mesh.obj");
    const auto common = files_of("");
    EXPECT_EQ(common.paths[0], folder / "frame_0001" / "mesh.obj");
    ASSERT_EQ(common.remarks.size(), 1u);
    EXPECT_THAT(common.remarks[0].text, HasSubstr("mesh.obj is taken"));
    EXPECT_THAT(files_of("", {{"collision*"}}).remarks, IsEmpty());
}

TEST_F(Sequence, FoldersForAFrameEachThatHoldLevelsOfDetailSayWhatToIgnore) {
    touch({"frame_1/lod0.obj", "frame_1/lod1.obj", "frame_2/lod0.obj", "frame_2/lod1.obj"});
    EXPECT_THAT(error(""), HasSubstr("leave the others out with --ignore \"lod1.obj\""));
    EXPECT_THAT(files_of("", {{"lod1.obj"}}).numbers, ElementsAre(1u, 2u));
    for (const char* name : {"frame_1", "frame_2"}) std::filesystem::remove_all(folder / name);
    touch({"frame_1/body_1.obj", "frame_1/floor_1.obj", "frame_2/body_2.obj", "frame_2/floor_2.obj"});
    EXPECT_THAT(error(""), HasSubstr("leave the others out with --ignore \"floor_*.obj\""));
    EXPECT_THAT(files_of("", {{"floor_*.obj"}}).numbers, ElementsAre(1u, 2u));
}

TEST_F(Sequence, FoldersOfLevelsOfDetailSayWhichToName) {
    for (const char* lod : {"lod0", "lod1"}) {
        std::filesystem::create_directories(folder / lod);
        touch_numbered(lod + std::string("/f"), ".ply", 0, 11);
    }
    EXPECT_THAT(error(""), AllOf(HasSubstr("name one of them, such as " + (folder / "lod0").string()),
                                 Not(HasSubstr("--ignore"))));
}

TEST_F(Sequence, FoldersOfFoldersSayWhereMeshesAre) {
    touch({"take/high/1.ply", "take/high/2.ply", "take/low/1.ply"});
    EXPECT_THAT(error(""), HasSubstr("but " + (folder / "take/high").string() + " holds some: name that"));
}

TEST_F(Sequence, AFolderAroundACaptureSaysWhichToName) {
    touch({"meshes/1.ply", "meshes/2.ply", "readme.txt"});
    EXPECT_THAT(error(""), HasSubstr("name one of them, such as " + (folder / "meshes").string()));
}

TEST_F(Sequence, NamedFilesAsAShellSortsThemAreTakenByNumber) {
    touch_numbered("f", ".ply", 0, 11);
    std::vector<std::string> names;
    for (const auto& path : files_of("").paths) names.push_back(path.string());
    std::sort(names.begin(), names.end());
    const auto sorted = find_sequence(names);
    ASSERT_TRUE(sorted) << sorted.error().message;
    EXPECT_EQ(sorted->paths, files_of("").paths);
    EXPECT_EQ(sorted->numbers.size(), 12u);
    ASSERT_EQ(sorted->remarks.size(), 1u);
    EXPECT_FALSE(sorted->remarks[0].is_loss);
    std::reverse(names.begin(), names.end());
    const auto given = find_sequence(names);
    ASSERT_TRUE(given);
    EXPECT_EQ(given->paths[0].filename(), "f9.ply");
    ASSERT_EQ(given->remarks.size(), 1u);
    EXPECT_TRUE(given->remarks[0].is_loss);
    EXPECT_THAT(given->remarks[0].text, HasSubstr("in the order given"));
}

TEST_F(Sequence, NamedFilesThatAreCalledAlikeAreNumberedByTheirFolders) {
    touch({"frame_2/mesh.obj", "frame_10/mesh.obj"});
    const auto files =
        find_sequence(std::vector{(folder / "frame_2/mesh.obj").string(), (folder / "frame_10/mesh.obj").string()});
    ASSERT_TRUE(files);
    EXPECT_THAT(files->numbers, ElementsAre(2u, 10u));
}

TEST_F(Sequence, OfNamedFilesWhatIsNoFrameIsOneAllTheSame) {
    touch({"f1.ply", "f2.ply", "f3.ply", "f3_copy.ply", "mean.ply"});
    std::vector<std::string> names;
    for (const char* name : {"f1.ply", "f2.ply", "f3.ply", "f3_copy.ply", "mean.ply"})
        names.push_back((folder / name).string());
    const auto files = find_sequence(names);
    ASSERT_TRUE(files) << files.error().message;
    EXPECT_EQ(files->paths.size(), 4u);
    ASSERT_EQ(files->remarks.size(), 2u);
    EXPECT_THAT(files->remarks[0].text, HasSubstr("f3_copy.ply"));
    EXPECT_THAT(files->remarks[1].text, HasSubstr("mean.ply is not named as most are"));
    const auto without = find_sequence(names, {{"mean*"}});
    EXPECT_THAT(without->numbers, ElementsAre(1u, 2u, 3u));
    EXPECT_FALSE(find_sequence(names, {{"*"}}));
}

TEST_F(Sequence, NumbersBelowZeroCountFromTheLowest) {
    touch({"f-2.ply", "f-1.ply", "f0.ply", "f1.ply"});
    for (const char* what : {"", "f%d.ply"}) {
        EXPECT_THAT(found(what), ElementsAre("f-2.ply", "f-1.ply", "f0.ply", "f1.ply"));
        EXPECT_THAT(files_of(what).numbers, ElementsAre(0u, 1u, 2u, 3u));
        EXPECT_EQ(files_of(what).remarks.size(), 1u);
    }
}

}  // namespace
}  // namespace htvm
