// How much of a surface a frame codes anew.
#include "metrics/recoded_area.h"

#include <gtest/gtest.h>

#include "metrics/shapes.h"

namespace htvm {
namespace {

FrameInfo sent(FrameType type, std::uint32_t triangles) {
    FrameInfo info;
    info.type = type;
    info.triangles = triangles;
    return info;
}

TEST(RecodedShare, OfAPatchedFrameIsThePatchBehindWhatStays) {
    // Four unit squares; then the last two become two triangles of half of 3 x 1 each.
    Mesh mesh = shapes::plane(2, 2, 0);
    mesh.triangles.resize(4);
    mesh.positions.insert(mesh.positions.end(), {{10, 0, 0}, {13, 0, 0}, {10, 1, 0}, {13, 1, 0}});
    mesh.triangles.push_back({9, 10, 12});
    mesh.triangles.push_back({9, 12, 11});
    const auto view = view_of(mesh);
    EXPECT_EQ(kept_triangles(view, sent(FrameType::patched, 2)), 4u);
    EXPECT_DOUBLE_EQ(recoded_share(view, sent(FrameType::patched, 2)), 3.0 / 5);
    EXPECT_DOUBLE_EQ(recoded_share(view, sent(FrameType::patched, 0)), 0);  // it only takes away
}

TEST(RecodedShare, IsAllOfAFrameByItselfAndNothingOfOneThatMovesItsReference) {
    const Mesh plane = shapes::plane(30, 3, 7);
    for (const auto type : {FrameType::intra, FrameType::enhanced})
        EXPECT_EQ(recoded_share(view_of(plane), sent(type, 18)), 1) << kind_of(type).letter;
    for (const auto type : {FrameType::predicted, FrameType::tracked})
        EXPECT_EQ(recoded_share(view_of(plane), sent(type, 18)), 0) << kind_of(type).letter;
    EXPECT_EQ(recoded_share({}, sent(FrameType::intra, 0)), 0);
}

}  // namespace
}  // namespace htvm
