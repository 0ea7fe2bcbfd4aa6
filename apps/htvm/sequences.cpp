#include "sequences.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "command_line/capture_kind.h"
#include "command_line/terminal.h"
#include "htvm/decoder.hpp"
#include "htvm/frame_numbers.hpp"
#include "htvm/picture_decoder.hpp"
#include "io/loose_vertices.h"
#include "io/mesh_file.h"
#include "io/recording.h"
#include "io/sequence.h"
#include "io/texture_colours.h"
#include "metrics/front.h"
#include "stream_file.h"
#include "stream_seek.h"
#include "texture_output.h"

namespace htvm::app {

// ---- Sources of meshes ----------------------------------------------------------------------------------------------

namespace {

// What the packets' headers say of all frames, and the sequence header.
Result<void> scan_stream(MeshSource& source, const DecoderOptions& options) {
    auto input = StreamInput::open(source.name, options.max_packet_bytes);
    if (!input) return tl::unexpected(input.error());
    Decoder headers(options);
    FrameNumbers numbers;
    bool ascends = true;
    std::uint64_t indexed = 0;  // frames of the indices in front
    bool bounded = true;
    while (const auto packet = input->next()) {
        numbers.push(*packet);
        if (packet->kind == PacketKind::sequence)
            if (auto ok = headers.decode(*packet); !ok)
                return fail(ok.error().kind, source.name + ": " + ok.error().message);
        if (const auto index = read_index(*packet); packet->kind == PacketKind::front_index && index) {
            indexed += index->frames;
            bounded = bounded && index->bounds;
            if (bounded) extend(source.bounds, index->bounds);
        }
        const auto kind = frame_type(packet->kind);
        if (!kind) continue;
        source.kinds.push_back(*kind);
        ascends = ascends && (source.times_us.empty() || source.times_us.back() < packet->timestamp_us);
        source.numbers.push_back(numbers.of(packet->frame));
        source.times_us.push_back(packet->timestamp_us);
    }
    if (!headers.sequence() && input->oversized_packets() == 0)
        return fail(ErrorKind::corrupt_stream, source.name + " is not an htvm stream: no sequence header was found");
    if (auto whole = check_whole(*input, source.name); !whole) return whole;
    if (!ascends) source.times_us.clear();  // of sequences one after the other
    source.frames = source.numbers.size();
    if (!bounded || indexed != source.frames) source.bounds.reset();
    source.up = headers.sequence()->up;
    source.front = front_of(headers.sequence()->metadata);
    source.rate = {headers.sequence()->fps_numerator, headers.sequence()->fps_denominator};
    source.millimetres_per_unit = headers.sequence()->unit_micrometres / 1000.0;
    source.global_shift = headers.sequence()->global_shift;
    return {};
}

Result<MeshSource> open_stream(const std::string& path, DecoderOptions options) {
    MeshSource source;
    source.name = path;
    source.is_stream = true;
    options.intra_coder = draco_intra_coder();
    if (auto scanned = scan_stream(source, options); !scanned) return tl::unexpected(scanned.error());
    auto input = StreamInput::open(path, options.max_packet_bytes);
    if (!input) return tl::unexpected(input.error());
    struct Reading {
        StreamInput input;
        Decoder decoder;
        DecoderOptions options;
        FrameNumbers numbers = {};
        bool begun = false;
        PictureDecoder pictures;
        std::optional<Packet> ahead = {};  // read while looking for a frame's picture
    };
    source.mesh_at = [reading = std::make_shared<Reading>(
                          Reading{std::move(*input), Decoder(options), options, {}, false, picture_decoder(), {}})](
                         MeshSource& self, std::size_t position) -> Result<TexturedMesh> {
        auto& [stream, decoder, settings, numbers, begun, pictures, ahead] = *reading;
        const auto number = self.numbers[position];
        if (!std::exchange(begun, true) && position > 0)
            if (const auto start = go_to_frame(stream, self.name, number, settings.max_packet_bytes))
                numbers.begin(start->first_needed_frame, start->first_needed_number);
        const auto next = [&on = *reading]() {
            return on.ahead ? std::exchange(on.ahead, std::nullopt) : on.input.next();
        };
        while (const auto packet = next()) {
            const auto sequences = numbers.dependencies().sequences();
            numbers.push(*packet);
            if (numbers.dependencies().sequences() != sequences) pictures.reset();
            if (packet->kind == PacketKind::texture) (void)pictures.decode(*packet);
            auto frame = decoder.decode_copy(*packet);
            if (!frame) return fail(frame.error().kind, self.name + ": " + frame.error().message);
            if (!*frame || numbers.of((*frame)->info.frame) != number) continue;
            self.shown = {(*frame)->reference_topology, {}};
            if (!(*frame)->presence.empty()) self.shown.places = drop_loose_vertices((*frame)->mesh);
            TexturedMesh out(std::move((*frame)->mesh));
            // Its picture comes behind it, before the next frame.
            const auto is_beside = [](PacketKind kind) {
                return kind == PacketKind::texture || kind == PacketKind::audio;
            };
            while ((ahead = stream.next()) && is_beside(ahead->kind)) {
                numbers.push(*ahead);
                if (ahead->kind != PacketKind::texture) continue;
                if (const auto shown = pictures.decode(*ahead); !shown)
                    return fail(shown.error().kind, fmt::format("{}: the picture of frame {} cannot be decoded: {}",
                                                                self.name, number, shown.error().message));
            }
            if (!out.mesh.texcoords.empty()) out.texture = pictures.image();
            if (out.texture && out.mesh.colours.empty())
                out.mesh.colours = colours_from_texture(out.mesh, *out.texture);
            return out;
        }
        return fail(ErrorKind::corrupt_stream, self.name + " changed while it was read");
    };
    return source;
}

// The times of files: as listed, or as the PLY files say.
Result<void> find_times(MeshSource& source, const SequenceFiles& files, const std::string& listed) {
    if (!listed.empty()) {
        auto times = read_frame_times(listed, {});
        if (!times) return tl::unexpected(times.error());
        if (times->microseconds.size() != files.paths.size())
            return fail(ErrorKind::bad_input, fmt::format("{} has {} times, but there are {} frames", listed,
                                                          times->microseconds.size(), files.paths.size()));
        source.times_us = std::move(times->microseconds);
        return {};
    }
    for (const auto& path : files.paths) {
        const auto text = timestamp_in_file(path);
        const auto time = text.empty() ? Result<std::int64_t>(0) : parse_time(text, {});
        const bool serves = !text.empty() && time && (source.times_us.empty() || source.times_us.back() < *time);
        if (!serves) {
            source.times_us.clear();
            return {};
        }
        source.times_us.push_back(*time);
    }
    return {};
}

}  // namespace

Result<MeshSource> open_meshes(const std::vector<std::string>& names, const MeshSourceOptions& options) {
    const auto& name = names.front();
    if (name == "-")
        return fail(ErrorKind::bad_input, "standard input is not read here; give files, a folder or an .htvm stream");
    if (names.size() == 1 && is_stream_name(name)) {
        if (!options.texture.files.empty() || options.texture.origin != TextureOrigin::by_format)
            return fail(
                ErrorKind::bad_input,
                name + " is a stream, whose texture is inside; --texture and --texture-origin are for mesh files");
        return open_stream(name, options.limits);
    }
    const auto files = find_frames(names, {options.ignored});
    if (!files) return tl::unexpected(files.error());
    MeshSource source;
    source.name = names.size() == 1 ? name : "the files";
    source.frames = files->paths.size();
    source.numbers = files->numbers;
    source.millimetres_per_unit = millimetres_per(options.unit.value_or(LengthUnit::millimetre));
    source.guesses_unit = !options.unit;
    source.finds_shift = true;
    if (auto found = find_times(source, *files, options.timestamps); !found) return tl::unexpected(found.error());
    auto textures = TextureFiles::open(options.texture, *files);
    if (!textures) return tl::unexpected(textures.error());
    source.mesh_at = [meshes = *files, told = std::set<std::string>(), textures = std::move(*textures)](
                         MeshSource& self, std::size_t position) mutable -> Result<TexturedMesh> {
        const auto read = [&](double millimetres_per_unit, const GlobalShift& shift) {
            MeshFileOptions file_options;
            file_options.millimetres_per_unit = millimetres_per_unit;
            file_options.reading.origin = in_units(shift, millimetres_per_unit);
            return textures.read(position, TextureUse::where_colourless, file_options);
        };
        const bool is_known = !self.guesses_unit && !self.finds_shift;
        auto textured = is_known ? read(self.millimetres_per_unit, self.global_shift) : read(1, {});
        if (!textured) return textured;
        if (!is_known) {
            if (std::exchange(self.guesses_unit, false))
                self.millimetres_per_unit =
                    millimetres_per(unit_of_frames(meshes, position).value_or(guess_unit(textured->mesh)));
            if (std::exchange(self.finds_shift, false))
                self.global_shift = shift_of(textured->mesh, self.millimetres_per_unit);
            if (self.global_shift != GlobalShift{})
                textured = read(self.millimetres_per_unit, self.global_shift);
            else if (const auto ok = scale_positions(textured->mesh, self.millimetres_per_unit); !ok)
                return tl::unexpected(ok.error());
            if (!textured) return textured;
        }
        for (const auto& [about, text, is_loss] : textures.findings().remarks)
            if (is_loss && told.insert(about).second)
                warn(fmt::format("{}: {}", meshes.paths[position].string(), text));
        if (textured->texture) {
            auto shown = colours_with_texture(*textured);
            textured->tints = std::exchange(textured->mesh.colours, std::move(shown));
        }
        return textured;
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

// As `htvm decode` numbers its files.
bool counts_from_0(const MeshSource& source) {
    return !source.numbers.empty() && source.numbers.front() == 0 && source.numbers.back() + 1 == source.frames;
}

// The microseconds that all times of a regular sequence are multiples of: the shortest interval, as exact as all of
// them together say it. Nothing if they are not regular, to the microsecond that each is rounded to.
std::optional<double> frame_interval(std::span<const std::int64_t> times) {
    std::int64_t shortest = std::numeric_limits<std::int64_t>::max();
    for (std::size_t k = 1; k < times.size(); ++k) shortest = std::min(shortest, times[k] - times[k - 1]);
    if (times.size() < 2 || shortest < 1) return std::nullopt;
    std::int64_t frames = 0;
    for (std::size_t k = 1; k < times.size(); ++k) {
        const std::int64_t interval = times[k] - times[k - 1], of_these = (interval + shortest / 2) / shortest;
        if (std::abs(interval - of_these * shortest) > of_these + 1) return std::nullopt;
        frames += of_these;
    }
    return static_cast<double>(times.back() - times.front()) / static_cast<double>(frames);
}

// When originals were captured that do not tell it: by their numbers, at the rate of the decoded ones.
std::vector<std::int64_t> times_at_rate_of(const MeshSource& original, std::span<const std::int64_t> decoded) {
    std::vector<std::int64_t> out;
    const auto interval = frame_interval(decoded);
    if (!interval) return out;
    for (const auto place : places_beside(original, decoded.size()))
        out.push_back(std::llround(static_cast<double>(place) * *interval));
    return out;
}

}  // namespace

std::vector<std::uint64_t> places_beside(const MeshSource& original, std::size_t decoded_frames) {
    const auto& numbers = original.numbers;
    if (!numbers.empty() && original.frames < decoded_frames && numbers.back() - numbers.front() < decoded_frames) {
        std::vector<std::uint64_t> out;
        for (const auto number : numbers) out.push_back(number - numbers.front());
        return out;
    }
    return places_in_time({std::vector<std::filesystem::path>(original.frames), numbers});
}

std::vector<FramePair> pair_files(const MeshSource& original, const MeshSource& decoded) {
    auto by_number = pair_by_number(original.numbers, decoded.numbers);
    const auto serves = [&](const std::vector<FramePair>& pairs) {
        return !pairs.empty() && pairs.size() >= by_number.size();
    };
    if (auto pairs = pair_by_time(original.times_us, decoded.times_us); serves(pairs)) return pairs;
    // Numbers with gaps are those of the originals.
    if (!counts_from_0(decoded)) return by_number;
    auto pairs = pair_by_time(times_at_rate_of(original, decoded.times_us), decoded.times_us);
    return serves(pairs) ? pairs : by_number;
}

bool may_be_out_of_step(const MeshSource& original, const MeshSource& decoded) {
    const bool are_files = !original.is_stream && !decoded.is_stream;
    return are_files && decoded.times_us.empty() && counts_from_0(decoded) && decoded.frames < original.frames;
}

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

std::vector<FramePair> pair_by_time(std::span<const std::int64_t> original, std::span<const std::int64_t> decoded) {
    constexpr std::int64_t tolerance = 500;
    std::vector<FramePair> pairs;
    for (std::size_t i = 0, k = 0; i < original.size() && k < decoded.size();) {
        if (original[i] + tolerance < decoded[k]) {
            ++i;
        } else if (decoded[k] + tolerance < original[i]) {
            ++k;
        } else {
            pairs.push_back({i++, k++});
        }
    }
    return pairs;
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
