// How fast a stream is decoded, frame by frame: the median, the 99th percentile and the most over all frames, then the
// same by kind of frame and by what stands before it, since much is derived behind I-frames and patches. Also a digest
// of all meshes, so that two builds can be compared. docs/performance.md says what was measured with it.
//
// A frame's time is the least of its rounds; of processor time, which hardly depends on what else the machine does, and
// of real time.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "clocks.h"
#include "core/crc32.h"
#include "htvm/decoder.hpp"
#include "htvm/packet.hpp"

namespace {

using htvm::pace::milliseconds, htvm::pace::processor_milliseconds;

struct Options {
    std::vector<std::string> streams;
    unsigned threads = 1;
    std::size_t rounds = 5;
    double vertices = 0;
    bool each = false;
};

std::vector<htvm::Packet> packets_of(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    const std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
    htvm::PacketReader reader;
    reader.push({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
    std::vector<htvm::Packet> out;
    while (auto packet = reader.pull()) out.push_back(std::move(*packet));
    return out;
}

struct FrameTime {
    std::string kind;  // its letter, and that of the frame before where that is another
    double vertices = 0, processor = 1e9, real = 1e9;
};

template <class Values>
std::uint32_t digest(const Values& values) {
    return htvm::internal::crc32(
        {reinterpret_cast<const std::uint8_t*>(values.data()), values.size() * sizeof(values[0])});
}

std::uint32_t digest(const htvm::MeshView& mesh) {
    const std::vector<std::uint32_t> parts{digest(mesh.positions), digest(mesh.triangles), digest(mesh.colours),
                                           digest(mesh.normals), digest(mesh.texcoords)};
    return digest(parts);
}

// Decodes the stream once; keeps the least times. Returns a digest of all meshes. False: a packet is corrupt.
bool decode(const std::vector<htvm::Packet>& packets, unsigned threads, std::vector<FrameTime>& frames,
            std::vector<std::uint32_t>& digests) {
    htvm::DecoderOptions options;
    options.threads = threads;
    htvm::Decoder decoder(options);
    std::size_t count = 0;
    std::string before;
    for (const auto& packet : packets) {
        const double real = milliseconds(), processor = processor_milliseconds();
        const auto frame = decoder.decode(packet);
        const double took_processor = processor_milliseconds() - processor, took = milliseconds() - real;
        if (!frame) {
            fmt::print(stderr, "{}\n", frame.error().message);
            return false;
        }
        if (!*frame) continue;
        const std::string kind = htvm::kind_of((*frame)->info.type).letter;
        if (frames.size() == count) {
            frames.push_back({.kind = before.empty() || before == kind ? kind : kind + " behind " + before});
            digests.push_back(digest((*frame)->mesh));
        }
        auto& best = frames[count++];
        best.vertices = (*frame)->info.vertices;
        best.processor = std::min(best.processor, took_processor);
        best.real = std::min(best.real, took);
        before = kind;
    }
    return true;
}

double percentile(std::vector<double> values, double share) {
    std::sort(values.begin(), values.end());
    const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size())));
    return values[std::clamp<std::size_t>(rank, 1, values.size()) - 1];
}

void print(const std::string& what, const std::vector<FrameTime>& frames, double vertices) {
    std::vector<double> processor, real;
    double sum = 0;
    for (const auto& frame : frames) {
        const double scale = vertices > 0 ? vertices / frame.vertices : 1;
        processor.push_back(scale * frame.processor);
        real.push_back(scale * frame.real);
        sum += frame.vertices;
    }
    fmt::print(
        "  {:14} {:4} frames {:6.0f} vertices; processor p50 {:6.2f} p99 {:6.2f} most {:6.2f} ms; real p50 {:6.2f} "
        "p99 {:6.2f} most {:6.2f} ms\n",
        what, frames.size(), sum / static_cast<double>(frames.size()), percentile(processor, 0.5),
        percentile(processor, 0.99), percentile(processor, 1), percentile(real, 0.5), percentile(real, 0.99),
        percentile(real, 1));
}

bool measure(const std::string& stream, const Options& options) {
    const auto packets = packets_of(stream);
    std::vector<FrameTime> frames;
    std::vector<std::uint32_t> digests;
    for (std::size_t round = 0; round < options.rounds; ++round)
        if (!decode(packets, options.threads, frames, digests)) return false;
    if (frames.empty()) {
        fmt::print(stderr, "{}: no frames\n", stream);
        return false;
    }
    fmt::print("{}: digest {:08x}\n", stream, digest(digests));
    if (options.each)
        for (std::size_t i = 0; i < frames.size(); ++i)
            fmt::print("  {:4} {:14} {:6.0f} vertices {:6.2f} ms processor {:6.2f} ms real\n", i, frames[i].kind,
                       frames[i].vertices, frames[i].processor, frames[i].real);
    print("all", frames, options.vertices);
    std::map<std::string, std::vector<FrameTime>> kinds;
    for (const auto& frame : frames) kinds[frame.kind].push_back(frame);
    for (const auto& [kind, of_kind] : kinds) print(kind, of_kind, options.vertices);
    return true;
}

}  // namespace

int main(int count, char** words) {
    Options options;
    CLI::App app("How fast streams are decoded, frame by frame");
    app.add_option("streams", options.streams, "Streams")->required();
    app.add_option("--threads", options.threads, "0: one per core")->capture_default_str();
    app.add_option("--rounds", options.rounds, "How often each stream is decoded")->capture_default_str();
    app.add_option("--vertices", options.vertices, "Scale times to so many decoded vertices; 0: do not");
    app.add_flag("--each", options.each, "Print each frame's kind and times");
    CLI11_PARSE(app, count, words);
    bool good = true;
    for (const auto& stream : options.streams) good = measure(stream, options) && good;
    return good ? 0 : 1;
}
