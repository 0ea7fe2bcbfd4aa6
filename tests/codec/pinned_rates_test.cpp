// The sizes and errors of each profile on small captures, compared with tests/data/pinned_rates.txt, so that a change
// of rate or error shows in a diff. If a change is intended, rewrite the table and commit it:
//   HTVM_WRITE_PINNED_RATES=1 build/release/test_codec --gtest_filter='PinnedRates.*'
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "codec/moving_sequences.h"
#include "surface/surface_distance.h"

namespace htvm::internal {
namespace {

using namespace test;

const char* const heading =
    "# Bytes of the frames by kind and of the whole stream; error of the surface (M2, estimated) and of the colours,\n"
    "# root mean square over all frames. Written by tests/codec/pinned_rates_test.cpp.\n"
    "# capture          profile      I  bytes   EP  bytes    P  bytes    T  bytes   stream     mm  levels\n";

// Five frames of the synthetic person as it begins to walk.
std::vector<TestSequence> captures() {
    SynthOptions options;
    options.vertices = 800;
    TestSequence whole{"with_skeleton", synth_skeleton(), {}};
    for (int t = 0; t < 5; ++t) {
        auto frame = synth_frame(options, 40 + t);
        whole.frames.push_back({std::move(frame.mesh), std::move(frame.pose)});
    }
    auto without_skeleton = whole;
    without_skeleton.name = "without_skeleton";
    without_skeleton.skeleton = {};
    for (auto& frame : without_skeleton.frames) frame.pose.reset();
    auto geometry = without_skeleton;
    geometry.name = "geometry_alone";
    for (auto& frame : geometry.frames) frame.mesh.colours.clear();
    return {whole, without_skeleton, geometry};
}

template <class... Values>
std::string text(const char* format, Values... values) {
    std::array<char, 80> out{};
    std::snprintf(out.data(), out.size(), format, values...);
    return out.data();
}

std::string line_of(const TestSequence& sequence, const char* name, Profile profile) {
    auto options = options_at_2_mm(profile);
    options.key_interval = 4;
    const auto coded = encode(sequence, options);
    EXPECT_TRUE(coded.errors.empty());
    std::string line = text("%-18s %-9s", sequence.name.c_str(), name);
    for (const auto type : {FrameType::intra, FrameType::enhanced, FrameType::predicted, FrameType::tracked}) {
        std::size_t bytes = 0;
        for (const auto& info : coded.infos) bytes += info.type == type ? info.bytes.total() : 0;
        line += text(" %4zu %6zu", frames_of(coded, type), bytes);
    }
    double squared_mm = 0, squared_levels = 0;
    for (std::size_t t = 0; t < coded.reconstructions.size(); ++t) {
        const auto &a = sequence.frames[t].mesh, &b = coded.reconstructions[t];
        const auto errors =
            surface_errors({a.positions, a.triangles, a.colours}, {b.positions, b.triangles, b.colours});
        squared_mm += errors.geometry_rms * errors.geometry_rms;
        squared_levels += errors.colour_rms * errors.colour_rms;
    }
    const auto frames = static_cast<double>(coded.reconstructions.size());
    return line + text(" %8zu %6.3f %7.2f", coded.bytes.size(), std::sqrt(squared_mm / frames),
                       std::sqrt(squared_levels / frames));
}

std::vector<std::string> lines_of(std::istream& in) {
    std::vector<std::string> out;
    for (std::string line; std::getline(in, line);)
        if (!line.starts_with('#')) out.push_back(line);
    return out;
}

TEST(PinnedRates, EveryProfileTakesAndLosesOnEachCaptureWhatTheTableSays) {
    std::string table;
    for (const auto& sequence : captures())
        for (const auto& [name, profile] :
             {std::pair{"tracked", Profile::tracked}, std::pair{"topology", Profile::topology},
              std::pair{"paper", Profile::paper}})
            table += line_of(sequence, name, profile) + "\n";
    const auto file = std::filesystem::path(HTVM_TEST_DATA) / "pinned_rates.txt";
    if (std::getenv("HTVM_WRITE_PINNED_RATES")) std::ofstream(file) << heading << table;
    std::ifstream pinned(file);
    std::istringstream now(table);
    EXPECT_EQ(lines_of(pinned), lines_of(now)) << "The table as it is now:\n" << heading << table;
}

}  // namespace
}  // namespace htvm::internal
