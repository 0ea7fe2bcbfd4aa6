// A bitrate of meshes and pictures together, over several passes: what each takes follows from the one scale of quality
// (picture_track.h), so that a pass codes both at the quality at which, by the passes before, both together take the
// rate. Meshes are rate-controlled to their part of it; pictures have the quality, the same for all.
#pragma once

#include <vector>

namespace htvm::app {

// What a pass took, bits in all, and at which qualities.
struct SharedPass {
    double mesh_quality = 0, mesh_bits = 0;        // of the frames on average, 0 to 100
    double picture_quality = 0, picture_bits = 0;  // 0 to finest_picture_quality
    double bits() const { return mesh_bits + picture_bits; }
};

// Where meshes are at their finest, pictures may get finer still, down to the coder's finest quantiser.
inline constexpr double finest_picture_quality = 130;

class RateSharing {
public:
    // wanted_bits: of the whole stream.
    explicit RateSharing(double wanted_bits) : wanted_bits_(wanted_bits) {}
    double wanted_bits() const { return wanted_bits_; }
    void add(const SharedPass& pass) { passes_.push_back(pass); }
    // Whether the last pass took what was wanted, within rate_tolerance, and meshes and pictures look alike.
    bool is_met() const;
    // Whether all is as fine as it gets and takes less than wanted.
    bool is_finest() const;
    // For the next pass, behind one at least: the quality of the pictures, and the bits of the meshes.
    struct Next {
        double picture_quality = 0, mesh_bits = 0;
    };
    Next next() const;

private:
    double wanted_bits_;
    std::vector<SharedPass> passes_;
};

}  // namespace htvm::app
