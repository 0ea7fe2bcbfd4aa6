#include "sequences.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "htvm/decoder.hpp"
#include "htvm/frame_numbers.hpp"
#include "io/mesh_file.h"
#include "io/sequence.h"
#include "stream_file.h"

namespace htvm::app {

// ---- Sources of meshes ----------------------------------------------------------------------------------------------

namespace {

Result<MeshSource> open_stream(const std::string& path, DecoderOptions options) {
    auto input = StreamInput::open(path, options.max_packet_bytes);
    if (!input) return tl::unexpected(input.error());
    MeshSource source;
    source.name = path;
    options.intra_coder = draco_intra_coder();
    source.next = [input = std::make_shared<StreamInput>(std::move(*input)),
                   decoder = std::make_shared<Decoder>(options), numbers = FrameNumbers(),
                   expected = std::uint32_t{0}](MeshSource& self) mutable -> Result<std::optional<Mesh>> {
        while (const auto packet = input->next()) {
            numbers.take(*packet);
            auto frame = decoder->push(*packet);
            if (!frame) return fail(frame.error().kind, self.name + ": " + frame.error().message);
            if (decoder->sequence()) self.millimetres_per_unit = decoder->sequence()->unit_micrometres / 1000.0;
            if (!*frame) continue;
            // Without this, every frame after a lost one would be compared with its neighbour.
            const auto number = numbers.of(packet->frame);
            if (number != expected)
                return fail(ErrorKind::corrupt_stream,
                            fmt::format("{} has frame {} where frame {} is due: frames were lost; decode it, and give "
                                        "the same frames on both sides",
                                        self.name, number, expected));
            ++expected;
            return std::optional(std::move((*frame)->mesh));
        }
        if (input->oversized_packets() > 0)
            return fail(ErrorKind::limit, self.name + " has packets larger than --max-packet");
        if (input->damaged_bytes() > 0 || input->cut_short_bytes() > 0 || !decoder->sequence())
            return fail(ErrorKind::corrupt_stream,
                        self.name + " is damaged, cut short, or not an htvm stream; 'htvm info' tells more");
        return std::optional<Mesh>{};
    };
    return source;
}

}  // namespace

Result<MeshSource> open_meshes(const std::string& name, const std::string& unit, const DecoderOptions& limits) {
    if (name == "-")
        return fail(ErrorKind::bad_input, "standard input is not read here; give files, a folder or an .htvm stream");
    if (name.ends_with(".htvm")) return open_stream(name, limits);
    const bool guess = unit == "auto";
    const auto chosen = guess ? LengthUnit::millimetre : length_unit(unit);
    if (!chosen) return tl::unexpected(chosen.error());
    const auto files = find_sequence(name);
    if (!files) return tl::unexpected(files.error());
    MeshSource source;
    source.name = name;
    source.frames = files->paths.size();
    source.numbers = files->numbers;
    source.millimetres_per_unit = millimetres_per(*chosen);
    source.next = [paths = files->paths, guess,
                   given = std::size_t{0}](MeshSource& self) mutable -> Result<std::optional<Mesh>> {
        if (given == paths.size()) return std::optional<Mesh>{};
        auto mesh = read_mesh(paths[given]);
        if (!mesh) return tl::unexpected(mesh.error());
        if (given == 0 && guess) self.millimetres_per_unit = millimetres_per(guess_unit(*mesh));
        if (const auto ok = scale_positions(*mesh, self.millimetres_per_unit); !ok) return tl::unexpected(ok.error());
        ++given;
        return std::optional(std::move(*mesh));
    };
    return source;
}

// ---- Which frames belong together -----------------------------------------------------------------------------------

namespace {

// The place of a number, if it is there.
std::optional<std::size_t> place_of(std::span<const std::uint64_t> ascending, std::uint64_t number) {
    const auto at = std::lower_bound(ascending.begin(), ascending.end(), number);
    if (at == ascending.end() || *at != number) return std::nullopt;
    return static_cast<std::size_t>(at - ascending.begin());
}

}  // namespace

std::vector<FramePair> pair_by_number(std::span<const std::uint64_t> original, std::span<const std::uint64_t> decoded) {
    std::vector<FramePair> best;
    if (original.empty() || decoded.empty()) return best;
    using Reading = std::function<std::optional<std::size_t>(std::uint64_t)>;
    const std::vector<Reading> readings = {
        [&](std::uint64_t n) { return place_of(original, n); },
        [&](std::uint64_t n) {
            return n < original.size() ? std::optional(static_cast<std::size_t>(n)) : std::nullopt;
        },
        [&](std::uint64_t n) { return place_of(original, original[0] + (n - decoded[0])); }};
    for (const auto& reading : readings) {
        std::vector<FramePair> pairs;
        for (std::size_t k = 0; k < decoded.size(); ++k)
            if (const auto place = reading(decoded[k])) pairs.push_back({*place, k});
        if (pairs.size() > best.size()) best = std::move(pairs);
    }
    return best;
}

std::string frames_left_out(std::span<const std::uint64_t> numbers, std::span<const std::size_t> paired) {
    std::string list;
    std::size_t next = 0, left_out = 0;
    for (std::size_t k = 0; k < numbers.size();) {
        if (next < paired.size() && paired[next] == k) {
            ++next;
            ++k;
            continue;
        }
        const std::size_t first = k, end = next < paired.size() ? paired[next] : numbers.size();
        k = end;
        left_out += end - first;
        if (!list.empty()) list += ", ";
        list += end - first == 1 ? fmt::format("{}", numbers[first])
                                 : fmt::format("{} to {}", numbers[first], numbers[end - 1]);
    }
    if (left_out == 0) return {};
    return (left_out == 1 ? "frame " : "frames ") + list;
}

}  // namespace htvm::app
