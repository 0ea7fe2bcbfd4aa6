#include "experiments.h"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <set>

#include "codec/bones/animated_frame.h"
#include "codec/bones/codebook.h"
#include "codec/bones/enhanced_frame.h"
#include "codec/bones/zipper.h"
#include "codec/format/sequence.h"
#include "codec/intra/intra_frame.h"
#include "codec/reference/transforms.h"
#include "command_line/layer_table.h"
#include "command_line/terminal.h"
#include "core/parallel.h"
#include "core/thread.h"
#include "htvm/decoder.hpp"
#include "htvm/encoder.hpp"
#include "synth/random.h"

namespace htvm::lab {

using namespace app;
using namespace internal;

// ---- Sweeps ---------------------------------------------------------------------------------------------------------

namespace {

CoderUnderTest coder_named(const std::string& name, int key_interval) {
    const auto all = built_in_coders(key_interval);
    for (const auto& coder : all)
        if (coder.name == name) return coder;
    return all.front();
}

Trial trial_at(const CoderUnderTest& coder, double quality) {
    const auto steps = quality_point(quality);
    return {coder, steps.geometry_step, steps.colour_step, quality};
}

std::string metrics_key(const CompareOptions& o) {
    return fmt::format("{}{}{} samples {}", o.points ? "m1 " : "", o.surface ? "m2 " : "", o.pictures ? "m3 " : "",
                       o.surface_options.samples);
}

bool contains(const std::vector<double>& list, double value) {
    return std::find(list.begin(), list.end(), value) != list.end();
}

// Runs the missing trials; results go to their places in `points`.
Result<void> run_missing(const Laboratory& laboratory, const std::string& name, const std::vector<Trial>& trials,
                         const SweepOptions& options, const std::vector<std::string>& names,
                         const std::vector<std::string>& keys, std::vector<std::optional<RdPoint>>& points) {
    std::vector<SweepJob> jobs;
    std::vector<std::size_t> places;
    for (std::size_t i = 0; i < trials.size(); ++i) {
        if (points[i]) continue;
        SweepJob job;
        job.coder = &trials[i].coder;
        job.quality.quality = trials[i].quality;
        job.quality.geometry_step = trials[i].geometry_step;
        job.quality.colour_step = trials[i].colour_step;
        job.quality.working_folder = laboratory.work_folder;
        jobs.push_back(job);
        places.push_back(i);
    }
    if (jobs.empty()) return {};
    std::vector<std::string> failures;
    Progress progress(name, jobs.size() * laboratory.source->size());
    sweep(
        jobs, *laboratory.source, options,
        [&](std::size_t i, Result<RdPoint> result) {
            if (!result) {
                failures.push_back(result.error().message);
                return;
            }
            const auto place = places[i];
            if (auto kept = laboratory.cache.keep(names[place], keys[place], *result); !kept)
                warn(kept.error().message);
            points[place] = std::move(*result);
        },
        [&] { progress.step(); });
    for (const auto& failure : failures) warn(failure);
    if (failures.size() == trials.size()) return fail(ErrorKind::bad_input, name + ": " + failures.front());
    return {};
}

}  // namespace

Result<std::vector<RdPoint>> measure_trials(const Laboratory& laboratory, const std::string& name,
                                            const std::vector<Trial>& trials, const SweepOptions& options) {
    std::vector<std::string> names, keys;
    std::vector<std::optional<RdPoint>> points;
    for (const auto& trial : trials) {
        names.push_back(fmt::format("{}_{:g}_{:g}", trial.coder.name, trial.geometry_step, trial.colour_step));
        keys.push_back(fmt::format("{}; {}every {}; {}: {}; steps {} {}", laboratory.common_key,
                                   metrics_key(options.compare), options.measure_every, trial.coder.name,
                                   trial.coder.settings, trial.geometry_step, trial.colour_step));
        points.push_back(laboratory.cache.find(names.back(), keys.back()));
    }
    if (auto ran = run_missing(laboratory, name, trials, options, names, keys, points); !ran)
        return tl::unexpected(ran.error());
    std::vector<RdPoint> out;
    for (auto& point : points)
        if (point) out.push_back(std::move(*point));
    return out;
}

CoderUnderTest without_colours(CoderUnderTest coder) {
    coder.settings += ", no colours";
    coder.start = [start = coder.start](const SequenceFacts& facts, const QualityPoint& quality) -> Result<FrameCoder> {
        auto inner = start(facts, quality);
        if (!inner) return inner;
        return FrameCoder([code = std::move(*inner)](const SourceFrame& frame) {
            SourceFrame bare = frame;
            bare.mesh.colours.clear();
            return code(bare);
        });
    };
    return coder;
}

CoderUnderTest with_poses(CoderUnderTest coder, std::vector<Pose> poses, const std::string& label) {
    coder.settings += ", poses: " + label;
    const auto shared = std::make_shared<const std::vector<Pose>>(std::move(poses));
    coder.start = [start = coder.start, shared](const SequenceFacts& facts,
                                                const QualityPoint& quality) -> Result<FrameCoder> {
        auto inner = start(facts, quality);
        if (!inner) return inner;
        return FrameCoder([code = std::move(*inner), shared](const SourceFrame& frame) {
            SourceFrame posed = frame;
            if (frame.index < shared->size()) posed.pose = (*shared)[frame.index];
            return code(posed);
        });
    };
    return coder;
}

Pose noisy_pose(Pose pose, double power, std::uint64_t seed, std::size_t frame) {
    const auto key = synth::derive_key(synth::derive_key({seed}, 0x5ce1e704), frame);
    const double deviation = std::sqrt(std::max(power, 0.0));
    std::uint64_t index = 0;
    for (auto& joint : pose.joints)
        for (auto& coordinate : joint) coordinate += deviation * synth::random_gaussian(key, index++);
    pose.orientations.clear();
    return pose;
}

std::size_t measure_every(std::size_t frames, std::size_t most) {
    return std::max<std::size_t>(1, (frames + most - 1) / std::max<std::size_t>(most, 1));
}

std::vector<Trial> geometry_trials(const ExperimentPlan& plan) {
    std::vector<Trial> out;
    for (const auto& name : plan.coders)
        for (const double quality : plan.qualities)
            out.push_back(trial_at(without_colours(coder_named(name, plan.key_interval)), quality));
    return out;
}

std::vector<Trial> interval_trials(const ExperimentPlan& plan) {
    std::vector<Trial> out;
    for (const double quality : plan.interval_qualities)
        for (const int interval : plan.intervals)
            out.push_back(trial_at(without_colours(coder_named("paper", interval)), quality));
    return out;
}

std::vector<Trial> colour_trials(const ExperimentPlan& plan) {
    std::vector<Trial> out;
    for (const char* name : {"paper", "tfan", "draco10"})
        for (const double geometry : plan.geometry_steps)
            for (const double colour : plan.colour_steps)
                if (contains(plan.colour_columns, colour) || contains(plan.geometry_rows, geometry))
                    out.push_back({coder_named(name, plan.key_interval), geometry, colour});
    return out;
}

std::vector<Trial> picture_trials(const ExperimentPlan& plan) {
    std::vector<Trial> out;
    for (const char* name : {"paper", "tfan", "draco10"})
        for (const double geometry : plan.geometry_steps)
            out.push_back({coder_named(name, plan.key_interval), geometry, plan.picture_colour_step});
    return out;
}

std::vector<Trial> noise_trials(const ExperimentPlan& plan, const std::vector<Pose>& poses, double power) {
    std::vector<Pose> noisy;
    for (std::size_t i = 0; i < poses.size(); ++i) noisy.push_back(noisy_pose(poses[i], power, 20, i));
    const auto coder = with_poses(without_colours(coder_named("paper", plan.key_interval)), std::move(noisy),
                                  fmt::format("noise of {:g} mm^2", power));
    std::vector<Trial> out;
    for (const double quality : plan.noise_qualities) out.push_back(trial_at(coder, quality));
    return out;
}

// ---- Thresholds on the skeleton's motion, and the coders that use them (figures 7 and 17 to 19) ---------------------

namespace {

// Two digits, so that a threshold is easy to read and type.
double rounded(double value) {
    if (!(value > 0)) return 0;
    const double unit = std::pow(10, std::floor(std::log10(value)) - 1);
    return std::round(value / unit) * unit;
}

// At equal steps between the quantiles `low` and `high` of the values, without repeats.
std::vector<double> quantiles(const std::vector<double>& values, double low, double high, int count) {
    std::vector<double> out;
    for (int i = 0; i < count; ++i) {
        const double part = count == 1 ? (low + high) / 2 : low + (high - low) * i / (count - 1);
        const double threshold = rounded(quantile(values, part));
        if (threshold > 0 && (out.empty() || threshold > out.back())) out.push_back(threshold);
    }
    return out;
}

CoderUnderTest labelled(const EncoderOptions& options, const std::string& label) {
    auto coder = codec_under_test("paper", "the paper's coder, " + label, options);
    coder.describe_quality = [label](const SequenceFacts&, const QualityPoint&) { return label; };
    return coder;
}

Trial trial_of(const CoderUnderTest& coder, double quality) {
    const auto steps = quality_point(quality);
    return {coder, steps.geometry_step, steps.colour_step, quality};
}

}  // namespace

std::vector<double> bone_motion(const Skeleton& skeleton, const Pose& reference, const Pose& pose) {
    std::vector<double> out;
    for (const auto& bone : skeleton.bones) {
        double squares = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const double shift = (pose.joints[bone.first][k] + pose.joints[bone.second][k] -
                                  reference.joints[bone.first][k] - reference.joints[bone.second][k]) /
                                 2;
            squares += shift * shift;
        }
        out.push_back(std::sqrt(squares));
    }
    return out;
}

