#include "core/edit_distance.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace htvm::internal {
namespace {

TEST(EditDistance, CountsWhatIsPutInTakenOutOrChanged) {
    EXPECT_EQ(edit_distance("quality", "quality"), 0u);
    EXPECT_EQ(edit_distance("qualty", "quality"), 1u);
    EXPECT_EQ(edit_distance("decode", "encode"), 2u);
    EXPECT_EQ(edit_distance("", "mm"), 2u);
}

const std::vector<std::string> parts = {"m1", "m2", "regions", "coverage", "flicker"};

TEST(MeantWord, IsTheOneSpeltMostAlike) {
    EXPECT_EQ(meant_word("flikker", parts), "flicker");
    EXPECT_EQ(meant_word("m3", parts), "m1");
    EXPECT_EQ(meant_word("regionss", parts), "regions");
}

TEST(MeantWord, IsTheOneOfWhichTheBeginningWasTyped) {
    EXPECT_EQ(meant_word("cover", parts), "coverage");
    EXPECT_EQ(meant_word("reg", parts), "regions");
}

TEST(MeantWord, IsNoneWhereNothingIsAlike) {
    EXPECT_EQ(meant_word("vertices", parts), "");
    EXPECT_EQ(meant_word("c", parts), "");
    EXPECT_EQ(meant_word("", parts), "");
    EXPECT_EQ(meant_word("zz", parts), "");
    EXPECT_EQ(meant_word("m1", std::vector<std::string>()), "");
}

}  // namespace
}  // namespace htvm::internal
