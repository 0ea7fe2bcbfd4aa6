#include "io/obj_material.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace htvm {
namespace {

using testing::ElementsAre;
using Names = std::vector<std::string>;

ObjMaterial only(const std::string& text) {
    const auto materials = read_obj_materials(text);
    EXPECT_EQ(materials.size(), 1u) << text;
    return materials.empty() ? ObjMaterial() : materials[0];
}

TEST(ObjMaterials, NamesHoldBlanksAndSigns) {
    EXPECT_EQ(only("newmtl  skin of #3 \t").name, "skin of #3");
    EXPECT_EQ(only("newmtl a\nmap_Kd te x #2.png ").image, "te x #2.png");
    EXPECT_EQ(only("\tnewmtl\ta\n\t\tmap_Kd\tC:\\scans\\t.jpg").image, "C:/scans/t.jpg");
}

TEST(ObjMaterials, LinesEndInAnyWay) {
    for (const std::string end : {"\n", "\r\n", "\r", "\n\n\r"}) {
        const auto material =
            only("# made\ra comment" + end + "newmtl m" + end + "Kd 1 0 0" + end + "map_Kd t.png" + end);
        EXPECT_EQ(material.name, "m");
        EXPECT_EQ(material.image, "t.png");
    }
    EXPECT_EQ(only("\xef\xbb\xbfnewmtl m\n").name, "m");
    EXPECT_EQ(only("NEWMTL m\nMap_kd t.png").image, "t.png");
    EXPECT_EQ(only("newmtl m \\\r\n n").name, "m   n");
}

TEST(ObjMaterials, OptionsOfMapsAreNoPartsOfTheName) {
    const auto image = [](const std::string& map) { return only("newmtl m\nmap_Kd " + map).image; };
    EXPECT_EQ(image("-s 1 1 1 -o 0 0 0 -bm 1.0 -clamp on -blendu on my skin.png"), "my skin.png");
    EXPECT_EQ(image("-s 2 2 -texres 512 -imfchan r -mm 0 1 -type sphere -boost 2 t.png"), "t.png");
    EXPECT_EQ(image("-o 0.5 1 3.png"), "3.png") << "the name is no number";
    EXPECT_EQ(image("-front.png"), "-front.png");
}

TEST(ObjMaterials, WhatMovesAnImageIsMarked) {
    const auto is_placed = [](const std::string& map) { return only("newmtl m\nmap_Kd " + map).is_placed; };
    EXPECT_FALSE(is_placed("t.png"));
    EXPECT_FALSE(is_placed("-s 1 1 1 -o 0 0 0 -bm 2 t.png"));
    EXPECT_TRUE(is_placed("-s 2 1 1 t.png"));
    EXPECT_TRUE(is_placed("-o 0.5 t.png"));
}

TEST(ObjMaterials, OtherMapsStandInForThatOfTheColour) {
    EXPECT_EQ(only("newmtl m\nmap_Ka a.png\nmap_Kd d.png\nmap_Ke e.png\nmap_Bump b.png\nmap_d c.png").image, "d.png");
    const auto substitute = only("newmtl m\nmap_Ke e.png\nmap_Ka a.png");
    EXPECT_EQ(substitute.image, "a.png");
    EXPECT_TRUE(substitute.is_substitute);
    EXPECT_EQ(only("newmtl m\nmap_Kd\nmap_d c.png").image, "");
    EXPECT_FALSE(only("newmtl m\nmap_Ka a.png\nmap_Kd d.png").is_substitute);
}

TEST(ObjMaterials, ColoursAreLevelsAsTheyStand) {
    EXPECT_EQ(only("newmtl m\nKd 1 0.5 0").colour, (Colour{255, 128, 0}));
    EXPECT_EQ(only("newmtl m\nKd 0.8").colour, (Colour{204, 204, 204}));
    EXPECT_EQ(only("newmtl m\nKd 2 -1 0").colour, (Colour{255, 0, 0}));
    for (const char* other : {"", "Kd", "Kd spectral a.rfl 1", "Kd xyz 1 1 1", "Kd 1 nan 0", "Ka 1 0 0"})
        EXPECT_EQ(only(std::string("newmtl m\n") + other).colour, std::nullopt) << other;
}

TEST(ObjMaterials, AreFoundByTheirLettersElseInEitherCase) {
    const auto materials = read_obj_materials("newmtl Skin\nKd 1 0 0\nnewmtl skin\nKd 0 1 0\n");
    EXPECT_EQ(find_material(materials, "skin"), &materials[1]);
    EXPECT_EQ(find_material(materials, "SKIN"), &materials[0]);
    EXPECT_EQ(find_material(materials, "hair"), nullptr);
}

TEST(ObjMaterials, LinesOfNamesAreReadInEveryWay) {
    EXPECT_THAT(material_file_names(" a.mtl\t"), ElementsAre(Names{"a.mtl"}));
    EXPECT_THAT(material_file_names("a.mtl b.MTL"), ElementsAre(Names{"a.mtl b.MTL"}, Names{"a.mtl", "b.MTL"}));
    EXPECT_THAT(material_file_names("take #3.mtl"), ElementsAre(Names{"take #3.mtl"}, Names{"take", "#3.mtl"}));
    EXPECT_THAT(
        material_file_names("my skin.mtl b.mtl"),
        ElementsAre(Names{"my skin.mtl b.mtl"}, Names{"my skin.mtl", "b.mtl"}, Names{"my", "skin.mtl", "b.mtl"}));
    EXPECT_THAT(material_file_names("\"my skin.mtl\""), ElementsAre(Names{"\"my skin.mtl\""}, Names{"my skin.mtl"}));
    EXPECT_THAT(material_file_names(" "), ElementsAre());
}

}  // namespace
}  // namespace htvm
