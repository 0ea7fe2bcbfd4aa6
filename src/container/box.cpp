#include "container/box.h"

namespace htvm {

void BoxWriter::begin(std::uint32_t type) {
    open_.push_back(bytes_.size());
    u32(0);
    u32(type);
}

void BoxWriter::begin(std::uint32_t type, std::uint8_t version, std::uint32_t flags) {
    begin(type);
    u8(version);
    u24(flags);
}

void BoxWriter::end() {
    const auto at = open_.back();
    open_.pop_back();
    set_u32(at, static_cast<std::uint32_t>(bytes_.size() - at));
}

void BoxWriter::set_u32(std::size_t at, std::uint32_t v) {
    for (std::size_t i = 0; i < 4; ++i) bytes_[at + i] = static_cast<std::uint8_t>(v >> (24 - 8 * i));
}

std::span<const std::uint8_t> BoxReader::take(std::uint64_t n) {
    if (n > remaining()) {
        ok_ = false;
        position_ = bytes_.size();
        return {};
    }
    const auto out = bytes_.subspan(position_, static_cast<std::size_t>(n));
    position_ += out.size();
    return out;
}

std::uint64_t BoxReader::get(std::size_t n) {
    std::uint64_t out = 0;
    for (const auto byte : take(n)) out = out << 8 | byte;
    return out;
}

std::optional<MediaBox> BoxReader::next() {
    if (remaining() == 0) return std::nullopt;
    std::uint64_t size = u32(), header = 8;
    MediaBox out;
    out.type = u32();
    if (size == 1) {
        size = u64();
        header = 16;
    } else if (size == 0) {
        size = header + remaining();  // up to the end
    }
    if (!ok_ || size < header || size - header > remaining()) {
        ok_ = false;
        position_ = bytes_.size();
        return std::nullopt;
    }
    out.inside = take(size - header);
    return out;
}

std::optional<MediaBox> find_box(std::span<const std::uint8_t> boxes, std::uint32_t type) {
    BoxReader in(boxes);
    while (const auto box = in.next())
        if (box->type == type) return box;
    return std::nullopt;
}

bool has_whole_boxes(std::span<const std::uint8_t> bytes) {
    BoxReader in(bytes);
    while (in.next())
        ;
    return in.ok() && !bytes.empty() && in.remaining() == 0;
}

}  // namespace htvm
