// Speed per frame, by kind and by stage, on the default synthetic person: about 35,000 vertices with colour.
//
// Real time on all cores, and frames per second. HTVM_BENCH_VERTICES changes the size.
//
// The benchmarks `..._two_threads` take each frame on one thread and on two, in turn, so that other load on the machine
// affects both equally. The counter `one/two` is the ratio of the median times, above 1 if two threads are faster.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "captures.h"
#include "htvm/decoder.hpp"
#include "htvm/encoder.hpp"

namespace {

const std::vector<htvm::SynthFrame>& capture() { return htvm::bench::synthetic_frames(); }

htvm::EncoderOptions encoder_options(double quality, unsigned threads) {
    htvm::EncoderOptions options = htvm::default_options(htvm::Profile::topology);
    options.quality = quality;
    options.threads = threads;
    options.skeleton = htvm::synth_skeleton();
    options.key_interval = 1000;
    return options;
}

// The kind of every frame after the first.
enum class Kind { intra, enhanced, motion, predicted, tracked };

// Motion-based coding leaves out some bones of frames this near to the I-frame; P-frames are animated whatever the
// motion.
void choose(htvm::EncoderOptions& options, Kind kind) {
    if (kind == Kind::tracked) {
        options.profile = htvm::Profile::tracked;
        options.least_key_interval = options.key_interval;
        return;
    }
    options.topology.frame_choice = htvm::FrameChoice::fixed;
    options.topology.scene_changes = false;
    if (kind == Kind::enhanced || kind == Kind::intra) return;
    options.topology.animation_error = 0;
    if (kind == Kind::motion) {
        options.topology.still_below = 60;
    } else {
        options.topology.frame_choice = htvm::FrameChoice::motion;
        options.topology.predicted_below = 1e6;
    }
}

// An encoder that has coded its first frame, so that the next ones can refer to it.
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

// Reports it if the encoder chose another kind of frame, such as I instead of T.
bool is_kind(benchmark::State& state, htvm::FrameType type, Kind kind) {
    const auto wanted = kind == Kind::intra       ? htvm::FrameType::intra
                        : kind == Kind::predicted ? htvm::FrameType::predicted
                        : kind == Kind::tracked   ? htvm::FrameType::tracked
                                                  : htvm::FrameType::enhanced;
    if (type == wanted) return true;
    state.SkipWithError("the encoder chose another kind of frame");
    return false;
}

// Runs forwards and backwards, so that the person never jumps, but not to the frame that the others refer to: there
// nothing has moved.
const htvm::SynthFrame& input_of(std::int64_t frame) {
    const std::size_t frames = capture().size(), step = static_cast<std::size_t>(frame) % (2 * (frames - 2));
    return capture()[1 + (step < frames - 1 ? step : 2 * (frames - 2) - step)];
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
    state.counters["captured vertices"] = static_cast<double>(capture()[1].mesh.positions.size());
    state.counters["decoded vertices"] = encoder.last_frame().vertices;
    state.counters["bpv"] = bits / static_cast<double>(state.iterations());
}

// The times of the frames with one thread and with two, ms.
using Times = std::array<std::vector<double>, 2>;

double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

// Codes the next frame with one thread and with two, alternating which goes first, with code(threads - 1).
template <class Code>
void take_both(Times& times, const Code& code) {
    const std::size_t first = times[0].size() % 2;
    for (const std::size_t which : {first, 1 - first}) {
        const auto begin = std::chrono::steady_clock::now();
        code(which);
        const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - begin;
        times[which].push_back(time.count());
    }
}

void report(benchmark::State& state, const Times& times) {
    const double one = median(times[0]), two = median(times[1]);
    state.counters["one, ms"] = one;
    state.counters["two, ms"] = two;
    state.counters["one/two"] = one / two;
}

void encode_two_threads(benchmark::State& state, Kind kind) {
    const auto quality = static_cast<double>(state.range(0));
    std::array<htvm::Encoder, 2> encoders{primed(kind, quality, 1), primed(kind, quality, 2)};
    Times times;
    std::int64_t frame = 0;
    for (auto _ : state) {
        ++frame;
        const auto& input = input_of(frame);
        take_both(times, [&](std::size_t which) {
            auto& encoder = encoders[which];
            if (!encoder.push(input.mesh, &input.pose, frame, kind == Kind::intra)) std::abort();
            while (auto packet = encoder.pull()) benchmark::DoNotOptimize(packet->payload.data());
        });
        if (!is_kind(state, encoders[0].last_frame().type, kind)) return;
    }
    report(state, times);
}

void encode_intra(benchmark::State& state) { encode(state, Kind::intra); }
void encode_enhanced(benchmark::State& state) { encode(state, Kind::enhanced); }
void encode_motion(benchmark::State& state) { encode(state, Kind::motion); }
void encode_predicted(benchmark::State& state) { encode(state, Kind::predicted); }
void encode_tracked(benchmark::State& state) { encode(state, Kind::tracked); }

// The packets before the last frame of that kind, and that frame.
std::pair<std::vector<htvm::Packet>, htvm::Packet> coded(Kind kind, double quality) {
    auto encoder = primed(kind, quality, 0);
    const auto& input = capture()[2];
    if (!encoder.push(input.mesh, &input.pose, 1)) std::abort();
    std::pair<std::vector<htvm::Packet>, htvm::Packet> out;
    while (auto packet = encoder.pull()) {
        const auto type = htvm::frame_type(packet->kind);
        if (type && (*type == htvm::FrameType::intra) == (kind == Kind::intra)) out.second = *packet;
        out.first.push_back(std::move(*packet));
    }
    return out;
}

htvm::Decoder primed_decoder(const std::vector<htvm::Packet>& packets, unsigned threads) {
    htvm::DecoderOptions options;
    options.threads = threads;
    htvm::Decoder decoder(options);
    for (const auto& packet : packets)
        if (!decoder.decode_copy(packet)) std::abort();
    return decoder;
}

void decode_frame(htvm::Decoder& decoder, const htvm::Packet& packet) {
    auto frame = decoder.decode_copy(packet);
    if (!frame || !*frame) std::abort();
    benchmark::DoNotOptimize((*frame)->mesh.positions.data());
}

void decode(benchmark::State& state, Kind kind) {
    const auto [packets, measured] = coded(kind, static_cast<double>(state.range(0)));
    auto decoder = primed_decoder(packets, static_cast<unsigned>(state.range(1)));
    if (!is_kind(state, *htvm::frame_type(measured.kind), kind)) return;
    for (auto _ : state) decode_frame(decoder, measured);
    report(state, std::map<std::string, double>{});
    state.counters["captured vertices"] = static_cast<double>(capture()[2].mesh.positions.size());
    state.counters["decoded vertices"] =
        static_cast<double>(decoder.decode_copy(measured)->value().mesh.positions.size());
}

void decode_two_threads(benchmark::State& state, Kind kind) {
    const auto sequence = coded(kind, static_cast<double>(state.range(0)));
    const auto& packets = sequence.first;
    const auto& measured = sequence.second;
    std::array<htvm::Decoder, 2> decoders{primed_decoder(packets, 1), primed_decoder(packets, 2)};
    if (!is_kind(state, *htvm::frame_type(measured.kind), kind)) return;
    Times times;
    for (auto _ : state) take_both(times, [&](std::size_t which) { decode_frame(decoders[which], measured); });
    report(state, times);
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

void one_quality(benchmark::internal::Benchmark* benchmark) {
    benchmark->ArgName("quality")->Arg(50)->Unit(benchmark::kMillisecond)->UseRealTime();
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
BENCHMARK_CAPTURE(encode_two_threads, intra, Kind::intra)->Apply(one_quality);
BENCHMARK_CAPTURE(encode_two_threads, enhanced, Kind::enhanced)->Apply(one_quality);
BENCHMARK_CAPTURE(encode_two_threads, motion, Kind::motion)->Apply(one_quality);
BENCHMARK_CAPTURE(encode_two_threads, predicted, Kind::predicted)->Apply(one_quality);
BENCHMARK_CAPTURE(encode_two_threads, tracked, Kind::tracked)->Apply(one_quality);
BENCHMARK_CAPTURE(decode_two_threads, intra, Kind::intra)->Apply(one_quality);
BENCHMARK_CAPTURE(decode_two_threads, enhanced, Kind::enhanced)->Apply(one_quality);
BENCHMARK_CAPTURE(decode_two_threads, motion, Kind::motion)->Apply(one_quality);
BENCHMARK_CAPTURE(decode_two_threads, predicted, Kind::predicted)->Apply(one_quality);
BENCHMARK_CAPTURE(decode_two_threads, tracked, Kind::tracked)->Apply(one_quality);

}  // namespace
