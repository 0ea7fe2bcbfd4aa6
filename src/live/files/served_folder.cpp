// A served folder, by POSIX: each segment is opened within the one before.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <utility>

#include "live/files/served_files.h"

namespace htvm::live {
namespace {

std::string tag_of(const struct stat& status) {
    char text[64];
    std::snprintf(text, sizeof text, "\"%llx-%llx%08lx\"", static_cast<unsigned long long>(status.st_size),
                  static_cast<unsigned long long>(status.st_mtim.tv_sec),
                  static_cast<unsigned long>(status.st_mtim.tv_nsec));
    return text;
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

}  // namespace htvm::live
