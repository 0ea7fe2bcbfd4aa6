// Pictures to video and back, by both coders.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <thread>
#include <vector>

#include "htvm/picture_decoder.hpp"
#include "htvm/picture_encoder.hpp"
#include "io/image_file.h"
#include "texture/thread_priority.h"

namespace htvm {
namespace {

constexpr int width = 160, height = 96;

// Waves that move.
Image waves(int time, int of_width = width, int of_height = height) {
    Image out{of_width, of_height, {}};
    for (int y = 0; y < of_height; ++y)
        for (int x = 0; x < of_width; ++x)
            for (int k = 0; k < 3; ++k)
                out.rgb.push_back(static_cast<std::uint8_t>(128 + 60 * std::sin((x + 2 * time) / 9.0 + k) +
                                                            50 * std::sin((y - time) / 7.0 - k)));
    return out;
}

double psnr(const Image& a, const Image& b) {
    EXPECT_EQ(a.rgb.size(), b.rgb.size());
    double sum = 0;
    for (std::size_t i = 0; i < a.rgb.size(); ++i) sum += std::pow(int{a.rgb[i]} - int{b.rgb[i]}, 2);
    return 10 * std::log10(255.0 * 255 * static_cast<double>(a.rgb.size()) / std::max(sum, 1.0));
}

PictureEncoderOptions small(PictureCoder coder) {
    PictureEncoderOptions out;
    out.coder = coder;
    out.width = width;
    out.height = height;
    out.quantiser = 20;
    return out;
}

Packet packet_of(const PictureEncoderOptions& options, const CodedPicture& picture, std::uint32_t frame) {
    TexturePicture written;
    written.coder = options.coder;
    written.width = options.width;
    written.height = options.height;
    written.coded = picture.bytes;
    return write_texture_picture(written, {frame, picture.key ? frame : frame - 1, 1000 * frame, true});
}

// Packets of so many pictures, those in `keys` being key pictures.
std::vector<Packet> coded(const PictureEncoderOptions& options, int pictures, const std::vector<int>& keys = {},
                          Image (*picture_at)(int, int, int) = waves) {
    auto encoder = PictureEncoder::create(options);
    EXPECT_TRUE(encoder) << encoder.error().message;
    std::vector<Packet> out;
    const auto is_key = [&](std::size_t i) { return i == 0 || std::count(keys.begin(), keys.end(), i) > 0; };
    const auto take = [&] {
        while (const auto picture = encoder->pull()) {
            EXPECT_EQ(picture->key, is_key(out.size()));
            out.push_back(packet_of(options, *picture, static_cast<std::uint32_t>(out.size())));
        }
    };
    for (int i = 0; i < pictures; ++i) {
        const OwnPlanes planes(picture_at(i, static_cast<int>(options.width), static_cast<int>(options.height)));
        const auto pushed = encoder->push(planes.view(), is_key(static_cast<std::size_t>(i)));
        EXPECT_TRUE(pushed) << pushed.error().message;
        take();
        EXPECT_TRUE(options.foresight || static_cast<int>(out.size()) == i + 1);
    }
    EXPECT_TRUE(encoder->finish());
    take();
    return out;
}

class PictureCoding : public ::testing::TestWithParam<PictureCoder> {};
INSTANTIATE_TEST_SUITE_P(BothCoders, PictureCoding, ::testing::Values(PictureCoder::av1, PictureCoder::vp9),
                         [](const auto& instance) { return std::string(name_of(instance.param)); });

TEST_P(PictureCoding, OnePacketAPictureComesBackLikeIt) {
    PictureDecoder decoder;
    int i = 0;
    for (const auto& packet : coded(small(GetParam()), 6)) {
        const auto taken = decoder.decode(packet);
        ASSERT_TRUE(taken) << taken.error().message;
        EXPECT_EQ(decoder.frame(), packet.frame);
        ASSERT_TRUE(decoder.planes());
        EXPECT_EQ(decoder.planes()->width, static_cast<std::uint32_t>(width));
        EXPECT_GT(psnr(*decoder.image(), waves(i++)), 32);
    }
    EXPECT_EQ(i, 6);
}

TEST_P(PictureCoding, DecodingStartsAtAKeyPictureAndNowhereElse) {
    const auto packets = coded(small(GetParam()), 8, {5});
    PictureDecoder decoder;
    EXPECT_FALSE(decoder.decode(packets[3]));
    EXPECT_EQ(decoder.image(), nullptr);
    for (std::size_t i = 5; i < 8; ++i) {
        const auto taken = decoder.decode(packets[i]);
        ASSERT_TRUE(taken) << taken.error().message;
        EXPECT_GT(psnr(*decoder.image(), waves(static_cast<int>(i))), 32);
    }
}

TEST_P(PictureCoding, AfterALostPictureTheLastOneStaysUntilTheNextKeyPicture) {
    const auto packets = coded(small(GetParam()), 8, {5});
    PictureDecoder decoder;
    ASSERT_TRUE(decoder.decode(packets[0]));
    const auto first = *decoder.image();
    for (const std::size_t i : {2, 3, 4}) {
        const auto taken = decoder.decode(packets[i]);
        ASSERT_FALSE(taken);
        EXPECT_EQ(taken.error().kind, ErrorKind::corrupt_stream);
        EXPECT_EQ(decoder.image()->rgb, first.rgb);
        EXPECT_EQ(decoder.frame(), 0u);
    }
    EXPECT_TRUE(decoder.decode(packets[5]));
}

TEST_P(PictureCoding, DamagedBytesAreAnErrorOrAPictureAndTheNextKeyPictureIsSound) {
    const auto packets = coded(small(GetParam()), 4, {3});
    std::srand(1);
    for (int trial = 0; trial < 200; ++trial) {
        PictureDecoder decoder;
        ASSERT_TRUE(decoder.decode(packets[0]));
        auto damaged = packets[1];
        for (int k = 0; k < 3; ++k)
            damaged.payload[10 + static_cast<std::size_t>(std::rand()) % (damaged.payload.size() - 10)] =
                static_cast<std::uint8_t>(std::rand());
        (void)decoder.decode(damaged);
        (void)decoder.decode(packets[2]);
        ASSERT_TRUE(decoder.decode(packets[3]));
        EXPECT_GT(psnr(*decoder.image(), waves(3)), 32);
    }
}

TEST_P(PictureCoding, AQuantiserThatIsCoarserTakesFewerBits) {
    const auto bytes = [&](int quantiser) {
        auto options = small(GetParam());
        options.quantiser = quantiser;
        std::size_t out = 0;
        for (const auto& packet : coded(options, 5)) out += packet.payload.size();
        return out;
    };
    EXPECT_LT(bytes(55), bytes(35));
    EXPECT_LT(bytes(35), bytes(10));
}

TEST_P(PictureCoding, TheQuantiserCanChangeFromPictureToPicture) {
    auto options = small(GetParam());
    options.quantiser = 60;
    auto encoder = PictureEncoder::create(options);
    ASSERT_TRUE(encoder);
    const auto coarse = encoder->encode(OwnPlanes(waves(0)).view());
    ASSERT_TRUE(encoder->set_quantiser(5));
    const auto fine = encoder->encode(OwnPlanes(waves(0)).view(), true);
    ASSERT_TRUE(coarse && fine);
    EXPECT_GT(fine->bytes.size(), 2 * coarse->bytes.size());
    EXPECT_FALSE(encoder->set_bitrate(1e5)) << "there was no rate from the beginning";
}

TEST_P(PictureCoding, KeepsToARate) {
    auto options = small(GetParam());
    options.bits_per_second = 60e3;
    options.buffer_seconds = 1;
    std::size_t bytes = 0;
    for (const auto& packet : coded(options, 90)) bytes += packet.payload.size();
    EXPECT_NEAR(8.0 * static_cast<double>(bytes) / 3, 60e3, 15e3);
}

TEST_P(PictureCoding, TheBytesAreTheSameForAnyNumberOfThreads) {
    auto options = small(GetParam());
    options.width = options.height = 1024;
    options.threads = 1;
    const auto by_one = coded(options, 3);
    options.threads = 3;
    const auto by_three = coded(options, 3);
    for (std::size_t i = 0; i < by_one.size(); ++i) EXPECT_EQ(by_one[i].payload, by_three[i].payload) << i;
}

TEST_P(PictureCoding, OddSidesComeBack) {
    auto options = small(GetParam());
    options.width = 99;
    options.height = 51;
    PictureDecoder decoder;
    for (const auto& packet : coded(options, 2)) ASSERT_TRUE(decoder.decode(packet));
    EXPECT_EQ(decoder.image()->width, 99);
    EXPECT_EQ(decoder.image()->height, 51);
    EXPECT_GT(psnr(*decoder.image(), waves(1, 99, 51)), 30);
}

TEST_P(PictureCoding, APictureOfAnotherSizeThanItsPacketSaysIsAnError) {
    auto packet = coded(small(GetParam()), 1)[0];
    auto picture = *read_texture_picture(packet);
    const std::vector<std::uint8_t> bytes(picture.coded.begin(), picture.coded.end());
    picture.coded = bytes;
    picture.width = 32;
    PictureDecoder decoder;
    const auto taken = decoder.decode(write_texture_picture(picture, {}));
    ASSERT_FALSE(taken);
    EXPECT_EQ(taken.error().kind, ErrorKind::corrupt_stream);
}

TEST_P(PictureCoding, WhatIsLargerThanAllowedIsRefusedBeforeItIsDecoded) {
    auto packet = coded(small(GetParam()), 1)[0];
    PictureDecoderOptions options;
    options.largest_side = 64;
    PictureDecoder decoder(options);
    const auto taken = decoder.decode(packet);
    ASSERT_FALSE(taken);
    EXPECT_EQ(taken.error().kind, ErrorKind::limit);
    // Nor where the packet lies about it.
    auto picture = *read_texture_picture(packet);
    const std::vector<std::uint8_t> bytes(picture.coded.begin(), picture.coded.end());
    picture.coded = bytes;
    picture.width = picture.height = 64;
    EXPECT_FALSE(decoder.decode(write_texture_picture(picture, {})));
}

// What stays, below noise that is another in every picture.
Image noisy_waves(int number, int w, int h) {
    auto out = waves(0, w, h);
    std::uint32_t random = static_cast<std::uint32_t>(number) + 1;
    for (auto& level : out.rgb) {
        random = random * 1664525u + 1013904223u;
        const int changed = level + static_cast<int>(random >> 24) % 17 - 8;
        level = static_cast<std::uint8_t>(std::clamp(changed, 0, 255));
    }
    return out;
}

PictureEncoderOptions foreseeing() {
    auto out = small(PictureCoder::av1);
    out.foresight = true;
    return out;
}

TEST(PicturesWithForesight, ComeBackInTheirOrderEachByThoseBeforeIt) {
    PictureDecoder decoder;
    int i = 0;
    for (const auto& packet : coded(foreseeing(), 40, {9, 10})) {
        const auto taken = decoder.decode(packet);
        ASSERT_TRUE(taken) << taken.error().message;
        EXPECT_GT(psnr(*decoder.image(), waves(i++)), 32) << i;
    }
    EXPECT_EQ(i, 40);
}

TEST(PicturesWithForesight, AreDecodedFromALaterKeyPictureOn) {
    const auto packets = coded(foreseeing(), 16, {9});
    PictureDecoder decoder;
    EXPECT_FALSE(decoder.decode(packets[4]));
    for (std::size_t i = 9; i < packets.size(); ++i) {
        const auto taken = decoder.decode(packets[i]);
        ASSERT_TRUE(taken) << taken.error().message;
        EXPECT_GT(psnr(*decoder.image(), waves(static_cast<int>(i))), 32);
    }
}

Image later_waves(int time, int w, int h) { return waves(time + 9, w, h); }

TEST(PicturesWithForesight, AreCodedFromAKeyPictureOnAsIfTheyBeganThere) {
    const auto whole = coded(foreseeing(), 20, {9});
    const auto part = coded(foreseeing(), 11, {}, later_waves);
    for (std::size_t i = 0; i < part.size(); ++i) EXPECT_EQ(part[i].payload, whole[9 + i].payload) << i;
}

TEST(PicturesWithForesight, AreTheSameBytesFromEncodersSideBySide) {
    const auto alone = coded(foreseeing(), 2);
    std::vector<std::thread> encoders;
    std::atomic<int> same = 0;
    constexpr int at_once = 6, times = 8;
    for (int k = 0; k < at_once; ++k)
        encoders.emplace_back([&] {
            auto options = foreseeing();
            options.threads = 1;
            for (int time = 0; time < times; ++time) same += coded(options, 2)[1].payload == alone[1].payload;
        });
    for (auto& encoder : encoders) encoder.join();
    EXPECT_EQ(same, at_once * times);
}

TEST(PicturesWithForesight, ShowWhatStaysBelowNoiseBetterAndTakeFewerBits) {
    const auto cost = [](PictureEncoderOptions options) {
        options.quantiser = 45;
        PictureDecoder decoder;
        std::pair<std::size_t, double> out{0, 0};  // bytes, mean dB against what has no noise
        for (const auto& packet : coded(options, 24, {}, noisy_waves)) {
            EXPECT_TRUE(decoder.decode(packet));
            out.first += packet.payload.size();
            out.second += psnr(*decoder.image(), waves(0)) / 24;
        }
        return out;
    };
    const auto [bytes, error] = cost(small(PictureCoder::av1));
    const auto [bytes_foreseen, error_foreseen] = cost(foreseeing());
    EXPECT_LT(bytes_foreseen, bytes);
    EXPECT_GT(error_foreseen, error + 1);
}

TEST(PicturesWithForesight, AreTheSameForAnyNumberOfThreads) {
    auto options = foreseeing();
    options.width = options.height = 256;
    std::vector<std::vector<std::uint8_t>> payloads[2];
    for (const unsigned threads : {1u, 4u}) {
        options.threads = threads;
        for (const auto& packet : coded(options, 40, {}, noisy_waves)) payloads[threads / 4].push_back(packet.payload);
    }
    EXPECT_TRUE(payloads[0] == payloads[1]);
}

TEST(PicturesWithForesight, OfAnySpeedAndQuantiserComeBack) {
    std::size_t before = 0;
    for (const int quantiser : {63, 40, 20, 0}) {
        auto options = foreseeing();
        options.quantiser = quantiser;
        options.speed = 5 + quantiser % 5;
        std::size_t bytes = 0;
        PictureDecoder decoder;
        for (const auto& packet : coded(options, 5)) {
            EXPECT_TRUE(decoder.decode(packet));
            bytes += packet.payload.size();
        }
        EXPECT_GT(bytes, before);
        before = bytes;
    }
}

TEST(PicturesWithForesight, TakeAnotherQuantiserFromTheNextKeyPictureOn) {
    auto encoder = PictureEncoder::create(foreseeing());
    ASSERT_TRUE(encoder && encoder->push(OwnPlanes(waves(0)).view()));
    ASSERT_TRUE(encoder->set_quantiser(60) && encoder->push(OwnPlanes(waves(0)).view(), true));
    ASSERT_TRUE(encoder->finish());
    const auto fine = encoder->pull(), coarse = encoder->pull();
    ASSERT_TRUE(fine && coarse);
    EXPECT_GT(fine->bytes.size(), 2 * coarse->bytes.size());
}

TEST(PicturesWithForesight, DoNotWaitForMoreThanSixtyFour) {
    auto options = foreseeing();
    options.width = options.height = 64;
    options.speed = 9;
    auto encoder = PictureEncoder::create(options);
    ASSERT_TRUE(encoder);
    const OwnPlanes planes(waves(0, 64, 64));
    int waiting = 0, most = 0;
    for (int i = 0; i < 200; ++i) {
        ASSERT_TRUE(encoder->push(planes.view()));
        ++waiting;
        while (encoder->pull()) --waiting;
        most = std::max(most, waiting);
    }
    EXPECT_LE(most, 64);
    EXPECT_GT(most, 1);
}

TEST(PicturesWithForesight, AreLeftInTheMiddleWithoutHarm) {
    auto encoder = PictureEncoder::create(foreseeing());
    ASSERT_TRUE(encoder);
    for (int i = 0; i < 3; ++i) ASSERT_TRUE(encoder->push(OwnPlanes(waves(i)).view()));
}

TEST(PicturesWithForesight, SmallOnesAndThoseOfOddSidesAreCodedAtOnce) {
    for (const auto& [w, h] : {std::pair(62, 96), std::pair(96, 16), std::pair(161, 96), std::pair(160, 97)}) {
        auto options = foreseeing();
        options.width = static_cast<std::uint32_t>(w);
        options.height = static_cast<std::uint32_t>(h);
        auto encoder = PictureEncoder::create(options);
        ASSERT_TRUE(encoder) << encoder.error().message;
        ASSERT_TRUE(encoder->push(OwnPlanes(waves(0, w, h)).view()));
        EXPECT_TRUE(encoder->pull());
        EXPECT_TRUE(encoder->finish());
    }
}

TEST(PicturesWithForesight, PrintNothing) {
    ::testing::internal::CaptureStderr();
    ::testing::internal::CaptureStdout();
    coded(foreseeing(), 2);
    EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
    EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

// As root, SVT-AV1 would have it otherwise.
TEST(PicturesWithForesight, HaveTheirTurnAsOthersDo) {
    auto encoder = PictureEncoder::create(foreseeing());
    ASSERT_TRUE(encoder && encoder->push(OwnPlanes(waves(0)).view()));
    EXPECT_TRUE(threads_before_all_else().empty());
}

TEST(PicturesWithForesight, AreAv1ByTheQuantiserAlone) {
    auto options = foreseeing();
    options.bits_per_second = 1e6;
    EXPECT_FALSE(PictureEncoder::create(options));
    options = foreseeing();
    options.coder = PictureCoder::vp9;
    EXPECT_FALSE(PictureEncoder::create(options));
    auto encoder = PictureEncoder::create(foreseeing());
    ASSERT_TRUE(encoder);
    EXPECT_FALSE(encoder->encode(OwnPlanes(waves(0)).view()));
}

TEST(PictureEncoder, RefusesWhatItCannotCode) {
    for (const auto& change : std::vector<void (*)(PictureEncoderOptions&)>{
             [](auto& o) { o.coder = PictureCoder::png; }, [](auto& o) { o.width = 0; },
             [](auto& o) { o.height = 5000; }, [](auto& o) { o.quantiser = 64; },
             [](auto& o) { o.frames_per_second = 0; }, [](auto& o) { o.bits_per_second = -1; },
             [](auto& o) { o.speed = 12; }}) {
        auto options = small(PictureCoder::av1);
        change(options);
        EXPECT_FALSE(PictureEncoder::create(options));
    }
    auto encoder = PictureEncoder::create(small(PictureCoder::av1));
    EXPECT_FALSE(encoder->encode(OwnPlanes(waves(0, 32, 32)).view()));
}

TEST(PictureDecoder, ReadsImageFilesWhereItIsGivenAReader) {
    const auto file = write_png_image(waves(0));
    ASSERT_TRUE(file);
    TexturePicture picture;
    picture.coder = PictureCoder::png;
    picture.width = width;
    picture.height = height;
    picture.gains = {picture_gain_one, picture_gain_one / 2, picture_gain_one};
    picture.coded = *file;
    const auto packet = write_texture_picture(picture, {});
    const auto refused = PictureDecoder().decode(packet);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().kind, ErrorKind::unsupported);
    PictureDecoderOptions options;
    options.read_image_file = [](std::span<const std::uint8_t> bytes) { return read_image(bytes); };
    PictureDecoder decoder(options);
    ASSERT_TRUE(decoder.decode(packet));
    EXPECT_EQ(decoder.planes(), nullptr);
    const auto shown = decoder.image();
    const auto expected = waves(0);
    for (std::size_t i = 0; i < expected.rgb.size(); ++i)
        ASSERT_EQ(shown->rgb[i], i % 3 == 1 ? (expected.rgb[i] + 1) / 2 : expected.rgb[i]);
}

}  // namespace
}  // namespace htvm
