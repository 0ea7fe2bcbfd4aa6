// The gate against flicker: where a frame refers to no other, or replaces a part of the mesh, pictures change no more
// than at the T-frames beside it, lit and unlit, but for the motion of the capture (metrics/flicker.h). Nor do they
// where a textured capture begins another layout.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <ostream>
#include <string>
#include <vector>

#include "codec/enhanced_options.h"
#include "htvm/decoder.hpp"
#include "htvm/encoder.hpp"
#include "htvm/picture_decoder.hpp"
#include "io/texture_colours.h"
#include "metrics/flicker.h"
#include "metrics/shapes.h"
#include "picture_track.h"
#include "synth/synth.h"
#include "synth/texture.h"

namespace htvm {
namespace {

struct Coded {
    std::vector<FrameType> kinds;
    std::vector<FrameFlicker> changes;  // none for the first frame
};

Mesh decode_next(Encoder& encoder, Decoder& decoder) {
    Mesh out;
    while (const auto packet = encoder.pull()) {
        auto frame = decoder.decode_copy(*packet);
        EXPECT_TRUE(frame.has_value());
        if (frame && *frame) out = std::move((*frame)->mesh);
    }
    return out;
}

// A ball at the hips that is there from frame 8 on, and at the other side from frame 17 on: no motion leads there.
void add_ball(Mesh& mesh, int frame) {
    if (frame < 8) return;
    const Mesh ball = shapes::moved(shapes::sphere(70, 4), frame < 17 ? 330.0f : -330.0f, 1000, 0);
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (const auto& [a, b, c] : ball.triangles) mesh.triangles.push_back({first + a, first + b, first + c});
    mesh.positions.insert(mesh.positions.end(), ball.positions.begin(), ball.positions.end());
    mesh.colours.resize(mesh.positions.size(), {180, 120, 60});
}

// The synthetic capture as the default codes it, but for an I-frame every twelve frames.
Coded code(const SynthOptions& capture, int frames) {
    auto options = test::options_at_2_mm(Profile::tracked);
    options.key_interval = 12;
    auto encoder = Encoder::create(options);
    EXPECT_TRUE(encoder.has_value());
    Decoder decoder;
    FlickerOptions pictures;
    pictures.views.views = 4;
    FlickerMeter meter(pictures);
    Coded out;
    for (int frame = 0; frame < frames; ++frame) {
        auto original = synth_frame(capture, frame).mesh;
        add_ball(original, frame);
        EXPECT_TRUE(encoder->push(original, nullptr, frame * 33333LL));
        auto decoded = decode_next(*encoder, decoder);
        out.kinds.push_back(encoder->last_frame().type);
        const auto change = meter.add(std::move(original), std::move(decoded));
        EXPECT_TRUE(change.has_value());
        out.changes.push_back(change && *change ? **change : FrameFlicker{});
    }
    return out;
}

// The measure of each frame of a kind over that of the T-frames beside it; ascending.
std::vector<double> over_tracked_beside(const Coded& coded, FrameType kind, ChangeSums FrameFlicker::*shading,
                                        double (*measure)(const ChangeSums&)) {
    std::vector<double> values, out;
    for (const auto& change : coded.changes) {
        const auto& sums = change.*shading;
        values.push_back(sums.pixels > 0 ? measure(sums) : std::numeric_limits<double>::infinity());
    }
    for (std::size_t frame = 0; frame < values.size(); ++frame)
        if (const auto over = flicker_beside_tracked(coded.kinds, values, frame); over && coded.kinds[frame] == kind)
            out.push_back(*over);
    std::ranges::sort(out);
    return out;
}

struct Gate {
    const char* name;
    SynthMotion motion;
    double noise;  // mm^2
    // The most that is let through, over the T-frames beside: at any frame, the ratio of changes; in the median, the
    // change of what stands still.
    double intra_ratio, intra_still, patched_ratio, patched_still;
};
std::ostream& operator<<(std::ostream& out, const Gate& gate) { return out << gate.name; }

class FlickerGate : public testing::TestWithParam<Gate> {};

TEST_P(FlickerGate, LetsNoFrameStandOut) {
    const Gate& gate = GetParam();
    SynthOptions capture;
    capture.motion = gate.motion;
    capture.surface_noise_power = gate.noise;
    capture.vertices = 6000;
    const Coded coded = code(capture, 27);
    for (const auto& [kind, most_ratio, most_still] :
         {std::tuple{FrameType::intra, gate.intra_ratio, gate.intra_still},
          std::tuple{FrameType::patched, gate.patched_ratio, gate.patched_still}})
        for (const auto& [shading_name, shading] :
             {std::pair{"lit", &FrameFlicker::lit}, std::pair{"unlit", &FrameFlicker::unlit}}) {
            const auto ratios = over_tracked_beside(coded, kind, shading, flicker_ratio);
            const auto still = over_tracked_beside(coded, kind, shading, still_change);
            const std::string what = std::string(kind_of(kind).name) + ", " + shading_name;
            ASSERT_FALSE(ratios.empty()) << what << ": the capture tests nothing";
            EXPECT_LE(ratios.back(), most_ratio) << what;
            EXPECT_LE(still[still.size() / 2], most_still) << what;
        }
}

// Where hardly anything moves and the capture has no noise of its own, an I-frame is seen: its mesh has other vertices,
// between which the texture is blurred otherwise, and other errors of quantisation; and the T-frames beside, which
// leave noise out, are the calmer. There the gate is where the encoder stands, not at 1.1.
INSTANTIATE_TEST_SUITE_P(Captures, FlickerGate,
                         testing::Values(Gate{"fast", SynthMotion::fast, 2.25, 1.1, 1.1, 1.1, 1.1},
                                         Gate{"calm_and_clean", SynthMotion::calm, 0, 1.35, 1.6, 1.2, 1.2}),
                         [](const auto& of) { return std::string(of.param.name); });

// A textured capture, as encode --texture-as picture codes it, from eight frames before another layout begins.
constexpr int first_of_layout = 30, beside = 8;
Coded code_textured(const SynthOptions& capture) {
    constexpr SynthTextureOptions images{.size = 512};
    auto options = test::options_at_2_mm(Profile::tracked);
    options.texture = {TextureLayout::charts, 384, 384};
    auto encoder = Encoder::create(options);
    app::PictureTrack::Settings settings;
    settings.bake = true;
    settings.width = settings.height = 384;
    settings.quality = 42;
    auto track = app::PictureTrack::create(settings);
    EXPECT_TRUE(encoder && track);
    Decoder decoder;
    PictureDecoder pictures;
    FlickerOptions views;
    views.views.views = 4;
    FlickerMeter meter(views);
    Coded out;
    for (int frame = first_of_layout - beside; frame < first_of_layout + beside; ++frame) {
        auto made = synth_texture(capture, images, synth_frame(capture, frame), frame);
        EXPECT_EQ(made.layout, frame < first_of_layout ? 0 : 1);
        const auto original = std::make_shared<const TexturedMesh>(
            std::move(made.mesh), std::make_shared<const Image>(std::move(made.image)));
        EXPECT_TRUE(encoder->push(with_vertex_colours(*original), nullptr, frame * 33333LL));
        track->add(frame * 33333LL, original);
        const auto repeated = encoder->repeated_vertices();
        track->show(encoder->last_frame().frame, encoder->reconstruction(), {repeated.begin(), repeated.end()});
        TexturedMesh shown;
        while (auto packet = encoder->pull()) {
            auto decoded = decoder.decode_copy(*packet);
            EXPECT_TRUE(decoded.has_value());
            if (decoded && *decoded) shown.mesh = std::move((*decoded)->mesh);
            const auto laid = track->lay_behind(std::move(*packet));
            EXPECT_TRUE(laid.has_value());
            for (const auto& one : laid ? *laid : std::vector<Packet>{})
                if (one.kind == PacketKind::texture && !pictures.decode(one))
                    ADD_FAILURE() << "a picture cannot be decoded";
        }
        shown.texture = pictures.image();
        if (!shown.texture) {
            ADD_FAILURE() << "frame " << frame << " has no picture";
            return out;
        }
        // As commands read them.
        const auto coloured = [](TexturedMesh mesh) {
            mesh.mesh.colours = colours_from_texture(mesh.mesh, *mesh.texture);
            return mesh;
        };
        out.kinds.push_back(encoder->last_frame().type);
        const auto change = meter.add(coloured(*original), coloured(shown));
        EXPECT_TRUE(change.has_value());
        out.changes.push_back(change && *change ? **change : FrameFlicker{});
    }
    return out;
}

TEST(NewLayouts, DoNotStandOut) {
    SynthOptions capture;
    capture.motion = SynthMotion::calm;
    capture.vertices = 4000;
    capture.surface_noise_power = 0;
    const Coded coded = code_textured(capture);
    ASSERT_EQ(coded.changes.size(), 2u * beside);
    for (const auto measure : {decoded_change, flicker_ratio, still_change}) {
        std::vector<double> values = {std::numeric_limits<double>::infinity()};
        for (std::size_t frame = 1; frame < coded.changes.size(); ++frame)
            values.push_back(measure(coded.changes[frame].unlit));
        const auto over = flicker_beside_tracked(coded.kinds, values, beside);
        ASSERT_TRUE(over) << "the capture tests nothing";
        EXPECT_LE(*over, 1.1);
    }
}

}  // namespace
}  // namespace htvm
