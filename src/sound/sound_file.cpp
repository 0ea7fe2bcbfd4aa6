#include "sound/sound_file.h"

#include <samplerate.h>
#include <sndfile.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

namespace htvm {
namespace {

constexpr int samples_per_second = 48000;
// A converter of 121 dB and 90 % of the band: what it leaves is below what Opus leaves, at a fifth of the best one's
// time.
constexpr int converter = SRC_SINC_MEDIUM_QUALITY;
constexpr sf_count_t block = 4096;
constexpr int slowest = 1000, fastest = 768000;  // samples a second

tl::unexpected<Error> failed(const std::filesystem::path& path, ErrorKind kind, const std::string& what) {
    return fail(kind, path.string() + ": " + what);
}

}  // namespace

struct SoundFile::State {
    std::filesystem::path path;
    SF_INFO info{};
    SNDFILE* file = nullptr;
    SRC_STATE* resampling = nullptr;  // null: the file has 48 kHz
    std::vector<float> read, resampled;
    std::size_t begin = 0, end = 0;  // what `read` has that is not resampled yet
    std::uint64_t given = 0;         // samples a channel
    bool file_ended = false, ended = false;

    ~State() {
        if (resampling) src_delete(resampling);
        if (file) sf_close(file);
    }

    std::size_t channels() const { return static_cast<std::size_t>(info.channels); }

    // What the file has next goes to `read`.
    Result<void> fill() {
        const auto got = sf_readf_float(file, read.data(), block);
        if (got < 0 || sf_error(file) != SF_ERR_NO_ERROR)
            return failed(path, ErrorKind::bad_input, std::string("the sound is damaged: ") + sf_strerror(file));
        begin = 0;
        end = static_cast<std::size_t>(got) * channels();
        file_ended = got == 0;
        // A file of floats may have anything in it.
        for (auto& sample : std::span(read).first(end))
            sample = std::isfinite(sample) ? std::clamp(sample, -4.0f, 4.0f) : 0.0f;
        return {};
    }

    Result<std::span<const float>> next() {
        while (!ended) {
            if (begin == end && !file_ended)
                if (auto ok = fill(); !ok) return tl::unexpected(ok.error());
            std::span<const float> out;
            if (!resampling) {
                out = std::span(read).subspan(begin, end - begin);
                begin = end;
                ended = file_ended;
            } else {
                SRC_DATA data{};
                data.data_in = read.data() + begin;
                data.data_out = resampled.data();
                data.input_frames = static_cast<long>((end - begin) / channels());
                data.output_frames = static_cast<long>(resampled.size() / channels());
                data.end_of_input = file_ended ? 1 : 0;
                data.src_ratio = static_cast<double>(samples_per_second) / info.samplerate;
                if (const int error = src_process(resampling, &data))
                    return failed(path, ErrorKind::bad_input,
                                  std::string("the sound cannot be resampled: ") + src_strerror(error));
                begin += static_cast<std::size_t>(data.input_frames_used) * channels();
                out = std::span(resampled).first(static_cast<std::size_t>(data.output_frames_gen) * channels());
                ended = file_ended && out.empty();
            }
            if (out.empty()) continue;
            given += out.size() / channels();
            if (given > most_sound_samples)
                return failed(path, ErrorKind::limit, "the sound is longer than six hours; cut out what is needed");
            return out;
        }
        return std::span<const float>();
    }
};

SoundFile::SoundFile(std::unique_ptr<State> state) : state_(std::move(state)) {}
SoundFile::SoundFile(SoundFile&&) noexcept = default;
SoundFile::~SoundFile() = default;

Result<SoundFile> SoundFile::open(const std::filesystem::path& path) {
    auto state = std::make_unique<State>();
    state->path = path;
    std::error_code error;
    if (!std::filesystem::exists(path, error)) return failed(path, ErrorKind::bad_input, "there is no such file");
    state->file = sf_open(path.c_str(), SFM_READ, &state->info);
    std::string why = sf_strerror(nullptr);
    if (why.ends_with('.')) why.pop_back();
    if (!state->file)
        return failed(path, ErrorKind::bad_input,
                      "it is no sound that can be read (WAV, FLAC, MP3, Ogg, AIFF and others): " + why +
                          "; ffmpeg makes one of most files: ffmpeg -i " + path.filename().string() + " sound.flac");
    const auto& info = state->info;
    if (info.channels < 1 || info.channels > 2)
        return failed(path, ErrorKind::bad_input,
                      "the sound has " + std::to_string(info.channels) +
                          " channels, and streams have one or two; mix it first, as by ffmpeg -i " +
                          path.filename().string() + " -ac 2 sound.flac");
    if (info.samplerate < slowest || info.samplerate > fastest)
        return failed(path, ErrorKind::bad_input,
                      "the sound has " + std::to_string(info.samplerate) + " samples a second, and " +
                          std::to_string(slowest) + " to " + std::to_string(fastest) + " can be read");
    state->read.resize(static_cast<std::size_t>(block) * state->channels());
    if (info.samplerate != samples_per_second) {
        int reason = 0;
        state->resampling = src_new(converter, info.channels, &reason);
        if (!state->resampling)
            return failed(path, ErrorKind::bad_input,
                          std::string("the sound cannot be resampled: ") + src_strerror(reason));
        state->resampled.resize(state->read.size());
    }
    return SoundFile(std::move(state));
}

Result<std::span<const float>> SoundFile::next() { return state_->next(); }

int SoundFile::channels() const { return state_->info.channels; }

std::uint64_t SoundFile::promised_samples() const {
    const auto frames = static_cast<double>(std::max<sf_count_t>(state_->info.frames, 0));
    const double samples = frames * samples_per_second / state_->info.samplerate;
    return samples > static_cast<double>(most_sound_samples) ? 0 : static_cast<std::uint64_t>(samples);
}

}  // namespace htvm
