// If memory runs out anywhere below the C interface, a status reports it, nothing is thrown, and the handle stays
// usable.
#include <gtest/gtest.h>

#include "htvm/htvm.h"
#include "memory/counted_allocations.h"
#include "memory/memory_streams.h"

namespace htvm {
namespace {

using namespace test;

struct Received {
    int frames = 0, errors = 0;
};

// Sends the stream, in pieces, and receives all frames.
Received receive_all(htvm_decoder* decoder, const std::vector<std::uint8_t>& bytes) {
    Received out;
    constexpr std::size_t piece = 3000;
    for (std::size_t at = 0; at < bytes.size(); at += piece) {
        out.errors +=
            htvm_decoder_send_bytes(decoder, bytes.data() + at, std::min(piece, bytes.size() - at)) != HTVM_OK;
        htvm_status status;
        while ((status = htvm_decoder_receive_frame(decoder, nullptr, 0)) != HTVM_AGAIN) {
            status == HTVM_OK ? ++out.frames : ++out.errors;
            EXPECT_NE(status, HTVM_BAD_INPUT);
            EXPECT_NE(status, HTVM_INTERNAL);
        }
        (void)htvm_decoder_conceal(decoder, 1, 1, nullptr, 0);
    }
    return out;
}

std::vector<std::uint8_t> bytes_of(const std::vector<Packet>& packets) {
    std::vector<std::uint8_t> out;
    for (const auto& packet : packets) {
        const auto bytes = write_packet(packet);
        out.insert(out.end(), bytes.begin(), bytes.end());
    }
    return out;
}

TEST(CInterfaceOutOfMemory, TheDecoderGoesOnAfterAnyFailure) {
    const auto bytes = bytes_of(animated_stream(100));
    htvm_decoder* decoder = nullptr;
    ASSERT_EQ(htvm_decoder_create(nullptr, &decoder), HTVM_OK);
    reset_allocations();
    const int frames = receive_all(decoder, bytes).frames;
    const std::uint64_t total = allocations().made;
    EXPECT_GT(frames, 0);
    htvm_decoder_destroy(decoder);
    for (const bool all : {false, true})
        for (std::uint64_t n = 0; n < total; n += 1 + total / 100) {
            const auto live = allocations().live;
            Received failing;
            while_failing(n, all, [&] {
                decoder = nullptr;
                if (htvm_decoder_create(nullptr, &decoder) == HTVM_OK) failing = receive_all(decoder, bytes);
            });
            if (decoder) {
                EXPECT_LE(failing.frames, frames);
                EXPECT_EQ(htvm_decoder_discard(decoder), HTVM_OK);
                EXPECT_EQ(receive_all(decoder, bytes).frames, frames) << "behind failure " << n;
            }
            htvm_decoder_destroy(decoder);
            EXPECT_EQ(allocations().live, live) << "behind failure " << n;
        }
}

TEST(CInterfaceOutOfMemory, TheEncoderSaysSo) {
    const float positions[] = {0, 0, 0, 100, 0, 0, 0, 100, 0, 0, 0, 100};
    const std::uint32_t indices[] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    htvm_mesh mesh;
    htvm_mesh_init(&mesh, sizeof mesh);
    mesh.vertices = mesh.triangles = 4;
    mesh.positions = positions;
    mesh.indices = indices;
    int failures = 0;
    const auto run = [&] {
        htvm_encoder* encoder = nullptr;
        htvm_encoder_options* options = nullptr;
        failures += htvm_encoder_options_create(HTVM_PROFILE_TOPOLOGY, nullptr, &options) != HTVM_OK;
        failures += htvm_encoder_options_set(options, "threads", "1") != HTVM_OK;
        failures += htvm_encoder_options_set_skeleton(options, nullptr) != HTVM_OK;
        failures += htvm_encoder_options_set(options, "an option that there is none of", "1") != HTVM_BAD_INPUT;
        failures += htvm_encoder_create(options, &encoder, nullptr, 0) != HTVM_OK;
        htvm_encoder_options_destroy(options);
        for (int t = 0; encoder && t < 3; ++t) {
            failures += htvm_encoder_send_mesh(encoder, &mesh, nullptr, t, 0) != HTVM_OK;
            std::uint8_t packet[4096];
            std::size_t size = 0;
            failures += htvm_encoder_receive_packet(encoder, packet, sizeof packet, &size) < 0;
        }
        failures += encoder && htvm_encoder_finish(encoder) != HTVM_OK;
        htvm_encoder_destroy(encoder);
    };
    reset_allocations();
    run();
    EXPECT_EQ(failures, 0);
    const std::uint64_t total = allocations().made;
    for (const bool all : {false, true})
        for (std::uint64_t n = 0; n < total; n += 1 + total / 200) {
            const auto live = allocations().live;
            while_failing(n, all, run);
            EXPECT_EQ(allocations().live, live) << "behind failure " << n;
        }
    EXPECT_GT(failures, 0);
}

}  // namespace
}  // namespace htvm
