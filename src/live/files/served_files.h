// The files that others may read: those of a folder, and nothing outside of it, or some that were named.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
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
    std::string tag;  // an entity tag, quotes included: another one whenever size or modification time differs
};

struct FolderEntry {
    std::string path;  // segments joined by slashes
    std::uint64_t size = 0;
};

class ServedFolder {
public:
    // bad_input if there is no such folder.
    static Result<ServedFolder> open(const std::string& path);

    // The regular file that these segments (live/files/http_request.h) name. bad_input if there is none. Symbolic
    // links are not followed, at any segment, so that no file outside of the folder is reached however it changes
    // meanwhile.
    Result<ServedFile> file(std::span<const std::string> segments) const;

    // Regular files whose names end in one of these, in the folder and those in it, sorted; no hidden ones. At most
    // 10,000, among the first 100,000 entries that the disk names: one walk, whatever the folder holds.
    std::vector<FolderEntry> files(std::span<const std::string_view> endings) const;

private:
    explicit ServedFolder(std::string path, OpenFile folder) : path_(std::move(path)), folder_(std::move(folder)) {}
    std::string path_;
    OpenFile folder_;
};

// How siblings are called: of person.htvm, person.h264.htvm has the same meshes, and pictures by another coder, for
// browsers that do not decode its own. They are served, and not listed.
inline constexpr std::string_view sibling_coders[] = {"av1", "vp9", "h264"};

// A file under a name of its own, wherever it lies.
struct NamedFile {
    std::string name;  // below /files/: segments joined by slashes
    std::string path;
};

// A stream that can be read.
struct ListedFile {
    std::string path;  // below /files/
    std::uint64_t size = 0;
    std::string poster{};  // of the picture beside it; "": none
};

// What lies below /files/. Each call looks at the disk, since files may come and go. Calls on several threads do not
// disturb each other.
class ServedFiles {
public:
    // There are none.
    ServedFiles() = default;
    // The .htvm, .png and .jpg files of the folder ("": none), or, if there are any, the named ones. bad_input if there
    // is no such folder.
    static Result<ServedFiles> open(const std::string& folder, std::vector<NamedFile> named);

    // As of ServedFolder.
    Result<ServedFile> file(std::span<const std::string> segments) const;
    // The streams of the folder sorted by their paths, or the named files in their order. It walks the folder, which
    // takes a tenth of a second where there are 10,000 streams: not for a thread that others wait for.
    std::vector<ListedFile> list() const;

private:
    std::optional<ServedFolder> folder_;
    std::vector<NamedFile> named_;
};

}  // namespace htvm::live
