#include "coders.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <string>

#include "htvm/option_list.hpp"
#include "metrics/point_error.h"
#include "synth/synth.h"

namespace htvm::lab {

namespace {

SourceFrame synthetic_frame(int frame) {
    SynthOptions options;
    options.vertices = 1500;
    const auto synthetic = synth_frame(options, frame);
    SourceFrame out;
    out.index = static_cast<std::size_t>(frame);
    out.mesh = synthetic.mesh;
    out.pose = synthetic.pose;
    out.timestamp_us = 33333 * frame;
    return out;
}

SequenceFacts facts_of(const SourceFrame& frame) {
    SequenceFacts facts;
    facts.box = bounding_box(frame.mesh);
    facts.frame_side = 1800;
    facts.skeleton = synth_skeleton();
    return facts;
}

TEST(DracoPositionBits, cell_is_the_nearest_to_the_step) {
    EXPECT_EQ(10, draco_position_bits(1023, 1));
    EXPECT_EQ(10, draco_position_bits(1023, 1.3));
    EXPECT_EQ(9, draco_position_bits(1023, 1.5));
    EXPECT_EQ(11, draco_position_bits(1023, 0.6));
}

TEST(DracoPositionBits, stay_within_1_and_30) {
    EXPECT_EQ(1, draco_position_bits(1, 1000));
    EXPECT_EQ(30, draco_position_bits(1e9, 1e-9));
    EXPECT_EQ(1, draco_position_bits(0, 1));
    EXPECT_EQ(1, draco_position_bits(-1, 1));
}

TEST(BuiltInCoders, have_different_names) {
    std::set<std::string> names;
    for (const auto& coder : built_in_coders(30)) EXPECT_TRUE(names.insert(coder.name).second) << coder.name;
    for (const char* name :
         {"paper", "htvm-ep", "htvm-motion", "htvm-rd", "htvm-t", "tfan", "tfan-mpeg", "draco10", "draco7"})
        EXPECT_TRUE(names.contains(name));
}

TEST(BuiltInCoders, decode_every_frame_within_their_steps) {
    const auto facts = facts_of(synthetic_frame(0));
    const auto quality = quality_point(50);
    for (const auto& coder : built_in_coders(30)) {
        if (coder.name == "htvm-t") continue;  // its vertices are those of the I-frame, not near the capture's
        const auto start = coder.start(facts, quality);
        ASSERT_TRUE(start) << coder.name;
        for (const int i : {0, 1, 2}) {
            const auto frame = synthetic_frame(i);
            const auto coded = (*start)(frame);
            ASSERT_TRUE(coded) << coder.name << ": " << coded.error().message;
            const auto error = point_error(frame.mesh, coded->decoded);
            EXPECT_LT(m1_geometry(error), quality.geometry_step) << coder.name;
            EXPECT_LT(m1_colour(error), 3 * quality.colour_step) << coder.name;
            EXPECT_GT(coded->bytes.total(), 100u) << coder.name;
            EXPECT_GT(coded->bytes[Layer::colour], 0u) << coder.name;
            EXPECT_LT(coded->bytes.total(), 15 * frame.mesh.positions.size()) << coder.name;
        }
    }
}

TEST(BuiltInCoders, only_the_coders_with_references_code_enhanced_frames) {
    const auto facts = facts_of(synthetic_frame(0));
    for (const auto& coder : built_in_coders(30)) {
        const auto start = coder.start(facts, quality_point(40));
        ASSERT_TRUE(start);
        EXPECT_EQ(FrameType::intra, (*start)(synthetic_frame(0))->type);
        if (coder.name == "htvm-rd" || coder.name == "htvm-t") continue;  // they choose by measuring
        const bool refers = coder.name == "paper" || coder.name == "htvm-ep" || coder.name == "htvm-motion";
        EXPECT_EQ(refers ? FrameType::enhanced : FrameType::intra, (*start)(synthetic_frame(1))->type) << coder.name;
    }
}

// The key of stored results includes everything except what the sweep itself sets for each run.
TEST(CodecUnderTest, settings_differ_where_options_do) {
    for (const auto profile : {Profile::tracked, Profile::topology, Profile::paper}) {
        std::set<std::string> settings = {codec_under_test("name", {}, default_options(profile)).settings};
        std::size_t different = 1;
        for (const auto& option : option_list()) {
            auto options = default_options(profile);
            const double usual = option.get(options);
            option.set(options, usual == option.least ? usual + 1 : option.least);
            ASSERT_NE(usual, option.get(options)) << option.name;
            const std::string name = option.name;
            const bool by_the_sweep = name == "quality" || name == "geometry_step" || name == "colour_step" ||
                                      name == "threads" || name.starts_with("fps_") || name == "unit_micrometres";
            different += serves(option.group, profile) && !by_the_sweep;
            settings.insert(codec_under_test("name", {}, options).settings);
        }
        EXPECT_EQ(different, settings.size()) << profile_name(profile);
    }
    const auto of = [](Profile profile) { return codec_under_test("name", {}, default_options(profile)).settings; };
    EXPECT_NE(of(Profile::topology), of(Profile::paper));
}

TEST(CodecUnderTest, tells_p_frames) {
    EncoderOptions options = default_options(Profile::topology);
    options.topology.frame_choice = FrameChoice::motion;
    options.topology.predicted_below = 1e6;
    options.topology.animation_error = 0;
    const auto start = codec_under_test("p", {}, options).start(facts_of(synthetic_frame(0)), quality_point(50));
    ASSERT_TRUE(start);
    EXPECT_EQ(FrameType::intra, (*start)(synthetic_frame(0))->type);
    const auto moved = (*start)(synthetic_frame(1));
    ASSERT_TRUE(moved);
    EXPECT_EQ(FrameType::predicted, moved->type);
    EXPECT_EQ(0u, moved->bytes[Layer::geometry]);
}

TEST(BuiltInCoders, meshes_without_colour_triangles_or_vertices_go_through) {
    auto points = synthetic_frame(0);
    points.mesh.triangles.clear();
    auto grey = synthetic_frame(0);
    grey.mesh.colours.clear();
    SourceFrame nothing;
    nothing.pose = points.pose;
    for (const auto& coder : built_in_coders(30)) {
        for (const auto* frame : {&points, &grey, &nothing}) {
            const auto start = coder.start(facts_of(points), quality_point(50));
            ASSERT_TRUE(start);
            const auto coded = (*start)(*frame);
            ASSERT_TRUE(coded) << coder.name << ": " << coded.error().message;
            EXPECT_EQ(frame->mesh.colours.empty(), coded->decoded.colours.empty()) << coder.name;
            EXPECT_EQ(frame->mesh.triangles.empty(), coded->decoded.triangles.empty()) << coder.name;
        }
    }
}

Mesh triangle() {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}};
    mesh.triangles = {{0, 1, 2}};
    return mesh;
}

