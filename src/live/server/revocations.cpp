#include "live/server/revocations.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>

namespace htvm::live {

Result<Revocations> read_revocations(const std::string& path) {
    constexpr std::size_t longest = 128;
    constexpr const char* blank = " \t\r";
    std::ifstream in(path, std::ios::binary);
    if (!in) return fail(ErrorKind::bad_input, "cannot read " + path + ": " + std::strerror(errno));
    Revocations out;
    for (std::string line; std::getline(in, line);) {
        line.resize(std::min(line.find('#'), line.size()));
        const auto begin = line.find_first_not_of(blank);
        if (begin == std::string::npos) continue;
        auto id = line.substr(begin, line.find_last_not_of(blank) + 1 - begin);
        if (id.size() > longest) return fail(ErrorKind::bad_input, path + " has a line that is no id");
        out.insert(std::move(id));
    }
    if (in.bad()) return fail(ErrorKind::bad_input, "cannot read " + path + " whole");
    return out;
}

}  // namespace htvm::live
