#include "mesh_source.h"

#include <fmt/core.h>

#include <cstdint>
#include <memory>

#include "htvm/decoder.hpp"
#include "io/mesh_file.h"
#include "io/sequence.h"
#include "stream_file.h"

namespace htvm::app {
namespace {

Result<std::optional<LengthUnit>> unit_named(const std::string& name) {
    if (name == "auto") return std::optional<LengthUnit>{};
    if (name == "mm") return std::optional(LengthUnit::millimetre);
    if (name == "cm") return std::optional(LengthUnit::centimetre);
    if (name == "m") return std::optional(LengthUnit::metre);
    return fail(ErrorKind::bad_input, "There is no unit '" + name + "': give mm, cm, m or auto.");
}

Result<MeshSource> open_stream(const std::string& path, DecoderOptions options) {
    auto input = StreamInput::open(path, options.max_packet_bytes);
    if (!input) return tl::unexpected(input.error());
    MeshSource source;
    source.name = path;
    options.intra_coder = draco_intra_coder();
    source.next = [input = std::make_shared<StreamInput>(std::move(*input)),
                   decoder = std::make_shared<Decoder>(options),
                   expected = std::uint32_t{0}](MeshSource& self) mutable -> Result<std::optional<Mesh>> {
        while (const auto packet = input->next()) {
            auto frame = decoder->push(*packet);
            if (!frame) return fail(frame.error().kind, self.name + ": " + frame.error().message);
            if (decoder->sequence()) self.millimetres_per_unit = decoder->sequence()->unit_micrometres / 1000.0;
            if (!*frame) continue;
            // Without this, every frame after a lost one would be taken for its neighbour.
            if (packet->frame != expected)
                return fail(ErrorKind::corrupt_stream,
                            fmt::format("{} has frame {} where frame {} is due: frames were lost; decode it, and give "
                                        "the same frames on both sides",
                                        self.name, packet->frame, expected));
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
    const auto chosen = unit_named(unit);
    if (!chosen) return tl::unexpected(chosen.error());
    const auto files = find_sequence(name);
    if (!files) return tl::unexpected(files.error());
    MeshSource source;
    source.name = name;
    source.frames = files->paths.size();
    source.numbers = files->numbers;
    if (*chosen) source.millimetres_per_unit = millimetres_per(**chosen);
    source.next = [paths = files->paths, guess = !*chosen,
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

}  // namespace htvm::app
