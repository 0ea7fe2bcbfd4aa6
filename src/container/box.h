// Boxes of ISO base media files (ISO/IEC 14496-12): a size, a type of four letters, and what is inside, most
// significant byte first. A writer that puts boxes into boxes, and a reader that checks every access.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace htvm {

// The four letters of a type as the number that they make.
constexpr std::uint32_t four(const char (&letters)[5]) {
    std::uint32_t out = 0;
    for (int i = 0; i < 4; ++i) out = out << 8 | static_cast<std::uint8_t>(letters[i]);
    return out;
}

class BoxWriter {
public:
    void u8(std::uint64_t v) { put(v, 1); }
    void u16(std::uint64_t v) { put(v, 2); }
    void u24(std::uint64_t v) { put(v, 3); }
    void u32(std::uint64_t v) { put(v, 4); }
    void u64(std::uint64_t v) { put(v, 8); }
    void zeros(std::size_t n) { bytes_.insert(bytes_.end(), n, std::uint8_t{0}); }
    void bytes(std::span<const std::uint8_t> v) { bytes_.insert(bytes_.end(), v.begin(), v.end()); }
    void text(std::string_view v) { bytes_.insert(bytes_.end(), v.begin(), v.end()); }
    // What is written from here up to end() is inside this box.
    void begin(std::uint32_t type);
    void begin(std::uint32_t type, std::uint8_t version, std::uint32_t flags);
    // Boxes must stay below 4 GiB; the data of samples, which need not, is no business of this writer.
    void end();
    std::size_t size() const { return bytes_.size(); }
    // Overwrites four bytes that are there: what is known only later.
    void set_u32(std::size_t at, std::uint32_t v);
    std::vector<std::uint8_t> take() { return std::move(bytes_); }

private:
    void put(std::uint64_t v, int n) {
        for (int i = n - 1; i >= 0; --i) bytes_.push_back(static_cast<std::uint8_t>(v >> (8 * i)));
    }
    std::vector<std::uint8_t> bytes_;
    std::vector<std::size_t> open_;  // where the boxes begin that are not ended
};

class BoxReader;

struct MediaBox {
    std::uint32_t type = 0;
    std::span<const std::uint8_t> inside;
};

// Reading past the end gives zero and makes ok() false for good. Check ok() before allocating by what was read.
class BoxReader {
public:
    explicit BoxReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
    std::uint8_t u8() { return static_cast<std::uint8_t>(get(1)); }
    std::uint16_t u16() { return static_cast<std::uint16_t>(get(2)); }
    std::uint32_t u32() { return static_cast<std::uint32_t>(get(4)); }
    std::uint64_t u64() { return get(8); }
    std::span<const std::uint8_t> take(std::uint64_t n);
    void skip(std::uint64_t n) { (void)take(n); }
    std::span<const std::uint8_t> rest() { return take(remaining()); }
    std::size_t remaining() const { return bytes_.size() - position_; }
    bool ok() const { return ok_; }
    // The box that begins here; nothing at the end, or if its size is not possible, which makes ok() false.
    std::optional<MediaBox> next();

private:
    std::uint64_t get(std::size_t n);
    std::span<const std::uint8_t> bytes_;
    std::size_t position_ = 0;
    bool ok_ = true;
};

// Whether the bytes are boxes one after another up to their end: of a file that is cut short they are not.
bool has_whole_boxes(std::span<const std::uint8_t> bytes);

// The first box of this type among those that begin here; nothing if there is none.
std::optional<MediaBox> find_box(std::span<const std::uint8_t> boxes, std::uint32_t type);

}  // namespace htvm
