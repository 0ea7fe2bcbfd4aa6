#include "io/ply_source.h"

#include <algorithm>

namespace htvm {

namespace {

bool is_space(std::uint8_t c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\v' || c == '\f'; }

}  // namespace

bool PlySource::refill(std::size_t n) {
    if (!stream_) return false;
    const std::size_t kept = buffered();
    if (kept > 0) std::copy(cursor_, end_, buffer_.data());
    if (buffer_.size() < n) buffer_.resize(n);
    const auto missing = static_cast<std::streamsize>(n - kept);
    const std::streamsize got = stream_->sgetn(reinterpret_cast<char*>(buffer_.data() + kept), missing);
    cursor_ = buffer_.data();
    end_ = cursor_ + kept + static_cast<std::size_t>(std::max<std::streamsize>(got, 0));
    return got == missing;
}

bool PlySource::skip(std::uint64_t n) {
    if (const auto left = remaining(); left && *left < n) return false;
    constexpr std::uint64_t chunk = 1 << 16;
    while (n > 0) {
        const auto now = static_cast<std::size_t>(std::min(n, chunk));
        if (!ensure(now)) return false;
        advance(now);
        n -= now;
    }
    return true;
}

std::optional<std::uint64_t> PlySource::remaining() const {
    if (stream_) return std::nullopt;
    return buffered();
}

std::optional<std::string_view> read_line(PlySource& source, char line_end, std::vector<char>& line, std::size_t most) {
    line.clear();
    if (!source.ensure(1)) return std::nullopt;
    while (source.ensure(1)) {
        const char c = static_cast<char>(*source.cursor());
        source.advance(1);
        if (c == line_end) break;
        if (line.size() == most) return std::nullopt;
        line.push_back(c);
    }
    return std::string_view(line.data(), line.size());
}

bool skip_to_ply(PlySource& source) {
    while (source.ensure(1)) {
        const std::uint8_t c = *source.cursor();
        const bool is_mark = c == 0xef && source.ensure(3) && source.cursor()[1] == 0xbb && source.cursor()[2] == 0xbf;
        constexpr std::uint8_t control_z = 26;
        if (!is_space(c) && c != 0 && c != control_z && !is_mark) return true;
        source.advance(is_mark ? 3 : 1);
    }
    return false;
}

std::string_view read_word(PlySource& source, std::span<char, 256> word) {
    while (source.ensure(1) && is_space(*source.cursor())) source.advance(1);
    std::size_t length = 0;
    while (source.ensure(1) && !is_space(*source.cursor())) {
        if (length == word.size() - 1) return {};
        word[length++] = static_cast<char>(*source.cursor());
        source.advance(1);
    }
    return {word.data(), length};
}

}  // namespace htvm
