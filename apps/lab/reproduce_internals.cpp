#include "reproduce_internals.h"

#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>

#include "command_line/layer_table.h"
#include "command_line/terminal.h"
#include "core/parallel.h"
#include "htvm/decoder.hpp"
#include "htvm/encoder.hpp"

namespace htvm::lab {

using namespace app;
using namespace internal;
namespace {

double now_ms() {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

EncoderOptions internal_options(const SequenceFacts& facts, double quality, int key_interval, unsigned threads) {
    const auto point = quality_point(quality);
    EncoderOptions options = paper_options(key_interval);
    options.geometry_step = point.geometry_step;
    options.colour_step = point.colour_step;
    options.threads = threads;
    options.skeleton = facts.skeleton;
    options.radii = facts.radii;
    return options;
}

Result<void> push(Encoder& encoder, const SourceFrame& frame) {
    return encoder.push(frame.mesh, frame.pose ? &*frame.pose : nullptr, frame.timestamp_us);
}

Result<InternalFrame> run_frame(Encoder& encoder, Decoder& decoder, const SourceFrame& source) {
    InternalFrame out;
    double start = now_ms();
    if (auto pushed = push(encoder, source); !pushed) return tl::unexpected(pushed.error());
    out.encode_ms = now_ms() - start;
    out.info = encoder.last_frame();
    while (auto packet = encoder.pull()) {
        start = now_ms();
        const auto decoded = decoder.push(*packet);
        out.decode_ms += now_ms() - start;
        if (!decoded) return tl::unexpected(decoded.error());
    }
    return out;
}

}  // namespace

Result<double> quality_near_rate(const SourceFrames& source, double rate, int key_interval, unsigned threads) {
    double best = 50, smallest = std::numeric_limits<double>::infinity();
    for (double quality = 20; quality <= 95; quality += 5) {
        auto encoder = Encoder::create(internal_options(source.facts(), quality, key_interval, thread_count(threads)));
        if (!encoder) return tl::unexpected(encoder.error());
        LayerTotals sums;
        for (const std::size_t i : std::set<std::size_t>{0, source.size() / 2, source.size() - 1}) {
            const auto frame = source.frame(i);
            if (!frame) return tl::unexpected(frame.error());
            if (auto pushed = push(*encoder, **frame); !pushed) return tl::unexpected(pushed.error());
            while (encoder->pull()) {
            }
            if (encoder->last_frame().type == FrameType::enhanced || source.size() == 1)
                add(sums, encoder->last_frame());
        }
        const double found = app::bits_per_vertex(sums.bytes.total(), sums.source_vertices);
        if (std::abs(found - rate) >= smallest) break;  // rates rise with the quality
        smallest = std::abs(found - rate);
        best = quality;
    }
    return best;
}

Result<InternalRun> run_internals(const SourceFrames& source, double quality, int key_interval, unsigned threads) {
    InternalRun run;
    run.quality = quality;
    run.threads = thread_count(threads);
    const auto options = internal_options(source.facts(), quality, key_interval, run.threads);
    run.geometry_step = options.geometry_step;
    run.colour_step = options.colour_step;
    auto encoder = Encoder::create(options);
    if (!encoder) return tl::unexpected(encoder.error());
    DecoderOptions decoder_options;
    decoder_options.threads = run.threads;
    Decoder decoder(decoder_options);
    LayerTotals sums;
    std::map<std::string, std::size_t> places;
    std::size_t enhanced = 0;
    Progress progress("figures 21 to 25: layers and times", source.size());
    for (std::size_t i = 0; i < source.size(); ++i, progress.step()) {
        const auto frame = source.frame(i);
        if (!frame) return tl::unexpected(frame.error());
        const auto measured = run_frame(*encoder, decoder, **frame);
        if (!measured) return tl::unexpected(measured.error());
        run.frames.push_back(*measured);
        add(sums, measured->info);
        if (measured->info.type != FrameType::enhanced) continue;
        ++enhanced;
        for (const auto& [stage, milliseconds] : encoder->stage_times()) {
            const auto place = places.try_emplace(stage, run.stages.size()).first->second;
            if (place == run.stages.size()) run.stages.push_back({stage, 0});
            run.stages[place].milliseconds += milliseconds;
        }
        if (run.distance_order_counts.empty() || i <= source.size() / 2) {
            const auto& counts = encoder->distance_order_counts();
            run.distance_order_counts.assign(counts.begin(), counts.end());
            run.order_frame = i;
        }
    }
    for (auto& stage : run.stages) stage.milliseconds /= static_cast<double>(enhanced);
    run.bits_per_vertex = app::bits_per_vertex(sums.bytes.total(), sums.source_vertices);
    return run;
}

std::vector<double> layer_rates(const InternalRun& run, std::size_t (*bytes)(const LayerBytes&)) {
    std::vector<double> out;
    for (const auto& frame : run.frames)
        if (frame.info.type == FrameType::enhanced && frame.info.source_vertices > 0)
            out.push_back(app::bits_per_vertex(bytes(frame.info.bytes), frame.info.source_vertices));
    return out;
}

double mean_of(const std::vector<double>& values) {
    double sum = 0;
    for (const double value : values) sum += value;
    return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

}  // namespace htvm::lab
