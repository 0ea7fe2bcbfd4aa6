#include "live/server/served_files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <set>

namespace htvm::live {
namespace {

constexpr std::size_t most_files = 10000, most_entries = 100000;
constexpr std::string_view stream_ending = ".htvm", picture_endings[] = {".png", ".jpg"};

std::string tag_of(const struct stat& status) {
    char text[64];
    std::snprintf(text, sizeof text, "\"%llx-%llx%08lx\"", static_cast<unsigned long long>(status.st_size),
                  static_cast<unsigned long long>(status.st_mtim.tv_sec),
                  static_cast<unsigned long>(status.st_mtim.tv_nsec));
    return text;
}

// A file by its path, which may change meanwhile as those of a folder may; symbolic links are not followed.
Result<ServedFile> file_at(const std::filesystem::path& path) {
    const auto folder = ServedFolder::open(path.parent_path().string());
    if (!folder) return tl::unexpected(folder.error());
    const std::vector<std::string> name = {path.filename().string()};
    return folder->file(name);
}

}  // namespace

OpenFile& OpenFile::operator=(OpenFile&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    return *this;
}

OpenFile::~OpenFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
}

std::size_t OpenFile::read(std::uint64_t offset, std::span<char> out) const {
    for (;;) {
        const auto count = ::pread(descriptor_, out.data(), out.size(), static_cast<off_t>(offset));
        if (count >= 0) return static_cast<std::size_t>(count);
        if (errno != EINTR) return 0;
    }
}

Result<ServedFolder> ServedFolder::open(const std::string& path) {
    OpenFile folder(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (folder.descriptor() < 0) return fail(ErrorKind::bad_input, path + " is not a folder that can be read");
    return ServedFolder(path, std::move(folder));
}

Result<ServedFile> ServedFolder::file(std::span<const std::string> segments) const {
    const auto missing = [] { return fail(ErrorKind::bad_input, "there is no such file"); };
    if (segments.empty()) return missing();
    OpenFile at;
    int folder = folder_.descriptor();
    for (const auto& segment : segments) {
        const bool last = &segment == &segments.back();
        // Not waiting for a writer, should it be a pipe.
        const int flags = O_RDONLY | O_NOFOLLOW | O_CLOEXEC | (last ? O_NONBLOCK : O_DIRECTORY);
        OpenFile next(::openat(folder, segment.c_str(), flags));
        if (next.descriptor() < 0) return missing();
        at = std::move(next);
        folder = at.descriptor();
    }
    struct stat status {};
    if (::fstat(at.descriptor(), &status) != 0 || !S_ISREG(status.st_mode)) return missing();
    return ServedFile{std::move(at), static_cast<std::uint64_t>(status.st_size), tag_of(status)};
}

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
        if (!error) out.push_back({it->path().lexically_relative(path_).string(), size});
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
