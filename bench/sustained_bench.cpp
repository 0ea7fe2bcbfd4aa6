// The tracked profile over 300 frames in a row, from memory, I-frames and patches counted: frames a second, and how
// long single frames take; with one in flight, a push is of two halves of frames. HTVM_BENCH_CAPTURE takes a folder of
// meshes instead of the synthetic person.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <utility>
#include <vector>

#include "captures.h"
#include "htvm/encoder.hpp"
#include "metrics/percentile.h"

namespace {

constexpr std::size_t frames = 300;

void encode_sustained(benchmark::State& state) {
    auto& capture = htvm::bench::whole_capture();
    auto options = htvm::default_options(htvm::Profile::tracked);
    options.tracked.effort = static_cast<int>(state.range(0));
    options.threads = static_cast<unsigned>(state.range(1));
    options.latency_frames = static_cast<int>(state.range(2));
    std::vector<double> times;
    double decoded = 0, bits = 0, intra = 0, patches = 0;
    for (auto _ : state) {
        auto encoder = htvm::Encoder::create(options);
        if (!encoder) std::abort();
        const auto count = [&] {
            while (auto packet = encoder->pull()) bits += 8.0 * static_cast<double>(packet->payload.size());
            for (const auto& [info, cost] : encoder->coded_frames()) {
                decoded += info.vertices;
                intra += info.type == htvm::FrameType::intra ? 1 : 0;
                patches += info.type == htvm::FrameType::patched ? 1 : 0;
            }
        };
        for (std::size_t i = 0; i < frames; ++i) {
            const auto begin = std::chrono::steady_clock::now();
            if (!encoder->push(capture.frame(i), nullptr, 33333 * static_cast<std::int64_t>(i))) std::abort();
            const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - begin;
            times.push_back(time.count());
            count();
        }
        if (!encoder->finish()) std::abort();
        count();
    }
    std::sort(times.begin(), times.end());
    const auto coded = static_cast<double>(frames) * static_cast<double>(state.iterations());
    state.counters["fps"] = benchmark::Counter(coded, benchmark::Counter::kIsRate);
    state.counters["p50, ms"] = htvm::percentile(times, 50);
    state.counters["p99, ms"] = htvm::percentile(times, 99);
    state.counters["max, ms"] = times.back();
    state.counters["I"] = intra / static_cast<double>(state.iterations());
    state.counters["TP"] = patches / static_cast<double>(state.iterations());
    state.counters["captured vertices"] = capture.vertices();
    state.counters["decoded vertices"] = decoded / coded;
    state.counters["Mbit/s at 30 fps"] = 30e-6 * bits / coded;
}

void levels(benchmark::internal::Benchmark* benchmark) {
    benchmark->ArgNames({"effort", "threads", "in_flight"});
    for (const int effort : {1, 5, 9})
        for (const auto& [threads, in_flight] : {std::pair(1, 0), std::pair(2, 0), std::pair(2, 1)})
            benchmark->Args({effort, threads, in_flight});
    benchmark->Iterations(1)->Unit(benchmark::kMillisecond)->UseRealTime();
}

BENCHMARK(encode_sustained)->Apply(levels);

}  // namespace
