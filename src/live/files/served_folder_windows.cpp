// A served folder, on Windows: each segment is looked at before what is in it.
#include <fcntl.h>
#include <io.h>
#include <windows.h>

#include <cstdio>
#include <filesystem>
#include <utility>
#include <vector>

#include "live/files/served_files.h"

namespace htvm::live {
namespace {

namespace fs = std::filesystem;

// A handle that is closed where it goes out of scope.
class Handle {
public:
    explicit Handle(HANDLE handle) : handle_(handle) {}
    Handle(Handle&& other) noexcept : handle_(other.release()) {}
    Handle& operator=(Handle&&) = delete;
    ~Handle() {
        if (valid()) ::CloseHandle(handle_);
    }
    bool valid() const { return handle_ != INVALID_HANDLE_VALUE; }
    HANDLE get() const { return handle_; }
    HANDLE release() { return std::exchange(handle_, INVALID_HANDLE_VALUE); }

private:
    HANDLE handle_;
};

// The link itself where it is one, so that none is followed. While a folder is open, nobody can put another in its
// place.
Handle opened(const fs::path& path) {
    return Handle(::CreateFileW(path.c_str(), GENERIC_READ, FILE_SHARE_READ | FILE_SHARE_WRITE, nullptr, OPEN_EXISTING,
                                FILE_FLAG_BACKUP_SEMANTICS | FILE_FLAG_OPEN_REPARSE_POINT, nullptr));
}

// Names that Windows gives devices, or reads as parts of others: ':' begins a stream of a file or follows a drive.
bool is_plain_name(const std::string& segment) {
    return segment.find_first_of(":*?<>|\"") == std::string::npos && !segment.ends_with('.') && !segment.ends_with(' ');
}

std::string tag_of(const BY_HANDLE_FILE_INFORMATION& about) {
    char text[64];
    std::snprintf(text, sizeof text, "\"%lx%08lx-%lx%08lx\"", about.nFileSizeHigh, about.nFileSizeLow,
                  about.ftLastWriteTime.dwHighDateTime, about.ftLastWriteTime.dwLowDateTime);
    return text;
}

}  // namespace

OpenFile& OpenFile::operator=(OpenFile&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    return *this;
}

OpenFile::~OpenFile() {
    if (descriptor_ >= 0) ::_close(descriptor_);
}

std::size_t OpenFile::read(std::uint64_t offset, std::span<char> out) const {
    if (::_lseeki64(descriptor_, static_cast<long long>(offset), SEEK_SET) < 0) return 0;
    const auto count = ::_read(descriptor_, out.data(), static_cast<unsigned>(out.size()));
    return count < 0 ? 0 : static_cast<std::size_t>(count);
}

Result<ServedFolder> ServedFolder::open(const std::string& path) {
    std::error_code error;
    if (!fs::is_directory(path.empty() ? fs::path(".") : fs::path(path), error))
        return fail(ErrorKind::bad_input, path + " is not a folder that can be read");
    return ServedFolder(path, OpenFile());
}

Result<ServedFile> ServedFolder::file(std::span<const std::string> segments) const {
    const auto missing = [] { return fail(ErrorKind::bad_input, "there is no such file"); };
    if (segments.empty()) return missing();
    std::vector<Handle> folders;
    folders.reserve(segments.size());
    fs::path path = path_;
    for (const auto& segment : segments) {
        if (!is_plain_name(segment)) return missing();
        path /= fs::path(segment);
        Handle next = opened(path);
        BY_HANDLE_FILE_INFORMATION about{};
        if (!next.valid() || ::GetFileType(next.get()) != FILE_TYPE_DISK ||
            !::GetFileInformationByHandle(next.get(), &about) ||
            (about.dwFileAttributes & FILE_ATTRIBUTE_REPARSE_POINT))
            return missing();
        const bool is_folder = about.dwFileAttributes & FILE_ATTRIBUTE_DIRECTORY;
        if (is_folder == (&segment == &segments.back())) return missing();
        if (is_folder) {
            folders.push_back(std::move(next));
            continue;
        }
        OpenFile file(::_open_osfhandle(reinterpret_cast<std::intptr_t>(next.get()), _O_RDONLY | _O_BINARY));
        if (file.descriptor() < 0) return missing();
        next.release();
        const auto size = (std::uint64_t{about.nFileSizeHigh} << 32) | about.nFileSizeLow;
        return ServedFile{std::move(file), size, tag_of(about)};
    }
    return missing();
}

}  // namespace htvm::live
