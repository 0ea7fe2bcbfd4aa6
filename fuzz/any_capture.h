// Invalid and unusual captures for the encoder: any sizes, any floats, indices out of range, poses of any kind. Many
// are almost valid, since nothing else gets far.
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fuzz_input.h"
#include "htvm/mesh.hpp"
#include "htvm/skeleton.hpp"

namespace htvm::fuzz {

struct AnyCapture {
    struct Frame {
        Mesh mesh;
        std::optional<Pose> pose;
    };
    Skeleton skeleton;
    std::vector<Frame> frames;
};

inline float any_coordinate(FuzzInput& input) {
    constexpr float infinity = std::numeric_limits<float>::infinity();
    constexpr std::array special = {
        0.f,      -0.f,     1e-40f, 1e9f, -1e9f, 3e38f, infinity, -infinity, std::numeric_limits<float>::quiet_NaN(),
        524288.f, -524288.f};
    const std::uint8_t shape = input.u8();
    if (shape < 150) return static_cast<float>(input.between(-128, 127)) * 2;
    if (shape < 240) return static_cast<float>(input.between(-32768, 32767)) / 16;
    if (shape < 248) return special[input.below(special.size())];
    return input.any_float();
}

inline Vector3f any_place(FuzzInput& input) {
    return {any_coordinate(input), any_coordinate(input), any_coordinate(input)};
}

// A tube of rings, or nothing: similar to a limb, with enough vertices to give registration work.
inline Mesh tube(std::uint32_t rings, std::uint32_t around) {
    Mesh out;
    for (std::uint32_t r = 0; r < rings; ++r)
        for (std::uint32_t a = 0; a < around; ++a) {
            // A diamond, since it needs no trigonometry: every machine makes the same.
            const float t = 4.f * static_cast<float>(a) / static_cast<float>(around);
            const float x = t < 2 ? 1 - t : t - 3, y = t < 1 ? t : t < 3 ? 2 - t : t - 4;
            out.positions.push_back({60 * x, 60 * y, 30 * static_cast<float>(r)});
        }
    for (std::uint32_t r = 0; r + 1 < rings; ++r)
        for (std::uint32_t a = 0; a < around; ++a) {
            const std::uint32_t v = r * around + a, w = r * around + (a + 1) % around;
            out.triangles.push_back({v, w, v + around});
            out.triangles.push_back({w, w + around, v + around});
        }
    return out;
}

inline void give_attributes(Mesh& mesh, std::uint8_t which, FuzzInput& input) {
    const std::size_t vertices = mesh.positions.size() + ((which & 16) && input.below(4) == 0 ? 1 : 0);
    for (std::size_t k = 0; k < vertices; ++k) {
        const auto grey = static_cast<std::uint8_t>(k * 3);
        if (which & 1) mesh.colours.push_back({grey, input.u8(), 40});
        if (which & 2) mesh.normals.push_back(k % 8 ? Vector3f{0, 0.6f, 0.8f} : any_place(input));
        if (which & 4)
            mesh.texcoords.push_back({static_cast<float>(k % 16) / 16, k % 8 ? 0.5f : any_coordinate(input)});
    }
}

inline Mesh any_mesh(FuzzInput& input) {
    const std::uint8_t kind = input.u8();
    Mesh out = kind & 1 ? tube(input.below(12), 3 + input.below(10)) : Mesh{};
    for (std::uint32_t n = input.below(kind & 2 ? 40 : 4); n > 0 && input.left() > 0; --n)
        out.positions.push_back(any_place(input));
    const auto vertices = static_cast<std::uint32_t>(out.positions.size());
    // Sometimes one that does not exist.
    const auto any_vertex = [&] { return vertices > 0 && (kind & 8) == 0 ? input.below(vertices) : input.u32(); };
    for (std::uint32_t n = input.below(kind & 4 ? 60 : 4); n > 0 && input.left() > 0; --n)
        out.triangles.push_back({any_vertex(), any_vertex(), any_vertex()});
    for (std::uint32_t n = input.below(16); n > 0 && vertices > 0 && input.left() > 0; --n)
        out.positions[input.below(vertices)] = any_place(input);
    give_attributes(out, kind / 16, input);
    return out;
}

inline Skeleton any_skeleton(FuzzInput& input) {
    Skeleton out;
    const std::uint32_t joints = input.below(7);
    for (std::uint32_t j = 0; j < joints; ++j) out.joint_names.push_back("joint " + std::to_string(j));
    for (std::uint32_t n = joints > 1 ? input.below(7) : 0; n > 0; --n) {
        // Sometimes one too far.
        const auto first = static_cast<std::uint16_t>(input.below(joints + (input.u8() == 255)));
        out.bones.push_back({first, static_cast<std::uint16_t>(input.below(joints))});
    }
    return out;
}

inline Pose any_pose(const Skeleton& skeleton, FuzzInput& input) {
    Pose out;
    const std::uint8_t kind = input.u8();
    const std::size_t joints = skeleton.joint_names.size() + (kind > 250 ? 1 : 0);
    for (std::size_t j = 0; j < joints; ++j) {
        if (kind & 1) {
            const auto p = any_place(input);
            out.joints.push_back({p[0], p[1], p[2]});
        } else {
            out.joints.push_back({1.0 * input.between(-128, 127), 10, 60.0 * static_cast<double>(j)});
        }
        if (kind & 2) out.found.push_back(input.flag());
    }
    if (kind & 4)
        for (std::size_t b = 0; b < skeleton.bones.size(); ++b) {
            Rotation rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
            for (std::uint32_t n = input.below(5); n > 0; --n) rotation[input.below(9)] = any_coordinate(input);
            out.orientations.push_back(rotation);
        }
    return out;
}

// One to five frames; some are the previous one, moved a little.
inline AnyCapture any_capture(FuzzInput& input) {
    AnyCapture out;
    out.skeleton = any_skeleton(input);
    for (std::uint32_t n = 1 + input.below(5); n > 0; --n) {
        AnyCapture::Frame frame;
        const std::uint8_t kind = input.u8();
        if ((kind & 3) && !out.frames.empty()) {
            frame.mesh = out.frames.back().mesh;
            const Vector3f shift = any_place(input);
            for (auto& p : frame.mesh.positions)
                for (std::size_t c = 0; c < 3; ++c) p[c] += shift[c] / (kind & 4 ? 16 : 1);
            if (kind & 8 && !frame.mesh.triangles.empty()) frame.mesh.triangles.pop_back();
        } else {
            frame.mesh = any_mesh(input);
        }
        if (kind & 16) frame.pose = any_pose(out.skeleton, input);
        out.frames.push_back(std::move(frame));
    }
    return out;
}

}  // namespace htvm::fuzz
