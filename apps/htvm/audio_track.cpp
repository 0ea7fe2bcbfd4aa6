#include "audio_track.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "command_line/headings.h"
#include "command_line/interruption.h"
#include "command_line/terminal.h"
#include "core/opus_packet.h"
#include "htvm/decoder.hpp"
#include "sound/opus_track.h"

namespace htvm::app {
namespace {

constexpr std::int64_t second_us = 1000000;
constexpr std::size_t most_in_one = 50;        // packets of Opus, where frames are far apart
constexpr std::int64_t converging_us = 80000;  // what a decoder that begins in the middle needs to come near

std::uint32_t clamped(std::int64_t samples, std::uint64_t most) {
    return static_cast<std::uint32_t>(std::clamp<std::int64_t>(samples, 0, static_cast<std::int64_t>(most)));
}

}  // namespace

void add_audio_options(CLI::App& command, AudioOptions& options) {
    auto* file = command.add_option(
        "--audio", options.file,
        "Sound, which begins with the first frame, mono or stereo: WAV, FLAC, MP3, Ogg, AIFF and others, coded as\n"
        "Opus; Opus files are taken as they are");
    file->type_name("FILE")->group(heading::sound);
    command
        .add_option(
            "--audio-delay", options.delay,
            "--audio: seconds from the first frame to where the sound begins; below 0, so much of the sound is\n"
            "left out")
        ->type_name("SECONDS")
        ->check(CLI::Range(-1e6, 1e6))
        ->needs(file)
        ->group(heading::sound);
    command
        .add_option("--audio-bitrate", options.kilobits,
                    "--audio: kbit/s of the sound, 6 to 510 (default: 48 mono, 96 stereo); Opus files are coded again")
        ->type_name("KBIT/S")
        ->check(CLI::Range(6.0, 510.0))
        ->needs(file)
        ->group(heading::sound);
}

Result<std::optional<AudioTrack>> AudioTrack::open(const AudioOptions& options) {
    if (options.file.empty()) return std::nullopt;
    OpusFileOptions coding;
    if (options.kilobits > 0) coding.bits_per_second = static_cast<std::uint32_t>(std::lround(1000 * options.kilobits));
    std::optional<Progress> progress;  // in steps of a second
    coding.step = [&](double, double of) {
        if (!progress) progress.emplace("coding the sound, seconds", static_cast<std::size_t>(of));
        progress->step();
        return interruption() == 0;
    };
    auto track = read_opus_track(options.file, coding);
    if (!track) return tl::unexpected(track.error());
    if (track->is_silent) warn(options.file + " is silent from its beginning to its end");
    return AudioTrack(std::move(*track), options.delay);
}

AudioTrack::AudioTrack(OpusTrack track, double delay)
    : track_(std::move(track)), delay_us_(std::llround(delay * second_us)) {
    begins_.push_back(0);
    for (const auto& packet : track_.packets)
        begins_.push_back(begins_.back() + internal::opus_samples(packet).value_or(0));
}

std::int64_t AudioTrack::time_us(std::uint64_t sample) const {
    const auto heard = static_cast<std::int64_t>(sample) - track_.pre_skip;
    return *first_us_ + delay_us_ + heard * second_us / audio_samples_per_second;
}

std::vector<Packet> AudioTrack::before(const Packet& packet) {
    std::vector<Packet> out;
    if (packet.kind == PacketKind::sequence) time_.push(packet, false);
    if (!frame_type(packet.kind)) return out;
    if (first_us_) out = up_to(packet.timestamp_us, false);
    if (!first_us_) {
        first_us_ = packet.timestamp_us;
        while (next_ < track_.packets.size() && time_us(begins_[next_ + 1]) <= *first_us_ - converging_us) ++next_;
    }
    last_us_ = packet.timestamp_us;
    frame_ = packet.frame;
    return out;
}

std::vector<Packet> AudioTrack::rest() {
    if (!first_us_ || is_over_) return {};
    is_over_ = true;
    auto out = up_to(last_us_ + static_cast<std::int64_t>(time_.one_frame_us()), true);
    next_ = track_.packets.size();
    if (!is_heard_) warn("none of the sound lies in the time of the frames, so the stream has none; see --audio-delay");
    return out;
}

std::vector<Packet> AudioTrack::up_to(std::int64_t until_us, bool last) {
    std::vector<Packet> out;
    while (next_ < track_.packets.size() && time_us(begins_[next_]) < until_us) {
        AudioPacket audio{track_.channels, track_.gain, 0, 0, {}};
        const auto first = next_;
        while (next_ < track_.packets.size() && time_us(begins_[next_]) < until_us && next_ - first < most_in_one)
            audio.opus.push_back(track_.packets[next_++]);
        const auto begin = static_cast<std::int64_t>(begins_[first]), end = static_cast<std::int64_t>(begins_[next_]);
        const std::int64_t pre_skip = track_.pre_skip;
        // The sample that is heard at a time, counted from the file's first.
        const auto at = [&](std::int64_t since_us) {
            return pre_skip + (since_us - delay_us_) * std::int64_t{audio_samples_per_second} / second_us;
        };
        const auto heard_from = std::max(pre_skip, at(0));
        auto heard_to = pre_skip + static_cast<std::int64_t>(track_.samples);
        if (last) heard_to = std::min(heard_to, at(until_us - *first_us_));
        const auto samples = static_cast<std::uint64_t>(end - begin);
        audio.skip_begin = clamped(heard_from - begin, samples);
        audio.skip_end = clamped(end - heard_to, samples - audio.skip_begin);
        out.push_back(write_audio(audio, frame_, time_us(begins_[first])));
        is_heard_ = true;
    }
    return out;
}

}  // namespace htvm::app
