#include "io/vologram.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <fstream>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "core/bytes.h"
#include "io/finite_mesh.h"

namespace htvm {

using namespace internal;

namespace {

constexpr std::size_t most_header_bytes = 1024;
constexpr std::size_t frame_header_bytes = 9, least_frame_bytes = frame_header_bytes + 8;

tl::unexpected<Error> not_readable(const std::string& why) {
    return fail(ErrorKind::bad_input, "the vologram cannot be read: " + why);
}

// ---- The header -----------------------------------------------------------------------------------------------------

struct Header {
    std::uint32_t version = 0, frames = 0;
    bool has_normals = false, has_pictures = false;
    float frames_per_second = 0;
    std::uint64_t body = 0;  // where frames begin, if they are in the same file
};

void skip_short_text(ByteReader& in) { (void)in.bytes(in.u8()); }

Result<Header> read_header(const ByteSource& source) {
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(std::min<std::uint64_t>(source.size, most_header_bytes)));
    if (!source.read(0, bytes)) return not_readable("its header is not there");
    // The name of the format is a text with its length before it, or from 1.3 on the first four bytes.
    const bool has_length = !bytes.empty() && bytes[0] == 4;
    ByteReader in(std::span<const std::uint8_t>(bytes).subspan(has_length ? 1 : 0));
    const auto name = in.bytes(4);
    constexpr std::string_view expected = "VOLS";
    if (!in.ok() || !std::equal(expected.begin(), expected.end(), name.begin()))
        return not_readable("it does not begin with \"VOLS\"");
    Header out;
    out.version = in.u32();
    in.u32();  // compression of the mesh: none is known
    if (in.ok() && (out.version < 10 || out.version > 13))
        return fail(ErrorKind::unsupported,
                    "the vologram is of version " + std::to_string(out.version) + " (in tenths); 1.0 to 1.3 are read");
    if (out.version < 13) {
        for (int text = 0; text < 3; ++text) skip_short_text(in);  // of the mesh, the material, the shader
        in.u32();                                                  // the topology: triangles
    }
    out.frames = in.u32();
    if (out.version >= 11) {
        out.has_normals = in.u8() != 0;
        out.has_pictures = in.u8() != 0;
        (void)in.bytes(out.version >= 13 ? 10 : 6);  // how pictures are compressed, and their size
    }
    if (out.version == 12) (void)in.bytes(32);  // where Unity places it
    if (out.version >= 13) {
        out.frames_per_second = std::bit_cast<float>(in.u32());
        in.u32();  // whether there is sound
        in.u32();  // where it is
    }
    const std::uint64_t body = out.version >= 13 ? in.u32() : 0;
    if (!in.ok()) return not_readable("it ends within its header");
    out.body = body > 0 ? body : in.position() + (has_length ? 1 : 0);
    return out;
}

// ---- The frames -----------------------------------------------------------------------------------------------------

struct Walk {
    const ByteSource& source;
    std::uint64_t at = 0;

