#include "io/system_file.h"

#include <cerrno>
#include <system_error>

#ifdef _WIN32
#include <io.h>

#include <random>
#include <string>
#else
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#endif

namespace htvm {

namespace fs = std::filesystem;

bool replace_file(const fs::path& from, const fs::path& to) {
    std::error_code error;
    fs::rename(from, to, error);
    if (error) errno = error.default_error_condition().value();
    return !error;
}

#ifdef _WIN32

std::FILE* open_file(const fs::path& path, const char* mode) {
    const std::string letters = mode;
    return ::_wfopen(path.c_str(), std::wstring(letters.begin(), letters.end()).c_str());
}

bool write_through(std::FILE* file) { return ::_commit(::_fileno(file)) == 0; }

void keep_owner(const fs::path&, const fs::path&) {}

// A user's folder for temporary files is their own.
std::optional<fs::path> make_own_folder(const fs::path& begin) {
    std::random_device random;
    for (int attempt = 0; attempt < 100; ++attempt) {
        auto path = begin;
        path += std::to_string(random());
        std::error_code error;
        if (fs::create_directory(path, error)) return path;
        if (error) return std::nullopt;
    }
    return std::nullopt;
}

bool is_disk_full(int reason) { return reason == ENOSPC; }

#else

std::FILE* open_file(const fs::path& path, const char* mode) { return std::fopen(path.c_str(), mode); }

bool write_through(std::FILE* file) { return ::fsync(::fileno(file)) == 0; }

void keep_owner(const fs::path& from, const fs::path& to) {
    struct stat was {};
    if (geteuid() != 0 || stat(from.c_str(), &was) != 0) return;
    [[maybe_unused]] const int kept = chown(to.c_str(), was.st_uid, was.st_gid);
}

std::optional<fs::path> make_own_folder(const fs::path& begin) {
    auto name = begin.string() + "XXXXXX";
    if (!::mkdtemp(name.data())) return std::nullopt;
    return fs::path(name);
}

bool is_disk_full(int reason) { return reason == ENOSPC || reason == EDQUOT; }

#endif

}  // namespace htvm
