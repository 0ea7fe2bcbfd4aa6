#include "live/files/served_files.h"

#include <algorithm>
#include <filesystem>
#include <set>

namespace htvm::live {
namespace {

constexpr std::size_t most_files = 10000, most_entries = 100000;
constexpr std::string_view stream_ending = ".htvm", picture_endings[] = {".png", ".jpg"};

// A file by its path, which may change meanwhile as those of a folder may; symbolic links are not followed.
Result<ServedFile> file_at(const std::filesystem::path& path) {
    const auto folder = ServedFolder::open(path.parent_path().string());
    if (!folder) return tl::unexpected(folder.error());
    const std::vector<std::string> name = {path.filename().string()};
    return folder->file(name);
}

}  // namespace

std::vector<FolderEntry> ServedFolder::files(std::span<const std::string_view> endings) const {
    namespace fs = std::filesystem;
    std::vector<FolderEntry> out;
    std::error_code error;
    std::size_t entries = 0;
    for (fs::recursive_directory_iterator it(path_, fs::directory_options::skip_permission_denied, error), end;
         !error && it != end && out.size() < most_files && entries < most_entries; it.increment(error)) {
        ++entries;
        const auto name = it->path().filename().string();
        const bool link = it->is_symlink(error);
        if (name.starts_with('.') || link) {
            it.disable_recursion_pending();
            continue;
        }
        const auto ends = [&](std::string_view ending) { return name.ends_with(ending); };
        if (std::none_of(endings.begin(), endings.end(), ends) || !it->is_regular_file(error)) continue;
        const auto size = it->file_size(error);
        if (!error) out.push_back({it->path().lexically_relative(path_).generic_string(), size});
    }
    std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.path < b.path; });
    return out;
}

Result<ServedFiles> ServedFiles::open(const std::string& folder, std::vector<NamedFile> named) {
    ServedFiles out;
    out.named_ = std::move(named);
    if (out.named_.empty() && !folder.empty()) {
        auto opened = ServedFolder::open(folder);
        if (!opened) return tl::unexpected(opened.error());
        out.folder_.emplace(std::move(*opened));
    }
    return out;
}

Result<ServedFile> ServedFiles::file(std::span<const std::string> segments) const {
    std::string path;
    for (const auto& segment : segments) path += (path.empty() ? "" : "/") + segment;
    for (const auto& [name, place] : named_)
        if (name == path) return file_at(place);
    const bool watched =
        path.ends_with(stream_ending) || path.ends_with(picture_endings[0]) || path.ends_with(picture_endings[1]);
    return folder_ && watched ? folder_->file(segments) : fail(ErrorKind::bad_input, "not served");
}

namespace {

// Whether it is the sibling of another one of these: person.h264.htvm of person.htvm.
bool is_sibling(std::string_view path, const std::set<std::string_view>& streams) {
    for (const auto coder : sibling_coders) {
        const auto ending = "." + std::string(coder) + std::string(stream_ending);
        if (!path.ends_with(ending)) continue;
        const auto other = std::string(path.substr(0, path.size() - ending.size())) + std::string(stream_ending);
        if (streams.contains(other)) return true;
    }
    return false;
}

}  // namespace

std::vector<ListedFile> ServedFiles::list() const {
    std::vector<ListedFile> out;
    std::set<std::string_view> streams;
    for (const auto& [name, path] : named_) streams.insert(name);
    for (const auto& [name, path] : named_)
        if (const auto file = file_at(path); file && !is_sibling(name, streams)) out.push_back({name, file->size});
    if (!folder_) return out;
    const std::string_view endings[] = {stream_ending, picture_endings[0], picture_endings[1]};
    const auto files = folder_->files(endings);
    std::set<std::string_view> pictures;
    for (const auto& file : files) (file.path.ends_with(stream_ending) ? streams : pictures).insert(file.path);
    for (const auto& [path, size] : files) {
        if (!path.ends_with(stream_ending) || is_sibling(path, streams)) continue;
        ListedFile& stream = out.emplace_back(ListedFile{path, size});
        const auto name = path.substr(0, path.size() - stream_ending.size());
        for (const char* picture : {".jpg", ".png"})
            if (pictures.contains(name + picture)) stream.poster = name + picture;
    }
    return out;
}

}  // namespace htvm::live
