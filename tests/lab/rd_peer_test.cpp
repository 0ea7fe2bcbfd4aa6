#include "rd_peer.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

namespace htvm::lab {
namespace {

Mesh triangle() {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}};
    mesh.triangles = {{0, 1, 2}};
    return mesh;
}

// Runs a peer's command on one frame in a folder of its own.
Result<CodedFrame> run(const std::string& command) {
    // A name of its own: tests run beside each other. With a space and a quote, which the shell must not see.
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
