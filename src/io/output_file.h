// Files that are there in whole or not at all: written beside their place, under a name that ends in .partial, and
// renamed when they are complete. What was there before stays until then.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>

#include "htvm/result.hpp"

namespace htvm {

class OutputFile {
public:
    // A pipe or a device, such as /dev/null, is written to at once, and has nothing that could be renamed.
    static Result<OutputFile> create(const std::filesystem::path& path);
    OutputFile(OutputFile&&) noexcept = default;
    OutputFile& operator=(OutputFile&&) = delete;
    // Removes what was neither finished nor kept.
    ~OutputFile();

    Result<void> write(std::span<const std::uint8_t> bytes);
    // Writes all of another file. bad_input if it cannot be read.
    Result<void> append(const std::filesystem::path& file);
    // Hands what was written to the system, so that it is there even if the program is killed.
    Result<void> flush();
    // Waits until the disk has what was written, so that not even a power cut takes it. Only for files.
    Result<void> sync();
    // Puts the file in its place.
    Result<void> finish();
    // The same with these bytes in front of what was written. Only for files. If it fails, finish() may still succeed.
    Result<void> finish_behind(std::span<const std::uint8_t> front);
    // Whether it is a file, not a pipe or a device.
    bool is_file() const { return !partial_.empty(); }
    // Where what was written so far can be read, once it is flushed.
    const std::filesystem::path& written_at() const { return partial_.empty() ? path_ : partial_; }
    // Leaves what was written so far beside its place and gives its name; an empty one where all went to a pipe or a
    // device.
    std::filesystem::path keep();

private:
    OutputFile() = default;
    struct Close {
        void operator()(std::FILE* file) const { std::fclose(file); }
    };
    std::filesystem::path path_, partial_;  // partial_: empty where path_ is a pipe or a device
    std::unique_ptr<std::FILE, Close> file_;
};

// A whole file at once.
Result<void> write_file(const std::filesystem::path& path, std::span<const std::uint8_t> bytes);
Result<void> write_file(const std::filesystem::path& path, std::string_view text);

// To standard output, at once.
Result<void> write_standard_output(std::span<const std::uint8_t> bytes);

// "NAME cannot be written: REASON", of kind disk_full where that is the reason; reason: an errno.
Error write_error(std::string_view name, int reason);

}  // namespace htvm
