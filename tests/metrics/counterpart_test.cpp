// What one surface has at the places of another: covered, displaced or absent.
#include "metrics/counterpart.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <limits>

#include "metrics/shapes.h"

namespace htvm {
namespace {

// Without the triangles that have a corner for which `is_cut` says so.
template <class IsCut>
Mesh cut(Mesh mesh, const IsCut& is_cut) {
    std::erase_if(mesh.triangles, [&](const Triangle& t) {
        return is_cut(mesh.positions[t[0]]) || is_cut(mesh.positions[t[1]]) || is_cut(mesh.positions[t[2]]);
    });
    return mesh;
}

// What `other` has of samples of `own` that lie at x, y, z between the bounds.
struct Part {
    Point3 low{-1e9, -1e9, -1e9}, high{1e9, 1e9, 1e9};
};

struct Counts {
    std::size_t covered = 0, displaced = 0, absent = 0, counting = 0;
    double largest = 0;  // mm, of those that count
};

Counts counts_of(const Mesh& own, const Mesh& other, const Part& part = {}) {
    const auto first = SearchedSurface::build(own), second = SearchedSurface::build(other);
    const auto samples = so_many_samples_on(own, 20000);
    const auto found = counterparts(samples, *first, *second, 5);
    Counts out;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        bool within = true;
        for (std::size_t axis = 0; axis < 3; ++axis)
            within = within && samples[i].place[axis] >= part.low[axis] && samples[i].place[axis] <= part.high[axis];
        if (!within) continue;
        out.covered += found[i].presence == Presence::covered;
        out.displaced += found[i].presence == Presence::displaced;
        out.absent += found[i].presence == Presence::absent;
        out.counting += found[i].counts;
        if (found[i].counts) out.largest = std::max(out.largest, found[i].distance);
    }
    return out;
}

TEST(Counterpart, OfTheSameSurfaceCoversItAndCounts) {
    const Mesh ball = shapes::sphere(200, 3);
    const auto counts = counts_of(ball, ball);
    EXPECT_NEAR(static_cast<double>(counts.covered), 20000, 1);
    EXPECT_EQ(counts.displaced + counts.absent, 0u);
    EXPECT_EQ(counts.counting, counts.covered);
}

TEST(Counterpart, OfASurfaceThatIsOffWithinTheDistanceIsCoveredAndBeyondDisplaced) {
    const Mesh sheet = shapes::plane(400, 40, 0);
    EXPECT_EQ(counts_of(sheet, shapes::moved(sheet, 0, 0, 4)).displaced, 0u);
    const auto beyond = counts_of(sheet, shapes::moved(sheet, 0, 0, 6));
    EXPECT_EQ(beyond.covered + beyond.absent, 0u);
    EXPECT_EQ(beyond.counting, beyond.displaced);
    EXPECT_NEAR(beyond.largest, 6, 1e-9);
}

TEST(Counterpart, BeyondTheBorderIsAbsentAndSaysNothingOfAnError) {
    // The other ends at 300 of 400 mm: 5 mm beyond are covered, the rest is absent.
    const Mesh sheet = shapes::plane(400, 40, 0);
    const Mesh narrower = cut(sheet, [](const Vector3f& p) { return p[0] > 305; });
    const auto counts = counts_of(sheet, narrower);
    EXPECT_NEAR(static_cast<double>(counts.covered), 20000 * 305.0 / 400, 120);
    EXPECT_EQ(counts.displaced, 0u);
    EXPECT_NEAR(static_cast<double>(counts.counting), 20000 * 300.0 / 400, 120);
    EXPECT_NEAR(counts.largest, 0, 1e-9) << "not what lies beside the border";
}

TEST(Counterpart, OfADentIsDisplaced) {
    const Mesh sheet = shapes::plane(400, 80, 0);
    Mesh dented = sheet;
    for (auto& p : dented.positions) {
        const double away = std::hypot(p[0] - 200, p[1] - 200);
        if (away < 60) p[2] = static_cast<float>(-30 * (1 - away / 60));
    }
    using Pair = std::pair<const Mesh*, const Mesh*>;
    for (const auto& [own, other] : {Pair{&sheet, &dented}, Pair{&dented, &sheet}}) {
        const auto counts = counts_of(*own, *other);
        EXPECT_GT(counts.displaced, 500u);
        EXPECT_EQ(counts.absent, 0u);
    }
    EXPECT_NEAR(counts_of(dented, sheet).largest, 30, 1);
}

TEST(Counterpart, OfASpikeIsDisplaced) {
    // 5 mm wide at its foot and 60 mm high: what is nearest to all of it is its foot, which the other surface has, too.
    const Mesh sheet = shapes::plane(200, 80, 0);
    Mesh spiky = sheet;
    for (auto& p : spiky.positions)
        if (std::hypot(p[0] - 100, p[1] - 100) < 2) p[2] = 60;
    const auto counts = counts_of(spiky, sheet);
    EXPECT_GT(counts.displaced, 100u);
    EXPECT_EQ(counts.absent, 0u);
    EXPECT_GT(counts.largest, 50);
    EXPECT_LE(counts.largest, 60);
}

TEST(Counterpart, OfTheBackOfABodyIsAbsentWhereOnlyTheFrontWasCaptured) {
    // An ellipsoid as wide as a torso and as thick: the front is nearer to the middle of the back than the rim is.
    Mesh torso = shapes::sphere(1, 6);
    for (auto& p : torso.positions) p = {p[0] * 220, p[1] * 300, p[2] * 100};
    const Mesh front = cut(torso, [](const Vector3f& p) { return p[2] < 0; });
    const auto nearest = SearchedSurface::build(front);
    std::uint32_t hint = 0;
    ASSERT_FALSE(nearest->nearest({0, 0, -100}, hint).on_border);
    const auto counts = counts_of(torso, front);
    EXPECT_EQ(counts.displaced, 0u);
    EXPECT_NEAR(static_cast<double>(counts.absent), 10000, 800);
}

TEST(Counterpart, OfASpeckIsAbsentWhereItsSurroundingsAreRight) {
    const Mesh sheet = shapes::plane(400, 40, 0);
    Mesh with_speck = sheet;
    shapes::append(with_speck, shapes::moved(shapes::plane(20, 4, 30), 200, 200, 0));
    const auto speck = counts_of(with_speck, sheet, {{-1e9, -1e9, 29}});
    EXPECT_GT(speck.absent, 20u);
    EXPECT_EQ(speck.displaced + speck.covered, 0u);
}

TEST(Counterpart, OfALimbCapturedAsAPieceOfItsOwnAndShownElsewhereIsDisplaced) {
    const Mesh body = shapes::plane(400, 40, 0), limb = shapes::plane(100, 20, 100);
    Mesh captured = body, shown = body;
    shapes::append(captured, limb);
    shapes::append(shown, shapes::moved(limb, 0, 0, 20));
    const auto counts = counts_of(captured, shown, {{-1e9, -1e9, 99}});
    EXPECT_GT(counts.displaced, 1000u);
    EXPECT_EQ(counts.covered + counts.absent, 0u);
    EXPECT_NEAR(counts.largest, 20, 1e-9);
}

TEST(Counterpart, OfAnythingIsAbsentOnAnEmptySurfaceAndNothingHasNone) {
    const Mesh sheet = shapes::plane(100, 10, 0);
    const auto counts = counts_of(sheet, {});
    EXPECT_NEAR(static_cast<double>(counts.absent), 20000, 1);
    EXPECT_EQ(counts.counting, 0u);
    EXPECT_EQ(counts_of({}, sheet).absent, 0u);
}

TEST(Counterpart, IsTheSameForAnyThreadCount) {
    std::mt19937 random(7);
    const Mesh a = shapes::soup(random, 100, 150), b = shapes::soup(random, 100, 150);
    const auto first = SearchedSurface::build(a), second = SearchedSurface::build(b);
    const auto samples = so_many_samples_on(a, 5000);
    const internal::ThreadPool pool(4);
    const auto one = counterparts(samples, *first, *second, 5), four = counterparts(samples, *first, *second, 5, pool);
    ASSERT_EQ(one.size(), four.size());
    for (std::size_t i = 0; i < one.size(); ++i) {
        EXPECT_EQ(one[i].presence, four[i].presence);
        EXPECT_EQ(one[i].distance, four[i].distance);
    }
}

}  // namespace
}  // namespace htvm