double skeletal_motion(const Skeleton& skeleton, const Pose& reference, const Pose& pose) {
    const auto motion = bone_motion(skeleton, reference, pose);
    return std::accumulate(motion.begin(), motion.end(), 0.0);
}

double quantile(std::vector<double> values, double part) {
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    const double place = std::clamp(part, 0.0, 1.0) * static_cast<double>(values.size() - 1);
    const auto low = static_cast<std::size_t>(place);
    const std::size_t high = std::min(low + 1, values.size() - 1);
    return values[low] + (place - static_cast<double>(low)) * (values[high] - values[low]);
}

double share_of_intra(const Skeleton& skeleton, std::span<const Pose> poses, double intra_above) {
    if (poses.empty()) return 0;
    std::size_t last = 0, count = 1;
    for (std::size_t i = 1; i < poses.size(); ++i) {
        if (skeletal_motion(skeleton, poses[last], poses[i]) <= intra_above) continue;
        last = i;
        ++count;
    }
    return static_cast<double>(count) / static_cast<double>(poses.size());
}

std::optional<MotionThresholds> motion_thresholds(const Skeleton& skeleton, std::span<const Pose> poses,
                                                  int key_interval, int count) {
    if (skeleton.bones.empty() || key_interval < 2) return std::nullopt;
    std::vector<double> of_bones, of_skeleton;
    for (std::size_t i = 0; i < poses.size(); ++i) {
        const auto reference = i / static_cast<std::size_t>(key_interval) * static_cast<std::size_t>(key_interval);
        if (i == reference) continue;
        const auto motion = bone_motion(skeleton, poses[reference], poses[i]);
        of_bones.insert(of_bones.end(), motion.begin(), motion.end());
        of_skeleton.push_back(std::accumulate(motion.begin(), motion.end(), 0.0));
    }
    MotionThresholds out;
    out.still_below = quantiles(of_bones, 0.15, 0.8, count);
    out.predicted_below = quantiles(of_skeleton, 0.1, 0.9, count);
    out.intra_above = quantiles(of_skeleton, 0, 0.9, count);
    if (out.still_below.empty() || out.predicted_below.empty() || out.intra_above.empty()) return std::nullopt;
    out.still_below.insert(out.still_below.begin(), 0);
    out.predicted_below.insert(out.predicted_below.begin(), 0);
    out.share_at_400 = share_of_intra(skeleton, poses, 400);
    out.share_at_500 = share_of_intra(skeleton, poses, 500);
    return out;
}

