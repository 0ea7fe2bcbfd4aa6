#include "live/hub/stream_name.h"

#include <algorithm>

namespace htvm::live {

bool is_stream_name(std::string_view name) {
    constexpr std::size_t longest = 64;
    const auto own = ladder_of(name);
    const auto fits = [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' ||
               c == '.';
    };
    return !own.empty() && own.size() <= longest && own.front() != '.' && std::all_of(own.begin(), own.end(), fits);
}

std::string rung_name(std::string_view ladder, std::size_t number) {
    return std::string(ladder) + '~' + std::to_string(number);
}

std::string_view ladder_of(std::string_view name) {
    const auto size = name.size();
    const bool is_rung =
        size >= 2 && name[size - 2] == '~' && name[size - 1] >= '1' && name[size - 1] <= char('0' + most_live_rungs);
    return is_rung ? name.substr(0, size - 2) : name;
}

}  // namespace htvm::live
