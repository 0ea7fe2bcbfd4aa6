#include "io/output_file.h"

#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "io/system_file.h"

namespace htvm {
namespace {

namespace fs = std::filesystem;

// Where the bytes end up: behind a symbolic link, what it leads to.
fs::path place_of(const fs::path& path) {
    std::error_code error;
    if (!fs::is_symlink(path, error)) return path;
    auto target = fs::canonical(path, error);
    return error ? path : target;
}

Error open_error(const fs::path& path, int reason) {
    std::error_code ignored;
    const auto folder = path.parent_path();
    if (!folder.empty() && !fs::exists(folder, ignored))
        return {ErrorKind::bad_input,
                path.string() + " cannot be written: there is no folder " + folder.string() + "; make it first"};
    return write_error(path.string(), reason);
}

}  // namespace

Error write_error(std::string_view name, int reason) {
    return {is_disk_full(reason) ? ErrorKind::disk_full : ErrorKind::bad_input,
            std::string(name) + " cannot be written: " + std::strerror(reason)};
}

Result<void> write_standard_output(std::span<const std::uint8_t> bytes) {
    if (std::fwrite(bytes.data(), 1, bytes.size(), stdout) == bytes.size() && std::fflush(stdout) == 0) return {};
    return tl::unexpected(write_error("standard output", errno));
}

Result<OutputFile> OutputFile::create(const fs::path& path) {
    OutputFile out;
    std::error_code ignored;
    out.path_ = place_of(path);
    const auto there = fs::status(out.path_, ignored);
    if (fs::is_directory(there)) return tl::unexpected(write_error(path.string(), EISDIR));
    if (!fs::exists(there) || fs::is_regular_file(there)) out.partial_ = out.path_.string() + ".partial";
    const auto& opened = out.partial_.empty() ? out.path_ : out.partial_;
    out.file_.reset(open_file(opened, "wb"));
    if (!out.file_) return tl::unexpected(open_error(path, errno));
    if (!out.partial_.empty() && fs::exists(there)) {
        fs::permissions(out.partial_, there.permissions(), ignored);
        keep_owner(out.path_, out.partial_);
    }
    return out;
}

OutputFile::~OutputFile() {
    if (!file_ || partial_.empty()) return;
    file_.reset();
    std::error_code ignored;
    fs::remove(partial_, ignored);
}

Result<void> OutputFile::write(std::span<const std::uint8_t> bytes) {
    const bool at_once = partial_.empty();
    if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size() ||
        (at_once && std::fflush(file_.get()) != 0))
        return tl::unexpected(write_error(path_.string(), errno));
    return {};
}

Result<void> OutputFile::append(const fs::path& file) {
    const std::unique_ptr<std::FILE, Close> in(open_file(file, "rb"));
    if (!in) return fail(ErrorKind::bad_input, file.string() + " cannot be read: " + std::strerror(errno));
    std::vector<std::uint8_t> piece(std::size_t{1} << 20);
    while (const auto bytes = std::fread(piece.data(), 1, piece.size(), in.get()))
        if (auto ok = write({piece.data(), bytes}); !ok) return ok;
    if (std::ferror(in.get()) != 0) return fail(ErrorKind::bad_input, file.string() + " cannot be read");
    return {};
}

Result<void> OutputFile::flush() {
    if (std::fflush(file_.get()) != 0) return tl::unexpected(write_error(path_.string(), errno));
    return {};
}

Result<void> OutputFile::sync() {
    if (auto ok = flush(); !ok) return ok;
    if (!write_through(file_.get())) return tl::unexpected(write_error(path_.string(), errno));
    return {};
}

Result<void> OutputFile::finish() {
    if (auto ok = flush(); !ok) return ok;
    if (partial_.empty()) {
        file_.reset();
        return {};
    }
    // Windows renames closed files alone.
    file_.reset();
    if (replace_file(partial_, path_)) return {};
    const auto error = write_error(path_.string(), errno);
    file_.reset(open_file(partial_, "ab"));  // it can still be kept, or finished, and is removed if it is neither
    return tl::unexpected(error);
}

Result<void> OutputFile::finish_behind(std::span<const std::uint8_t> front) {
    if (auto ok = flush(); !ok) return ok;
    OutputFile whole;
    whole.path_ = path_;
    whole.partial_ = partial_.string() + ".whole";
    whole.file_.reset(open_file(whole.partial_, "wb"));
    if (!whole.file_) return tl::unexpected(write_error(path_.string(), errno));
    std::error_code ignored;
    fs::permissions(whole.partial_, fs::status(partial_, ignored).permissions(), ignored);
    if (auto ok = whole.write(front); !ok) return ok;
    if (auto ok = whole.append(partial_); !ok) return ok;
    if (auto ok = whole.finish(); !ok) return ok;
    file_.reset();
    fs::remove(partial_, ignored);
    return {};
}

fs::path OutputFile::keep() {
    file_.reset();
    return partial_;
}

Result<void> write_file(const fs::path& path, std::span<const std::uint8_t> bytes) {
    auto file = OutputFile::create(path);
    if (!file) return tl::unexpected(file.error());
    if (auto ok = file->write(bytes); !ok) return ok;
    return file->finish();
}

Result<void> write_file(const fs::path& path, std::string_view text) {
    return write_file(path, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

}  // namespace htvm
