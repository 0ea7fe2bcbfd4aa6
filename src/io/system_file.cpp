#include "io/system_file.h"

#include <cerrno>
#include <system_error>

#ifdef _WIN32
#include <io.h>

#include <string>
#else
#include <sys/stat.h>
#include <unistd.h>
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

bool is_disk_full(int reason) { return reason == ENOSPC; }

#else

std::FILE* open_file(const fs::path& path, const char* mode) { return std::fopen(path.c_str(), mode); }

bool write_through(std::FILE* file) { return ::fsync(::fileno(file)) == 0; }

void keep_owner(const fs::path& from, const fs::path& to) {
    struct stat was {};
    if (geteuid() != 0 || stat(from.c_str(), &was) != 0) return;
    [[maybe_unused]] const int kept = chown(to.c_str(), was.st_uid, was.st_gid);
}

bool is_disk_full(int reason) { return reason == ENOSPC || reason == EDQUOT; }

#endif

}  // namespace htvm
