// The bytes of a PLY, from memory or from a stream; a stream is never read beyond the end of the mesh.
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

    // True if at least n more bytes exist; they are then at cursor(). A stream is asked for exactly the bytes that are
    // missing, so ask only for bytes that the mesh is known to have. n is at most 1 MiB.
    bool ensure(std::size_t n) { return buffered() >= n || refill(n); }
    // The number of bytes already at cursor(), whatever was ensured.
    std::size_t buffered() const { return static_cast<std::size_t>(end_ - cursor_); }
    const std::uint8_t* cursor() const { return cursor_; }
    // Moves past n bytes, which must have been ensured.
    void advance(std::size_t n) {
        cursor_ += n;
        consumed_ += n;
    }
    // Moves past n bytes that need not have been ensured; false if there are fewer.
    bool skip(std::uint64_t n);
    // The number of bytes left, if known: for memory.
    std::optional<std::uint64_t> remaining() const;
    // The number of bytes moved past since the beginning.
    std::uint64_t consumed() const { return consumed_; }

private:
    bool refill(std::size_t n);

    std::streambuf* stream_ = nullptr;
    std::vector<std::uint8_t> buffer_;  // for a stream: [cursor_, end_) lies in it
    const std::uint8_t* cursor_ = nullptr;
    const std::uint8_t* end_ = nullptr;
    std::uint64_t consumed_ = 0;
};

// Reads bytes up to and including the next `line_end` (or up to the end of the bytes), and returns them without it.
// Nothing if no byte was left or if the line is longer than `most` bytes.
std::optional<std::string_view> read_line(PlySource& source, char line_end, std::vector<char>& line, std::size_t most);

// Skips white space and reads the word after it (but not the separator that ends it). Empty at the end of the
// bytes, and if the word is longer than 255 characters, which no number is.
std::string_view read_word(PlySource& source, std::span<char, 256> word);

// Skips what may stand before a PLY and between two: white space, zero bytes (which pad blocks), the control-Z of old
// systems and byte-order marks. False if nothing is left after them.
bool skip_to_ply(PlySource& source);

}  // namespace htvm
