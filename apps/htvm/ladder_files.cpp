#include "ladder_files.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <set>
#include <string_view>
#include <utility>

#include "container/playlist.h"
#include "io/mesh_file.h"
#include "live/hub/stream_name.h"

namespace htvm::app {
namespace {

namespace fs = std::filesystem;

tl::unexpected<Error> refused(const std::string& why) { return fail(ErrorKind::bad_input, "--ladder: " + why); }

Result<std::string> text_of(const fs::path& file) {
    const auto bytes = read_file(file.string());
    if (!bytes) return tl::unexpected(bytes.error());
    return std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size());
}

// None where the file is no list of playlists.
Result<std::vector<std::string>> files_of_list(const fs::path& list) {
    const auto text = text_of(list);
    if (!text) return tl::unexpected(text.error());
    auto variants = read_variants(*text);
    std::stable_sort(variants.begin(), variants.end(), [](const PlaylistVariant& a, const PlaylistVariant& b) {
        const auto rate = [](const PlaylistVariant& one) { return one.average ? one.average : one.bits_per_second; };
        return rate(a) < rate(b);
    });
    std::vector<std::string> out;
    for (const auto& variant : variants) {
        if (!is_name_below(variant.uri))
            return refused(list.string() + " names a playlist that is not beside it: " + variant.uri.substr(0, 80));
        out.push_back((list.parent_path() / variant.uri).string());
    }
    return out;
}

Result<std::vector<std::string>> files_of_folder(const fs::path& folder) {
    std::vector<std::vector<std::string>> lists;
    std::vector<std::pair<std::uintmax_t, std::string>> streams;  // by size
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder, error)) {
        if (!entry.is_regular_file(error)) continue;
        const auto ending = entry.path().extension();
        if (ending == ".htvm" || ending == ".mp4") streams.emplace_back(entry.file_size(error), entry.path().string());
        if (ending != ".m3u8") continue;
        auto files = files_of_list(entry.path());
        if (!files) return files;
        if (!files->empty()) lists.push_back(std::move(*files));
    }
    if (error) return refused(folder.string() + " cannot be read: " + error.message());
    if (lists.size() > 1) return refused(folder.string() + " has several ladders: name the list of playlists of one");
    if (lists.size() == 1) return std::move(lists.front());
    // Maps and segments in .mp4 are no streams, but then playlists are beside them.
    std::sort(streams.begin(), streams.end());
    std::vector<std::string> out;
    for (auto& [size, name] : streams) out.push_back(std::move(name));
    return out;
}

}  // namespace

Result<std::vector<std::string>> files_of_ladder(const std::vector<std::string>& named) {
    auto out = named;
    std::error_code error;
    if (named.size() == 1) {
        const fs::path one(named.front());
        auto found = fs::is_directory(one, error) ? files_of_folder(one)
                     : one.extension() == ".m3u8" ? files_of_list(one)
                                                  : Result<std::vector<std::string>>(named);
        if (!found) return found;
        out = std::move(*found);
    }
    if (out.size() < 2)
        return refused(
            fmt::format("{} is no ladder: name two files or more, the coarsest first, or the list of "
                        "playlists or the folder that htvm encode --ladder wrote",
                        named.empty() ? "nothing" : named.front()));
    if (out.size() > live::most_live_rungs)
        return refused(fmt::format("{} files are too many: a hub takes {} rungs", out.size(), live::most_live_rungs));
    if (std::set<std::string>(out.begin(), out.end()).size() < out.size()) return refused("a file is named twice");
    return out;
}

}  // namespace htvm::app
