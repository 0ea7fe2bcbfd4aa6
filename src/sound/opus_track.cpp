#include "sound/opus_track.h"

#include <opus.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sound/sound_file.h"

namespace htvm {
namespace {

constexpr std::size_t frame_samples = 960;  // 20 ms
constexpr std::size_t most_packet_bytes = 4000;
constexpr double second = 48000;

tl::unexpected<Error> opus_failed(int reason) {
    return fail(ErrorKind::bad_input, std::string("Opus cannot code the sound: ") + opus_strerror(reason));
}

// Ogg with Opus in it, whatever else the file has; other Ogg files, such as Vorbis, libsndfile reads.
bool has_opus(const std::filesystem::path& path) {
    std::array<char, 4096> first{};
    std::ifstream in(path, std::ios::binary);
    in.read(first.data(), first.size());
    const std::string_view text(first.data(), static_cast<std::size_t>(in.gcount()));
    return text.starts_with("OggS") && text.find("OpusHead") != std::string_view::npos;
}

}  // namespace

struct OpusTrackEncoder::State {
    std::unique_ptr<OpusEncoder, decltype(&opus_encoder_destroy)> encoder{nullptr, opus_encoder_destroy};
    OpusTrack track;
    std::vector<float> waiting;  // less than a packet's

    std::size_t packet_floats() const { return frame_samples * track.channels; }

    Result<void> code(std::span<const float> samples) {
        std::array<unsigned char, most_packet_bytes> packet;
        const auto size = opus_encode_float(encoder.get(), samples.data(), frame_samples, packet.data(), packet.size());
        if (size < 0) return opus_failed(size);
        track.packets.emplace_back(packet.begin(), packet.begin() + size);
        return {};
    }
};

OpusTrackEncoder::OpusTrackEncoder(std::unique_ptr<State> state) : state_(std::move(state)) {}
OpusTrackEncoder::OpusTrackEncoder(OpusTrackEncoder&&) noexcept = default;
OpusTrackEncoder::~OpusTrackEncoder() = default;

Result<OpusTrackEncoder> OpusTrackEncoder::create(int channels, std::uint32_t bits_per_second) {
    auto state = std::make_unique<State>();
    int reason = OPUS_OK;
    state->encoder.reset(opus_encoder_create(48000, channels, OPUS_APPLICATION_AUDIO, &reason));
    if (!state->encoder) return opus_failed(reason);
    auto* encoder = state->encoder.get();
    opus_int32 lookahead = 0;
    for (const int said : {opus_encoder_ctl(encoder, OPUS_SET_BITRATE(static_cast<opus_int32>(bits_per_second))),
                           opus_encoder_ctl(encoder, OPUS_SET_COMPLEXITY(10)),
                           opus_encoder_ctl(encoder, OPUS_GET_LOOKAHEAD(&lookahead))})
        if (said != OPUS_OK) return opus_failed(said);
    state->track.channels = static_cast<std::uint8_t>(channels);
    state->track.pre_skip = static_cast<std::uint32_t>(lookahead);
    return OpusTrackEncoder(std::move(state));
}

Result<void> OpusTrackEncoder::push(std::span<const float> samples) {
    auto& state = *state_;
    const auto packet = state.packet_floats();
    state.track.samples += samples.size() / state.track.channels;
    if (!state.waiting.empty()) {
        const auto taken = std::min(packet - state.waiting.size(), samples.size());
        state.waiting.insert(state.waiting.end(), samples.begin(),
                             samples.begin() + static_cast<std::ptrdiff_t>(taken));
        samples = samples.subspan(taken);
        if (state.waiting.size() < packet) return {};
        if (auto ok = state.code(state.waiting); !ok) return ok;
        state.waiting.clear();
    }
    for (; samples.size() >= packet; samples = samples.subspan(packet))
        if (auto ok = state.code(samples.first(packet)); !ok) return ok;
    state.waiting.assign(samples.begin(), samples.end());
    return {};
}

Result<OpusTrack> OpusTrackEncoder::finish() {
    auto& state = *state_;
    // What is heard comes out of a decoder pre_skip samples late.
    while (state.track.packets.size() * frame_samples < state.track.samples + state.track.pre_skip) {
        state.waiting.resize(state.packet_floats());
        if (auto ok = state.code(state.waiting); !ok) return tl::unexpected(ok.error());
        state.waiting.clear();
    }
    return std::move(state.track);
}

Result<OpusTrack> read_opus_track(const std::filesystem::path& path, const OpusFileOptions& options) {
    if (!options.bits_per_second && has_opus(path)) return read_ogg_opus(path);
    auto file = SoundFile::open(path);
    if (!file) return tl::unexpected(file.error());
    const auto in_file = [&](const Error& error) { return fail(error.kind, path.string() + ": " + error.message); };
    auto encoder =
        OpusTrackEncoder::create(file->channels(), options.bits_per_second.value_or(usual_opus_rate(file->channels())));
    if (!encoder) return in_file(encoder.error());
    double done = 0, told = 0;
    bool is_silent = true;
    const double promised = static_cast<double>(file->promised_samples()) / second;
    for (;;) {
        const auto samples = file->next();
        if (!samples) return tl::unexpected(samples.error());
        if (samples->empty()) break;
        is_silent = is_silent && std::all_of(samples->begin(), samples->end(), [](float s) { return s == 0; });
        if (auto ok = encoder->push(*samples); !ok) return in_file(ok.error());
        done += static_cast<double>(samples->size()) / file->channels() / second;
        if (done < told + 1) continue;
        told = done;
        if (options.step && !options.step(done, promised))
            return fail(ErrorKind::bad_input, path.string() + ": interrupted");
    }
    auto track = encoder->finish();
    if (!track) return in_file(track.error());
    if (track->samples == 0) return fail(ErrorKind::bad_input, path.string() + ": there is no sound in it");
    track->is_silent = is_silent;
    return track;
}

}  // namespace htvm
