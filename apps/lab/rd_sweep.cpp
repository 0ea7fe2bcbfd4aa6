#include "rd_sweep.h"

#include <fmt/core.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <new>

#include "core/parallel.h"
#include "io/mesh_file.h"

namespace htvm::lab {

using namespace internal;
namespace {

Result<void> keep_frame(const std::filesystem::path& folder, const SourceFrame& source, const Mesh& decoded) {
    if (folder.empty()) return {};
    return write_mesh(folder / fmt::format("{:05}.ply", source.index), decoded);
}

Result<RdFrame> run_frame(const SweepJob& job, const FrameCoder& coder, const SourceFrame& source,
                          const SweepOptions& options, SequenceComparison& sums) {
    auto coded = coder(source);
    if (!coded) return tl::unexpected(coded.error());
    RdFrame out;
    out.type = coded->type;
    out.vertices = static_cast<std::uint32_t>(source.mesh.positions.size());
    out.bytes = coded->bytes;
    out.encode_ms = coded->encode_ms;
    out.decode_ms = coded->decode_ms;
    if (source.index % options.measure_every == 0) {
        const auto compared = compare_frame(source.mesh, coded->decoded, options.compare);
        if (!compared) return tl::unexpected(compared.error());
        if (options.compare.points) out.m1_mm = m1_geometry(compared->points);
        if (options.compare.surface) out.m2_mm = m2(compared->surface);
        sums += *compared;
    }
    if (auto kept = keep_frame(job.keep_frames, source, coded->decoded); !kept) return tl::unexpected(kept.error());
    return out;
}

Result<RdPoint> run_job(const SweepJob& job, const SourceFrames& source, const SweepOptions& options,
                        const std::function<void()>& step) {
    const auto coder = job.coder->start(source.facts(), job.quality);
    if (!coder) return tl::unexpected(coder.error());
    RdPoint point;
    point.coder = job.coder->name;
    point.quality = job.quality.quality;
    point.geometry_step = job.quality.geometry_step;
    point.colour_step = job.quality.colour_step;
    if (job.coder->describe_quality) point.setting = job.coder->describe_quality(source.facts(), job.quality);
    point.fps = source.facts().fps;
    SequenceComparison sums;
    for (std::size_t i = 0; i < source.size(); ++i) {
        const auto frame = source.frame(i);
        if (!frame) return tl::unexpected(frame.error());
        auto measured = run_frame(job, *coder, **frame, options, sums);
        if (!measured)
            return fail(measured.error().kind, fmt::format("{} at quality {:g}, frame {}: {}", point.coder,
                                                           point.quality, i, measured.error().message));
        point.frames.push_back(*measured);
        step();
    }
    take_measures(summarise(sums, diagonal(source.facts().box)), options.compare, point.values);
    return point;
}

// No exception leaves a thread.
Result<RdPoint> run_guarded(const SweepJob& job, const SourceFrames& source, const SweepOptions& options,
                            const std::function<void()>& step) {
    try {
        return run_job(job, source, options, step);
    } catch (const std::bad_alloc&) {
        return fail(ErrorKind::limit, job.coder->name + ": out of memory");
    } catch (const std::exception& error) {
        return fail(ErrorKind::bad_input, job.coder->name + ": " + error.what());
    }
}

}  // namespace

void sweep(const std::vector<SweepJob>& jobs, const SourceFrames& source, const SweepOptions& options,
           const std::function<void(std::size_t, Result<RdPoint>)>& done, const std::function<void()>& step) {
    const auto workers =
        static_cast<unsigned>(std::clamp<std::size_t>(options.threads, 1, std::max<std::size_t>(jobs.size(), 1)));
    SweepOptions each = options;
    const ThreadPool pool(std::max(1u, options.threads));
    each.compare.threads =
        pool.threads().at_most(std::max(1u, options.threads / workers));  // where there are more cores than jobs
    std::atomic<std::size_t> next = 0;
    std::mutex mutex;
    auto work = [&](std::size_t, std::size_t) {
        for (std::size_t i = next++; i < jobs.size(); i = next++) {
            auto result = run_guarded(jobs[i], source, each, [&] {
                const std::lock_guard lock(mutex);
                step();
            });
            const std::lock_guard lock(mutex);
            done(i, std::move(result));
        }
    };
    parallel_for(workers, pool.threads().at_most(workers), 1, work);
}

}  // namespace htvm::lab
