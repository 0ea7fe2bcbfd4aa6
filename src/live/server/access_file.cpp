#include "live/server/access_file.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace htvm::live {

Result<std::string> read_access_file(const std::string& path) {
    constexpr std::size_t most_bytes = std::size_t{4} << 20;
    std::error_code unknown;
    if (std::filesystem::is_directory(path, unknown))
        return fail(ErrorKind::bad_input, "cannot read " + path + ": it is a folder");
    std::ifstream in(path, std::ios::binary);
    if (!in) return fail(ErrorKind::bad_input, "cannot read " + path + ": " + std::strerror(errno));
    std::string out;
    // Reading by iterators would throw where the system cannot read.
    std::array<char, 4096> part{};
    while (in.read(part.data(), part.size()), in.gcount() > 0) {
        out.append(part.data(), static_cast<std::size_t>(in.gcount()));
        if (out.size() > most_bytes) return fail(ErrorKind::bad_input, path + " is larger than such a file may be");
    }
    if (in.bad()) return fail(ErrorKind::bad_input, "cannot read " + path + " whole");
    return out;
}

}  // namespace htvm::live
