// Decodes streams and compares the digest of every frame with the file next to the stream: this proves that a build of
// the decoder gives the same bits as all others. It needs only the decoder and the standard library, and no threads or
// exceptions, so that it runs wherever the decoder does.
//
//   digests THREADS FILE.htvm ...
//
// FILE.digests has one line per frame (tests/codec/conformance_test.cpp writes it).
//
// Prints one line per stream: its name, its frames, the CRC-32 of its lines of digests; then the same over all streams.
// Exits with 1 if anything differs.
#include <array>
#include <bit>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include "core/bytes.h"
#include "core/crc32.h"
#include "htvm/decoder.hpp"

namespace {

using Bytes = std::vector<std::uint8_t>;

std::optional<Bytes> bytes_of(const std::string& path) {
    std::FILE* file = std::fopen(path.c_str(), "rb");
    if (!file) return std::nullopt;
    Bytes out;
    std::array<std::uint8_t, 4096> piece;
    while (const std::size_t count = std::fread(piece.data(), 1, piece.size(), file))
        out.insert(out.end(), piece.begin(), piece.begin() + static_cast<std::ptrdiff_t>(count));
    std::fclose(file);
    return out;
}

template <class Values>
void add_floats(htvm::internal::ByteWriter& out, const Values& values) {
    for (const auto& value : values)
        for (const float c : value) out.u32(std::bit_cast<std::uint32_t>(c));
}

std::uint32_t digest(const htvm::Mesh& mesh) {
    htvm::internal::ByteWriter out;
    add_floats(out, mesh.positions);
    for (const auto& triangle : mesh.triangles)
        for (const auto v : triangle) out.u32(v);
    for (const auto& colour : mesh.colours) out.bytes(colour);
    add_floats(out, mesh.normals);
    add_floats(out, mesh.texcoords);
    return htvm::internal::crc32(out.data());
}

std::string line_of(const htvm::DecodedFrame& frame) {
    std::array<char, 80> line{};
    std::snprintf(line.data(), line.size(), "%lu %c %lu %lu %08lx\n", static_cast<unsigned long>(frame.info.frame),
                  htvm::kind_of(frame.info.type).letter[0], static_cast<unsigned long>(frame.mesh.positions.size()),
                  static_cast<unsigned long>(frame.mesh.triangles.size()),
                  static_cast<unsigned long>(digest(frame.mesh)));
    return line.data();
}

struct Digests {
    std::string lines;
    int frames = 0;
};

std::optional<Digests> digests_of(const Bytes& stream, unsigned threads) {
    htvm::DecoderOptions options;
    options.threads = threads;
    htvm::Decoder decoder(options);
    htvm::PacketReader reader;
    reader.push(stream);
    Digests out;
    while (const auto packet = reader.pull()) {
        const auto frame = decoder.decode_copy(*packet);
        if (!frame) {
            std::printf("%s\n", frame.error().message.c_str());
            return std::nullopt;
        }
        if (!*frame) continue;
        out.lines += line_of(**frame);
        ++out.frames;
    }
    return out;
}

// Prints what differs, line by line.
void print_difference(const std::string& name, const std::string& expected, const std::string& got) {
    std::printf("%s: the frames' digests differ from those stored\nstored:\n%sdecoded:\n%s", name.c_str(),
                expected.c_str(), got.c_str());
}

std::uint32_t crc32_of(const std::string& text) { return htvm::internal::crc32(Bytes(text.begin(), text.end())); }

}  // namespace

int main(int argc, char** argv) {
    if (argc < 3) {
        std::puts("digests THREADS FILE.htvm ...");
        return 2;
    }
    const auto threads = static_cast<unsigned>(std::strtoul(argv[1], nullptr, 10));
    std::string all;
    int frames = 0, failures = 0;
    for (int i = 2; i < argc; ++i) {
        const std::string path = argv[i], stem = path.substr(0, path.rfind('.'));
        const std::string name = stem.substr(stem.rfind('/') + 1);
        const auto stream = bytes_of(path), stored = bytes_of(stem + ".digests");
        const auto decoded = stream ? digests_of(*stream, threads) : std::nullopt;
        if (!stored || !decoded) {
            std::printf("%s: %s\n", name.c_str(), decoded ? "no .digests beside it" : "cannot be read or decoded");
            ++failures;
            continue;
        }
        const std::string expected(stored->begin(), stored->end());
        if (decoded->lines != expected) {
            print_difference(name, expected, decoded->lines);
            ++failures;
        }
        std::printf("%-32s %4d frames  %08lx\n", name.c_str(), decoded->frames,
                    static_cast<unsigned long>(crc32_of(decoded->lines)));
        all += decoded->lines;
        frames += decoded->frames;
    }
    std::printf("%-32s %4d frames  %08lx\n", "all", frames, static_cast<unsigned long>(crc32_of(all)));
    return failures > 0 ? 1 : 0;
}
