// Streams for the tests of the C interface, and what the C++ interface decodes from them.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "codec/enhanced_options.h"
#include "codec/test_sequences.h"
#include "htvm/htvm.h"

namespace htvm::test {

using namespace internal;

// A person of about 300 vertices with skeleton, colours and normals; an I-frame, EP-frames, P-frames, T-frames.
inline const CodedSequence& coded_person() {
    static const auto coded = [] {
        EncoderOptions options = enhanced_options();
        options.key_interval = 3;
        options.topology.frame_choice = FrameChoice::motion;
        options.topology.predicted_below = 60;
        return encode(synthetic(true, 6, 300), options);
    }();
    return coded;
}

// Without skeleton, with every attribute.
inline const CodedSequence& coded_grid() {
    static const auto coded = [] {
        EncoderOptions options = enhanced_options();
        options.key_interval = 2;
        return encode(sequence_of(tfan_test::grid(6, 6), 4, all), options);
    }();
    return coded;
}

// The current frame of a decoder, through the copying functions of the C interface.
inline Mesh copied_mesh(htvm_decoder* decoder, const htvm_frame_info& info) {
    Mesh out;
    const auto take = [&](auto& array, std::size_t count, auto copy) {
        array.resize(count);
        const std::size_t numbers = count * (count > 0 ? array[0].size() : 1);
        EXPECT_EQ(copy(decoder, count > 0 ? array[0].data() : nullptr, numbers), HTVM_OK)
            << htvm_decoder_last_error(decoder);
    };
    take(out.positions, info.vertices, htvm_decoder_copy_positions);
    take(out.triangles, info.triangles, htvm_decoder_copy_triangles);
    if (info.attributes & HTVM_COLOURS) take(out.colours, info.vertices, htvm_decoder_copy_colours);
    if (info.attributes & HTVM_NORMALS) take(out.normals, info.vertices, htvm_decoder_copy_normals);
    if (info.attributes & HTVM_TEXCOORDS) take(out.texcoords, info.vertices, htvm_decoder_copy_texcoords);
    return out;
}

// The same through the view.
inline Mesh lent_mesh(htvm_decoder* decoder, const htvm_frame_info& info) {
    htvm_mesh_view view;
    EXPECT_EQ(htvm_decoder_view(decoder, &view, sizeof view), HTVM_OK);
    EXPECT_EQ(view.struct_size, sizeof view);
    EXPECT_EQ(view.vertices, info.vertices);
    EXPECT_EQ(view.triangles, info.triangles);
    EXPECT_EQ(view.topology, info.topology);
    EXPECT_EQ(view.colours != nullptr, (info.attributes & HTVM_COLOURS) != 0);
    EXPECT_EQ(view.normals != nullptr, (info.attributes & HTVM_NORMALS) != 0);
    EXPECT_EQ(view.texcoords != nullptr, (info.attributes & HTVM_TEXCOORDS) != 0);
    Mesh out;
    const auto take = [](auto& array, const auto* numbers, std::size_t count) {
        if (!numbers || count == 0) return;
        array.resize(count);
        std::copy_n(numbers, count * array[0].size(), array[0].data());
    };
    take(out.positions, view.positions, view.vertices);
    take(out.triangles, view.indices, view.triangles);
    take(out.colours, view.colours, view.vertices);
    take(out.normals, view.normals, view.vertices);
    take(out.texcoords, view.texcoords, view.vertices);
    return out;
}

inline Pose copied_pose(htvm_decoder* decoder, const htvm_frame_info& info) {
    Pose out;
    out.joints.resize(info.joints);
    out.orientations.resize(info.bones);
    EXPECT_EQ(htvm_decoder_copy_joints(decoder, out.joints[0].data(), 3 * info.joints), HTVM_OK);
    EXPECT_EQ(htvm_decoder_copy_orientations(decoder, out.orientations[0].data(), 9 * info.bones), HTVM_OK);
    return out;
}

// An allocator of the caller that counts, and fails from its `fails_from`-th allocation on.
struct CountingMemory {
    int made = 0, released = 0, fails_from = 1 << 30;

    static void* allocate(void* user, std::size_t bytes) {
        auto& self = *static_cast<CountingMemory*>(user);
        if (self.made >= self.fails_from) return nullptr;
        ++self.made;
        return std::malloc(bytes);
    }
    static void release(void* user, void* memory) {
        EXPECT_NE(memory, nullptr);
        ++static_cast<CountingMemory*>(user)->released;
        std::free(memory);
    }
    htvm_allocator allocator() { return {this, allocate, release}; }
};

}  // namespace htvm::test
