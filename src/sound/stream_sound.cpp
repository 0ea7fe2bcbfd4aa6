#include "sound/stream_sound.h"

#include <opus.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "core/bytes.h"
#include "core/opus_packet.h"
#include "io/ogg_opus.h"
#include "io/output_file.h"
#include "sound/opus_track.h"
#include "sound/sound_file.h"

namespace htvm {

using namespace internal;
namespace {

constexpr std::int64_t within = 48;           // samples: pieces follow each other (docs/bitstream.md, section 13)
constexpr std::int64_t block = 4800;          // samples that are put together at a time
constexpr std::int64_t ahead = 48000;         // where streams were joined, a piece may begin before the last one
constexpr std::int64_t packet_samples = 960;  // of silence
constexpr std::uint32_t most_packet_samples = 5760;
constexpr std::uint32_t most_pre_skip = 0xFFFF;

std::int64_t end_of(const SoundPiece& piece) { return piece.begin + static_cast<std::int64_t>(piece.audio.samples()); }
std::int64_t heard_from(const SoundPiece& piece) { return piece.begin + piece.audio.skip_begin; }
std::int64_t heard_to(const SoundPiece& piece) { return end_of(piece) - piece.audio.skip_end; }
bool is_heard(const SoundPiece& piece) { return heard_from(piece) < heard_to(piece); }

std::string extension_of(const std::filesystem::path& path) {
    auto out = path.extension().string();
    for (auto& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return out;
}

// ---- Decoded, and laid where it belongs -----------------------------------------------------------------------------

class LaidSound {
public:
    LaidSound(std::vector<SoundPiece> pieces, int channels, std::int64_t end)
        : pieces_(std::move(pieces)), channels_(channels), end_(end) {
        decoded_.resize(std::size_t{most_packet_samples} * 2);
    }

    // The next samples of all channels in turn; empty at the end. Valid until the next call.
    std::span<const float> next() {
        const auto count = std::min(block, end_ - at_);
        if (count <= 0) return {};
        laid_.erase(laid_.begin(), laid_.begin() + static_cast<std::ptrdiff_t>(std::min(given_, laid_.size())));
        while (next_ < pieces_.size() && pieces_[next_].begin < at_ + count + ahead) lay(pieces_[next_++]);
        given_ = static_cast<std::size_t>(count * channels_);
        if (laid_.size() < given_) laid_.resize(given_);
        at_ += count;
        return std::span(laid_).first(given_);
    }

    std::uint64_t damaged() const { return damaged_; }

private:
    void lay(const SoundPiece& piece) {
        const auto& audio = piece.audio;
        const bool goes_on = decoder_ && decoder_channels_ == audio.channels && std::abs(piece.begin - due_) <= within;
        if (!goes_on) {
            int reason = OPUS_OK;
            decoder_.reset(opus_decoder_create(48000, audio.channels, &reason));
            decoder_channels_ = audio.channels;
        }
        due_ = end_of(piece);
        const auto gain = static_cast<float>(std::pow(10.0, audio.gain / 256.0 / 20.0));
        auto begin = piece.begin;
        for (const auto& packet : audio.opus) {
            const auto samples = opus_samples(packet).value_or(0);
            const int got =
                decoder_ ? opus_decode_float(decoder_.get(), packet.data(), static_cast<opus_int32>(packet.size()),
                                             decoded_.data(), static_cast<int>(most_packet_samples), 0)
                         : OPUS_ALLOC_FAIL;
            if (got != static_cast<int>(samples))
                ++damaged_;
            else
                mix(begin, samples, std::max(heard_from(piece), at_), std::min(heard_to(piece), end_), gain);
            begin += samples;
        }
    }

    // Adds what was decoded, which begins at `begin`, to what is laid, from sample `from` up to sample `to`.
    void mix(std::int64_t begin, std::int64_t samples, std::int64_t from, std::int64_t to, float gain) {
        from = std::max(from, begin);
        to = std::min(to, begin + samples);
        if (from >= to) return;
        const auto size = static_cast<std::size_t>((to - at_) * channels_);
        if (laid_.size() < size) laid_.resize(size);
        for (auto sample = from; sample < to; ++sample)
            for (int channel = 0; channel < channels_; ++channel)
                laid_[static_cast<std::size_t>((sample - at_) * channels_ + channel)] +=
                    gain * decoded_[static_cast<std::size_t>((sample - begin) * decoder_channels_ +
                                                             std::min(channel, decoder_channels_ - 1))];
    }

    std::vector<SoundPiece> pieces_;
    int channels_ = 1;
    std::int64_t end_ = 0, at_ = 0;  // at_: where laid_ begins
    std::size_t next_ = 0;           // of the pieces
    std::vector<float> laid_, decoded_;
    std::size_t given_ = 0;  // floats of laid_ that were given out
    std::unique_ptr<OpusDecoder, decltype(&opus_decoder_destroy)> decoder_{nullptr, opus_decoder_destroy};
    int decoder_channels_ = 0;
    std::int64_t due_ = 0;  // where a piece begins that follows the one before
    std::uint64_t damaged_ = 0;
};

// ---- WAV ------------------------------------------------------------------------------------------------------------

std::vector<std::uint8_t> wav_header(std::uint32_t samples, int channels) {
    const auto text = [](ByteWriter& out, std::string_view four) {
        for (const char c : four) out.u8(static_cast<std::uint8_t>(c));
    };
    const std::uint32_t frame_bytes = 2 * static_cast<std::uint32_t>(channels), bytes = samples * frame_bytes;
    ByteWriter out;
    text(out, "RIFF");
    out.u32(36 + bytes);
    text(out, "WAVEfmt ");
    out.u32(16);
    out.u16(1);  // integers
    out.u16(static_cast<std::uint16_t>(channels));
    out.u32(48000);
    out.u32(48000 * frame_bytes);
    out.u16(static_cast<std::uint16_t>(frame_bytes));
    out.u16(16);
    text(out, "data");
    out.u32(bytes);
    return out.take();
}

Result<void> write_wav(const std::filesystem::path& path, LaidSound& sound, SoundFileSummary& summary) {
    auto file = OutputFile::create(path);
    if (!file) return tl::unexpected(file.error());
    if (auto ok = file->write(wav_header(static_cast<std::uint32_t>(summary.samples), summary.channels)); !ok)
        return ok;
    std::vector<std::uint8_t> bytes;
    for (auto samples = sound.next(); !samples.empty(); samples = sound.next()) {
        bytes.clear();
        for (const auto sample : samples) {
            const auto value = static_cast<std::int16_t>(std::lround(std::clamp(sample * 32768, -32768.0f, 32767.0f)));
            bytes.push_back(static_cast<std::uint8_t>(value & 0xFF));
            bytes.push_back(static_cast<std::uint8_t>((value >> 8) & 0xFF));
        }
        if (auto ok = file->write(bytes); !ok) return ok;
    }
    return file->finish();
}

// ---- Ogg Opus -------------------------------------------------------------------------------------------------------

// The stream's own packets, if they follow each other, nothing is left out between them, and all are equally loud;
// silence comes before them if they begin late.
std::optional<OpusTrack> own_track(const std::vector<SoundPiece>& pieces, std::int64_t end) {
    const auto& first = pieces.front();
    const auto last_heard = std::find_if(pieces.rbegin(), pieces.rend(), is_heard);
    if (last_heard == pieces.rend()) return std::nullopt;
    OpusTrack out;
    out.channels = first.audio.channels;
    out.gain = first.audio.gain;
    std::int64_t begin = first.begin, heard = first.begin;
    bool hears = false, ended = false;
    for (const auto& piece : pieces) {
        const auto& audio = piece.audio;
        const bool follows = std::abs(piece.begin - begin) <= within;
        if (!follows || audio.channels != out.channels || audio.gain != out.gain) return std::nullopt;
        const auto samples = static_cast<std::int64_t>(audio.samples());
        if (!hears) {
            heard = begin + audio.skip_begin;
            hears = is_heard(piece);
        } else if (!ended && audio.skip_begin > 0) {
            return std::nullopt;
        }
        if (ended && is_heard(piece)) return std::nullopt;
        ended = ended || (hears && audio.skip_end > 0);
        begin += samples;
        out.packets.insert(out.packets.end(), audio.opus.begin(), audio.opus.end());
    }
    // In samples of the decoded packets, from the first one's beginning.
    const auto skip = heard - first.begin;
    const auto silent = heard > skip ? (heard - skip + packet_samples - 1) / packet_samples : 0;
    const auto pre_skip = silent * packet_samples + skip - heard;
    const auto to = std::min(end, heard_to(*last_heard));
    if (pre_skip > most_pre_skip || to <= 0) return std::nullopt;
    out.pre_skip = static_cast<std::uint32_t>(pre_skip);
    out.samples = static_cast<std::uint64_t>(std::min(to, begin));
    if (silent == 0) return out;
    auto silence = OpusTrackEncoder::create(out.channels, usual_opus_rate(out.channels));
    if (!silence) return std::nullopt;
    const std::vector<float> zeros(static_cast<std::size_t>(packet_samples * out.channels));
    for (std::int64_t n = 0; n < silent; ++n)
        if (!silence->push(zeros)) return std::nullopt;
    auto before = silence->finish();
    if (!before) return std::nullopt;
    before->packets.resize(static_cast<std::size_t>(silent));  // without the one that says what was held back
    out.packets.insert(out.packets.begin(), before->packets.begin(), before->packets.end());
    return out;
}

Result<OpusTrack> coded_again(LaidSound& sound, int channels) {
    auto encoder = OpusTrackEncoder::create(channels, usual_opus_rate(channels));
    if (!encoder) return tl::unexpected(encoder.error());
    for (auto samples = sound.next(); !samples.empty(); samples = sound.next())
        if (auto ok = encoder->push(samples); !ok) return tl::unexpected(ok.error());
    return encoder->finish();
}

}  // namespace

Result<SoundFileSummary> write_stream_sound(const std::filesystem::path& path, std::vector<SoundPiece> pieces,
                                            std::int64_t end) {
    const auto failed = [&](ErrorKind kind, const std::string& what) {
        return fail(kind, path.string() + ": " + what);
    };
    SoundFileSummary summary;
    std::int64_t last = 0;
    for (const auto& piece : pieces) {
        if (!is_heard(piece)) continue;
        last = std::max(last, heard_to(piece));
        summary.channels = std::max<int>(summary.channels, piece.audio.channels);
    }
    end = std::min(end, last);
    if (end <= 0) return failed(ErrorKind::bad_input, "there is no sound in it");
    if (static_cast<std::uint64_t>(end) > most_sound_samples)
        return failed(ErrorKind::limit, "the sound is longer than six hours; take a part of the frames");
    summary.samples = static_cast<std::uint64_t>(end);
    const bool wav = extension_of(path) == ".wav";
    auto track = wav ? std::nullopt : own_track(pieces, end);
    LaidSound sound(std::move(pieces), summary.channels, end);
    if (wav) {
        if (auto ok = write_wav(path, sound, summary); !ok) return tl::unexpected(ok.error());
    } else {
        summary.coded_again = !track;
        if (!track) {
            auto coded = coded_again(sound, summary.channels);
            if (!coded) return failed(coded.error().kind, coded.error().message);
            track = std::move(*coded);
        }
        if (auto ok = write_file(path, write_ogg_opus(*track)); !ok) return tl::unexpected(ok.error());
    }
    summary.damaged = sound.damaged();
    return summary;
}

}  // namespace htvm
