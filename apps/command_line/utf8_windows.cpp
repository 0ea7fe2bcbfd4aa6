// The C library's conversions between char and wchar_t, in UTF-8: std::filesystem::path makes names by them. Those of
// MinGW's C library, in whose place these are linked, know no UTF-8.
#include <cstdint>
#include <cwchar>

namespace {

constexpr std::size_t invalid = static_cast<std::size_t>(-1), incomplete = static_cast<std::size_t>(-2);

// How many bytes a letter has that begins with this one; 0: none begins so.
int length_of(unsigned char first) {
    if (first < 0x80) return 1;
    if (first < 0xC2) return 0;
    if (first < 0xE0) return 2;
    if (first < 0xF0) return 3;
    return first < 0xF5 ? 4 : 0;
}

}  // namespace

extern "C" {

// A letter beyond 16 bits is two halves: the first comes with three bytes, the second waits in the state for the
// fourth.
std::size_t mbrtowc(wchar_t* out, const char* text, std::size_t bytes, std::mbstate_t* state) {
    static std::mbstate_t own = 0;
    auto& waits = state ? *state : own;
    if (!text) return static_cast<std::size_t>(waits = 0);
    if (bytes == 0) return incomplete;
    if (waits != 0) {
        if (out) *out = static_cast<wchar_t>(waits);
        waits = 0;
        return 1;
    }
    const auto first = static_cast<unsigned char>(*text);
    const int length = length_of(first);
    if (length == 0) return invalid;
    if (static_cast<std::size_t>(length) > bytes) return incomplete;
    std::uint32_t letter = length == 1 ? first : first & (0x7Fu >> length);
    for (int i = 1; i < length; ++i) {
        const auto next = static_cast<unsigned char>(text[i]);
        if ((next & 0xC0) != 0x80) return invalid;
        letter = letter << 6 | (next & 0x3Fu);
    }
    const bool surrogate = letter >= 0xD800 && letter < 0xE000, overlong = length == 3 && letter < 0x800;
    if (letter > 0x10FFFF || surrogate || overlong || (length == 4 && letter < 0x10000)) return invalid;
    if (out) *out = static_cast<wchar_t>(letter < 0x10000 ? letter : 0xD7C0 + (letter >> 10));
    if (letter < 0x10000) return letter == 0 ? 0 : static_cast<std::size_t>(length);
    waits = static_cast<std::mbstate_t>(0xDC00 | (letter & 0x3FF));
    return 3;
}

std::size_t wcrtomb(char* out, wchar_t unit, std::mbstate_t* state) {
    static std::mbstate_t own = 0;
    auto& waits = state ? *state : own;
    if (!out) {
        waits = 0;
        return 1;
    }
    std::uint32_t letter = unit;
    if (waits != 0) {
        if (letter < 0xDC00 || letter >= 0xE000) return invalid;
        letter = 0x10000 + ((static_cast<std::uint32_t>(waits) - 0xD800) << 10) + (letter - 0xDC00);
        waits = 0;
    } else if (letter >= 0xD800 && letter < 0xDC00) {
        waits = static_cast<std::mbstate_t>(letter);
        return 0;
    } else if (letter >= 0xDC00 && letter < 0xE000) {
        return invalid;
    }
    if (letter < 0x80) {
        *out = static_cast<char>(letter);
        return 1;
    }
    const int length = letter < 0x800 ? 2 : letter < 0x10000 ? 3 : 4;
    for (int i = length - 1; i > 0; --i, letter >>= 6) out[i] = static_cast<char>(0x80 | (letter & 0x3F));
    *out = static_cast<char>(static_cast<std::uint32_t>(0xF00 >> length & 0xFF) | letter);
    return static_cast<std::size_t>(length);
}

}  // extern "C"