std::string threshold_words(const char* what, double millimetres) {
    return fmt::format("{} {:g} mm", what, millimetres);
}

std::vector<std::pair<double, const RdPoint*>> by_threshold(std::span<const RdPoint> points, const char* what,
                                                            std::span<const double> thresholds) {
    std::vector<std::pair<double, const RdPoint*>> out;
    for (const double threshold : thresholds)
        for (const auto& point : points)
            if (point.setting == threshold_words(what, threshold)) out.emplace_back(threshold, &point);
    return out;
}

CoderUnderTest motion_coder(int key_interval, double still_below) {
    auto options = paper_options(key_interval);
    options.topology.still_below = still_below;
    options.topology.animation_error = 0;
    return labelled(options, threshold_words(still_below_words, still_below));
}

std::vector<Trial> motion_trials(const ExperimentPlan& plan, const MotionThresholds& thresholds) {
    std::vector<Trial> out;
    for (const double threshold : thresholds.still_below)
        out.push_back({motion_coder(plan.key_interval, threshold), plan.motion_step, plan.picture_colour_step});
    return out;
}

std::vector<Trial> intra_choice_trials(const ExperimentPlan& plan, const MotionThresholds& thresholds) {
    std::vector<Trial> out;
    for (const double quality : plan.interval_qualities) {
        for (const double threshold : thresholds.intra_above) {
            // Only the threshold decides.
            auto options = paper_options(1000000);
            options.topology.frame_choice = FrameChoice::motion;
            options.topology.intra_above = threshold;
            options.topology.scene_changes = false;
            out.push_back(
                trial_of(without_colours(labelled(options, threshold_words(intra_above_words, threshold))), quality));
        }
    }
    return out;
}

