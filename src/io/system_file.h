// What systems do differently with files.
#pragma once

#include <cstdio>
#include <filesystem>
#include <optional>

namespace htvm {

// As std::fopen, for any name.
std::FILE* open_file(const std::filesystem::path& path, const char* mode);

// Waits until the disk has what was handed to the system. False, with errno set, if it does not.
bool write_through(std::FILE* file);

// Puts a closed file in the place of another. False, with errno set, if that fails.
bool replace_file(const std::filesystem::path& from, const std::filesystem::path& to);

// Where root replaces somebody's file, it stays theirs: a service that reads it again may not read root's. Windows does
// so by itself.
void keep_owner(const std::filesystem::path& from, const std::filesystem::path& to);

// Makes a folder that nobody had yet and nobody else can look into; its name is this with some letters behind it.
std::optional<std::filesystem::path> make_own_folder(const std::filesystem::path& begin);

// Whether a write failed because there is no room.
bool is_disk_full(int reason);

}  // namespace htvm