// Runs a peer's command on one frame in a folder of its own.
Result<CodedFrame> run(const std::string& command) {
    // A name of its own, since tests run in parallel. It contains a space and a quote, which the shell must not
    // interpret.
    std::string name = (std::filesystem::path(testing::TempDir()) / "rd peer's XXXXXX").string();
    if (!mkdtemp(name.data())) return fail(ErrorKind::bad_input, "no temporary folder");
    const std::filesystem::path folder = name;
    const auto coder = peer_under_test("peer=" + command);
    if (!coder) return tl::unexpected(coder.error());
    auto quality = quality_point(50);
    quality.working_folder = folder;
    SequenceFacts facts;
    facts.frame_side = 10;
    const auto start = coder->start(facts, quality);
    SourceFrame frame;
    frame.mesh = triangle();
    auto coded = (*start)(frame);
    std::filesystem::remove_all(folder);
    return coded;
}

TEST(Substitute, replaces_every_known_key) {
    EXPECT_EQ("a 1 b 22 1", substitute("a {x} b {yy} {x}", {{"x", "1"}, {"yy", "22"}}));
}

TEST(Substitute, leaves_other_braces_alone) {
    EXPECT_EQ("{z} ${x {", substitute("{z} ${x {", {{"x", "1"}}));
    EXPECT_EQ("awk '{print}' 1", substitute("awk '{print}' {x}", {{"x", "1"}}));
    EXPECT_EQ("", substitute("", {{"x", "1"}}));
}

TEST(Substitute, does_not_look_into_what_it_put_in) { EXPECT_EQ("{x}", substitute("{x}", {{"x", "{x}"}})); }

TEST(QuotedForShell, is_one_word_whatever_it_holds) {
    EXPECT_EQ("'plain'", quoted_for_shell("plain"));
    EXPECT_EQ("'it'\\''s $HOME'", quoted_for_shell("it's $HOME"));
}

TEST(Peer, is_a_name_and_a_command_that_names_its_files) {
    const auto peer = peer_under_test("my-coder.2=run {in} {out} {decoded} a=b");
    ASSERT_TRUE(peer);
    EXPECT_EQ("my-coder.2", peer->name);
    EXPECT_EQ("run {in} {out} {decoded} a=b", peer->settings);
}

TEST(Peer, bad_input_where_name_or_files_are_missing) {
    for (const char* text : {"", "=", "name", "=run {in} {out} {decoded}", "a/b=run {in} {out} {decoded}",
                             "..=run {in} {out} {decoded}", "name=run {in} {out}", "name=run {out} {decoded}"}) {
        const auto peer = peer_under_test(text);
        ASSERT_FALSE(peer) << text;
        EXPECT_EQ(ErrorKind::bad_input, peer.error().kind);
    }
}

TEST(Peer, size_of_out_is_the_rate_and_decoded_is_the_mesh) {
    const auto coded = run("printf 12345 > {out} && cp {in} {decoded}");
    ASSERT_TRUE(coded) << coded.error().message;
    EXPECT_EQ(5u, coded->bytes.total());
    EXPECT_EQ(triangle().positions, coded->decoded.positions);
    EXPECT_EQ(triangle().triangles, coded->decoded.triangles);
    EXPECT_FALSE(coded->decode_ms);
}

TEST(Peer, is_told_the_quality_and_its_steps) {
    const auto coded = run("printf '{q} {step} {colour_step} {bits}' > {out} && cp {in} {decoded}");
    ASSERT_TRUE(coded) << coded.error().message;
    EXPECT_EQ(std::string("50 2 6 3").size(), coded->bytes.total());  // 10 mm in steps of 2: 3 bits
}

TEST(Peer, failing_command_is_an_error_that_says_what_it_printed) {
    const auto coded = run("echo no such luck; false {in} {out} {decoded}");
    ASSERT_FALSE(coded);
    EXPECT_NE(std::string::npos, coded.error().message.find("no such luck")) << coded.error().message;
}

TEST(Peer, command_that_writes_nothing_is_an_error) {
    EXPECT_FALSE(run("true {in} {out} {decoded}"));
    EXPECT_FALSE(run("true {in} {decoded}; touch {out}"));
    EXPECT_FALSE(run("true {in}; touch {out}; echo rubbish > {decoded}"));
}

}  // namespace
}  // namespace htvm::lab
