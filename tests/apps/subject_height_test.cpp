// What the height of the first mesh says of the unit.
#include "command_line/subject_height.h"

#include <gtest/gtest.h>

namespace htvm::app {
namespace {

TEST(SubjectHeight, OfAPersonIsToldWithAGuess) {
    const auto said = remark_on_height(175, LengthUnit::centimetre, "");
    EXPECT_EQ(said.text,
              "the meshes look as if they were in centimetres, which makes the subject 1.75 m tall (see --unit)");
    EXPECT_FALSE(said.is_loss);
    EXPECT_EQ(remark_on_height(1750, LengthUnit::millimetre, "").text, "") << "nothing is scaled";
    EXPECT_EQ(remark_on_height(1.75, LengthUnit::metre, "glTF").text, "") << "the format says it";
}

TEST(SubjectHeight, ThatIsHardlyAPersonsNamesTheUnitsInWhichItWouldBe) {
    const auto inches = remark_on_height(69, LengthUnit::centimetre, "");
    EXPECT_EQ(
        inches.text,
        "the meshes look as if they were in centimetres, which makes the subject 69 cm tall; in inches it would be "
        "1.75 m (--unit in); if that is wrong, give --unit or --height");
    EXPECT_TRUE(inches.is_loss);
    EXPECT_NE(remark_on_height(5.74, LengthUnit::metre, "").text.find("in feet it would be 1.75 m (--unit ft)"),
              std::string::npos);
    EXPECT_NE(remark_on_height(175, LengthUnit::metre, "glTF").text.find("in centimetres it would be 1.75 m"),
              std::string::npos);
}

TEST(SubjectHeight, OfAChildOrHalfAPersonIsNotDoubtedWhereNoOtherUnitFits) {
    EXPECT_FALSE(remark_on_height(0.7, LengthUnit::metre, "").is_loss);
    EXPECT_EQ(remark_on_height(700, LengthUnit::millimetre, "").text, "");
    EXPECT_EQ(remark_on_height(0, LengthUnit::millimetre, "").text, "") << "flat";
    EXPECT_TRUE(remark_on_height(0.2, LengthUnit::metre, "").is_loss) << "too small for anybody";
}

}  // namespace
}  // namespace htvm::app
