// Sound files to Opus, and the sound of streams to files: bursts of a tone stay where they are.
#include <gtest/gtest.h>
#include <sndfile.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "core/opus_packet.h"
#include "io/ogg_opus.h"
#include "sound/opus_track.h"
#include "sound/sound_file.h"
#include "sound/stream_sound.h"

namespace htvm {
namespace {

namespace fs = std::filesystem;

class Sound : public ::testing::Test {
protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() / ("htvm-sound-" + std::to_string(getpid()));
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }
    fs::path in(const std::string& name) const { return folder_ / name; }

private:
    fs::path folder_;
};

// 50 ms of 1 kHz, fading in and out, around each of these times; the second channel has half of the first.
std::vector<float> bursts(const std::vector<double>& seconds, double length, int rate, int channels) {
    std::vector<float> out(static_cast<std::size_t>(length * rate) * static_cast<std::size_t>(channels));
    constexpr double half = 0.025;
    for (std::size_t n = 0; n < out.size(); ++n) {
        const double t = static_cast<double>(n / static_cast<std::size_t>(channels)) / rate;
        for (const double at : seconds)
            if (std::abs(t - at) < half)
                out[n] = static_cast<float>(0.5 * (1 + std::cos(std::numbers::pi * (t - at) / half)) / 2 *
                                            std::sin(2 * std::numbers::pi * 1000 * (t - at)) *
                                            (n % static_cast<std::size_t>(channels) == 0 ? 1.0 : 0.5));
    }
    return out;
}

void write_sound(const fs::path& path, const std::vector<float>& samples, int rate, int channels, int format) {
    SF_INFO info{};
    info.samplerate = rate;
    info.channels = channels;
    info.format = format;
    auto* file = sf_open(path.c_str(), SFM_WRITE, &info);
    ASSERT_NE(file, nullptr) << sf_strerror(nullptr);
    sf_write_float(file, samples.data(), static_cast<sf_count_t>(samples.size()));
    sf_close(file);
}

constexpr int wav = SF_FORMAT_WAV | SF_FORMAT_PCM_16;

// All that a file decodes to, at 48 kHz.
std::vector<float> read_all(const fs::path& path, int channels) {
    std::vector<float> out;
    auto file = SoundFile::open(path);
    if (!file) ADD_FAILURE() << file.error().message;
    if (!file) return out;
    EXPECT_EQ(file->channels(), channels);
    for (;;) {
        const auto samples = file->next();
        if (!samples) ADD_FAILURE() << samples.error().message;
        if (!samples || samples->empty()) return out;
        out.insert(out.end(), samples->begin(), samples->end());
    }
}

// The energy's centre within 50 ms around a time; and how much there is.
struct Burst {
    double seconds = 0, energy = 0;
};
Burst burst_near(const std::vector<float>& samples, double seconds, int channels = 1, int channel = 0) {
    double sum = 0, moment = 0;
    for (std::size_t n = 0; n < samples.size() / static_cast<std::size_t>(channels); ++n) {
        const double t = static_cast<double>(n) / 48000;
        if (std::abs(t - seconds) > 0.05) continue;
        const double x = samples[n * static_cast<std::size_t>(channels) + static_cast<std::size_t>(channel)];
        sum += x * x;
        moment += x * x * t;
    }
    return {sum > 0 ? moment / sum : -1, sum};
}

// As `encode --audio` lays it: a piece for each frame of 1/30 s.
std::vector<SoundPiece> pieces_of(const OpusTrack& track, std::int64_t begin) {
    std::vector<SoundPiece> out;
    std::int64_t at = begin - track.pre_skip, end = begin + static_cast<std::int64_t>(track.samples);
    for (std::size_t n = 0; n < track.packets.size();) {
        SoundPiece piece{{track.channels, track.gain, 0, 0, {}}, at};
        for (int k = 0; k < 2 && n < track.packets.size(); ++k) piece.audio.opus.push_back(track.packets[n++]);
        const auto samples = static_cast<std::int64_t>(piece.audio.samples());
        if (out.empty()) piece.audio.skip_begin = track.pre_skip;
        if (at + samples > end) piece.audio.skip_end = static_cast<std::uint32_t>(at + samples - end);
        at += samples;
        out.push_back(std::move(piece));
    }
    return out;
}

TEST_F(Sound, BurstsStayWhereTheyAreAtEveryRateAndFormat) {
    const std::vector<double> at = {0.1, 0.75, 1.4};
    struct Case {
        std::string name;
        int rate, channels, format;
    };
    for (const auto& [name, rate, channels, format] :
         {Case{"a.wav", 48000, 1, wav}, Case{"b.wav", 44100, 2, wav}, Case{"c.wav", 8000, 1, wav},
          Case{"d.flac", 96000, 2, SF_FORMAT_FLAC | SF_FORMAT_PCM_16},
          Case{"e.wav", 44100, 1, SF_FORMAT_WAV | SF_FORMAT_FLOAT}}) {
        SCOPED_TRACE(name);
        const auto samples = bursts(at, 1.5, rate, channels);
        write_sound(in(name), samples, rate, channels, format);
        const auto track = read_opus_track(in(name));
        ASSERT_TRUE(track) << track.error().message;
        EXPECT_EQ(track->channels, channels);
        EXPECT_NEAR(static_cast<double>(track->samples), 1.5 * 48000, 2);
        const auto written = write_stream_sound(in("out.wav"), pieces_of(*track, 0), 48000 * 10);
        ASSERT_TRUE(written) << written.error().message;
        EXPECT_EQ(written->samples, track->samples);
        EXPECT_EQ(written->damaged, 0u);
        const auto decoded = read_all(in("out.wav"), channels);
        EXPECT_EQ(decoded.size(), track->samples * static_cast<std::size_t>(channels));
        const auto full = burst_near(bursts(at, 1.5, 48000, 1), at[0]).energy;
        for (const double t : at) {
            const auto burst = burst_near(decoded, t, channels);
            EXPECT_NEAR(burst.seconds, t, 0.001);
            EXPECT_NEAR(burst.energy, full, 0.2 * full);
            const auto last = burst_near(decoded, t, channels, channels - 1);
            EXPECT_NEAR(last.energy, channels == 2 ? full / 4 : full, 0.2 * full);
        }
        EXPECT_LT(burst_near(decoded, 0.4, channels).energy, 0.01 * full);
    }
}

TEST_F(Sound, OpusFilesAreTakenAsTheyAreUnlessARateIsAskedFor) {
    const fs::path clicks = HTVM_TEST_DATA "/audio/clicks.opus";
    const auto as_is = read_opus_track(clicks), file = read_ogg_opus(clicks);
    ASSERT_TRUE(as_is && file);
    EXPECT_TRUE(as_is->packets == file->packets);
    OpusFileOptions options;
    options.bits_per_second = 96000;
    const auto again = read_opus_track(clicks, options);
    ASSERT_TRUE(again) << again.error().message;
    EXPECT_EQ(again->samples, file->samples);
    EXPECT_FALSE(again->packets == file->packets);
}

TEST_F(Sound, MoreBitsMakeMoreBytes) {
    write_sound(in("a.wav"), bursts({0.1, 0.3, 0.5, 0.7}, 1, 48000, 1), 48000, 1, wav);
    const auto bytes = [&](std::uint32_t rate) {
        OpusFileOptions options;
        options.bits_per_second = rate;
        std::size_t sum = 0;
        const auto track = read_opus_track(in("a.wav"), options);
        for (const auto& packet : track.value().packets) sum += packet.size();
        return sum;
    };
    EXPECT_LT(2 * bytes(12000), bytes(128000));
}

TEST_F(Sound, WhatCannotBeReadIsToldWithAdvice) {
    write_sound(in("six.wav"), bursts({}, 0.1, 48000, 6), 48000, 6, wav);
    std::ofstream(in("text.wav")) << "no sound at all";
    const auto said = [&](const std::string& name) {
        const auto track = read_opus_track(in(name));
        EXPECT_FALSE(track);
        return track ? "" : track.error().message;
    };
    EXPECT_NE(said("six.wav").find("6 channels"), std::string::npos) << said("six.wav");
    EXPECT_NE(said("six.wav").find("-ac 2"), std::string::npos);
    EXPECT_NE(said("text.wav").find("ffmpeg -i text.wav"), std::string::npos) << said("text.wav");
    EXPECT_NE(said("nowhere.wav").find("no such file"), std::string::npos);
    write_sound(in("empty.wav"), {}, 48000, 1, wav);
    EXPECT_NE(said("empty.wav").find("no sound in it"), std::string::npos) << said("empty.wav");
}

TEST_F(Sound, CodingCanBeStopped) {
    write_sound(in("a.wav"), bursts({}, 3, 8000, 1), 8000, 1, wav);
    OpusFileOptions options;
    options.step = [](double seconds, double of) { return seconds < 1 || of != 3; };
    EXPECT_FALSE(read_opus_track(in("a.wav"), options));
}

class StreamSound : public Sound {
protected:
    OpusTrack track() {
        write_sound(in("in.wav"), bursts({0.2, 0.6}, 1, 48000, 1), 48000, 1, wav);
        return read_opus_track(in("in.wav")).value();
    }
    // The bursts of what is written as Opus, and whether its packets are these.
    void expect_opus(std::vector<SoundPiece> pieces, const std::vector<double>& at, bool coded_again) {
        const auto written = write_stream_sound(in("out.opus"), std::move(pieces), 48000 * 10);
        ASSERT_TRUE(written) << written.error().message;
        EXPECT_EQ(written->coded_again, coded_again);
        const auto decoded = read_all(in("out.opus"), 1);
        EXPECT_NEAR(static_cast<double>(decoded.size()), static_cast<double>(written->samples), 1);
        const auto full = burst_near(bursts({0.2}, 1, 48000, 1), 0.2).energy;
        double sum = 0;
        for (const auto x : decoded) sum += double{x} * x;
        EXPECT_NEAR(sum, full * static_cast<double>(at.size()), 0.2 * sum);
        for (const double t : at) EXPECT_NEAR(burst_near(decoded, t).seconds, t, 0.001);
    }
};

TEST_F(StreamSound, PacketsThatFollowEachOtherGoIntoTheFileAsTheyAre) {
    const auto sound = track();
    expect_opus(pieces_of(sound, 0), {0.2, 0.6}, false);
    const auto file = read_ogg_opus(in("out.opus"));
    ASSERT_TRUE(file) << file.error().message;
    EXPECT_TRUE(file->packets == sound.packets);
    EXPECT_EQ(file->pre_skip, sound.pre_skip);
    EXPECT_EQ(file->samples, sound.samples);
}

TEST_F(StreamSound, SoundThatBeginsLateHasSilenceBeforeIt) {
    for (const int late : {1, 100, 960, 4801, 48000})
        expect_opus(pieces_of(track(), late), {0.2 + late / 48000.0, 0.6 + late / 48000.0}, false);
}

TEST_F(StreamSound, WhatIsBeforeTheFirstFrameIsCutOff) {
    expect_opus(pieces_of(track(), -19200), {0.2}, false);  // 0.4 s
}

TEST_F(StreamSound, AfterAGapItGoesOnWhereItShould) {
    auto pieces = pieces_of(track(), 0);
    auto later = pieces_of(track(), 48000 + 12345);
    pieces.insert(pieces.end(), later.begin(), later.end());
    const double by = 1 + 12345 / 48000.0;
    expect_opus(pieces, {0.2, 0.6, 0.2 + by, 0.6 + by}, true);
}

TEST_F(StreamSound, WhatOverlapsIsHeardTogether) {
    std::vector<SoundPiece> pieces;
    std::vector<float> both(2 * 48000);
    constexpr int later = 48000 - 600;  // less than a packet of Opus overlaps
    OpusFileOptions fine;
    fine.bits_per_second = 256000;
    for (const int begin : {0, later}) {
        const auto samples = bursts({begin == 0 ? 0.98 : 0.02}, 1, 48000, 1);
        for (std::size_t n = 0; n < samples.size(); ++n) both[n + static_cast<std::size_t>(begin)] += samples[n];
        write_sound(in("in.wav"), samples, 48000, 1, wav);
        const auto more = pieces_of(read_opus_track(in("in.wav"), fine).value(), begin);
        pieces.insert(pieces.end(), more.begin(), more.end());
    }
    ASSERT_TRUE(write_stream_sound(in("out.wav"), pieces, 96000));
    const auto decoded = read_all(in("out.wav"), 1);
    double product = 0, energy = 0, expected = 0;
    for (std::size_t n = later; n < 48000; ++n) {
        product += double{both[n]} * decoded[n];
        energy += double{decoded[n]} * decoded[n];
        expected += double{both[n]} * both[n];
    }
    EXPECT_GT(product, 0.95 * std::sqrt(energy * expected));
}

TEST_F(StreamSound, LouderPiecesAreRaised) {
    auto pieces = pieces_of(track(), 0);
    for (auto& piece : pieces) piece.audio.gain = -1541;  // a half: -6.02 dB
    ASSERT_TRUE(write_stream_sound(in("out.wav"), pieces, 48000));
    const auto full = burst_near(bursts({0.2}, 1, 48000, 1), 0.2).energy;
    EXPECT_NEAR(burst_near(read_all(in("out.wav"), 1), 0.2).energy, full / 4, 0.05 * full);
}

TEST_F(StreamSound, ADamagedPacketIsSilenceAndCounted) {
    auto pieces = pieces_of(track(), 0);
    pieces[5].audio.opus[0] = {0xfb, 0xc1, 0xff};  // a frame of padding without end
    const auto written = write_stream_sound(in("out.wav"), pieces, 48000);
    ASSERT_TRUE(written) << written.error().message;
    EXPECT_EQ(written->damaged, 1u);
}

TEST_F(StreamSound, TooLongAndNothingAtAllAreErrors) {
    auto pieces = pieces_of(track(), std::int64_t{1} << 40);
    const auto long_one = write_stream_sound(in("out.wav"), pieces, std::int64_t{1} << 48);
    ASSERT_FALSE(long_one);
    EXPECT_EQ(long_one.error().kind, ErrorKind::limit);
    EXPECT_FALSE(write_stream_sound(in("out.wav"), {}, 48000));
    EXPECT_FALSE(fs::exists(in("out.wav")));
}

}  // namespace
}  // namespace htvm
