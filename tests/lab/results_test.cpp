#include "results.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <tuple>

namespace htvm::lab {

using namespace app;

namespace {

RdFrame frame_of(FrameType type, std::uint32_t vertices, std::size_t geometry) {
    RdFrame frame;
    frame.type = type;
    frame.vertices = vertices;
    frame.bytes[Layer::geometry] = geometry;
    frame.encode_ms = 20;
    frame.decode_ms = 10;
    return frame;
}

RdPoint point_of(const std::string& coder, double quality, std::size_t bytes, double m1) {
    RdPoint point;
    point.coder = coder;
    point.quality = quality;
    point.frames = {frame_of(FrameType::intra, 100, bytes), frame_of(FrameType::enhanced, 300, bytes)};
    point.values["m1_mm"] = m1;
    return point;
}

TEST(RdPoint, bits_per_vertex_are_all_bits_over_all_captured_vertices) {
    EXPECT_DOUBLE_EQ(2 * 8 * 50 / 400.0, bits_per_vertex(point_of("a", 50, 50, 1)));
    EXPECT_DOUBLE_EQ(0, bits_per_vertex(RdPoint{}));
}

TEST(RdPoint, rates_and_speeds_are_means_over_frames) {
    const auto point = point_of("a", 50, 1000, 1);
    EXPECT_DOUBLE_EQ(8e-6 * 1000 * 30, megabits_per_second(point));
    EXPECT_DOUBLE_EQ(50, encode_fps(point));
    EXPECT_DOUBLE_EQ(100, *decode_fps(point));
    EXPECT_DOUBLE_EQ(0, megabits_per_second(RdPoint{}));
    EXPECT_DOUBLE_EQ(0, encode_fps(RdPoint{}));
    EXPECT_FALSE(decode_fps(RdPoint{}));
}

TEST(RdPoint, decoding_speed_is_unknown_where_a_frame_has_none) {
    auto point = point_of("a", 50, 1000, 1);
    point.frames[1].decode_ms.reset();
    EXPECT_FALSE(decode_fps(point));
}

TEST(RdPoint, totals_by_type_add_up) {
    const auto point = point_of("a", 50, 70, 1);
    EXPECT_EQ(1u, totals(point, FrameType::intra).frames);
    EXPECT_EQ(300u, totals(point, FrameType::enhanced).source_vertices);
    EXPECT_EQ(140u, totals(point).bytes.total());
}

TEST(RdPoint, comes_back_from_json_as_it_was) {
    auto point = point_of("draco10", 35, 77, 1.25);
    point.geometry_step = 3.7;
    point.colour_step = 10;
    point.setting = "9 bits";
    point.fps = 25;
    point.frames[0].bytes[Layer::distance_orders] = 3;
    point.frames[0].m1_mm = 1.5;
    point.frames[1].covered_region_mm = 4.5;
    point.frames[1].decode_ms.reset();
    const auto json = to_json(point);
    const auto back = rd_point_from_json(nlohmann::json::parse(json.dump()));
    ASSERT_TRUE(back);
    EXPECT_EQ(json, to_json(*back));
    EXPECT_EQ(3u, back->frames[0].bytes[Layer::distance_orders]);
    EXPECT_EQ(1.5, back->frames[0].m1_mm);
    EXPECT_EQ(4.5, back->frames[1].covered_region_mm);
    EXPECT_FALSE(back->frames[1].decode_ms);
}

TEST(RdPoint, other_json_gives_nothing) {
    auto json = to_json(point_of("a", 50, 1, 1));
    EXPECT_FALSE(rd_point_from_json(nlohmann::json()));
    EXPECT_FALSE(rd_point_from_json(nlohmann::json::array({1, 2})));
    json["frames"][0].erase("bytes");
    EXPECT_FALSE(rd_point_from_json(json));
}

TEST(TakeMeasures, only_what_was_asked_for_and_is_finite) {
    ComparisonSummary summary;
    summary.m1_mm = 1;
    summary.m2_mm = 2;
    summary.d1_db = std::numeric_limits<double>::infinity();
    summary.d2_db = 60;
    CompareOptions options;
    options.surface = options.pictures = false;
    std::map<std::string, double> values;
    take_measures(summary, options, values);
    EXPECT_EQ((std::map<std::string, double>{{"d2_db", 60}, {"m1_mm", 1}}), values);
}

TEST(TakeMeasures, unlit_pictures_only_where_there_are_colours) {
    ComparisonSummary summary;
    summary.m3_ssim = 0.5;
    summary.m3_unlit_foreground_db = 30;
    summary.m3_unlit_ssim = 0.75;
    CompareOptions options;
    options.points = options.surface = options.cloud = false;
    std::map<std::string, double> values;
    take_measures(summary, options, values);
    EXPECT_EQ(0.5, values.at("m3_ssim"));
    EXPECT_FALSE(values.contains("m3_unlit_db") || values.contains("m3_unlit_ssim"));
    summary.has_unlit = true;
    take_measures(summary, options, values);
    EXPECT_EQ(30, values.at("m3_unlit_db"));
    EXPECT_EQ(0.75, values.at("m3_unlit_ssim"));
}

TEST(TakeFrameMeasures, worst_regions_of_i_frames_and_of_others_and_what_patches_replace) {
    RdPoint point;
    for (const auto& [type, worst, recoded] :
         {std::tuple{FrameType::intra, 2.0, 1.0}, std::tuple{FrameType::tracked, 3.0, 0.0},
          std::tuple{FrameType::patched, 5.0, 0.04}, std::tuple{FrameType::tracked, 4.0, 0.0}}) {
        point.frames.push_back(frame_of(type, 100, 10));
        point.frames.back().worst_region_mm = worst;
        point.frames.back().recoded = recoded;
    }
    point.coder = "htvm-t";
    take_frame_measures(point);
    EXPECT_EQ(2, point.values.at("region_intra_p99_mm"));
    EXPECT_EQ(5, point.values.at("region_p99_mm"));
    EXPECT_DOUBLE_EQ(0.04 / 3, point.values.at("patched_share"));
    const std::string table = region_table(std::vector{point});
    EXPECT_NE(std::string::npos, table.find("2.000       5.000         1.333")) << table;
}

TEST(TakeMeasures, coverage_where_it_was_asked_for_and_errors_over_it_where_something_is_covered) {
    ComparisonSummary summary;
    summary.captured_covered = 0.9;
    summary.shown_covered = 0.8;
    summary.covered_m2_mm = 1.5;
    CompareOptions options;
    options.points = options.surface = options.cloud = options.pictures = false;
    std::map<std::string, double> values;
    take_measures(summary, options, values);
    EXPECT_TRUE(values.empty());
    options.coverage = true;
    take_measures(summary, options, values);
    EXPECT_EQ((std::map<std::string, double>{{"captured_covered", 0.9}, {"shown_covered", 0.8}}), values);
    summary.has_covered = true;
    take_measures(summary, options, values);
    EXPECT_EQ(1.5, values.at("covered_m2_mm"));
}

TEST(CoverageTable, has_a_row_for_each_point_that_was_measured) {
    auto point = point_of("htvm-t", 50, 100, 1);
    EXPECT_EQ("", coverage_table(std::vector{point}));
    for (const double worst : {2.0, 7.0, 3.0}) {
        point.frames.push_back(frame_of(FrameType::tracked, 100, 10));
        point.frames.back().covered_region_mm = worst;
    }
    point.values["captured_covered"] = 0.9125;
    point.values["shown_covered"] = 1;
    point.values["covered_m2_mm"] = 1.25;
    take_frame_measures(point);
    EXPECT_EQ(7, point.values.at("covered_region_p99_mm"));
    const std::string table = coverage_table(std::vector{point});
    EXPECT_NE(std::string::npos, table.find("91.25    100.00         1.250         7.000")) << table;
}

TEST(EqualM2, is_over_what_is_covered_where_that_was_measured) {
    auto point = point_of("htvm-t", 50, 100, 1);
    EXPECT_STREQ("m2_mm", equal_m2_measure(std::vector{point}).key);
    point.values["covered_m2_mm"] = 1;
    EXPECT_STREQ("covered_m2_mm", equal_m2_measure(std::vector{point}).key);
}

TEST(TakeFrameMeasures, nothing_of_frames_by_themselves_that_were_not_measured) {
    auto point = point_of("tfan", 50, 70, 1);
    const auto before = point.values;
    take_frame_measures(point);
    EXPECT_EQ(before, point.values);
    EXPECT_EQ("", region_table(std::vector{point}));
}

TEST(RateCurve, errors_count_the_better_the_smaller) {
    const std::vector<RdPoint> points{point_of("a", 20, 50, 4), point_of("b", 20, 50, 9), point_of("a", 50, 100, 2)};
    const auto curve = rate_curve(points, "a", measures()[0]);
    ASSERT_EQ(2u, curve.size());
    EXPECT_DOUBLE_EQ(2, curve[0].rate);
    EXPECT_LT(curve[0].quality, curve[1].quality);
}

TEST(RateDifferences, twice_the_bits_is_plus_100_percent_in_table_and_json) {
    const std::vector<RdPoint> points{point_of("draco10", 20, 50, 4), point_of("draco10", 50, 100, 2),
                                      point_of("ours", 20, 100, 4), point_of("ours", 50, 200, 2)};
    EXPECT_NE(std::string::npos, rate_difference_table(points, "draco10").find("+100.0 %"));
    EXPECT_NEAR(1, rate_differences_json(points, "draco10")["ours"]["m1_mm"].get<double>(), 1e-9);
    EXPECT_EQ("", rate_difference_table(points, "tfan"));
}

TEST(RateDifferences, not_available_without_a_common_range) {
    const std::vector<RdPoint> points{point_of("draco10", 20, 50, 4), point_of("draco10", 50, 100, 3),
                                      point_of("ours", 20, 100, 2), point_of("ours", 50, 200, 1)};
    EXPECT_NE(std::string::npos, rate_difference_table(points, "draco10").find("n/a"));
    EXPECT_TRUE(rate_differences_json(points, "draco10")["ours"]["m1_mm"].is_null());
}

TEST(CrossingSentence, says_where_and_who_is_ahead_below) {
    const std::vector<RdPoint> points{point_of("paper", 20, 25, 4), point_of("paper", 50, 400, 1),
                                      point_of("tfan", 20, 25, 8), point_of("tfan", 50, 400, 0.5)};
    // Halfway between ln 1 and ln 16: 4 bits.
    EXPECT_EQ("M1: paper and tfan cross at 4.00 bpvf (2.00 mm; paper ahead below)\n",
              crossing_sentence(points, "paper", "tfan"));
}

TEST(CrossingSentence, says_who_is_ahead_where_they_do_not_cross) {
    const std::vector<RdPoint> points{point_of("paper", 20, 25, 4), point_of("paper", 50, 400, 1),
                                      point_of("tfan", 20, 25, 8), point_of("tfan", 50, 400, 2)};
    EXPECT_EQ("M1: paper and tfan do not cross between 1.00 and 16.00 bpvf, the rates both reach: paper is ahead\n",
              crossing_sentence(points, "paper", "tfan"));
    EXPECT_EQ("", crossing_sentence(points, "paper", "draco10"));
}

TEST(Csv, has_as_many_fields_in_every_line) {
    const auto csv = rd_csv(std::vector<RdPoint>{point_of("a", 50, 50, 1), point_of("b", 20, 70, 2)});
    std::vector<std::ptrdiff_t> commas;
    for (std::size_t start = 0; start < csv.size();) {
        const auto end = csv.find('\n', start);
        ASSERT_NE(std::string::npos, end);
        commas.push_back(std::count(csv.begin() + static_cast<std::ptrdiff_t>(start),
                                    csv.begin() + static_cast<std::ptrdiff_t>(end), ','));
        start = end + 1;
    }
    ASSERT_EQ(3u, commas.size());
    EXPECT_EQ(commas[0], commas[1]);
    EXPECT_EQ(commas[0], commas[2]);
}

}  // namespace
}  // namespace htvm::lab
