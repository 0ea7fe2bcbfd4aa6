#include "segment_folder.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <memory>
#include <utility>

#include "container/box.h"
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

namespace {

// Files one after another, as one.
struct Pieces {
    struct Piece {
        fs::path path;
        std::uint64_t begin = 0, end = 0;
    };
    std::vector<Piece> pieces;
    std::size_t opened = 0;
    std::ifstream file;

    std::uint64_t size() const { return pieces.empty() ? 0 : pieces.back().end; }
    bool read(std::uint64_t offset, std::span<std::uint8_t> to) {
        while (!to.empty()) {
            const auto at = std::upper_bound(pieces.begin(), pieces.end(), offset,
                                             [](std::uint64_t place, const Piece& piece) { return place < piece.end; });
            if (at == pieces.end()) return false;
            const auto number = static_cast<std::size_t>(at - pieces.begin()) + 1;
            if (number != opened) {
                file = std::ifstream(at->path, std::ios::binary);
                opened = number;
            }
            const auto bytes = static_cast<std::size_t>(std::min<std::uint64_t>(to.size(), at->end - offset));
            file.clear();
            file.seekg(static_cast<std::streamoff>(offset - at->begin));
            if (!file.read(reinterpret_cast<char*>(to.data()), static_cast<std::streamsize>(bytes))) return false;
            offset += bytes;
            to = to.subspan(bytes);
        }
        return true;
    }
};

// Whether the file is boxes one after another up to its end: one that is cut short would take the next file's bytes for
// its own.
bool has_whole_boxes(const fs::path& path, std::uint64_t bytes) {
    std::ifstream file(path, std::ios::binary);
    for (std::uint64_t offset = 0; offset < bytes;) {
        std::array<std::uint8_t, 16> beginning{};
        const auto known = static_cast<std::size_t>(std::min<std::uint64_t>(beginning.size(), bytes - offset));
        file.seekg(static_cast<std::streamoff>(offset));
        if (!file.read(reinterpret_cast<char*>(beginning.data()), static_cast<std::streamsize>(known))) return false;
        BoxReader in{std::span(beginning).first(known)};
        std::uint64_t size = in.u32();
        in.skip(4);
        if (size == 1) size = in.u64();
        if (size == 0) size = bytes - offset;
        if (!in.ok() || size < 8 || size > bytes - offset) return false;
        offset += size;
    }
    return bytes > 0;
}

Result<void> add_piece(Pieces& pieces, const fs::path& playlist, const std::string& name) {
    if (!is_name_below(name))
        return fail(ErrorKind::bad_input,
                    fmt::format("{} names {}, which is not a file beside it", playlist.string(), name));
    const auto path = playlist.parent_path() / name;
    std::error_code error;
    const auto bytes = fs::is_regular_file(path, error) ? fs::file_size(path, error) : 0;
    if (error || !fs::is_regular_file(path, error))
        return fail(ErrorKind::bad_input, fmt::format("{} names {}, which is not there", playlist.string(), name));
    if (!has_whole_boxes(path, bytes))
        return fail(ErrorKind::corrupt_stream,
                    fmt::format("{} names {}, which is cut short, or no segment", playlist.string(), name));
    pieces.pieces.push_back({path, pieces.size(), pieces.size() + bytes});
    return {};
}

// So that no list leads to itself.
bool is_list_of_playlists(const fs::path& path) {
    const auto bytes = read_file(path.string());
    return bytes && !read_variants({reinterpret_cast<const char*>(bytes->data()), bytes->size()}).empty();
}

}  // namespace

Result<FileBytes> source_of_playlist(const std::string& path) {
    const auto bytes = read_file(path);
    if (!bytes) return tl::unexpected(bytes.error());
    const std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
    // The finest, where there are several qualities.
    if (const auto variants = read_variants(text); !variants.empty()) {
        const auto& finest = *std::max_element(variants.begin(), variants.end(), [](const auto& a, const auto& b) {
            return a.bits_per_second < b.bits_per_second;
        });
        if (!is_name_below(finest.uri) || is_list_of_playlists(fs::path(path).parent_path() / finest.uri))
            return fail(ErrorKind::bad_input,
                        fmt::format("{} names {}, which is not a playlist beside it", path, finest.uri));
        return source_of_playlist((fs::path(path).parent_path() / finest.uri).string());
    }
    const auto list = read_playlist(text);
    if (!list) return fail(list.error().kind, path + ": " + list.error().message);
    auto pieces = std::make_shared<Pieces>();
    std::string map;
    for (const auto& segment : list->segments) {
        if (segment.map_uri != map)
            if (auto added = add_piece(*pieces, path, segment.map_uri); !added) return tl::unexpected(added.error());
        map = segment.map_uri;
        if (auto added = add_piece(*pieces, path, segment.uri); !added) return tl::unexpected(added.error());
    }
    return FileBytes{pieces->size(),
                     [pieces](std::uint64_t offset, std::span<std::uint8_t> to) { return pieces->read(offset, to); }};
}

}  // namespace htvm::app
