#include "rate_report.h"

#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "rate_passes.h"

namespace htvm::app {

// ---- The receiver's buffer ------------------------------------------------------------------------------------------

BufferModel::BufferModel(double bits_per_second, double buffer_seconds)
    : bits_per_second_(bits_per_second), capacity_(bits_per_second * buffer_seconds) {}

void BufferModel::add(const Packet& packet) {
    if (packet.kind == PacketKind::index) return;
    if (last_us_ && packet.timestamp_us > *last_us_) {
        const double elapsed = static_cast<double>(packet.timestamp_us - *last_us_) / 1e6;
        held_ = std::max(0.0, held_ - bits_per_second_ * elapsed);
    }
    if (!last_us_ || packet.timestamp_us > *last_us_) last_us_ = packet.timestamp_us;
    held_ += 8.0 * static_cast<double>(packet.payload.size() + packet_overhead);
    if (held_ > peak_) peak_ = held_, peak_frame_ = packet.frame;
    // Timestamps are whole microseconds: rounding may have lost two since the buffer was last empty.
    if (!overflows_ && held_ > capacity_ + 2e-6 * bits_per_second_) overflows_ = true, first_overflow_ = packet.frame;
}

// ---- The outcome of a bitrate or a target error ---------------------------------------------------------------------

namespace {

double rate_of(std::uint64_t bytes, double seconds) {
    return seconds > 0 ? 8.0 * static_cast<double>(bytes) / seconds : 0;
}

double error_percent(const RateReport& report, std::uint64_t bytes, double seconds) {
    return 100 * (rate_of(bytes, seconds) / report.bits_per_second - 1);
}

// About the frames that miss a target error because quality is at an end of its range.
std::string beyond_reach(const RateReport& report) {
    const auto coded = [&](auto test) {
        return std::count_if(report.costs.begin(), report.costs.end(), [&](const FrameCost& cost) {
            return cost.type != FrameType::predicted && test(cost.quality);
        });
    };
    const auto finest = coded([](double quality) { return quality >= 100; });
    const auto coarsest = coded([](double quality) { return quality <= 0; });
    std::string out;
    if (finest > 0) out += fmt::format("; {} frames have the finest quality and may still err more", finest);
    if (coarsest > 0) out += fmt::format("; {} frames have the coarsest quality and err less", coarsest);
    return out;
}

}  // namespace

RateReport::RateReport(const EncoderOptions& options)
    : bits_per_second(options.rate.bits_per_second),
      buffer_seconds(options.rate.bits_per_second > 0 ? options.rate.buffer_seconds : 0),
      target_error(options.rate.target_error),
      buffer(options.rate.bits_per_second > 0 ? options.rate.bits_per_second : 1, options.rate.buffer_seconds),
      moved_by_choice(options.profile != Profile::tracked &&
                      (options.topology.frame_choice == FrameChoice::motion ||
                       options.topology.frame_choice == FrameChoice::rate_distortion)) {}

void add_coded(RateReport& report, const FrameCost& cost) { report.costs.push_back(cost); }

void add_dropped(RateReport& report) {
    report.dropped.push_back(report.costs.size());
    report.costs.push_back({FrameType::predicted, 0, 0});
}

QualityRange quality_range(const RateReport& report) {
    QualityRange out;
    std::size_t count = 0;
    for (const auto& cost : report.costs) {
        if (cost.type == FrameType::predicted) continue;
        out.lowest = count == 0 ? cost.quality : std::min(out.lowest, cost.quality);
        out.highest = count == 0 ? cost.quality : std::max(out.highest, cost.quality);
        out.mean += cost.quality;
        ++count;
    }
    if (count > 0) out.mean /= static_cast<double>(count);
    return out;
}

RateStrain rate_strain(const RateReport& report) {
    RateStrain out;
    if (!report.rate_controlled()) return out;
    for (const auto& cost : report.costs) {
        const bool moved = cost.type == FrameType::predicted;
        if (!moved && cost.quality <= 0) ++out.lowest_quality;
        if (moved && cost.bits > 0 && !report.moved_by_choice) ++out.moved_alone;
    }
    out.dropped = report.dropped.size();
    return out;
}

std::string rate_warning(const RateReport& report) {
    const auto strain = rate_strain(report);
    if (!strain.any() || report.line_was_slower) return {};
    std::string what;
    const auto add = [&](std::size_t frames, const char* how) {
        if (frames > 0) what += fmt::format("{}{} {}", what.empty() ? "" : ", ", frames, how);
    };
    add(strain.lowest_quality, "at the lowest quality");
    add(strain.moved_alone, "as motion alone");
    add(strain.dropped, "dropped");
    return fmt::format("{:g} Mbit/s is little for this capture: of {} frames {}; a higher --bitrate{} helps",
                       report.bits_per_second / 1e6, report.costs.size(), what,
                       strain.moved_alone + strain.dropped > 0 ? " or a larger --buffer" : "");
}

std::string missed_rate(const RateReport& report, std::uint64_t bytes, double seconds) {
    const double most = report.is_shared ? 100 * rate_tolerance : 100.0 / 3;
    if (!report.rate_controlled() || !report.dropped.empty() || report.line_was_slower) return {};
    const double error = error_percent(report, bytes, seconds);
    if (report.is_shared && error < -most && !report.is_finest)
        return fmt::format(
            "takes {:.2f} Mbit/s, {:.0f} % below its --bitrate, which its meshes and pictures did not "
            "find how to use: give -q in its place, or a larger --buffer",
            rate_of(bytes, seconds) / 1e6, -error);
    if (error <= most) return {};
    return fmt::format("takes {:.2f} Mbit/s, {:.0f} % above its --bitrate: give at least that, or fewer vertices",
                       rate_of(bytes, seconds) / 1e6, error);
}

std::string rate_summary(const RateReport& report, std::uint64_t bytes, double seconds) {
    const auto quality = quality_range(report);
    const std::string qualities =
        fmt::format("quality {:.1f} to {:.1f}, {:.1f} on average", quality.lowest, quality.highest, quality.mean);
    if (!report.rate_controlled())
        return fmt::format("target error {:g} mm: {}{} (htvm compare --only m2 measures the errors)",
                           report.target_error, qualities, beyond_reach(report));
    std::string out = fmt::format("target {:g} Mbit/s: {:+.1f} %; buffer of {:g} s at most {:.0f} % full; {}",
                                  report.bits_per_second / 1e6, error_percent(report, bytes, seconds),
                                  report.buffer_seconds, report.buffer.peak_percent(), qualities);
    if (quality.lowest >= 100) out += ", the highest there is";
    if (report.line_was_slower) out += "; less than asked for, since the line did not carry it";
    if (!report.dropped.empty())
        out += fmt::format("; {} of {} frames dropped", report.dropped.size(), report.costs.size());
    return out;
}

nlohmann::json rate_json(const RateReport& report, std::uint64_t bytes, double seconds) {
    const auto quality = quality_range(report);
    nlohmann::json out = {
        {"quality", {{"lowest", quality.lowest}, {"mean", quality.mean}, {"highest", quality.highest}}}};
    if (!report.rate_controlled()) {
        out["target_error_mm"] = report.target_error;
        return out;
    }
    out["target_megabits_per_second"] = report.bits_per_second / 1e6;
    out["megabits_per_second"] = rate_of(bytes, seconds) / 1e6;
    out["error_percent"] = error_percent(report, bytes, seconds);
    out["buffer_seconds"] = report.buffer_seconds;
    out["buffer_peak_percent"] = report.buffer.peak_percent();
    const auto strain = rate_strain(report);
    out["line_was_slower"] = report.line_was_slower;
    out["lowest_quality_frames"] = strain.lowest_quality;
    out["moved_alone_frames"] = strain.moved_alone;
    out["dropped_frames"] = report.dropped;
    return out;
}

}  // namespace htvm::app
