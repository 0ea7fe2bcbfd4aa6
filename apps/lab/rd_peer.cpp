#include "rd_peer.h"

#include <fmt/core.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>

#include "io/mesh_file.h"

namespace htvm::lab {
namespace {

using std::filesystem::path;

// The end of what a command printed.
std::string last_words(const path& file) {
    const auto bytes = read_file(file, 1 << 20);
    if (!bytes) return {};
    std::string text(bytes->begin(), bytes->end());
    while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
    if (text.size() > 300) text = "... " + text.substr(text.size() - 300);
    return text;
}

Result<CodedFrame> code_frame(const std::string& name, const std::string& command, const path& folder,
                              std::map<std::string, std::string> values, const SourceFrame& frame) {
    const path in = folder / "in.ply", out = folder / "out.bin", decoded = folder / "decoded.ply", log = folder / "log";
    std::error_code ignored;
    std::filesystem::remove(out, ignored);
    std::filesystem::remove(decoded, ignored);
    if (auto written = write_mesh(in, frame.mesh); !written) return tl::unexpected(written.error());
    values["in"] = quoted_for_shell(in.string());
    values["out"] = quoted_for_shell(out.string());
    values["decoded"] = quoted_for_shell(decoded.string());
    const std::string line =
        fmt::format("( {} ) >{} 2>&1 </dev/null", substitute(command, values), quoted_for_shell(log.string()));
    const auto start = std::chrono::steady_clock::now();
    const int status = std::system(line.c_str());
    CodedFrame coded;
    coded.encode_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    if (status != 0)
        return fail(ErrorKind::bad_input, fmt::format("the command of {} failed: {}", name, last_words(log)));
    std::error_code missing;
    const auto bytes = std::filesystem::file_size(out, missing);
    if (missing) return fail(ErrorKind::bad_input, fmt::format("the command of {} wrote no {{out}}", name));
    coded.bytes.external_intra = bytes;
    auto mesh = read_mesh(decoded);
    if (!mesh)
        return fail(ErrorKind::bad_input,
                    fmt::format("what {} decoded cannot be read: {}", name, mesh.error().message));
    coded.decoded = std::move(*mesh);
    return coded;
}

}  // namespace

std::string quoted_for_shell(const std::string& text) {
    std::string out = "'";
    for (const char c : text) {
        if (c == '\'')
            out += "'\\''";
        else
            out += c;
    }
    return out + "'";
}

std::string substitute(const std::string& text, const std::map<std::string, std::string>& values) {
    std::string out;
    for (std::size_t i = 0; i < text.size();) {
        const std::size_t end = text[i] == '{' ? text.find('}', i) : std::string::npos;
        const auto value = end == std::string::npos ? values.end() : values.find(text.substr(i + 1, end - i - 1));
        if (value == values.end()) {
            out += text[i++];
        } else {
            out += value->second;
            i = end + 1;
        }
    }
    return out;
}

Result<CoderUnderTest> peer_under_test(const std::string& name_and_command) {
    const auto equals = name_and_command.find('=');
    const std::string name = name_and_command.substr(0, equals);
    const std::string letters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-";
    if (equals == std::string::npos || name.empty() || name[0] == '.' ||
        name.find_first_not_of(letters) != std::string::npos)
        return fail(ErrorKind::bad_input,
                    "--peer " + name_and_command + ": give NAME=COMMAND, the name of letters, digits, dots, _ and -");
    const std::string command = name_and_command.substr(equals + 1);
    for (const char* needed : {"{in}", "{out}", "{decoded}"})
        if (command.find(needed) == std::string::npos)
            return fail(ErrorKind::bad_input, fmt::format("--peer {}: the command does not name {}", name, needed));
    CoderUnderTest out;
    out.name = name;
    out.description = "an external command, frame by frame";
    out.settings = command;
    out.start = [name, command](const SequenceFacts& facts, const QualityPoint& quality) -> Result<FrameCoder> {
        const std::map<std::string, std::string> values = {
            {"q", fmt::format("{:g}", quality.quality)},
            {"step", fmt::format("{:g}", quality.geometry_step)},
            {"colour_step", fmt::format("{:g}", quality.colour_step)},
            {"bits", fmt::format("{}", draco_position_bits(facts.frame_side, quality.geometry_step))}};
        return FrameCoder([name, command, values, folder = quality.working_folder](const SourceFrame& frame) {
            return code_frame(name, command, folder, values, frame);
        });
    };
    return out;
}

}  // namespace htvm::lab
