#include "sweep.h"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <fstream>
#include <mutex>
#include <new>
#include <nlohmann/json.hpp>

#include "command_line/terminal.h"
#include "core/crc32.h"
#include "core/parallel.h"
#include "io/image_file.h"
#include "io/mesh_file.h"
#include "io/output_file.h"

namespace htvm::lab {

using namespace app;
using namespace internal;

// ---- The capture ----------------------------------------------------------------------------------------------------

namespace {

std::size_t bytes_of(const Mesh& mesh) {
    return mesh.positions.size() * sizeof(Vector3f) + mesh.triangles.size() * sizeof(Triangle) +
           mesh.colours.size() * sizeof(Colour) + mesh.texcoords.size() * sizeof(Vector2f);
}

std::size_t bytes_of(const SourceFrame& frame) {
    const std::size_t textured =
        frame.textured ? bytes_of(frame.textured->mesh) + frame.textured->texture->rgb.size() : 0;
    return bytes_of(frame.mesh) + textured;
}

// The image lies beside the mesh.
std::filesystem::path image_of(std::filesystem::path mesh) { return mesh.replace_extension(".png"); }

Result<void> spill(const TexturedMesh& textured, const std::filesystem::path& file) {
    const auto image = write_png_image(*textured.texture);
    if (!image) return tl::unexpected(image.error());
    if (auto written = write_file(image_of(file), *image); !written) return written;
    return write_mesh(file, textured.mesh);
}

Result<std::shared_ptr<const TexturedMesh>> read_spilled(const std::filesystem::path& file) {
    auto mesh = read_mesh(file);
    if (!mesh) return tl::unexpected(mesh.error());
    auto image = read_image_file(image_of(file));
    if (!image) return tl::unexpected(image.error());
    return std::make_shared<const TexturedMesh>(std::move(*mesh), std::make_shared<const Image>(std::move(*image)));
}

}  // namespace

Result<void> SourceFrames::keep(SourceFrame frame, const SourceOptions& options) {
    const Box box = bounding_box(frame.mesh);
    extend(facts_.box, box);
    const Point3 side = box.high - box.low;
    facts_.frame_side += std::max({side[0], side[1], side[2]});
    std::filesystem::path file, textured;
    const std::size_t bytes = bytes_of(frame);
    if (bytes_ + bytes > options.memory_bytes) {
        file = options.spill_folder / fmt::format("source_{:05}.ply", frame.index);
        if (auto written = write_mesh(file, frame.mesh); !written) return written;
        if (frame.textured) {
            textured = options.spill_folder / fmt::format("textured_{:05}.ply", frame.index);
            if (auto written = spill(*frame.textured, textured); !written) return written;
        }
        frame.mesh = {};
        frame.textured.reset();
    } else {
        bytes_ += bytes;
    }
    files_.push_back(std::move(file));
    textured_.push_back(std::move(textured));
    frames_.push_back(std::make_shared<const SourceFrame>(std::move(frame)));
    return {};
}

Result<SourceFrames> SourceFrames::load(Capture& capture, const SourceOptions& options) {
    SourceFrames out;
    Progress progress("reading", capture.frames());
    for (;;) {
        auto mesh = capture.next();
        if (!mesh) return tl::unexpected(mesh.error());
        if (!*mesh) break;
        SourceFrame frame;
        frame.index = out.frames_.size();
        frame.mesh = std::move(**mesh);
        frame.mesh.normals.clear();
        frame.mesh.texcoords.clear();
        if (options.geometry_only)
            frame.mesh.colours.clear();
        else
            frame.textured = capture.textured();
        if (capture.pose()) frame.pose = *capture.pose();
        frame.timestamp_us = capture.timestamp_us();
        if (auto kept = out.keep(std::move(frame), options); !kept) return tl::unexpected(kept.error());
        progress.step();
    }
    if (out.frames_.empty()) return fail(ErrorKind::bad_input, "there is no mesh to measure");
    out.facts_.frame_side /= static_cast<double>(out.frames_.size());
    out.facts_.fps = capture.fps();
    out.facts_.skeleton = capture.skeleton();
    out.facts_.radii = capture.radii();
    return out;
}

Result<SourceFrames> SourceFrames::of(std::vector<SourceFrame> frames, SequenceFacts facts,
                                      const SourceOptions& options) {
    if (frames.empty()) return fail(ErrorKind::bad_input, "there is no mesh to measure");
    SourceFrames out;
    out.facts_ = std::move(facts);
    for (SourceFrame& frame : frames)
        if (auto kept = out.keep(std::move(frame), options); !kept) return tl::unexpected(kept.error());
    out.facts_.frame_side /= static_cast<double>(out.frames_.size());
    return out;
}

Result<std::shared_ptr<const SourceFrame>> SourceFrames::frame(std::size_t index) const {
    if (files_[index].empty()) return frames_[index];
    auto mesh = read_mesh(files_[index]);
    if (!mesh) return tl::unexpected(mesh.error());
    auto whole = std::make_shared<SourceFrame>(*frames_[index]);
    whole->mesh = std::move(*mesh);
    if (!textured_[index].empty()) {
        auto textured = read_spilled(textured_[index]);
        if (!textured) return tl::unexpected(textured.error());
        whole->textured = std::move(*textured);
    }
    return std::shared_ptr<const SourceFrame>(std::move(whole));
}

// ---- Results stored between runs ------------------------------------------------------------------------------------

namespace {

using std::filesystem::path;

std::uint32_t crc_of(const std::string& text) {
    return crc32({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

std::string stamp(const path& file) {
    std::error_code error;
    const auto size = std::filesystem::file_size(file, error);
    if (error) return file.string() + " missing";
    const auto changed = std::filesystem::last_write_time(file, error).time_since_epoch().count();
    return fmt::format("{} {} {}", file.string(), size, changed);
}

}  // namespace

std::string fingerprint(const std::vector<path>& files) {
    std::string all;
    for (const auto& file : files) {
        std::error_code error;
        const auto whole = std::filesystem::absolute(file, error);
        all += stamp(error ? file : whole.lexically_normal()) + "\n";
    }
    std::error_code error;
    const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
    return fmt::format("htvm-lab {} {:08x}; {} files {:08x}", HTVM_VERSION, error ? 0 : crc_of(stamp(program)),
                       files.size(), crc_of(all));
}

path ResultCache::file(const std::string& name, const std::string& key) const {
    return folder_ / fmt::format("{}_{:08x}.json", name, crc_of(key));
}

std::optional<RdPoint> ResultCache::find(const std::string& name, const std::string& key) const {
    const auto bytes = read_file(file(name, key), std::uint64_t{1} << 28);
    if (!bytes) return std::nullopt;
    const auto json = nlohmann::json::parse(bytes->begin(), bytes->end(), nullptr, false);
    if (!json.is_object() || json.value("key", nlohmann::json()) != key || !json.contains("result"))
        return std::nullopt;
    return rd_point_from_json(json["result"]);
}

Result<void> ResultCache::keep(const std::string& name, const std::string& key, const RdPoint& point) const {
    return write_text(file(name, key), nlohmann::json({{"key", key}, {"result", to_json(point)}}).dump());
}

Result<void> write_text(const path& where, const std::string& text) {
    const path temporary = where.string() + fmt::format(".{}", getpid());
    std::ofstream out(temporary, std::ios::binary);
    out << text;
    out.close();
    std::error_code error;
    if (out) std::filesystem::rename(temporary, where, error);
    if (!out || error) return fail(ErrorKind::bad_input, where.string() + " cannot be written");
    return {};
}

// ---- The sweep itself -----------------------------------------------------------------------------------------------

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
    out.recoded = coded->recoded;
    out.encode_ms = coded->encode_ms;
    out.decode_ms = coded->decode_ms;
    if (source.index % options.measure_every == 0) {
        const auto original = source.textured ? ComparedMesh(source.mesh, *source.textured) : ComparedMesh(source.mesh);
        const auto compared = compare_frame(original, coded->decoded, options.compare);
        if (!compared) return tl::unexpected(compared.error());
        if (options.compare.points) out.m1_mm = m1_geometry(compared->points);
        if (options.compare.surface) out.m2_mm = m2(compared->surface);
        if (options.compare.regions) out.worst_region_mm = compared->region.worst_mm;
        if (options.compare.coverage && compared->coverage.region.regions > 0)
            out.covered_region_mm = compared->coverage.region.worst_mm;
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
    take_frame_measures(point);
    return point;
}

// Turns exceptions into errors: no exception may leave a thread.
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
        pool.threads().at_most(std::max(1u, options.threads / workers));  // used if there are more cores than jobs
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
