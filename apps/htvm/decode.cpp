// htvm decode: a stream in, meshes out.
#include <fmt/core.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "capture.h"
#include "commands.h"
#include "htvm/decoder.hpp"
#include "io/mesh_file.h"
#include "io/ply.h"
#include "io/sequence.h"
#include "layer_table.h"
#include "stream_file.h"
#include "terminal.h"

namespace htvm::app {
namespace {

struct Options {
    std::string input, output, format = "ply", unit = "capture";
    std::size_t frames = 0;
    unsigned threads = 0;
    bool json = false;
};

struct Summary {
    std::size_t frames = 0, failed = 0;
    std::uint32_t due = 0;  // the number of the frame that should come next
    double decode_seconds = 0;
    nlohmann::json list = nlohmann::json::array();
};

class MeshOutput {
public:
    static Result<MeshOutput> open(const Options& options) {
        MeshOutput out;
        out.standard_ = options.output == "-";
        if (out.standard_) return out;
        auto names = output_names(options.output, "." + options.format);
        if (!names) return tl::unexpected(names.error());
        out.names_ = std::move(*names);
        std::error_code error;
        if (!out.names_.folder.empty()) std::filesystem::create_directories(out.names_.folder, error);
        out.folder_alone_ = !out.names_.one_file && options.output.find('%') == std::string::npos;
        if (error)
            return fail(ErrorKind::bad_input, out.names_.folder.string() + " cannot be made: " + error.message());
        return out;
    }
    // Gives the name of what was written.
    Result<std::string> write(Mesh& mesh, std::uint32_t frame, double millimetres_per_unit) {
        if (!standard_) {
            const auto path = output_path(names_, frame);
            MeshFileOptions file_options;
            file_options.millimetres_per_unit = millimetres_per_unit;
            if (auto ok = write_mesh(path, mesh, file_options); !ok) return tl::unexpected(ok.error());
            written_.insert(path.filename().string());
            return path.string();
        }
        if (auto ok = scale_positions(mesh, 1 / millimetres_per_unit); !ok) return tl::unexpected(ok.error());
        const auto bytes = write_ply(mesh);
        if (!bytes) return tl::unexpected(bytes.error());
        std::cout.write(reinterpret_cast<const char*>(bytes->data()), static_cast<std::streamsize>(bytes->size()));
        std::cout.flush();
        if (!std::cout) return fail(ErrorKind::bad_input, "standard output cannot be written");
        return std::string("-");
    }
    bool one_file() const { return !standard_ && names_.one_file; }
    // Meshes in the folder that this run did not write: they would be read as one sequence with its own.
    std::size_t other_meshes() const {
        if (!folder_alone_) return 0;  // a pattern tells its own files from others
        std::size_t others = 0;
        std::error_code error;
        const auto folder = names_.folder.empty() ? std::filesystem::path(".") : names_.folder;
        for (const auto& entry : std::filesystem::directory_iterator(folder, error))
            if (is_mesh_file_name(entry.path()) && !written_.contains(entry.path().filename().string())) ++others;
        return others;
    }

private:
    OutputNames names_;
    std::set<std::string> written_;
    bool standard_ = false, folder_alone_ = false;
};

Result<double> output_unit(const Options& options, const SequenceInfo& info) {
    if (options.unit == "capture") return info.unit_micrometres / 1000.0;
    return millimetres_of_unit(options.unit);
}

// Frames that were lost on the way leave no damage behind, only a gap in the numbers.
void tell_gap(Summary& summary, std::uint32_t frame) {
    if (frame == summary.due + 1) warn(fmt::format("frame {} is not in the stream", summary.due));
    if (frame > summary.due + 1) warn(fmt::format("frames {} to {} are not in the stream", summary.due, frame - 1));
    summary.due = frame + 1;
}

// True while there is more to decode.
Result<bool> decode_next(const Options& options, StreamInput& input, Decoder& decoder, MeshOutput& output,
                         Summary& summary, Progress& progress) {
    if (options.frames > 0 && summary.frames >= options.frames) return false;
    const auto packet = input.next();
    if (!packet) return false;
    const auto start = std::chrono::steady_clock::now();
    auto frame = decoder.push(*packet);
    if (!frame) {
        if (frame.error().kind == ErrorKind::unsupported || frame.error().kind == ErrorKind::limit)
            return tl::unexpected(frame.error());
        if (frame_type(packet->kind)) tell_gap(summary, packet->frame);
        warn(fmt::format("frame {} is lost: {}", packet->frame, frame.error().message));
        ++summary.failed;
        return true;
    }
    if (!*frame) return true;
    tell_gap(summary, packet->frame);
    summary.decode_seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    auto unit = output_unit(options, *decoder.sequence());
    if (!unit) return tl::unexpected(unit.error());
    auto name = output.write((*frame)->mesh, packet->frame, *unit);
    if (!name) return tl::unexpected(name.error());
    if (options.json) {
        auto entry = frame_json((*frame)->info);
        entry["file"] = *name;
        summary.list.push_back(std::move(entry));
    }
    ++summary.frames;
    progress.step();
    return !output.one_file();
}

Result<void> decode(const Options& options) {
    if (options.output == "-" && options.json)
        return fail(ErrorKind::bad_input, "--json prints on standard output, where -o - puts the meshes; choose one");
    auto input = StreamInput::open(options.input);
    if (!input) return tl::unexpected(input.error());
    auto output = MeshOutput::open(options);
    if (!output) return tl::unexpected(output.error());
    DecoderOptions settings;
    settings.threads = options.threads;
    settings.intra_coder = draco_intra_coder();
    Decoder decoder(settings);
    Summary summary;
    {
        Progress progress("decoding", options.frames);
        for (;;) {
            const auto more = decode_next(options, *input, decoder, *output, summary, progress);
            if (!more) return tl::unexpected(more.error());
            if (!*more) break;
        }
    }
    const bool all = options.frames == 0 || summary.frames < options.frames;
    const bool cut_short = all && !output->one_file() && input->cut_short_bytes() > 0;
    if (options.json)
        fmt::print("{}\n", nlohmann::json{{"frames", summary.list},
                                          {"lost_frames", summary.failed},
                                          {"damaged_bytes", input->damaged_bytes()},
                                          {"decode_frames_per_second", static_cast<double>(summary.frames) /
                                                                           std::max(summary.decode_seconds, 1e-9)}}
                               .dump(2));
    if (!decoder.sequence())
        return fail(ErrorKind::corrupt_stream, options.input + " is not an htvm stream: no sequence header was found");
    const double rate = static_cast<double>(summary.frames) / std::max(summary.decode_seconds, 1e-9);
    const std::string where = options.output == "-" ? "standard output" : options.output;
    note(fmt::format("{} to {}, decoded at {:.1f} frames/s",
                     output->one_file() ? "the first frame alone" : fmt::format("{} frames", summary.frames), where,
                     rate));
    if (const auto others = output->other_meshes(); others > 0 && summary.frames > 0)
        warn(
            fmt::format("the output folder holds {} mesh files besides, of an earlier run perhaps; whoever reads the "
                        "folder reads them too",
                        others));
    if (input->damaged_bytes() > 0)
        return fail(ErrorKind::corrupt_stream,
                    fmt::format("{} is damaged: {} bytes were no sound packet; {} frames were decoded, {} lost besides",
                                options.input, input->damaged_bytes(), summary.frames, summary.failed));
    if (cut_short)
        return fail(ErrorKind::corrupt_stream, fmt::format("{} ends in the middle of a packet; the {} complete frames "
                                                           "before it were decoded",
                                                           options.input, summary.frames));
    if (summary.failed > 0)
        return fail(ErrorKind::corrupt_stream, fmt::format("{} frames could not be decoded", summary.failed));
    return {};
}

}  // namespace

void add_decode(CLI::App& app, Run& run) {
    auto options = std::make_shared<Options>();
    auto* command = app.add_subcommand("decode", "Turn an .htvm stream back into meshes");
    command->add_option("input", options->input, "The stream: a file, or - for standard input")->required();
    command
        ->add_option("-o,--output", options->output,
                     "Where the meshes go: a folder, a pattern such as out/frame_%05d.obj, the name of one file (the\n"
                     "first frame alone), or - for PLY after PLY on standard output")
        ->required();
    command->add_option("--format", options->format, "Format in a folder: ply (default) or obj")
        ->check(CLI::IsMember({"ply", "obj"}));
    command->add_option("--unit", options->unit, "Unit of the positions: the capture's (default), mm, cm or m")
        ->check(CLI::IsMember({"capture", "mm", "cm", "m"}));
    command->add_option("--frames", options->frames, "Decode at most this many frames (default: all)");
    command->add_option("--threads", options->threads, "Threads (default: one a core); the meshes do not depend on it");
    command->add_flag("--json", options->json, "Print what was decoded as JSON on standard output");
    command->footer(
        "A damaged or shortened stream gives every frame that is whole, says what was lost, and exits with 3.\n"
        "Examples:\n"
        "  htvm decode person.htvm -o meshes/\n"
        "  htvm decode person.htvm -o 'out/%04d.obj'\n"
        "  htvm decode - -o - < person.htvm | viewer --ply");
    command->callback([options, &run] { run = [options] { return decode(*options); }; });
}

}  // namespace htvm::app
