#include "encode_jobs.h"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <map>
#include <new>
#include <thread>
#include <utility>
#include <vector>

#include "command_line/interruption.h"
#include "command_line/terminal.h"
#include "core/thread.h"
#include "stream_join.h"

namespace htvm::app {
namespace {

struct CodedGroup {
    std::vector<Packet> packets;
    Summary summary;
    std::vector<FrameCost> costs;
};

// What the encoders share.
struct Work {
    const EncodePlan& plan;
    EncoderOptions settings;
    const Mesh& first_mesh;
    const Pose* first_pose;
    std::vector<Range> groups;
    std::size_t ahead;  // groups that may be finished or at work before the next one that is written
    Progress& progress;
    FrameWarnings warnings = {};

    std::mutex mutex = {};
    std::condition_variable changed = {};
    std::size_t next = 0, written = 0;  // indices of groups
    std::map<std::size_t, CodedGroup> coded = {};
    std::optional<Error> failed = {};  // the first failure there was
};

bool is_stopped(Work& work) {
    if (interruption() != 0) return true;
    const std::lock_guard lock(work.mutex);
    return work.failed.has_value();
}

std::string frames_text(const Range& group) {
    return group.count() == 1 ? fmt::format("frame {}", group.begin)
                              : fmt::format("frames {} to {}", group.begin, group.end - 1);
}

// The frame before the group stands in for its first ones, if it has to.
void find_stand_in(Pass& pass, const Range& group) {
    if (group.begin == 0 || (!pass.plan.fill && pass.plan.bad_frames != BadFrames::repeat)) return;
    pass.capture.restrict_to(group.begin - 1, group.count() + 1);
    auto before = pass.capture.next();
    if (!before || !*before) return;
    pass.last = std::move(**before);
    if (const auto* pose = pass.capture.pose()) pass.last_pose = *pose;
    if (pass.pictures) pass.last_textured = pass.capture.textured();
}

Result<CodedGroup> code_group(Work& work, Capture& capture, const Range& group) {
    auto encoder = Encoder::create(work.settings);
    if (!encoder) return tl::unexpected(encoder.error());
    if (auto begun = encoder->begin(work.first_mesh, work.first_pose); !begun) return tl::unexpected(begun.error());
    CodedGroup out;
    RateReport rate(work.settings);
    Pass pass{.plan = work.plan,
              .capture = capture,
              .encoder = *encoder,
              .write =
                  [&](Packet packet) {
                      // The index is the whole stream's.
                      if (packet.kind != PacketKind::index) out.packets.push_back(std::move(packet));
                      return Result<void>();
                  },
              .step =
                  [&](const std::string& text) {
                      const std::lock_guard lock(work.mutex);
                      work.progress.step(text);
                  },
              .is_stopped = [&] { return is_stopped(work); },
              .warnings = &work.warnings,
              .summary = out.summary,
              .rate = rate,
              .saw_triangles = !work.first_mesh.triangles.empty()};
    auto pictures = picture_track(work.plan, capture, work.settings);
    if (!pictures) return tl::unexpected(pictures.error());
    if (*pictures) pass.pictures = &**pictures;
    capture.restrict_to(group.begin, group.count());
    find_stand_in(pass, group);
    if (auto done = encode_frames(pass); !done) return tl::unexpected(done.error());
    if (auto done = finish(pass); !done) return tl::unexpected(done.error());
    out.costs = std::move(rate.costs);
    if (*pictures) out.summary.pictures = (*pictures)->totals();
    return out;
}

// Takes one group after another. Each thread has a capture of its own, to read from.
void code_groups(Work& work, Capture capture) {
    for (;;) {
        std::size_t index = 0;
        {
            std::unique_lock lock(work.mutex);
            work.changed.wait(lock, [&] {
                return work.failed || work.next == work.groups.size() || work.next < work.written + work.ahead;
            });
            if (work.failed || work.next == work.groups.size()) return;
            index = work.next++;
        }
        const auto& group = work.groups[index];
        auto coded = [&]() -> Result<CodedGroup> {
            try {
                return code_group(work, capture, group);
            } catch (const std::bad_alloc&) {
                return fail(ErrorKind::limit, "out of memory");
            }
        }();
        {
            const std::lock_guard lock(work.mutex);
            if (coded)
                work.coded.emplace(index, std::move(*coded));
            else if (!work.failed)
                work.failed = Error{coded.error().kind,
                                    interruption() != 0
                                        ? coded.error().message
                                        : fmt::format("{} failed: {}", frames_text(group), coded.error().message)};
        }
        work.changed.notify_all();
    }
}

// In the order of the capture, as they come.
Result<void> write_groups(Work& work, StreamOutput& output, Summary& summary, RateReport& rate) {
    StreamJoin join(output);
    for (std::size_t index = 0; index < work.groups.size(); ++index) {
        std::unique_lock lock(work.mutex);
        work.changed.wait(lock, [&] { return work.failed || work.coded.contains(index); });
        if (work.failed) return tl::unexpected(*work.failed);
        auto coded = std::move(work.coded.extract(index).mapped());
        lock.unlock();
        join.begin_stream();
        for (auto& packet : coded.packets)
            if (auto ok = join.take(std::move(packet)); !ok) return ok;
        add(summary, std::move(coded.summary));
        for (const auto& cost : coded.costs) add_coded(rate, cost);
        lock.lock();
        ++work.written;
        lock.unlock();
        work.changed.notify_all();
    }
    return {};
}

// The Ith of so many parts of things in order, as even as possible.
Range part_of(const Job& part, std::size_t things) {
    return {(part.number - 1) * things / part.of, part.number * things / part.of};
}

}  // namespace

std::size_t frames_of_group(int key_interval) {
    const auto interval = std::min<std::size_t>(static_cast<std::size_t>(key_interval), most_of_group);
    return interval * ((least_of_group + interval - 1) / interval);
}

std::vector<Range> groups_of(const EncodePlan& plan, int key_interval, std::size_t frames) {
    std::vector<Range> out;
    if (plan.chunks > 1) {
        const auto chunks = std::min(plan.chunks, frames);
        for (std::size_t k = 1; k <= chunks; ++k) out.push_back(part_of({k, chunks}, frames));
        return out;
    }
    const auto of_each = frames_of_group(key_interval);
    const auto groups = (frames + of_each - 1) / of_each;
    const auto [begin, end] = plan.job.of > 0 ? part_of(plan.job, groups) : Range{0, groups};
    for (auto k = begin; k < end; ++k) out.push_back({k * of_each, std::min((k + 1) * of_each, frames)});
    return out;
}

Result<void> encode_groups(const EncodePlan& plan, const EncoderOptions& settings, Capture& capture,
                           std::vector<Range> groups, StreamOutput& output, Summary& summary, RateReport& rate) {
    const auto start = std::chrono::steady_clock::now();
    const auto pose = capture.first_pose() ? std::optional(*capture.first_pose()) : std::nullopt;
    const auto mesh = capture.take_first();
    summary.first_surface = internal::openness_of(mesh.positions, mesh.triangles);
    std::size_t frames = 0;
    for (const auto& group : groups) frames += group.count();
    const auto of_machine = internal::thread_count(settings.threads);
    const auto at_once = plan.chunks > 1 ? of_machine : std::max<std::size_t>(plan.jobs, 1);
    const auto threads = std::min(at_once, groups.size());
    Progress progress("encoding", frames);
    Work work{.plan = plan,
              .settings = settings,
              .first_mesh = mesh,
              .first_pose = pose ? &*pose : nullptr,
              .groups = std::move(groups),
              .ahead = 2 * threads,
              .progress = progress};
    work.settings.threads = std::max(1u, of_machine / static_cast<unsigned>(threads));
    std::vector<std::thread> encoders;
    for (std::size_t k = 0; k < threads; ++k) encoders.emplace_back([&work, capture] { code_groups(work, capture); });
    auto done = write_groups(work, output, summary, rate);
    if (!done) {
        const std::lock_guard lock(work.mutex);
        if (!work.failed) work.failed = done.error();  // so that all stop
    }
    work.changed.notify_all();
    for (auto& encoder : encoders) encoder.join();
    summary.encode_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return done;
}

}  // namespace htvm::app
