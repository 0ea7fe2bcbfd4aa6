// A capture and what is shown of it against the whole surface.
#include "metrics/truth_coverage.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "metrics/shapes.h"

namespace htvm {
namespace {

// A sheet of 400 by 400 mm without what lies between these x.
Mesh with_hole(float from, float to, float height = 0) {
    Mesh mesh = shapes::plane(400, 80, height);
    std::erase_if(mesh.triangles, [&](const Triangle& t) {
        return std::ranges::any_of(t, [&](auto v) { return mesh.positions[v][0] > from && mesh.positions[v][0] < to; });
    });
    return mesh;
}

const Mesh truth = shapes::plane(400, 80, 0);

TEST(TruthCoverage, TellsWhichHolesOfTheCaptureAreFilled) {
    // The capture lacks 100 mm of 400, what is shown 20; the 5 mm beside a border are covered.
    const auto found = truth_coverage(with_hole(200, 300), with_hole(240, 260), truth);
    ASSERT_TRUE(found.has_value());
    EXPECT_NEAR(truth_share(*found, &TruthCoverage::captured), 310.0 / 400, 0.005);
    EXPECT_NEAR(truth_share(*found, &TruthCoverage::shown), 390.0 / 400, 0.005);
    EXPECT_NEAR(truth_share(*found, &TruthCoverage::filled), 80.0 / 400, 0.005);
    EXPECT_EQ(found->lost, 0);
    const auto other = truth_coverage(with_hole(240, 260), with_hole(200, 300), truth);
    EXPECT_NEAR(truth_share(*other, &TruthCoverage::lost), 80.0 / 400, 0.005);
    EXPECT_EQ(other->filled, 0);
}

TEST(TruthCoverage, MeasuresWhatIsShownWhereTheCaptureCoversTheTruth) {
    // What is shown is 1 mm off, but 12 mm in the capture's hole, where nobody saw anything.
    const Mesh captured = with_hole(200, 300, 2);
    Mesh shown = shapes::plane(400, 80, 1);
    for (auto& p : shown.positions)
        if (p[0] > 210 && p[0] < 290) p[2] = 12;
    const auto found = truth_coverage(captured, shown, truth);
    ASSERT_TRUE(found.has_value());
    EXPECT_NEAR(captured_to_truth_rms(*found), 2, 1e-5);
    EXPECT_NEAR(shown_to_truth_rms(*found), 1, 1e-5);
}

TEST(TruthCoverage, TakesWhatIsSeenFromThoseWhoKnow) {
    Mesh shown = shapes::plane(400, 80, 1);
    for (auto& p : shown.positions)
        if (p[0] > 202) p[2] = 3;
    std::vector<std::uint8_t> seen;
    for (const auto& t : truth.triangles) seen.push_back(truth.positions[t[0]][0] < 195);
    EXPECT_NEAR(shown_to_truth_rms(*truth_coverage(truth, shown, truth, seen)), 1, 1e-5);
    const std::vector<std::uint8_t> all(truth.triangles.size(), 1);
    EXPECT_GT(shown_to_truth_rms(*truth_coverage(truth, shown, truth, all)), 2);
    seen.pop_back();
    EXPECT_EQ(truth_coverage(truth, shown, truth, seen).error().kind, ErrorKind::bad_input);
}

TEST(TruthCoverage, OfSeveralFramesIsOfAllTheirAreaAndSamples) {
    TruthCoverage sums;
    sums += *truth_coverage(truth, shapes::moved(truth, 0, 0, 1), truth);
    sums += *truth_coverage(truth, {}, truth);
    EXPECT_NEAR(truth_share(sums, &TruthCoverage::shown), 0.5, 1e-6);
    EXPECT_NEAR(truth_share(sums, &TruthCoverage::lost), 0.5, 1e-6);
    EXPECT_NEAR(shown_to_truth_rms(sums), 1, 1e-5);
}

TEST(TruthCoverage, RefusesATruthWithoutSurface) {
    EXPECT_EQ(truth_coverage(truth, truth, {}).error().kind, ErrorKind::bad_input);
}

}  // namespace
}  // namespace htvm
