#include "reproduce_zipper.h"

#include <gtest/gtest.h>

#include "htvm/decoder.hpp"
#include "synth/synth.h"

namespace htvm::lab {
namespace {

struct Shots {
    std::vector<std::shared_ptr<const SourceFrame>> frames;
    SequenceFacts facts;
};

// A few frames of the synthetic person, who walks.
Shots walking() {
    Shots out;
    SynthOptions options;
    options.vertices = 2000;
    for (const int i : {40, 43, 46}) {
        const auto made = synth_frame(options, i);
        SourceFrame frame;
        frame.index = static_cast<std::size_t>(i);
        frame.mesh = made.mesh;
        frame.pose = made.true_pose;
        frame.timestamp_us = 33333 * i;
        out.frames.push_back(std::make_shared<const SourceFrame>(std::move(frame)));
    }
    out.facts.skeleton = synth_skeleton();
    return out;
}

EncoderOptions partly(double still_below) {
    auto options = paper_options(30);
    options.topology.still_below = still_below;
    options.topology.animation_error = 0;
    options.threads = 1;
    return options;
}

TEST(SeamStages, the_last_is_what_the_decoder_shows) {
    const auto shots = walking();
    const auto stages = code_in_stages(shots.frames, shots.facts, partly(60));
    ASSERT_TRUE(stages) << stages.error().message;
    ASSERT_EQ(2u, stages->size());
    EXPECT_EQ(43u, (*stages)[0].frame);
    EXPECT_EQ(46u, (*stages)[1].frame);
    auto options = partly(60);
    options.skeleton = shots.facts.skeleton;
    options.key_interval = 1000000;
    options.topology.scene_changes = false;
    auto encoder = Encoder::create(options);
    ASSERT_TRUE(encoder);
    Decoder decoder;
    std::vector<Mesh> shown;
    for (const auto& frame : shots.frames) {
        ASSERT_TRUE(encoder->push(frame->mesh, &*frame->pose, frame->timestamp_us));
        while (auto packet = encoder->pull())
            if (auto decoded = decoder.push(*packet); decoded && *decoded) shown.push_back((*decoded)->mesh);
    }
    ASSERT_EQ(3u, shown.size());
    for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_EQ(shown[i + 1].positions, (*stages)[i].zippered.positions);
        EXPECT_EQ(shown[i + 1].triangles, (*stages)[i].zippered.triangles);
    }
}

TEST(SeamStages, each_adds_to_the_coded_part) {
    const auto shots = walking();
    const auto stages = code_in_stages(shots.frames, shots.facts, partly(60));
    ASSERT_TRUE(stages);
    for (const auto& stage : *stages) {
        const auto coded = static_cast<std::ptrdiff_t>(stage.coded_triangles);
        for (const auto* mesh : {&stage.overlapping, &stage.trimmed})
            EXPECT_TRUE(
                std::equal(mesh->triangles.begin(), mesh->triangles.begin() + coded, stage.zippered.triangles.begin()));
        EXPECT_EQ(stage.kept_end, stage.trimmed.triangles.size());
        EXPECT_LT(stage.kept_end, stage.zippered.triangles.size());
        EXPECT_LT(stage.trimmed.triangles.size(), stage.overlapping.triangles.size());
    }
}

TEST(SeamCounts, fall_from_trimmed_to_zippered) {
    const auto shots = walking();
    const auto stages = code_in_stages(shots.frames, shots.facts, partly(60));
    ASSERT_TRUE(stages);
    for (std::size_t i = 0; i < stages->size(); ++i) {
        const auto counts = count_seams(shots.frames[i + 1]->mesh, (*stages)[i], 1);
        ASSERT_TRUE(counts);
        EXPECT_EQ(0u, counts->original.open_edges);
        EXPECT_GT(counts->overlapping.open_edges, 0u);
        EXPECT_GT(counts->trimmed.open_edges, 0u);
        EXPECT_LT(10 * counts->zippered.open_edges, counts->trimmed.open_edges);
    }
}

TEST(SeamStages, there_are_none_where_all_or_nothing_is_coded) {
    const auto shots = walking();
    for (const double still_below : {0.0, 1e6}) {
        const auto stages = code_in_stages(shots.frames, shots.facts, partly(still_below));
        ASSERT_TRUE(stages);
        EXPECT_TRUE(stages->empty());
    }
    EXPECT_TRUE(code_in_stages({}, shots.facts, partly(60))->empty());
}

}  // namespace
}  // namespace htvm::lab
