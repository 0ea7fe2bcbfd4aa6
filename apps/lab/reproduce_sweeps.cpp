#include "reproduce_sweeps.h"

#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "command_line/terminal.h"
#include "synth/random.h"

namespace htvm::lab {

using namespace app;
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

// The trials that are missing, run; results go to their places in `points`.
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

}  // namespace htvm::lab