    std::optional<std::uint32_t> next() {
        std::array<std::uint8_t, 4> bytes{};
        if (!source.read(at, bytes)) return std::nullopt;
        at += bytes.size();
        return ByteReader(bytes).u32();
    }
    // The size of an array, and what it is of.
    std::optional<VologramArray> array() {
        const auto bytes = next();
        if (!bytes || *bytes > source.size - at) return std::nullopt;
        const VologramArray out{at, *bytes};
        at += *bytes;
        return out;
    }
};

// The next frame; nothing if it is damaged or cut off.
std::optional<VologramFrame> next_frame(Walk& walk, const Vologram& vologram, std::size_t number) {
    const auto said_number = walk.next(), said_bytes = walk.next();
    std::array<std::uint8_t, 1> kind{};
    if (!said_bytes || *said_number != number || !walk.source.read(walk.at, kind) || kind[0] > 2) return std::nullopt;
    ++walk.at;
    const bool is_key = kind[0] == 1 || (kind[0] == 2 && vologram.version >= 12);
    if (!is_key && number == 0) return std::nullopt;
    VologramFrame out;
    out.key_frame = is_key ? number : vologram.frames.back().key_frame;
    const auto add = [&](bool is_there, VologramArray& array) {
        if (!is_there) return true;
        const auto found = walk.array();
        if (found) array = *found;
        return found.has_value();
    };
    VologramArray picture;
    const bool whole = add(true, out.vertices) && add(vologram.has_normals, out.normals) &&
                       add(is_key, out.triangles) && add(is_key, out.texcoords) && add(vologram.has_pictures, picture);
    const auto bytes_again = whole ? walk.next() : std::nullopt;
    return bytes_again && *bytes_again == *said_bytes ? std::optional(out) : std::nullopt;
}

// ---- A frame's mesh -------------------------------------------------------------------------------------------------

Result<std::vector<std::uint8_t>> bytes_of(const ByteSource& source, const VologramArray& array) {
    std::vector<std::uint8_t> out(static_cast<std::size_t>(array.bytes));
    if (!source.read(array.offset, out)) return not_readable("a frame is cut off");
    return out;
}

Result<void> add_vectors(const ByteSource& source, const VologramArray& array, const std::array<double, 3>& origin,
                         std::vector<Vector3f>& out) {
    const auto bytes = bytes_of(source, array);
    if (!bytes) return tl::unexpected(bytes.error());
    ByteReader in(*bytes);
    for (std::size_t n = 0; n < bytes->size() / 12; ++n) {
        auto& vector = out.emplace_back();
        for (std::size_t i = 0; i < 3; ++i) {
            const auto c = static_cast<double>(std::bit_cast<float>(in.u32()));
            const auto moved = (i == 0 ? -c : c) - origin[i];
            vector[i] = fits_float(moved) ? static_cast<float>(moved) : std::numeric_limits<float>::quiet_NaN();
        }
    }
    return {};
}

Result<void> add_triangles(const ByteSource& source, const VologramArray& array, Mesh& mesh) {
    const auto bytes = bytes_of(source, array);
    if (!bytes) return tl::unexpected(bytes.error());
    ByteReader in(*bytes);
    const bool is_short = mesh.positions.size() < 65535;
    const auto next = [&] { return is_short ? in.u16() : in.u32(); };
    for (std::size_t n = 0; n < bytes->size() / (is_short ? 6 : 12); ++n) {
        const auto a = next(), b = next(), c = next();
        mesh.triangles.push_back({c, b, a});
    }
    return {};
}

Result<void> add_texcoords(const ByteSource& source, const VologramArray& array, Mesh& mesh) {
    const auto bytes = bytes_of(source, array);
    if (!bytes) return tl::unexpected(bytes.error());
    ByteReader in(*bytes);
    const auto next = [&] { return finite_or_zero(static_cast<double>(std::bit_cast<float>(in.u32()))); };
    for (std::size_t n = 0; n < bytes->size() / 8; ++n) {
        const auto u = next(), v = next();
        mesh.texcoords.push_back({u, v});
    }
    return {};
}

Result<void> check_sizes(const VologramFrame& frame, const VologramFrame& key, const MeshLimits& limits) {
    const auto vertices = frame.vertices.bytes / 12;
    if (auto ok = check_count(vertices, limits.most_vertices, "vertices"); !ok) return ok;
    const auto index_bytes = vertices < 65535 ? 2u : 4u;
    if (auto ok = check_count(key.triangles.bytes / (3 * index_bytes), limits.most_triangles, "triangles"); !ok)
        return ok;
    const bool fits = frame.vertices.bytes % 12 == 0 && key.triangles.bytes % (3 * index_bytes) == 0 &&
                      (frame.normals.bytes == 0 || frame.normals.bytes == frame.vertices.bytes) &&
                      (key.texcoords.bytes == 0 || key.texcoords.bytes == 8 * vertices);
    return fits ? Result<void>() : not_readable("the arrays of a frame do not belong to each other");
}

}  // namespace

ByteSource byte_source(std::span<const std::uint8_t> bytes) {
    return {bytes.size(), [bytes](std::uint64_t offset, std::span<std::uint8_t> out) {
                if (offset > bytes.size() || out.size() > bytes.size() - offset) return false;
                const auto from = bytes.subspan(static_cast<std::size_t>(offset), out.size());
                std::copy(from.begin(), from.end(), out.begin());
                return true;
            }};
}

