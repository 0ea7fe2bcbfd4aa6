// A folder whose files others may read, and nothing outside of it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "htvm/result.hpp"

namespace htvm::live {

// An open file descriptor.
class OpenFile {
public:
    OpenFile() = default;
    explicit OpenFile(int descriptor) : descriptor_(descriptor) {}
    OpenFile(OpenFile&& other) noexcept : descriptor_(other.descriptor_) { other.descriptor_ = -1; }
    OpenFile& operator=(OpenFile&& other) noexcept;
    ~OpenFile();
    int descriptor() const { return descriptor_; }
    // Reads up to out.size() bytes from offset on; 0 at the end of the file or after an error.
    std::size_t read(std::uint64_t offset, std::span<char> out) const;

private:
    int descriptor_ = -1;
};

struct ServedFile {
    OpenFile file;
    std::uint64_t size = 0;
    std::string tag;  // an entity tag, quotes included: another one whenever size or modification time differ
};

struct FolderEntry {
    std::string path;  // segments joined by slashes
    std::uint64_t size = 0;
};

class ServedFolder {
public:
    // bad_input if there is no such folder.
    static Result<ServedFolder> open(const std::string& path);

    // The regular file that these segments (live/server/http_request.h) name. bad_input if there is none. Symbolic
    // links are not followed, at any segment, so that no file outside of the folder is reached however it changes
    // meanwhile.
    Result<ServedFile> file(std::span<const std::string> segments) const;

    // Regular files whose names end so, in the folder and those in it, sorted; no hidden ones. At most 10,000.
    std::vector<FolderEntry> files(const std::string& ending) const;

private:
    explicit ServedFolder(std::string path, OpenFile folder) : path_(std::move(path)), folder_(std::move(folder)) {}
    std::string path_;
    OpenFile folder_;
};

}  // namespace htvm::live
