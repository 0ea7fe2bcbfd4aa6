// A tracker's errors cost bits, never correctness: errors at a given quality stay the same (paper, Fig. 20), and only
// what fits the capture is animated without residuals.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "codec/enhanced_options.h"
#include "codec/test_sequences.h"
#include "surface/surface_distance.h"

namespace htvm::internal {
namespace {

using namespace test;

struct Fault {
    std::string name;
    std::function<void(Pose&, std::size_t frame, const Pose& first)> spoil;
};

// A joint of synth_skeleton() by name, so that left and right limbs can be swapped.
std::size_t joint_named(const Skeleton& skeleton, const std::string& name) {
    const auto found = std::find(skeleton.joint_names.begin(), skeleton.joint_names.end(), name);
    EXPECT_NE(found, skeleton.joint_names.end()) << name;
    return static_cast<std::size_t>(found - skeleton.joint_names.begin()) % skeleton.joint_names.size();
}

std::vector<Fault> faults(const Skeleton& skeleton) {
    std::vector<std::pair<std::size_t, std::size_t>> mirrored;
    for (const auto& name : skeleton.joint_names)
        if (name.starts_with("l"))
            mirrored.emplace_back(joint_named(skeleton, name), joint_named(skeleton, "r" + name.substr(1)));
    EXPECT_FALSE(mirrored.empty());
    return {
        {"noise of 80 mm^2 on every coordinate",
         [](Pose& pose, std::size_t frame, const Pose&) {
             std::mt19937 random(static_cast<unsigned>(frame));
             for (auto& joint : pose.joints)
                 for (auto& c : joint) c += between(random, -155, 155) / 10.0;  // uniform: variance 80
         }},
        {"left and right limbs swapped in every other frame",
         [mirrored](Pose& pose, std::size_t frame, const Pose&) {
             if (frame % 2 == 0) return;
             for (const auto& [left, right] : mirrored) std::swap(pose.joints[left], pose.joints[right]);
         }},
        {"a lost joint that jumps to the origin",
         [](Pose& pose, std::size_t frame, const Pose&) {
             if (frame == 0) return;
             pose.joints[4 + frame % 3] = {0, 0, 0};
             pose.found.assign(pose.joints.size(), true);
             pose.found[4 + frame % 3] = false;
         }},
        {"a skeleton that is frozen for all of the sequence",
         [](Pose& pose, std::size_t, const Pose& first) { pose = first; }},
    };
}

// The synthetic person, walking.
TestSequence walking(int frames) {
    SynthOptions options;
    options.vertices = 2000;
    TestSequence out{"walking", synth_skeleton(), {}};
    for (int t = 0; t < frames; ++t) {
        auto frame = synth_frame(options, 60 + t);
        frame.pose.orientations.clear();
        out.frames.push_back({std::move(frame.mesh), std::move(frame.pose)});
    }
    return out;
}

TestSequence spoilt(TestSequence sequence, const Fault& fault) {
    const Pose first = *sequence.frames[0].pose;
    for (std::size_t t = 0; t < sequence.frames.size(); ++t) fault.spoil(*sequence.frames[t].pose, t, first);
    return sequence;
}

std::vector<double> surface_errors_of(const TestSequence& sequence, const CodedSequence& coded) {
    std::vector<double> out;
    for (std::size_t t = 0; t < coded.reconstructions.size(); ++t) {
        const auto& a = sequence.frames[t].mesh;
        const auto& b = coded.reconstructions[t];
        out.push_back(
            surface_errors({a.positions, a.triangles, a.colours}, {b.positions, b.triangles, b.colours}).geometry_rms);
    }
    return out;
}

double root_mean_square(const std::vector<double>& values) {
    double sum = 0;
    for (const double v : values) sum += v * v;
    return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(values.size(), 1)));
}

TEST(SkeletonFaults, LeaveTheErrorsOfFullyCodedFramesAsTheyAre) {
    const auto sequence = walking(6);
    for (const auto reference : {ReferenceVertices::any, ReferenceVertices::bone}) {
        EncoderOptions options = test::enhanced_options();
        options.topology.reference_vertices = reference;
        const auto clean = encode(sequence, options);
        const double error = root_mean_square(surface_errors_of(sequence, clean));
        for (const auto& fault : faults(sequence.skeleton)) {
            SCOPED_TRACE(fault.name);
            const auto coded = encode(spoilt(sequence, fault), options);
            ASSERT_TRUE(coded.errors.empty()) << coded.errors[0];
            EXPECT_NEAR(root_mean_square(surface_errors_of(sequence, coded)), error, 0.12 * error);
            EXPECT_EQ(decode_packets(coded.packets).errors.size(), 0u);
        }
    }
}

TEST(SkeletonFaults, NeverLetAnAnimatedFrameOrPartOfOneBeFartherOffThanAllowed) {
    const auto sequence = walking(16);
    EncoderOptions options = test::enhanced_options();
    options.topology.frame_choice = FrameChoice::motion;
    options.topology.predicted_below = 600;
    options.topology.still_below = 100;
    options.topology.animation_error = 4;
    const auto fully_coded = encode(sequence, test::enhanced_options()).bytes.size();
    std::vector<Fault> all = faults(sequence.skeleton);
    all.insert(all.begin(), {"none", [](Pose&, std::size_t, const Pose&) {}});
    for (const auto& fault : all) {
        SCOPED_TRACE(fault.name);
        const auto coded = encode(spoilt(sequence, fault), options);
        ASSERT_TRUE(coded.errors.empty()) << coded.errors[0];
        const auto errors = surface_errors_of(sequence, coded);
        if (fault.name == "none") {
            EXPECT_LT(coded.bytes.size(), fully_coded) << "something was animated";
        }
        for (std::size_t t = 0; t < errors.size(); ++t)
            EXPECT_LE(errors[t], 1.2 * options.topology.animation_error)
                << "frame " << t;  // the limit is per bone, the measurement by area
        EXPECT_EQ(decode_packets(coded.packets).errors.size(), 0u);
    }
}

TEST(SkeletonFaults, CostNoMoreThanAFewBits) {
    const auto sequence = walking(6);
    const auto bytes_of = [](const TestSequence& capture) {
        return encode(capture, test::enhanced_options()).bytes.size();
    };
    const auto clean = bytes_of(sequence);
    for (const auto& fault : faults(sequence.skeleton)) {
        SCOPED_TRACE(fault.name);
        const auto spoiled = bytes_of(spoilt(sequence, fault));
        EXPECT_NE(spoiled, clean);
        EXPECT_LT(spoiled, clean + clean / 4);
    }
}

}  // namespace
}  // namespace htvm::internal
