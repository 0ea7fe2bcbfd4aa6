#include "charts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace htvm::lab {

namespace {

bool holds(const Axis& axis, const std::vector<double>& values) {
    return std::all_of(values.begin(), values.end(),
                       [&](double v) { return axis.low <= v * (1 + 1e-9) && v * (1 - 1e-9) <= axis.high; });
}

TEST(RateAxis, begins_at_zero) {
    const auto axis = rate_axis(std::vector<double>{5, 12, 20});
    EXPECT_EQ(0, axis.low);
    EXPECT_FALSE(axis.logarithmic);
    EXPECT_EQ(0, axis.tics.front());
}

TEST(RateAxis, is_logarithmic_where_a_coder_needs_a_tenth_of_another) {
    const auto axis = rate_axis(std::vector<double>{0.5, 5, 20});
    EXPECT_TRUE(axis.logarithmic);
    EXPECT_GT(axis.low, 0);
}

TEST(PsnrAxis, begins_and_ends_at_round_numbers) {
    const auto axis = psnr_axis(std::vector<double>{31.4, 33, 38.2});
    EXPECT_EQ(31, axis.low);
    EXPECT_EQ(39, axis.high);
}

TEST(PsnrAxis, shows_no_less_than_it_is_told_to) {
    const std::vector<double> values{0.952, 0.958};
    EXPECT_LT(psnr_axis(values).low, 0.9);
    EXPECT_NEAR(0.95, psnr_axis(values, 0.01).low, 1e-9);
    EXPECT_NEAR(0.96, psnr_axis(values, 0.01).high, 1e-9);
}

TEST(Axes, hold_all_values_and_have_a_few_tics_within) {
    std::mt19937 random(3);
    for (int round = 0; round < 200; ++round) {
        std::uniform_real_distribution<double> exponent(-3, 3), narrow(0, round % 2 == 0 ? 2 : 0.1);
        std::vector<double> values;
        const double scale = std::pow(10, exponent(random));
        for (int i = 0; i < 1 + round % 6; ++i) values.push_back(scale * std::pow(10, narrow(random)));
        for (const auto& axis : {rate_axis(values), error_axis(values), psnr_axis(values)}) {
            EXPECT_LT(axis.low, axis.high);
            EXPECT_TRUE(holds(axis, values));
            EXPECT_LE(axis.tics.size(), 40u);
            for (const double tic : axis.tics) {
                EXPECT_GE(tic, axis.low * (1 - 1e-6) - 1e-9);
                EXPECT_LE(tic, axis.high * (1 + 1e-6) + 1e-9);
            }
        }
        EXPECT_FALSE(rate_axis(values).tics.empty());
    }
}

RdPoint point_of(const std::string& coder, double m1) {
    RdPoint point;
    point.coder = coder;
    RdFrame frame;
    frame.vertices = 100;
    frame.bytes[Layer::geometry] = 100;
    point.frames = {frame};
    point.values["m1_mm"] = m1;
    return point;
}

TEST(CurveScript, draws_each_measure_taken_against_both_rates) {
    const std::vector<RdPoint> points{point_of("paper", 1), point_of("a_b's", 2)};
    EXPECT_EQ((std::vector<std::string>{"m1_mm_bpvf", "m1_mm_mbits"}), curve_names(points));
    const auto script = curve_script(points, {"it's samba", "out", true});
    for (const char* part : {"'out/m1_mm_bpvf.svg'", "'out/m1_mm_mbits.png'", "title 'a_b''s'", "'it''s samba'"})
        EXPECT_NE(std::string::npos, script.find(part)) << part;
}

TEST(CurveScript, an_error_of_zero_has_no_place_on_a_logarithmic_axis) {
    EXPECT_TRUE(curve_names(std::vector<RdPoint>{point_of("lossless", 0)}).empty());
    const auto script = curve_script(std::vector<RdPoint>{point_of("a", 0), point_of("b", 1)}, {"t", "out", false});
    EXPECT_EQ(std::string::npos, script.find("title 'a'"));
    EXPECT_NE(std::string::npos, script.find("title 'b'"));
}

}  // namespace
}  // namespace htvm::lab
