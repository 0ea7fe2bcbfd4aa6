#include "live/hub/stream_name.h"

#include <algorithm>

namespace htvm::live {

bool is_stream_name(std::string_view name) {
    constexpr std::size_t longest = 64;
    const auto fits = [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' ||
               c == '.';
    };
    return !name.empty() && name.size() <= longest && name.front() != '.' &&
           std::all_of(name.begin(), name.end(), fits);
}

}  // namespace htvm::live
