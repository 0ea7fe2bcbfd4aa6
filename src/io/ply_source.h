// The bytes of a PLY, from memory or from a stream, taken so that a stream is never read further than the mesh goes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <streambuf>
#include <string_view>
#include <vector>

namespace htvm {

class PlySource {
public:
    explicit PlySource(std::span<const std::uint8_t> bytes) : cursor_(bytes.data()), end_(cursor_ + bytes.size()) {}
    // The stream's buffer, which must outlive the source.
    explicit PlySource(std::streambuf& stream) : stream_(&stream) {}

    // True where at least n more bytes exist; they then lie at cursor(). A stream is asked for just the bytes that are
    // missing, so ask only for what the mesh is known to hold. n at most 1 MiB.
    bool ensure(std::size_t n) { return buffered() >= n || refill(n); }
    // Bytes at cursor() already, whatever was ensured.
    std::size_t buffered() const { return static_cast<std::size_t>(end_ - cursor_); }
    const std::uint8_t* cursor() const { return cursor_; }
    // Moves past n bytes, which must have been ensured.
    void advance(std::size_t n) {
        cursor_ += n;
        consumed_ += n;
    }
    // Moves past n bytes that need not have been ensured; false where there are fewer.
    bool skip(std::uint64_t n);
    // Bytes left, where that is known: in memory.
    std::optional<std::uint64_t> remaining() const;
    // Bytes moved past since the beginning.
    std::uint64_t consumed() const { return consumed_; }

private:
    bool refill(std::size_t n);

    std::streambuf* stream_ = nullptr;
    std::vector<std::uint8_t> buffer_;  // of the stream: [cursor_, end_) lies in it
    const std::uint8_t* cursor_ = nullptr;
    const std::uint8_t* end_ = nullptr;
    std::uint64_t consumed_ = 0;
};

// Takes bytes up to and including the next '\n' (or up to the end), and gives them without it and without a '\r' before
// it. Nothing where no byte was left or where the line is longer than `most` bytes.
std::optional<std::string_view> take_line(PlySource& source, std::vector<char>& line, std::size_t most);

// Takes leading white space and the word after it (not the separator that ends it). Empty at the end of the bytes, and
// where the word is longer than 255 characters, which no number is.
std::string_view take_word(PlySource& source, std::span<char, 256> word);

// Takes spaces, tabs and ends of lines. False where nothing is left after them.
bool take_white_space(PlySource& source);

}  // namespace htvm
