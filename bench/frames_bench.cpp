// Speed of a frame, by kind and by stage, on the default synthetic person: about 35,000 vertices with colour.
//
// Real time, on all cores; frames per second beside it. HTVM_BENCH_VERTICES changes the size.
#include <benchmark/benchmark.h>

#include <cstdlib>
#include <map>
#include <string>

#include "htvm/decoder.hpp"
#include "htvm/encoder.hpp"
#include "synth/synth.h"

namespace {

constexpr int first_frame = 40, frames = 6;

struct Sequence {
    std::vector<htvm::SynthFrame> frames;
    std::vector<htvm::Packet> packets;
};

htvm::EncoderOptions encoder_options(double quality, unsigned threads) {
    htvm::EncoderOptions options = htvm::default_options(htvm::Profile::topology);
    const auto steps = htvm::quality_steps(quality);
    options.geometry_step = steps.geometry_step;
    options.colour_step = steps.colour_step;
    options.threads = threads;
    options.skeleton = htvm::synth_skeleton();
    options.key_interval = 1000;
    options.topology.scene_changes = false;
    return options;
}

// What every frame behind the first becomes.
enum class Kind { intra, enhanced, motion, predicted, tracked };

// Motion-based coding leaves some bones of frames so near to the I-frame out; P-frames are animated whatever the
// motion.
void choose(htvm::EncoderOptions& options, Kind kind) {
    if (kind == Kind::enhanced || kind == Kind::intra) return;
    if (kind == Kind::tracked) {
        options.profile = htvm::Profile::tracked;
        options.least_key_interval = options.key_interval;
        return;
    }
    options.topology.animation_error = 0;
    if (kind == Kind::motion) {
        options.topology.still_below = 60;
    } else {
        options.topology.frame_choice = htvm::FrameChoice::motion;
        options.topology.predicted_below = 1e6;
    }
}

const std::vector<htvm::SynthFrame>& capture() {
    static const auto made = [] {
        htvm::SynthOptions options;
        if (const char* vertices = std::getenv("HTVM_BENCH_VERTICES")) options.vertices = std::atoi(vertices);
        std::vector<htvm::SynthFrame> out;
        for (int i = 0; i < frames; ++i) out.push_back(htvm::synth_frame(options, first_frame + i));
        return out;
    }();
    return made;
}

// An encoder behind its first frame, so that the next ones can refer to it.
htvm::Encoder primed(Kind kind, double quality, unsigned threads) {
    auto options = encoder_options(quality, threads);
    choose(options, kind);
    auto encoder = htvm::Encoder::create(options);
    if (!encoder->push(capture()[0].mesh, &capture()[0].pose, 0)) std::abort();
    return std::move(*encoder);
}

void report(benchmark::State& state, const std::map<std::string, double>& stages) {
    const auto iterations = static_cast<double>(state.iterations());
    state.counters["fps"] = benchmark::Counter(iterations, benchmark::Counter::kIsRate);
    for (const auto& [stage, milliseconds] : stages) state.counters[stage + ", ms"] = milliseconds / iterations;
}

// Says so where the encoder chose another kind of frame, as I in place of T.
bool is_kind(benchmark::State& state, htvm::FrameType type, Kind kind) {
    const auto wanted = kind == Kind::intra       ? htvm::FrameType::intra
                        : kind == Kind::predicted ? htvm::FrameType::predicted
                        : kind == Kind::tracked   ? htvm::FrameType::tracked
                                                  : htvm::FrameType::enhanced;
    if (type == wanted) return true;
    state.SkipWithError("the encoder chose another kind of frame");
    return false;
}

// To and fro, so that the person never jumps.
const htvm::SynthFrame& input_of(std::int64_t frame) {
    const auto step = static_cast<std::size_t>(frame % (2 * (frames - 1)));
    return capture()[step < frames ? step : 2 * (frames - 1) - step];
}

void encode(benchmark::State& state, Kind kind) {
    const auto threads = static_cast<unsigned>(state.range(1));
    auto encoder = primed(kind, static_cast<double>(state.range(0)), threads);
    std::map<std::string, double> stages;
    std::int64_t frame = 0;
    double bits = 0;
    for (auto _ : state) {
        ++frame;
        const auto& input = input_of(frame);
        if (!encoder.push(input.mesh, &input.pose, frame, kind == Kind::intra)) std::abort();
        while (auto packet = encoder.pull()) benchmark::DoNotOptimize(packet->payload.data());
        for (const auto& stage : encoder.stage_times()) stages[stage.stage] += stage.milliseconds;
        const auto& info = encoder.last_frame();
        if (!is_kind(state, info.type, kind)) return;
        bits += 8.0 * static_cast<double>(info.bytes.total()) / info.source_vertices;
    }
    report(state, stages);
    state.counters["bpv"] = bits / static_cast<double>(state.iterations());
}

void encode_intra(benchmark::State& state) { encode(state, Kind::intra); }
void encode_enhanced(benchmark::State& state) { encode(state, Kind::enhanced); }
void encode_motion(benchmark::State& state) { encode(state, Kind::motion); }
void encode_predicted(benchmark::State& state) { encode(state, Kind::predicted); }
void encode_tracked(benchmark::State& state) { encode(state, Kind::tracked); }

void decode(benchmark::State& state, Kind kind) {
    auto encoder = primed(kind, static_cast<double>(state.range(0)), 0);
    const auto& input = capture()[2];
    if (!encoder.push(input.mesh, &input.pose, 1)) std::abort();
    htvm::DecoderOptions options;
    options.threads = static_cast<unsigned>(state.range(1));
    htvm::Decoder decoder(options);
    htvm::Packet measured;
    while (auto packet = encoder.pull()) {
        if (!decoder.push(*packet)) std::abort();
        const auto type = htvm::frame_type(packet->kind);
        if (type && (*type == htvm::FrameType::intra) == (kind == Kind::intra)) measured = *packet;
    }
    if (!is_kind(state, *htvm::frame_type(measured.kind), kind)) return;
    for (auto _ : state) {
        auto frame = decoder.push(measured);
        if (!frame || !*frame) std::abort();
        benchmark::DoNotOptimize((*frame)->mesh.positions.data());
    }
    report(state, {});
}

void decode_intra(benchmark::State& state) { decode(state, Kind::intra); }
void decode_enhanced(benchmark::State& state) { decode(state, Kind::enhanced); }
void decode_motion(benchmark::State& state) { decode(state, Kind::motion); }
void decode_predicted(benchmark::State& state) { decode(state, Kind::predicted); }
void decode_tracked(benchmark::State& state) { decode(state, Kind::tracked); }

void arguments(benchmark::internal::Benchmark* benchmark) {
    benchmark->ArgNames({"quality", "threads"});
    for (const int quality : {25, 42, 50, 75})
        for (const int threads : {1, 2}) benchmark->Args({quality, threads});
    benchmark->Unit(benchmark::kMillisecond)->UseRealTime();
}

BENCHMARK(encode_intra)->Apply(arguments);
BENCHMARK(encode_enhanced)->Apply(arguments);
BENCHMARK(encode_motion)->Apply(arguments);
BENCHMARK(encode_predicted)->Apply(arguments);
BENCHMARK(encode_tracked)->Apply(arguments);
BENCHMARK(decode_intra)->Apply(arguments);
BENCHMARK(decode_enhanced)->Apply(arguments);
BENCHMARK(decode_motion)->Apply(arguments);
BENCHMARK(decode_predicted)->Apply(arguments);
BENCHMARK(decode_tracked)->Apply(arguments);

}  // namespace
