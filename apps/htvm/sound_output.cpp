#include "sound_output.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "command_line/terminal.h"
#include "htvm/decoder.hpp"

namespace htvm::app {
namespace {

constexpr std::uint64_t most_bytes = std::uint64_t{1} << 30;
constexpr double converging_us = 80000;  // what a decoder that begins in the middle needs to come near
constexpr double samples_per_us = audio_samples_per_second / 1e6;

double length_us(const AudioPacket& audio) { return static_cast<double>(audio.samples()) / samples_per_us; }

// Timestamps may be anything; what lies outside is refused when the file is written, or is not heard.
std::int64_t samples_of(double microseconds) {
    constexpr double most = 0x1p48;
    return std::llround(std::clamp(microseconds * samples_per_us, -most, most));
}

}  // namespace

Result<void> SoundOutput::take(const Packet& packet) {
    numbers_.push(packet);
    time_.push(packet, numbers_.begins_sequence());
    if (is_enough()) return {};
    if (frame_type(packet.kind)) {
        const auto now = static_cast<double>(time_.microseconds());
        frame_timestamp_us_ = packet.timestamp_us;
        any_frame_ = true;
        const std::uint64_t number = numbers_.of(packet.frame);
        if (number < range_.first)  // what is long over is not needed
            std::erase_if(pieces_,
                          [&](const auto& p) { return p.begin_us + length_us(p.audio) < now - converging_us; });
        else if (!begin_us_)
            begin_us_ = now;
        if (range_.frames > 0 && number >= range_.first && number - range_.first >= range_.frames) end_us_ = now;
    }
    if (packet.kind != PacketKind::audio || !any_frame_) return {};
    auto audio = read_audio(packet);
    if (!audio && audio.error().kind == ErrorKind::unsupported) return {};
    if (!audio) return tl::unexpected(audio.error());
    bytes_ += packet.payload.size();
    if (bytes_ > most_bytes)
        return fail(ErrorKind::limit, path_ + ": the sound is larger than 1 GiB; take fewer frames");
    const double behind = static_cast<double>(packet.timestamp_us) - static_cast<double>(frame_timestamp_us_);
    pieces_.push_back({std::move(*audio), static_cast<double>(time_.microseconds()) + behind});
    return {};
}

Result<void> SoundOutput::finish(const std::string& input) {
    if (!begin_us_) return fail(ErrorKind::bad_input, fmt::format("{} has no frame {}", input, range_.first));
    const double begin = *begin_us_, end = end_us_.value_or(static_cast<double>(time_.total_us()));
    std::vector<SoundPiece> pieces;
    for (auto& piece : pieces_)
        if (piece.begin_us + length_us(piece.audio) > begin - converging_us && piece.begin_us < end)
            pieces.push_back({std::move(piece.audio), samples_of(piece.begin_us - begin)});
    pieces_.clear();
    if (pieces.empty())
        return fail(ErrorKind::bad_input,
                    input + (range_.first > 0 || range_.frames > 0 ? " has no sound in the time of these frames"
                                                                   : " has no sound"));
    const auto written = write_stream_sound(path_, std::move(pieces), samples_of(end - begin));
    if (!written) return tl::unexpected(written.error());
    note(fmt::format("{:.2f} s of {} sound to {}{}", static_cast<double>(written->samples) / audio_samples_per_second,
                     written->channels == 1 ? "mono" : "stereo", path_,
                     written->coded_again ? ", coded again, since it is in pieces that do not follow each other" : ""));
    if (written->damaged > 0)
        warn(counted(written->damaged, "packet") + " of Opus could not be decoded, and is silence");
    return {};
}

}  // namespace htvm::app
