// htvm/htvm.hpp holds the whole API.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "htvm/htvm.hpp"

namespace htvm {
namespace {

TEST(UmbrellaHeader, IncludesEveryPublicHeader) {
    const auto folder = std::filesystem::path(HTVM_TEST_DATA) / "../../include/htvm";
    std::ifstream file(folder / "htvm.hpp");
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    int headers = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        const auto name = entry.path().filename().string();
        if (entry.path().extension() != ".hpp" || name == "htvm.hpp") continue;
        ++headers;
        EXPECT_NE(text.find("#include \"htvm/" + name + "\""), text.npos) << name;
    }
    EXPECT_GT(headers, 20);
}

}  // namespace
}  // namespace htvm