std::vector<Trial> predicted_trials(const ExperimentPlan& plan, const MotionThresholds& thresholds, bool checked) {
    std::vector<Trial> out;
    for (const bool check : {false, true}) {
        if (check && !checked) continue;
        for (const double threshold : thresholds.predicted_below) {
            auto options = paper_options(plan.key_interval);
            options.topology.frame_choice = FrameChoice::motion;
            options.topology.predicted_below = threshold;
            if (!check) options.topology.animation_error = 0;
            const auto label = threshold_words(check ? checked_words : predicted_below_words, threshold);
            out.push_back(trial_of(without_colours(labelled(options, label)), plan.predicted_quality));
        }
    }
    return out;
}

// ---- One run of the paper's coder, looked into (figures 21 to 25) ---------------------------------------------------

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
        const auto decoded = decoder.decode_copy(*packet);
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
        if (std::abs(found - rate) >= smallest) break;  // rates rise with quality
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

// ---- Motion-coded frames taken apart (figure 19) --------------------------------------------------------------------

namespace {

// The state that a decoder keeps between frames, accessible.
struct OpenDecoder {
    std::optional<SequenceHeader> header;
    std::optional<ReferenceMesh> reference;
    std::optional<NumberedCodebook> geometry_codebook, colour_codebook;
    Threads threads = {};
};

const Codebook* book_of(const std::optional<NumberedCodebook>& codebook) {
    return codebook ? &codebook->codebook : nullptr;
}

Result<void> keep_intra(OpenDecoder& decoder, const Packet& packet) {
    const auto payload = read_frame_payload(packet.payload);
    if (!payload) return tl::unexpected(payload.error());
    const auto& header = *decoder.header;
    const auto pose =
        decode_pose(payload->of(Layer::pose), header.skeleton.joint_names.size(), header.skeleton.bones.size());
    if (!pose) return tl::unexpected(pose.error());
    auto mesh = decode_intra_frame(*payload, nullptr);
    if (!mesh) return tl::unexpected(mesh.error());
    decoder.reference = make_reference(std::move(*mesh), header.skeleton.bones, pose->joints, pose->orientations,
                                       header.radii, header.weight_width, packet.frame, decoder.threads);
    return {};
}

Result<void> keep_codebook(OpenDecoder& decoder, const Packet& packet) {
    auto codebook = read_codebook_payload(packet.payload);
    if (!codebook) return tl::unexpected(codebook.error());
    (codebook->purpose == codebook_for_geometry ? decoder.geometry_codebook : decoder.colour_codebook) =
        std::move(*codebook);
    return {};
}

// The coded part, then the animated triangles that are wanted (one flag each).
Mesh joined(const LatticeMesh& coded, const LatticeMesh& animated, const std::vector<std::uint8_t>& wanted,
            const Lattice& lattice) {
    Mesh out = to_mesh(coded, lattice);
    const Mesh rest = to_mesh(animated, lattice);
    const auto first = static_cast<std::uint32_t>(out.positions.size());
    out.positions.insert(out.positions.end(), rest.positions.begin(), rest.positions.end());
    out.colours.insert(out.colours.end(), rest.colours.begin(), rest.colours.end());
    out.normals.clear();
    out.texcoords.clear();
    for (std::size_t t = 0; t < wanted.size(); ++t)
        if (wanted[t])
            out.triangles.push_back(
                {rest.triangles[t][0] + first, rest.triangles[t][1] + first, rest.triangles[t][2] + first});
    return out;
}

// The coded part of a zippered mesh, which comes first in it.
LatticeMesh coded_part(const LatticeMesh& zippered, const FrameHeader& header) {
    LatticeMesh out;
    out.positions.assign(zippered.positions.begin(), zippered.positions.begin() + header.vertices);
    if (!zippered.colours.empty())
        out.colours.assign(zippered.colours.begin(), zippered.colours.begin() + header.vertices);
    out.triangles.assign(zippered.triangles.begin(), zippered.triangles.begin() + header.triangles);
    return out;
}

// Nothing if the frame is coded as a whole.
Result<std::optional<SeamStages>> take_apart(const OpenDecoder& decoder, const Packet& packet) {
    const auto payload = read_frame_payload(packet.payload);
    if (!payload) return tl::unexpected(payload.error());
    if (!payload->has(Layer::coded_bones)) return std::optional<SeamStages>();
    const auto& reference = *decoder.reference;
    const auto& lattice = decoder.header->lattice;
    auto decoded = decode_enhanced_frame(
        *payload, {reference, book_of(decoder.geometry_codebook), book_of(decoder.colour_codebook),
                   decoder.header->nearest_vertices, decoder.threads});
    if (!decoded) return tl::unexpected(decoded.error());
    const auto bones = read_coded_bones(payload->of(Layer::coded_bones), reference.pivots.size());
    if (!bones) return tl::unexpected(bones.error());
    const auto still = still_vertices(reference, *bones);
    const auto animated =
        animate(reference, decoded->transforms, predict_positions(reference, decoded->transforms, decoder.threads));
    const auto coded = coded_part(decoded->mesh, payload->header);
    std::vector<std::uint8_t> touching;
    for (const auto& t : animated.triangles) touching.push_back(still[t[0]] || still[t[1]] || still[t[2]] ? 1 : 0);
    const auto kept = kept_by_zippering(coded, animated, still, decoder.threads);
    SeamStages out;
    out.frame = packet.frame;
    out.coded_triangles = coded.triangles.size();
    out.animated = to_mesh(animated, lattice);
    out.overlapping = joined(coded, animated, touching, lattice);
    out.trimmed = joined(coded, animated, kept, lattice);
    out.kept_end = out.trimmed.triangles.size();
    out.zippered = to_mesh(decoded->mesh, lattice);
    return std::optional<SeamStages>(std::move(out));
}

Result<std::optional<SeamStages>> stages_of(OpenDecoder& decoder, const Packet& packet) {
    Result<void> taken;
    if (packet.kind == PacketKind::sequence) {
        auto header = read_sequence_header(packet.payload);
        if (!header) return tl::unexpected(header.error());
        decoder.header = std::move(*header);
    } else if (packet.kind == PacketKind::intra) {
        taken = keep_intra(decoder, packet);
    } else if (packet.kind == PacketKind::codebook) {
        taken = keep_codebook(decoder, packet);
    } else if (packet.kind == PacketKind::enhanced) {
        return take_apart(decoder, packet);
    }
    if (!taken) return tl::unexpected(taken.error());
    return std::optional<SeamStages>();
}

}  // namespace

