#include "io/ply_body.h"

#include <algorithm>
#include <array>

#include "io/number_text.h"

namespace htvm {

namespace {

bool begins_comment(std::string_view word) { return word == "comment" || word == "obj_info" || word.starts_with('#'); }

}  // namespace

std::optional<double> read_value(PlyBody& body, PlyType type) {
    if (body.format == PlyFormat::ascii) {
        std::array<char, 256> memory;
        body.took_words = true;
        for (;;) {
            const auto word = read_word(body.source, memory);
            if (const auto value = parse_measurement(word); value || !begins_comment(word)) return value;
            while (body.source.ensure(1) && *body.source.cursor() != '\n' && *body.source.cursor() != '\r')
                body.source.advance(1);
        }
    }
    const std::size_t size = ply_type_size(type);
    if (!body.source.ensure(size)) return std::nullopt;
    const double value = decode_value(body.source.cursor(), type, body.format == PlyFormat::binary_big_endian);
    body.source.advance(size);
    return value;
}

std::optional<std::uint64_t> read_list_length(PlyBody& body, const PlyProperty& list) {
    const auto length = read_value(body, list.count_type);
    if (!length || !(*length >= 0) || *length > 4294967295.0) return std::nullopt;
    const auto whole = static_cast<std::uint64_t>(*length);
    if (static_cast<double>(whole) != *length) return std::nullopt;
    return whole;
}

bool skip_property(PlyBody& body, const PlyProperty& property) {
    std::uint64_t count = 1;
    if (property.is_list) {
        const auto length = read_list_length(body, property);
        if (!length) return false;
        count = *length;
    }
    if (body.format != PlyFormat::ascii) return body.source.skip(count * ply_type_size(property.type));
    for (std::uint64_t i = 0; i < count; ++i) {
        if (!read_value(body, property.type)) return false;
    }
    return true;
}

void fetch_ahead(PlyBody& body, std::uint64_t element_bytes, std::uint64_t elements_left) {
    constexpr std::uint64_t piece = 1 << 16;
    if (body.source.buffered() >= element_bytes) return;
    // In text, the last value of all may lack the separator that the count includes.
    const std::uint64_t wanted = element_bytes * std::min(elements_left, piece / (element_bytes + 1) + 1);
    (void)body.source.ensure(static_cast<std::size_t>(std::min(wanted - (wanted > 0 ? 1 : 0), piece)));
}

void skip_rest_of_line(PlyBody& body, char line_end) {
    while (body.took_words && body.source.ensure(1)) {
        const auto c = static_cast<char>(*body.source.cursor());
        body.source.advance(1);
        if (c == line_end) break;
    }
}

Result<void> check_element_count(const PlyBody& body, const PlyElement& element) {
    const std::uint64_t fewest = fewest_element_bytes(element, body.format);
    const auto left = body.source.remaining();
    if (!left || fewest == 0) return {};
    const std::uint64_t slack = body.format == PlyFormat::ascii ? 1 : 0;
    if (element.count <= (*left + slack) / fewest) return {};
    return fail(ErrorKind::bad_input, "the PLY header claims " + std::to_string(element.count) + " of the element \"" +
                                          element.name.substr(0, 80) + "\", more than the " + std::to_string(*left) +
                                          " bytes that follow can hold; the file is cut off or damaged");
}

std::size_t reservation(const PlyBody& body, std::uint64_t count, std::uint64_t bytes_each) {
    const std::uint64_t most = body.source.remaining().value_or(1 << 18) / bytes_each;
    return static_cast<std::size_t>(std::min(count, most));
}

tl::unexpected<Error> ends_within(const PlyElement& element, std::uint64_t index) {
    return fail(ErrorKind::bad_input, "the PLY ends or cannot be read at " + element.name + " " +
                                          std::to_string(index) + " of " + std::to_string(element.count) +
                                          "; the file is cut off or damaged");
}

}  // namespace htvm
