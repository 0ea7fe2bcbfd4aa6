#include "rd_source.h"

#include <fmt/core.h>

#include <algorithm>

#include "command_line/terminal.h"
#include "io/mesh_file.h"

namespace htvm::lab {

using namespace app;
namespace {

std::size_t bytes_of(const Mesh& mesh) {
    return mesh.positions.size() * sizeof(Vector3f) + mesh.triangles.size() * sizeof(Triangle) +
           mesh.colours.size() * sizeof(Colour);
}

}  // namespace

Result<void> SourceFrames::keep(SourceFrame frame, const SourceOptions& options) {
    const Box box = bounding_box(frame.mesh);
    extend(facts_.box, box);
    const Point3 side = box.high - box.low;
    facts_.frame_side += std::max({side[0], side[1], side[2]});
    std::filesystem::path file;
    const std::size_t bytes = bytes_of(frame.mesh);
    if (bytes_ + bytes > options.memory_bytes) {
        file = options.spill_folder / fmt::format("source_{:05}.ply", frame.index);
        if (auto written = write_mesh(file, frame.mesh); !written) return written;
        frame.mesh = {};
    } else {
        bytes_ += bytes;
    }
    files_.push_back(std::move(file));
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
        if (options.geometry_only) frame.mesh.colours.clear();
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

Result<std::shared_ptr<const SourceFrame>> SourceFrames::frame(std::size_t index) const {
    if (files_[index].empty()) return frames_[index];
    auto mesh = read_mesh(files_[index]);
    if (!mesh) return tl::unexpected(mesh.error());
    auto whole = std::make_shared<SourceFrame>(*frames_[index]);
    whole->mesh = std::move(*mesh);
    return std::shared_ptr<const SourceFrame>(std::move(whole));
}

}  // namespace htvm::lab
