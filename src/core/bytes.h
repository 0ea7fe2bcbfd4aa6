// Little-endian bytes: a writer with a growing buffer, and a reader that checks every access.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace htvm::internal {

class ByteWriter {
public:
    void u8(std::uint8_t v) { bytes_.push_back(v); }
    void u16(std::uint16_t v) { put(v, 2); }
    void u32(std::uint32_t v) { put(v, 4); }
    void u64(std::uint64_t v) { put(v, 8); }
    // LEB128: seven bits per byte, least significant first; the top bit is set on all bytes except the last.
    void varint(std::uint64_t v) {
        for (; v >= 0x80; v >>= 7) bytes_.push_back(static_cast<std::uint8_t>(v | 0x80));
        bytes_.push_back(static_cast<std::uint8_t>(v));
    }
    // Zig-zag: 0, -1, 1, -2, ... become 0, 1, 2, 3, ...
    void signed_varint(std::int64_t v) {
        varint((static_cast<std::uint64_t>(v) << 1) ^ static_cast<std::uint64_t>(v >> 63));
    }
    void bytes(std::span<const std::uint8_t> v) { bytes_.insert(bytes_.end(), v.begin(), v.end()); }
    std::size_t size() const { return bytes_.size(); }
    const std::vector<std::uint8_t>& data() const { return bytes_; }
    std::vector<std::uint8_t> take() { return std::move(bytes_); }

private:
    void put(std::uint64_t v, int n) {
        for (int i = 0; i < n; ++i) bytes_.push_back(static_cast<std::uint8_t>(v >> (8 * i)));
    }
    std::vector<std::uint8_t> bytes_;
};

// Reading past the end gives zero and makes ok() false for good. Check ok() before allocating by what was read.
class ByteReader {
public:
    explicit ByteReader(std::span<const std::uint8_t> data) : data_(data) {}
    std::uint8_t u8() { return static_cast<std::uint8_t>(get(1)); }
    std::uint16_t u16() { return static_cast<std::uint16_t>(get(2)); }
    std::uint32_t u32() { return static_cast<std::uint32_t>(get(4)); }
    std::uint64_t u64() { return get(8); }
    std::uint64_t varint() {
        std::uint64_t v = 0;
        for (int shift = 0; shift < 64; shift += 7) {
            const std::uint8_t b = u8();
            if (shift == 63 && b > 1) break;
            v |= static_cast<std::uint64_t>(b & 0x7f) << shift;
            if (!(b & 0x80)) return v;
        }
        ok_ = false;
        return 0;
    }
    std::int64_t signed_varint() {
        const std::uint64_t v = varint();
        return static_cast<std::int64_t>(v >> 1) ^ -static_cast<std::int64_t>(v & 1);
    }
    // The next n bytes; if fewer are left, none, and ok() becomes false.
    std::span<const std::uint8_t> bytes(std::uint64_t n) {
        if (n > remaining()) {
            ok_ = false;
            position_ = data_.size();
            return {};
        }
        auto out = data_.subspan(position_, static_cast<std::size_t>(n));
        position_ += static_cast<std::size_t>(n);
        return out;
    }
    std::size_t remaining() const { return data_.size() - position_; }
    std::size_t position() const { return position_; }
    bool ok() const { return ok_; }

private:
    std::uint64_t get(std::size_t n) {
        if (n > remaining()) {
            ok_ = false;
            position_ = data_.size();
            return 0;
        }
        std::uint64_t v = 0;
        for (std::size_t i = 0; i < n; ++i) v |= static_cast<std::uint64_t>(data_[position_ + i]) << (8 * i);
        position_ += n;
        return v;
    }
    std::span<const std::uint8_t> data_;
    std::size_t position_ = 0;
    bool ok_ = true;
};

}  // namespace htvm::internal
