// htvm-lab events: whether hands and feet are followed through what they do.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "command_line/terminal.h"
#include "commands.h"
#include "limb_events.h"

namespace htvm::lab {

using namespace app;
namespace {

struct Options {
    SyntheticOptions stream;
    LimbRule rule;
    int frames = 300;
    bool json = false;
};

struct Measured {
    std::vector<FrameOfLimbs> frames;
    std::vector<JudgedEvent> events;
    std::size_t bytes = 0, vertices = 0;  // of all packets; of all captured frames
};

// All marks on hands and feet.
std::vector<SurfaceMark> limb_marks(const SynthOptions& options) {
    auto marks = surface_marks(options, std::numeric_limits<std::size_t>::max());
    std::erase_if(marks, [](const SurfaceMark& mark) {
        const std::string name = part_name(mark.part);
        return !name.ends_with("hand") && !name.ends_with("foot");
    });
    return marks;
}

Result<Measured> measure(const Options& options) {
    const auto marks = limb_marks(options.stream.synth);
    auto stream = SyntheticStream::start(options.stream, marks);
    if (!stream) return tl::unexpected(stream.error());
    LimbMeter meter(marks, options.rule);
    Measured out;
    std::vector<std::vector<LimbState>> states;
    Progress progress("events", static_cast<std::size_t>(options.frames));
    for (int i = 0; i < options.frames; ++i) {
        auto frame = stream->next();
        if (!frame) return tl::unexpected(frame.error());
        auto limbs = meter.add(*frame);
        if (!limbs) return tl::unexpected(limbs.error());
        out.frames.push_back(std::move(*limbs));
        states.push_back(std::move(frame->truth.limbs));
        out.bytes += frame->bytes;
        out.vertices += frame->surface.positions.size();
        progress.step();
    }
    const auto events = limb_events(states, options.stream.first_frame, options.stream.synth.fps);
    out.events = judge_events(events, out.frames, options.rule);
    return out;
}

// ---- The output -----------------------------------------------------------------------------------------------------

// In the order of the names.
using NamedCounts = std::vector<std::pair<std::string, OutcomeCounts>>;

template <class Name>
NamedCounts counts_by(const std::vector<JudgedEvent>& events, const Name& name_of) {
    std::map<std::string, OutcomeCounts> by_name;
    for (const auto& event : events) add(by_name[name_of(event.event)], event);
    return {by_name.begin(), by_name.end()};
}

std::string limb_name(const LimbEvent& event) {
    const std::string figure = figure_name(event.part);
    return (figure == "person" ? "" : figure + "'s ") + part_name(event.part);
}

OutcomeCounts all_of(const std::vector<JudgedEvent>& events) {
    OutcomeCounts all;
    for (const auto& event : events) add(all, event);
    return all;
}

std::map<std::string, std::size_t> frames_by_kind(const std::vector<FrameOfLimbs>& frames) {
    std::map<std::string, std::size_t> out;
    for (const auto& frame : frames) ++out[frame.renewal ? "I of the tracked mesh" : kind_of(frame.type).letter];
    return out;
}

// How many limbs are shown, all frames together, and how many of these are right.
struct LimbFrames {
    std::size_t shown = 0, right = 0;
    double right_share() const { return shown == 0 ? 1 : static_cast<double>(right) / static_cast<double>(shown); }
};

LimbFrames limb_frames(const Options& options, const Measured& measured) {
    LimbFrames out;
    for (const auto& frame : measured.frames)
        for (const auto& limb : frame.limbs) {
            if (limb.hidden) continue;
            ++out.shown;
            if (limb.right >= options.rule.least_share) ++out.right;
        }
    return out;
}

double megabits(const Options& options, const Measured& measured) {
    return 8e-6 * static_cast<double>(measured.bytes) * options.stream.synth.fps /
           static_cast<double>(measured.frames.size());
}

void print_tables(const Options& options, const Measured& measured) {
    fmt::print("{} of {:.0f} vertices, {:.2f} Mbit/s:", counted(measured.frames.size(), "frame"),
               static_cast<double>(measured.vertices) / static_cast<double>(measured.frames.size()),
               megabits(options, measured));
    for (const auto& [kind, count] : frames_by_kind(measured.frames)) fmt::print("  {} {}", count, kind);
    const LimbFrames limbs = limb_frames(options, measured);
    fmt::print("\nA limb is right in {:.1f} % of the frames that show it.\n", 100 * limbs.right_share());
    fmt::print("\n{:<26}{:>8}", "events", "all");
    for (const char* outcome : limb_outcomes) fmt::print("{:>10}", outcome);
    fmt::print("{:>12}\n", "followed, %");
    const auto row = [](const std::string& name, const OutcomeCounts& counts) {
        fmt::print("{:<26}{:>8}", name, counts.counted() + counts[LimbOutcome::hidden]);
        for (const auto count : counts.of) fmt::print("{:>10}", count);
        fmt::print("{:>12.1f}\n", 100 * counts.followed_share());
    };
    for (const auto& [name, counts] : counts_by(measured.events, [](const auto& e) { return event_name(e.kind); }))
        row(name, counts);
    for (const auto& [name, counts] : counts_by(measured.events, limb_name)) row(name, counts);
    row("all", all_of(measured.events));
    bool first = true;
    for (const auto& [event, outcome, least, worst] : measured.events) {
        if (outcome == LimbOutcome::followed || outcome == LimbOutcome::hidden) continue;
        if (std::exchange(first, false)) fmt::print("\nnot followed:\n");
        fmt::print("  frames {:>5} to {:<5} {:<9} {:<26} {:<9} {:>5.1f} % right in frame {}\n", event.first, event.last,
                   event_name(event.kind), limb_name(event), limb_outcomes[static_cast<std::size_t>(outcome)],
                   100 * least, worst);
    }
}

nlohmann::ordered_json counts_json(const OutcomeCounts& counts) {
    nlohmann::ordered_json out;
    for (std::size_t i = 0; i < limb_outcomes.size(); ++i) out[limb_outcomes[i]] = counts.of[i];
    out["followed_share"] = counts.followed_share();
    return out;
}

nlohmann::ordered_json as_json(const Options& options, const Measured& measured) {
    nlohmann::ordered_json out = {
        {"program", "htvm-lab " HTVM_VERSION},
        {"frames", measured.frames.size()},
        {"first_frame", options.stream.first_frame},
        {"vertices", static_cast<double>(measured.vertices) / static_cast<double>(measured.frames.size())},
        {"megabits_per_second", megabits(options, measured)},
        {"frames_by_kind", frames_by_kind(measured.frames)},
        {"near_mm", options.rule.near_mm},
        {"least_share", options.rule.least_share},
        {"frames_after", options.rule.frames_after},
        {"right_share_of_limb_frames", limb_frames(options, measured).right_share()},
        {"all", counts_json(all_of(measured.events))}};
    for (const auto& [name, counts] : counts_by(measured.events, [](const auto& e) { return event_name(e.kind); }))
        out["by_kind"][name] = counts_json(counts);
    for (const auto& [name, counts] : counts_by(measured.events, limb_name)) out["by_limb"][name] = counts_json(counts);
    auto& events = out["events"] = nlohmann::ordered_json::array();
    for (const auto& [event, outcome, least, worst] : measured.events)
        events.push_back({{"event", event_name(event.kind)},
                          {"of", figure_name(event.part)},
                          {"limb", part_name(event.part)},
                          {"first", event.first},
                          {"last", event.last},
                          {"outcome", limb_outcomes[static_cast<std::size_t>(outcome)]},
                          {"least_right_share", least},
                          {"worst_frame", worst}});
    auto& frames = out["frame_list"] = nlohmann::ordered_json::array();
    for (const auto& frame : measured.frames) {
        frames.push_back({{"frame", frame.number}, {"type", kind_of(frame.type).letter}, {"renewal", frame.renewal}});
        for (const auto& limb : frame.limbs)
            frames.back()["limbs"].push_back({{"of", figure_name(limb.part)},
                                              {"limb", part_name(limb.part)},
                                              {"hidden", limb.hidden},
                                              {"right_share", limb.right},
                                              {"patched_share", limb.renewed}});
    }
    return out;
}

Result<void> count_events(const Options& options) {
    const auto measured = measure(options);
    if (!measured) return tl::unexpected(measured.error());
    if (options.json)
        fmt::print("{}\n", as_json(options, *measured).dump(1));
    else
        print_tables(options, *measured);
    return {};
}

}  // namespace

void add_events(CLI::App& app, app::Run& run) {
    auto options = std::make_shared<Options>();
    auto& o = *options;
    auto* command = app.add_subcommand("events", "Whether hands and feet are followed through what they do");
    command->description(
        "Whether the encoder follows hands and feet through fast moves, touches, releases and occlusions: a synthetic\n"
        "capture, whose truth is known, is made, encoded and decoded in memory, without a skeleton.");
    command->add_option("--frames", o.frames, "How many frames")->check(CLI::Range(2, 100000))->capture_default_str();
    add_synthetic_options(*command, o.stream);
    command->add_option("--near", o.rule.near_mm, "mm that the surfaces may be apart where a limb is right")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    command->add_option("--after", o.rule.frames_after, "Frames behind an event that are judged with it")
        ->check(CLI::Range(0, 1000))
        ->capture_default_str();
    command->add_flag("--json", o.json, "Everything, with every event, as JSON on standard output");
    command->footer(
        "A limb is right in a frame if 95 % of it is near: of the points fixed on it that the capture shows (its own\n"
        "surface is within 5 mm), from the decoded surface; and of the decoded vertices that lay on it when the "
        "mesh's\n"
        "triangles were new, from the true surface. An event is judged over its frames and those behind (--after):\n"
        "  followed  the limb is right in each, in T-frames, or in an I-frame made of the tracked mesh\n"
        "  patched   a TP-frame replaced at least 5 % of it, and it is right from there on\n"
        "  I-frame   an I-frame of the capture came, and it is right from there on\n"
        "  lost      it is wrong, and not made good\n"
        "  hidden    less than ten points of it are shown in any of the frames; not counted\n"
        "The kinds of events are described in docs/synth.md.\n\n"
        "Example:\n"
        "  htvm-lab events --motion everyday --frames 300");
    command->callback([options, &run] { run = [options] { return count_events(*options); }; });
}

}  // namespace htvm::lab
