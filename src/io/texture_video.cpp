#include "io/texture_video.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "core/letter_case.h"
#include "io/child_program.h"

namespace htvm {

namespace fs = std::filesystem;

namespace {

// What a failed decoding says, in one line that is fit to be shown: without the parts of ffmpeg and the file's name.
std::string first_line(std::FILE* said, const fs::path& path) {
    std::array<char, 1024> bytes{};
    if (!said || ::lseek(::fileno(said), 0, SEEK_SET) < 0) return {};
    const auto count = ::read(::fileno(said), bytes.data(), bytes.size());
    std::string line(bytes.data(), static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
    line.resize(std::min(line.find('\n'), line.size()));
    if (line.starts_with('[')) line.erase(0, std::min(line.find("] "), line.size() - 2) + 2);
    if (const auto name = "file:" + path.string() + ": "; line.starts_with(name)) line.erase(0, name.size());
    line.resize(std::min<std::size_t>(line.size(), 200));
    std::replace_if(
        line.begin(), line.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
    return line;
}

}  // namespace

// A run of ffmpeg, which writes pictures into a pipe.
class TextureVideo::Decoding {
public:
    static Result<std::unique_ptr<Decoding>> begin(const TextureVideo& video, const std::vector<std::string>& output) {
        std::unique_ptr<Decoding> out(new Decoding);
        std::array<int, 2> ends{};
        if (::pipe2(ends.data(), O_CLOEXEC) != 0)
            return fail(ErrorKind::limit, video.path_.string() + " cannot be decoded: too many files are open");
        out->pipe_ = ends[0];
        out->said_ = std::tmpfile();
        if (out->said_) ::fcntl(::fileno(out->said_), F_SETFD, FD_CLOEXEC);
        // A file that turns out to be a list of others leads nowhere but to files. A decoder that passed over what is
        // damaged would shift all pictures behind it.
        std::vector<std::string> words = {video.ffmpeg_, "-nostdin",   "-loglevel",
                                          "error",       "-xerror",    "-protocol_whitelist",
                                          "file",        "-i",         "file:" + video.path_.string(),
                                          "-map",        "0:v:0",      "-fps_mode",
                                          "passthrough", "-sws_flags", "bicubic+accurate_rnd+full_chroma_int",
                                          "-pix_fmt",    "rgb24"};
        words.insert(words.end(), output.begin(), output.end());
        words.emplace_back("pipe:1");
        out->program_ =
            start_program(words, {no_stream, ends[1], out->said_ ? ::fileno(out->said_) : no_stream, /*apart=*/true});
        ::close(ends[1]);
        if (out->program_ == 0)
            return fail(ErrorKind::unsupported,
                        video.path_.string() + " is a video, which the program " + video.ffmpeg_ +
                            " decodes, and that was not found: install ffmpeg, or give images, such as tex_%05d.png");
        return out;
    }
    Decoding(const Decoding&) = delete;
    Decoding& operator=(const Decoding&) = delete;
    ~Decoding() {
        if (program_ != 0) ::kill(program_, SIGKILL);
        if (program_ != 0) ends_well(program_);
        if (pipe_ >= 0) ::close(pipe_);
        if (said_) std::fclose(said_);
    }

    // Whether all of it came.
    bool read(std::span<std::uint8_t> bytes) {
        while (!bytes.empty()) {
            const auto count = ::read(pipe_, bytes.data(), bytes.size());
            if (count < 0 && errno == EINTR) continue;
            if (count <= 0) return false;
            bytes = bytes.subspan(static_cast<std::size_t>(count));
        }
        return true;
    }
    // A line without its end; nothing if there is none, or it is too long for what is expected.
    std::optional<std::string> read_line() {
        std::string line;
        for (std::uint8_t byte = 0; line.size() < 200; line += static_cast<char>(byte)) {
            if (!read({&byte, 1})) return std::nullopt;
            if (byte != '\n') continue;
            if (line.ends_with('\r')) line.pop_back();
            return line;
        }
        return std::nullopt;
    }
    // How many bytes the next picture has: the lines in front of it say so.
    std::optional<std::uint64_t> read_length() {
        constexpr std::string_view name = "Content-length: ";
        std::optional<std::uint64_t> length;
        for (auto line = read_line(); line; line = read_line()) {
            if (line->empty() && length) return length;
            if (!line->starts_with(name)) continue;
            std::uint64_t value = 0;
            if (std::from_chars(line->data() + name.size(), line->data() + line->size(), value).ec == std::errc())
                length = value;
        }
        return std::nullopt;
    }
    // Waits for the end of the program, of which no more is read, and says whether it met no error.
    bool ended_well() {
        ::close(std::exchange(pipe_, -1));
        return ends_well(std::exchange(program_, 0));
    }
    std::string why(const fs::path& path) const {
        const auto line = first_line(said_, path);
        return line.empty() ? "it does not say why" : line;
    }

    std::size_t next = 0;  // number of the next picture

private:
    Decoding() = default;
    pid_t program_ = 0;
    int pipe_ = -1;
    std::FILE* said_ = nullptr;  // its errors
};

Result<TextureVideo> TextureVideo::open(const fs::path& path, const std::string& ffmpeg) {
    TextureVideo out;
    out.path_ = path;
    out.ffmpeg_ = ffmpeg;
    std::error_code error;
    if (!fs::is_regular_file(path, error))
        return fail(ErrorKind::bad_input, path.string() + " is no file, which a video has to be");
    auto decoding = Decoding::begin(out, {"-frames:v", "1", "-c:v", "ppm", "-f", "image2pipe"});
    if (!decoding) return tl::unexpected(decoding.error());
    const auto format = (*decoding)->read_line(), size = (*decoding)->read_line();
    if (!size || format != "P6") {
        (*decoding)->ended_well();
        return fail(ErrorKind::bad_input,
                    path.string() + " is no video that " + ffmpeg + " can decode: " + (*decoding)->why(path));
    }
    const char* const end = size->data() + size->size();
    const auto width = std::from_chars(size->data(), end, out.width_);
    if (width.ec == std::errc() && width.ptr != end) std::from_chars(width.ptr + 1, end, out.height_);
    if (out.width_ < 1 || out.height_ < 1)
        return fail(ErrorKind::bad_input, path.string() + ": " + ffmpeg + " does not say how large its pictures are");
    if (std::max(out.width_, out.height_) > largest_image_side)
        return fail(ErrorKind::limit, path.string() + ": its pictures have " + std::to_string(out.width_) + " x " +
                                          std::to_string(out.height_) + " pixels; up to " +
                                          std::to_string(largest_image_side) + " x " +
                                          std::to_string(largest_image_side) + " are read");
    return out;
}

TextureVideo::TextureVideo(const TextureVideo& other)
    : path_(other.path_), ffmpeg_(other.ffmpeg_), width_(other.width_), height_(other.height_), end_(other.end_) {}
TextureVideo::TextureVideo(TextureVideo&& other) noexcept = default;
TextureVideo& TextureVideo::operator=(TextureVideo other) noexcept {
    path_ = std::move(other.path_);
    ffmpeg_ = std::move(other.ffmpeg_);
    width_ = other.width_;
    height_ = other.height_;
    decoding_ = std::move(other.decoding_);
    end_ = std::move(other.end_);
    return *this;
}
TextureVideo::~TextureVideo() = default;

Result<void> TextureVideo::begin() {
    decoding_.reset();
    // As they come, each with its length in front, which tells if the size changes.
    auto decoding = Decoding::begin(*this, {"-autoscale", "0", "-c:v", "rawvideo", "-f", "mpjpeg"});
    if (!decoding) return tl::unexpected(decoding.error());
    decoding_ = std::move(*decoding);
    return {};
}

// Why there is no picture where the next one was expected.
Error TextureVideo::end_of(Decoding& decoding) const {
    const auto number = std::to_string(decoding.next);
    if (decoding.ended_well())
        return {ErrorKind::bad_input,
                path_.string() + " has " + number + (decoding.next == 1 ? " picture" : " pictures")};
    return {ErrorKind::bad_input, path_.string() + " cannot be decoded from picture " + number +
                                      " on (of 0, 1, ...): " + decoding.why(path_)};
}

Result<Image> TextureVideo::picture(std::size_t number) {
    if (end_ && number >= end_->number) return tl::unexpected(end_->why);
    if (!decoding_ || number < decoding_->next)
        if (auto begun = begin(); !begun) return tl::unexpected(begun.error());
    Image out{width_, height_, {}};
    out.rgb.resize(3 * static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
    auto& next = decoding_->next;
    for (;; ++next) {
        const auto length = decoding_->read_length();
        if (length && *length != out.rgb.size())
            end_ = {next, Error{ErrorKind::bad_input, path_.string() + " changes its size, at picture " +
                                                          std::to_string(next) +
                                                          " (of 0, 1, ...); bring all to one size first"}};
        else if (!length || !decoding_->read(out.rgb))
            end_ = {next, end_of(*decoding_)};
        else if (next < number)
            continue;
        else
            break;
        decoding_.reset();
        return tl::unexpected(end_->why);
    }
    ++next;
    return out;
}

}  // namespace htvm
