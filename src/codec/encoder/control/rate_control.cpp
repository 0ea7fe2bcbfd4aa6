#include "codec/encoder/control/rate_control.h"

#include <algorithm>
#include <cmath>

#include "codec/encoder/control/rate_plan.h"
#include "codec/format/frame_kinds.h"

namespace htvm::internal {
namespace {

std::size_t index_of(FrameType type) { return static_cast<std::size_t>(type); }

// Number of frames seen of a class.
int seen_of(const FrameSizeModel& model, RateClass rate) {
    int seen = 0;
    for (const auto& rules : frame_rules)
        if (rules.rate == rate) seen += model.seen[index_of(rules.type)];
    return seen;
}

// How far the model follows a surprise: little for the usual noise, half for a jump, almost fully if the jump comes
// twice.
double belief(const FrameSizeModel& model, double surprise) {
    constexpr double jump = 0.35;
    const double last_surprise = model.last_surprise;
    if (std::abs(surprise) < jump) return model.usual_belief;
    return surprise * last_surprise > 0 && std::abs(last_surprise) >= jump ? 0.8 : 0.4;
}

// Learns the slope from neighbouring frames of a type, not from their levels: if the content changes, bits and quality
// move in opposite directions, and levels would teach the wrong slope. Steps that cannot come from a step of quality
// are ignored.
void learn_slope(FrameSizeModel& model, const FrameCost& before, const FrameCost& now) {
    const double step = now.quality - before.quality, change = std::log2(now.bits / before.bits);
    if (std::abs(step) < 1.5 || std::abs(change - model.slope * step) > 0.4 + 0.02 * std::abs(step)) return;
    model.slope_weight += step * step;
    model.slope_sum += step * change;
    model.slope = std::clamp(model.slope_sum / model.slope_weight, 0.01, 0.12);
}

RateControlOptions sane(RateControlOptions o) {
    const auto positive = [](double x, double otherwise) { return std::isfinite(x) && x > 0 ? x : otherwise; };
    o.bits_per_second = positive(o.bits_per_second, 8e6);
    o.frames_per_second = positive(o.frames_per_second, 30);
    o.buffer_seconds = std::max(positive(o.buffer_seconds, 1), 1 / o.frames_per_second);
    o.key_interval = std::max(o.key_interval, 1);
    o.highest_quality = std::max(o.highest_quality, o.lowest_quality);
    o.largest_step = positive(o.largest_step, 2);
    return o;
}

}  // namespace

double expected_bits(const FrameSizeModel& model, RateClass rate, double quality, double renewed) {
    if (rate == RateClass::moved) return model.moved_bits;
    const double between = std::exp2(model.content + model.slope * quality);
    const double intra = between * std::exp2(model.intra_extra);
    return rate == RateClass::intra ? intra : between + renewed * intra;
}

void learn(FrameSizeModel& model, const FrameCost& frame) {
    if (!(frame.bits > 0)) return;
    const bool first = model.seen[index_of(frame.type)]++ == 0;
    const auto rate = rules_of(frame.type).rate;
    if (rate == RateClass::moved) {
        model.moved_bits += (first ? 1 : 0.2) * (frame.bits - model.moved_bits);
        return;
    }
    const double surprise = std::log2(frame.bits / expected_bits(model, rate, frame.quality, frame.renewed));
    if (frame.renewed > 0) {
        // Patches differ: what one takes says less of the frames between than these do themselves.
        model.content += (first && seen_of(model, RateClass::between) == 1 ? 0.5 : model.usual_belief / 2) * surprise;
        return;
    }
    if (first) {
        const bool other = seen_of(model, rate == RateClass::intra ? RateClass::between : RateClass::intra) > 0;
        if (rate == RateClass::intra && other) {
            model.intra_extra += surprise;
        } else {
            model.content += surprise;
            if (other) model.intra_extra -= surprise;
        }
    } else {
        learn_slope(model, model.last[index_of(frame.type)], frame);
        // Turn the line about the present quality, where the sizes are known.
        const double again = std::log2(frame.bits / expected_bits(model, rate, frame.quality));
        const double believed = belief(model, again) * again;
        // From I-frames alone nobody can tell how much more they take than other frames.
        const bool compared = rate == RateClass::intra && seen_of(model, RateClass::between) > 0;
        model.content += compared ? believed / 2 : believed;
        if (compared) model.intra_extra += believed;
        model.last_surprise = again;
    }
    model.last[index_of(frame.type)] = frame;
}

RateController::RateController(const RateControlOptions& options, std::vector<FrameCost> first_pass)
    : options_(sane(options)), first_pass_(std::move(first_pass)) {
    follow_bitrate();
    level_ = (options_.lowest_quality + options_.highest_quality) / 2;
    model_.intra_extra = options_.intra_extra;
    // Before any frame is seen, assume as many I-frames as the key interval asks for.
    recent_.assign(static_cast<std::size_t>(std::clamp(options_.key_interval, 1, 1000)), RateClass::between);
    recent_[0] = RateClass::intra;
    if (first_pass_.empty()) return;
    for (auto& cost : first_pass_) cost.bits = std::isfinite(cost.bits) ? std::max(cost.bits, 0.0) : 0.0;
    // What the first pass taught has little weight against what this pass will teach.
    for (const auto& cost : first_pass_) learn(model_, cost);
    plan_slope_ = model_.slope;
    plan_ = plan_qualities(first_pass_, options_, plan_slope_);
    rest_.assign(first_pass_.size() + 1, {});
    for (std::size_t i = first_pass_.size(); i-- > 0;) {
        rest_[i] = rest_[i + 1];
        rest_[i][rules_of(first_pass_[i].type).rate == RateClass::moved ? 0 : 1] +=
            bits_at(first_pass_[i], plan_[i], plan_slope_);
    }
}

void RateController::follow_bitrate() {
    per_frame_ = options_.bits_per_second / options_.frames_per_second;
    capacity_ = options_.bits_per_second * options_.buffer_seconds;
    // With a large buffer there is no need to follow small changes.
    model_.usual_belief = std::clamp(3 * per_frame_ / capacity_, 0.05, 0.15);
}

void RateController::change_rate(double bits_per_second) {
    const double before = options_.bits_per_second;
    if (!std::isfinite(bits_per_second) || !(bits_per_second > 0) || bits_per_second == before) return;
    options_.bits_per_second = bits_per_second;
    follow_bitrate();
    plan_.clear();
    // A slower line has more waiting than it may have: dropping frames until that is gone would stop the picture, so
    // the line is taken to begin half full. What it did not carry before is not made up for.
    buffer_ = std::min(buffer_, capacity_ / 2);
    idle_bits_ = 0;
    level_ = std::clamp(level_ + std::log2(bits_per_second / before) / model_.slope, options_.lowest_quality,
                        options_.highest_quality);
    hurries_ = static_cast<int>(std::ceil(options_.frames_per_second / 2));
}

double RateController::room() const { return capacity_ - buffer_; }

bool RateController::is_guess(FrameType type) const {
    const auto rate = rules_of(type).rate;
    return rate != RateClass::moved && first_pass_.empty() &&
           (frames_ == 0 || (rate == RateClass::between && !sent_between_));
}

double RateController::quality(FrameType type) const {
    double q = frames_ < plan_.size() ? planned_quality() : live_quality(type);
    const auto rate = rules_of(type).rate;
    if (rate != RateClass::moved) {
        const double most = 0.9 * room(), expected = expected_bits(model_, rate, q);
        const bool known = seen_of(model_, RateClass::intra) + seen_of(model_, RateClass::between) > 0;
        if (known && expected > most) q -= std::log2(expected / std::max(most, 1.0)) / model_.slope;
    }
    return std::clamp(q, options_.lowest_quality, options_.highest_quality);
}

// The bits the line carries, plus what makes up for those that frames so far took too much, or too little. Of an
// I-frame only the part counts that should have been made up for by now, since quality is chosen for the usual mixture
// of types.
double RateController::wanted_bits() const {
    const double frames = capacity_ / per_frame_, horizon = std::clamp(frames, 4.0, 15.0);
    const double phase = 1 - static_cast<double>(since_intra_) / options_.key_interval;
    const double of_intra = std::max(0.0, expected_bits(model_, RateClass::intra, level_) - per_frame_);
    const double excused = since_intra_ > 0 ? of_intra * std::max(0.0, phase) : 0;
    // More than half a buffer below the target is not made up for: that would be a burst.
    const double behind = std::max(buffer_ - idle_bits_ - excused, -capacity_ / 2);
    return std::clamp(per_frame_ - behind / horizon, per_frame_ / 4, per_frame_ * 1.5);
}

double RateController::live_quality(FrameType type) const {
    const double wanted = wanted_bits();
    const auto average = [&](double q) {
        double bits = 0;
        for (const auto rate : recent_) bits += expected_bits(model_, rate, q, renewed_);
        return bits / static_cast<double>(recent_.size());
    };
    double low = options_.lowest_quality, high = options_.highest_quality;
    if (average(high) <= wanted) low = high;
    for (int i = 0; i < 20; ++i) {
        const double middle = (low + high) / 2;
        (average(middle) <= wanted ? low : high) = middle;
    }
    // Little is known during the first frames, so quality may change by more.
    const int seen = seen_of(model_, RateClass::between) + seen_of(model_, RateClass::intra);
    if (is_guess(type)) return low;
    // At an I-frame and the frame after it, quality can change without extra cost.
    const bool free = since_intra_ == 1 || rules_of(type).rate == RateClass::intra;
    const double usual = options_.largest_step * (hurries_ > 0 ? 4 : 1) / (free ? 2 : 1);
    const double change = low - level_, step = std::max(usual, 20.0 / seen);
    if (std::abs(change) < (free ? 0.5 : options_.stay)) return level_;
    return level_ + std::clamp(change, -step, step);
}

double RateController::planned_bits(std::size_t frame, double correction) const {
    const auto& cost = first_pass_[frame];
    const double bits = bits_at(cost, plan_[frame], plan_slope_);
    return rules_of(cost.type).rate == RateClass::moved
               ? bits
               : bits * std::exp2(planned_surprise_ + model_.slope * correction);
}

// The correction with which the rest of the sequence spends the remaining bits. The last frames make up only for what
// would leave the whole sequence off by more than a hundredth: few as they are, their quality would jump.
double RateController::remaining_correction() const {
    const auto& rest = rest_[frames_];
    if (!(rest[1] > 0)) return correction_;
    const double left = per_frame_ * static_cast<double>(plan_.size()) - total_bits_ - rest[0];
    const double expected = rest[1] * std::exp2(planned_surprise_ + model_.slope * correction_);
    const double tolerated = frames_ + 10 <= plan_.size() ? 0 : 0.01 * per_frame_ * static_cast<double>(plan_.size());
    const double amiss = left - expected;
    const double wanted = expected + amiss - std::clamp(amiss, -tolerated, tolerated);
    const double ratio = std::clamp(wanted / rest[1], 1e-3, 1e3);
    const double range = options_.highest_quality - options_.lowest_quality;
    return std::clamp((std::log2(ratio) - planned_surprise_) / model_.slope, -range, range);
}

// The highest level of the buffer in the next frames.
double RateController::peak_of_plan(double correction) const {
    constexpr std::size_t farthest = 300;
    double buffer = buffer_, highest = 0;
    for (std::size_t i = frames_; i < std::min(plan_.size(), frames_ + farthest); ++i) {
        buffer += planned_bits(i, correction);
        highest = std::max(highest, buffer);
        buffer = std::max(0.0, buffer - per_frame_);
    }
    return highest;
}

double RateController::planned_quality() const {
    double high = correction_;
    if (peak_of_plan(high) > 0.95 * capacity_) {
        double low = high - (options_.highest_quality - options_.lowest_quality);
        for (int i = 0; i < 12; ++i) {
            const double middle = (low + high) / 2;
            (peak_of_plan(middle) > 0.95 * capacity_ ? high : low) = middle;
        }
        high = low;
    }
    return plan_[frames_] + high;
}

double RateController::lower_quality(FrameType type, double quality, double bits) {
    // From the model, with a margin of a tenth; at least a step that doubles from call to call.
    const double range = options_.highest_quality - options_.lowest_quality;
    const double least = range / 20 * std::exp2(calls_++);
    const double excess = bits > 0 ? std::log2(bits / std::max(room(), 1.0)) + 0.15 : 0;
    const double needed = rules_of(type).rate == RateClass::moved ? 0 : excess / model_.slope;
    if (calls_ >= 5) return options_.lowest_quality;
    return std::max(options_.lowest_quality, quality - std::max(least, needed));
}

void RateController::coded(const FrameCost& frame) {
    const auto [type, quality, given, renewed] = frame;
    const double bits = std::isfinite(given) ? std::max(given, 0.0) : 0.0;
    // An I-frame that was cut to fit does not lower the quality of the EP-frames after it.
    const auto rate = rules_of(type).rate;
    const bool between = rate == RateClass::between;
    if (between || !sent_between_) level_ = quality;
    sent_between_ = sent_between_ || between;
    if (rate == RateClass::intra && std::abs(quality - level_) <= options_.largest_step) level_ = quality;
    if (frames_ < plan_.size() && type == first_pass_[frames_].type && rate != RateClass::moved && bits > 0) {
        const double planned = planned_bits(frames_, quality - plan_[frames_]);
        if (planned > 0)
            planned_surprise_ += std::max(0.05, 1.0 / static_cast<double>(frames_ + 5)) * std::log2(bits / planned);
    }
    learn(model_, {type, quality, bits, renewed});
    if (between) renewed_ += (renewed - renewed_) / 30;
    recent_[frames_ % recent_.size()] = rate;
    since_intra_ = rate == RateClass::intra ? 1 : since_intra_ + (since_intra_ > 0 ? 1 : 0);
    total_bits_ += bits;
    buffer_ += bits;
    idle_bits_ += std::max(0.0, per_frame_ - buffer_);
    buffer_ = std::max(0.0, buffer_ - per_frame_);
    ++frames_;
    calls_ = 0;
    hurries_ = std::max(0, hurries_ - 1);
    if (frames_ < plan_.size()) correct_plan(rate);
}

void RateController::correct_plan(RateClass rate) {
    const double change = remaining_correction() - correction_;
    if (std::abs(change) < (rate == RateClass::intra ? options_.stay / 4 : options_.stay)) return;
    const double step = frames_ < 15 ? 4 * options_.largest_step : options_.largest_step;
    correction_ += std::clamp(change, -step, step);
}

}  // namespace htvm::internal
