#include "sweep.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

namespace htvm::lab {

namespace {

using std::filesystem::path;

path fresh_folder(const char* name) {
    const path folder = path(testing::TempDir()) / name;
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
    return folder;
}

void write(const path& file, const std::string& text) { std::ofstream(file) << text; }

TEST(Fingerprint, changes_with_size_time_and_name_of_a_file) {
    const auto folder = fresh_folder("rd_fingerprint");
    write(folder / "a", "one");
    write(folder / "b", "one");
    const auto before = fingerprint({folder / "a"});
    EXPECT_EQ(before, fingerprint({folder / "a"}));
    EXPECT_EQ(before, fingerprint({folder / "." / "a"}));
    EXPECT_NE(before, fingerprint({folder / "b"}));
    EXPECT_NE(before, fingerprint({folder / "a", folder / "b"}));
    std::filesystem::last_write_time(folder / "a",
                                     std::filesystem::last_write_time(folder / "a") + std::chrono::seconds(1));
    const auto later = fingerprint({folder / "a"});
    EXPECT_NE(before, later);
    write(folder / "a", "longer");
    EXPECT_NE(later, fingerprint({folder / "a"}));
}

TEST(Fingerprint, of_missing_files_is_no_error) { EXPECT_NE("", fingerprint({"/no/such/file"})); }

TEST(ResultCache, gives_back_what_it_kept_under_that_very_key) {
    const ResultCache cache(fresh_folder("rd_cache"));
    RdPoint point;
    point.coder = "tfan";
    point.values["m1_mm"] = 0.5;
    EXPECT_FALSE(cache.find("tfan_q50", "key"));
    ASSERT_TRUE(cache.keep("tfan_q50", "key", point));
    const auto found = cache.find("tfan_q50", "key");
    ASSERT_TRUE(found);
    EXPECT_EQ(to_json(point), to_json(*found));
    EXPECT_FALSE(cache.find("tfan_q50", "other key"));
    EXPECT_FALSE(cache.find("tfan_q60", "key"));
}

TEST(ResultCache, damaged_file_counts_as_missing) {
    const auto folder = fresh_folder("rd_cache_damaged");
    const ResultCache cache(folder);
    ASSERT_TRUE(cache.keep("a", "key", RdPoint{}));
    for (const auto& entry : std::filesystem::directory_iterator(folder)) write(entry.path(), "{\"key\": \"key\"");
    EXPECT_FALSE(cache.find("a", "key"));
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        write(entry.path(), "{\"key\": \"key\", \"result\": 3}");
    EXPECT_FALSE(cache.find("a", "key"));
}

TEST(WriteText, error_names_a_file_that_cannot_be_written) {
    const auto written = write_text("/no/such/folder/rd.json", "x");
    ASSERT_FALSE(written);
    EXPECT_NE(std::string::npos, written.error().message.find("/no/such/folder/rd.json"));
}

}  // namespace
}  // namespace htvm::lab