Result<std::vector<SeamStages>> code_in_stages(const std::vector<std::shared_ptr<const SourceFrame>>& frames,
                                               const SequenceFacts& facts, const EncoderOptions& options) {
    auto all = options;
    all.key_interval = 1000000;
    all.topology.scene_changes = false;
    all.skeleton = facts.skeleton;
    all.radii = facts.radii;
    auto encoder = Encoder::create(all);
    if (!encoder) return tl::unexpected(encoder.error());
    const ThreadPool pool(options.threads, options.runner);
    OpenDecoder decoder;
    decoder.threads = pool.threads();
    std::vector<SeamStages> out;
    for (const auto& frame : frames) {
        const auto pushed = encoder->push(frame->mesh, frame->pose ? &*frame->pose : nullptr, frame->timestamp_us);
        if (!pushed) return tl::unexpected(pushed.error());
        while (auto packet = encoder->pull()) {
            auto stages = stages_of(decoder, *packet);
            if (!stages) return tl::unexpected(stages.error());
            if (!*stages) continue;
            (*stages)->frame = frame->index;
            out.push_back(std::move(**stages));
        }
    }
    return out;
}

Result<SeamCounts> count_seams(const Mesh& original, const SeamStages& stages, unsigned threads) {
    TopologyMeasureOptions options;
    options.crack_width = 2 * internal::mean_edge(original.positions, original.triangles);
    SeamCounts out;
    out.frame = stages.frame;
    const std::pair<const Mesh*, Topology*> meshes[] = {{&original, &out.original},
                                                        {&stages.animated, &out.animated},
                                                        {&stages.overlapping, &out.overlapping},
                                                        {&stages.trimmed, &out.trimmed},
                                                        {&stages.zippered, &out.zippered}};
    const ThreadPool pool(threads);
    for (const auto& [mesh, counts] : meshes) {
        auto counted = topology(*mesh, options, pool.threads());
        if (!counted) return tl::unexpected(counted.error());
        *counts = *counted;
    }
    return out;
}

}  // namespace htvm::lab
