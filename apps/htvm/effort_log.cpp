#include "effort_log.h"

#include <fmt/core.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <string_view>
#include <utility>

#include "command_line/terminal.h"
#include "io/mesh_file.h"
#include "io/number_text.h"

namespace htvm::app {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view beginning = "frame,effort";  // of every log
constexpr std::string_view header = "frame,effort,waited_ms,took_ms,may_repair,asked_effort\n";

std::vector<std::string> cells_of(const std::string& row) {
    std::vector<std::string> out;
    for (std::size_t at = 0; at <= row.size();) {
        const auto end = std::min(row.find(',', at), row.size());
        out.push_back(row.substr(at, end - at));
        at = end + 1;
    }
    return out;
}

std::optional<int> effort_of(const std::string& text, int least) {
    const double effort = parse_number(text).value_or(-1);
    if (!(effort >= least && effort <= 9) || effort != static_cast<int>(effort)) return std::nullopt;
    return static_cast<int>(effort);
}

// Where a log has what earlier ones do not have.
struct Columns {
    std::size_t count = 0;
    std::optional<std::size_t> may_repair, asked_effort;
};

Columns columns_of(const std::string& first_line) {
    Columns out;
    for (const auto& name : cells_of(first_line)) {
        if (name == "may_repair" || name == "repaired") out.may_repair = out.count;  // the latter is its earlier name
        if (name == "asked_effort") out.asked_effort = out.count;
        ++out.count;
    }
    return out;
}

// The next frame of a log. Says what is wrong with its line; null if nothing is.
const char* take_line(const std::string& line, const Columns& columns, EffortLog& log) {
    const auto cells = cells_of(line);
    if (cells.size() < 2) return "there is no effort";
    if (parse_number(cells[0]).value_or(-1) != static_cast<double>(log.frames.size()))
        return "frames are not numbered from 0 on";
    const auto effort = effort_of(cells[1], 0);
    if (!effort) return "an effort is 0 to 9";
    if (cells.size() != columns.count) return "a column is missing, or one too many";
    const auto may_repair = columns.may_repair ? cells[*columns.may_repair] : "1";
    if (may_repair != "0" && may_repair != "1") return "whether it may be repaired is 0 or 1";
    const auto asked = columns.asked_effort ? effort_of(cells[*columns.asked_effort], 1) : std::max(log.asked, *effort);
    if (!asked) return "the effort asked for is 1 to 9";
    if (columns.asked_effort && !log.frames.empty() && *asked != log.asked)
        return "the effort asked for is another than before";
    log.asked = *asked;
    log.frames.push_back({*effort, may_repair == "1"});
    return nullptr;
}

// Nothing, an empty file or an earlier log may be replaced; of a device or a pipe nothing is lost.
Result<void> check_may_be_replaced(const fs::path& path) {
    std::error_code ignored;
    if (!fs::is_regular_file(path, ignored) || fs::file_size(path, ignored) == 0) return {};
    std::string first(beginning.size(), '\0');
    std::ifstream(path, std::ios::binary).read(first.data(), static_cast<std::streamsize>(first.size()));
    if (first == beginning) return {};
    return fail(ErrorKind::bad_input,
                fmt::format("{} is there already, and is no effort log, which would begin with \"{},...\": give "
                            "--effort-log another name, or remove that file",
                            path.string(), beginning));
}

Result<void> write_text(OutputFile& file, std::string_view text) {
    return file.write({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

}  // namespace

Result<EffortLog> read_effort_log(const fs::path& path) {
    const auto bytes = read_file(path);
    if (!bytes) return tl::unexpected(bytes.error());
    const std::string text(bytes->begin(), bytes->end());
    EffortLog out;
    const auto wrong = [&](std::size_t line, const char* what) {
        return fail(ErrorKind::bad_input,
                    fmt::format("{}, line {}: {} (an effort log, as --effort-log writes it, has a "
                                "line \"{},...\", then one per frame)",
                                path.string(), line, what, beginning));
    };
    std::size_t number = 0;
    Columns columns;
    for (std::size_t at = 0; at < text.size();) {
        const auto end = std::min(text.find('\n', at), text.size());
        auto line = text.substr(at, end - at);
        at = end + 1;
        if (line.ends_with('\r')) line.pop_back();
        if (++number == 1) {
            if (!line.starts_with(beginning)) return wrong(number, "this is no effort log");
            columns = columns_of(line);
        } else if (!line.empty()) {
            if (const char* what = take_line(line, columns, out)) return wrong(number, what);
        }
    }
    if (out.frames.empty()) return wrong(number + 1, "there is no frame");
    return out;
}

std::string too_few_efforts(const std::string& path, std::size_t efforts, const std::string& frames) {
    return fmt::format(
        "{} has the efforts of {}, but there are {}: repeat the run that wrote it, with the same frames "
        "and options, or give --frames {}",
        path, counted(efforts, "frame"), frames, efforts);
}

Result<EffortLogWriter> EffortLogWriter::create(const fs::path& path, int asked) {
    if (auto may = check_may_be_replaced(path); !may) return tl::unexpected(may.error());
    auto file = OutputFile::create(path);
    if (!file) return tl::unexpected(file.error());
    if (auto written = write_text(*file, header); !written) return tl::unexpected(written.error());
    return EffortLogWriter(std::move(*file), asked);
}

Result<void> EffortLogWriter::add(const TimedFrame& frame) {
    const auto line = fmt::format("{},{},{:.3f},{:.3f},{},{}\n", frames_++, frame.effort, frame.waited, frame.took,
                                  frame.left_lost ? 0 : 1, asked_);
    if (auto written = write_text(file_, line); !written) return written;
    return file_.flush();
}

Result<void> EffortLogWriter::finish() {
    is_finished_ = true;
    return file_.finish();
}

fs::path EffortLogWriter::keep() { return is_finished_ || frames_ == 0 ? fs::path() : file_.keep(); }

}  // namespace htvm::app