Result<ByteSource> byte_source(const std::filesystem::path& path) {
    const auto file = std::make_shared<std::ifstream>(path, std::ios::binary);
    std::error_code error;
    const auto size = std::filesystem::file_size(path, error);
    if (error || !*file) return fail(ErrorKind::bad_input, path.string() + ": cannot be opened for reading");
    return ByteSource{size, [file, size](std::uint64_t offset, std::span<std::uint8_t> out) {
                          if (offset > size || out.size() > size - offset) return false;
                          file->clear();
                          file->seekg(static_cast<std::streamoff>(offset));
                          file->read(reinterpret_cast<char*>(out.data()), static_cast<std::streamsize>(out.size()));
                          return static_cast<std::size_t>(file->gcount()) == out.size();
                      }};
}

Result<Vologram> open_vologram(ByteSource header, std::vector<ByteSource> sequences) {
    const auto said = read_header(header);
    if (!said) return tl::unexpected(said.error());
    Vologram out;
    out.version = said->version;
    out.has_normals = said->has_normals;
    out.has_pictures = said->has_pictures;
    const double rate = static_cast<double>(said->frames_per_second);
    if (rate > 0 && rate < 1000) out.frames_per_second = rate;
    std::uint64_t begin = 0;
    if (sequences.empty()) {
        begin = said->body;
        sequences.push_back(std::move(header));
    }
    std::uint64_t bytes = 0;
    for (const auto& source : sequences) bytes += source.size;
    if (said->frames == 0 || said->frames > bytes / least_frame_bytes)
        return not_readable("it says that it has " + std::to_string(said->frames) + " frames, in " +
                            std::to_string(bytes) + " bytes");
    out.sources = std::move(sequences);
    for (std::size_t s = 0; s < out.sources.size(); ++s, begin = 0) {
        Walk walk{out.sources[s], std::min(begin, out.sources[s].size)};
        while (out.frames.size() < said->frames && walk.at < walk.source.size) {
            auto frame = next_frame(walk, out, out.frames.size());
            if (!frame) return not_readable("frame " + std::to_string(out.frames.size()) + " is damaged or cut off");
            frame->source = s;
            out.frames.push_back(*frame);
        }
    }
    if (out.frames.size() < said->frames)
        return not_readable("it has " + std::to_string(out.frames.size()) + " of its " + std::to_string(said->frames) +
                            " frames");
    return out;
}

Result<Mesh> read_vologram_frame(const Vologram& vologram, std::size_t number, const MeshReadOptions& options,
                                 MeshFindings* findings) {
    if (number >= vologram.frames.size()) return not_readable("there is no frame " + std::to_string(number));
    const auto& frame = vologram.frames[number];
    const auto& key = vologram.frames[frame.key_frame];
    if (auto ok = check_sizes(frame, key, options.limits); !ok) return tl::unexpected(ok.error());
    const auto &source = vologram.sources[frame.source], &key_source = vologram.sources[key.source];
    Mesh mesh;
    auto added = add_vectors(source, frame.vertices, options.origin, mesh.positions);
    if (added) added = add_vectors(source, frame.normals, {}, mesh.normals);
    if (added) added = add_triangles(key_source, key.triangles, mesh);
    if (added) added = add_texcoords(key_source, key.texcoords, mesh);
    if (!added) return tl::unexpected(added.error());
    for (auto& normal : mesh.normals)
        for (auto& c : normal) c = finite_or_zero(static_cast<double>(c));
    for (const auto& triangle : mesh.triangles)
        if (std::ranges::any_of(triangle, [&](auto index) { return index >= mesh.positions.size(); }))
            return not_readable("a triangle uses a vertex that is not there");
    MeshFindings unheard;
    if (auto ok = leave_out_not_finite(mesh, findings ? *findings : unheard); !ok) return tl::unexpected(ok.error());
    if (auto ok = check_mesh(mesh); !ok) return tl::unexpected(ok.error());
    return mesh;
}

}  // namespace htvm
