#include "segment_folder.h"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "core/letter_case.h"
#include "io/mesh_file.h"
#include "io/output_file.h"

namespace htvm::app {

namespace fs = std::filesystem;

bool is_playlist_name(const std::string& path) {
    return internal::lower_case(fs::path(path).extension().string()) == ".m3u8";
}

SegmentFolder::SegmentFolder(fs::path playlist, const SegmentOptions& options)
    : path_(std::move(playlist)),
      options_(options),
      segmenter_({.seconds = options.seconds, .on_grid = options.on_grid}) {
    list_.target_seconds = options.seconds;
    list_.has_end = false;
    list_.kind = !options.is_live             ? PlaylistKind::whole
                 : options.window_seconds > 0 ? PlaylistKind::window
                                              : PlaylistKind::event;
}

Result<void> SegmentFolder::add(const StreamSegment& segment) {
    const auto folder = path_.parent_path();
    PlaylistSegment entry;
    entry.seconds = static_cast<double>(segment.end_us - segment.begin_us) / 1e6;
    entry.map_uri = "map-" + name_by_content(segment.map) + ".mp4";
    entry.uri = fmt::format("{:06}-{}.m4s", written_++, name_by_content(segment.media));
    if (maps_.insert(entry.map_uri).second) {
        if (auto written = write_file(folder / entry.map_uri, segment.map); !written) return written;
        bytes_ += segment.map.size();
    }
    if (auto written = write_file(folder / entry.uri, segment.media); !written) return written;
    bytes_ += segment.media.size();
    list_.segments.push_back(std::move(entry));
    if (!options_.is_live) return {};
    drop_old();
    return write_list();
}

// Takes what is out of the window off the list, and removes what has been off it as long as a list may be in use.
void SegmentFolder::drop_old() {
    if (!(options_.window_seconds > 0)) return;
    const auto seconds_of = [](const auto& segments) {
        double out = 0;
        for (const auto& segment : segments) out += segment.seconds;
        return out;
    };
    auto& listed = list_.segments;
    while (listed.size() > 1 && seconds_of(listed) - listed.front().seconds >= options_.window_seconds) {
        leaving_.push_back(std::move(listed.front()));
        listed.erase(listed.begin());
        ++list_.first_number;
    }
    while (!leaving_.empty() && seconds_of(leaving_) - leaving_.front().seconds > options_.window_seconds) {
        const auto gone = std::move(leaving_.front());
        leaving_.pop_front();
        std::error_code ignored;
        fs::remove(path_.parent_path() / gone.uri, ignored);
        const auto has_map = [&](const PlaylistSegment& other) { return other.map_uri == gone.map_uri; };
        if (std::any_of(leaving_.begin(), leaving_.end(), has_map) ||
            std::any_of(listed.begin(), listed.end(), has_map))
            continue;
        fs::remove(path_.parent_path() / gone.map_uri, ignored);
        maps_.erase(gone.map_uri);
    }
}

Result<void> SegmentFolder::write_list() { return write_file(path_, write_playlist(list_)); }

Result<void> SegmentFolder::write(Packet packet) {
    const auto segment = segmenter_.push(std::move(packet));
    if (!segment) return tl::unexpected(segment.error());
    return *segment ? add(**segment) : Result<void>();
}

Result<void> SegmentFolder::finish() {
    const auto rest = segmenter_.finish();
    if (!rest) return tl::unexpected(rest.error());
    for (const auto& segment : *rest)
        if (auto added = add(segment); !added) return added;
    if (list_.segments.empty()) return fail(ErrorKind::bad_input, "there is no frame for " + path_.string());
    list_.has_end = true;
    return write_list();
}

// ---- Reading --------------------------------------------------------------------------------------------------------

}  // namespace htvm::app
