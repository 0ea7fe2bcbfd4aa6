// What encoders of the same capture in several qualities find once for all (Encoder::share_with()): the search
// structures of each captured surface, and where that surface moved, from which the registration of the others starts.
// Each has its own reference and nodes, so each registers these by itself, but from a start that is nearly right.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "codec/encoder/configuration.h"
#include "surface/surface_index.h"
#include "surface/tracked_registration.h"

namespace htvm::internal {

// What search structures depend on, besides the frame: what has the same has the same structures.
struct SurfaceKey {
    std::int64_t timestamp_us = 0;
    std::array<std::int32_t, 3> origin{};  // of the lattice
    int lattice_bits = 0, effort = 0;
    bool open = false;
    std::size_t vertices = 0, colours = 0;
    auto operator<=>(const SurfaceKey&) const = default;
};

// How the first encoder's nodes moved in one frame.
struct SharedStep {
    Lattice lattice;                      // in whose units
    std::vector<Eigen::Vector3d> before;  // where each node was one frame before
    std::vector<RigidMotion> motion;      // of each since
};
// mesh: whose handles are the nodes. before: their motions up to the frame before; empty: they were at rest.
SharedStep shared_step(const Lattice& lattice, const DeformableMesh& mesh, std::span<const RigidMotion> before,
                       std::span<const RigidMotion> now);

class SharedTracking {
public:
    // Null where nobody has made it.
    std::shared_ptr<const SurfaceIndex> surface(const SurfaceKey& key) const;
    void add(const SurfaceKey& key, std::shared_ptr<const SurfaceIndex> surface);
    void add(std::int64_t timestamp_us, SharedStep step);
    // A start for the handles of another mesh: each goes on as the nearest node did. last: their motions up to the
    // frame before; empty: they were at rest. Empty where the step is not known, or of another lattice.
    std::vector<RigidMotion> start(std::int64_t timestamp_us, const Lattice& lattice, const DeformableMesh& mesh,
                                   std::span<const RigidMotion> last) const;

private:
    mutable std::mutex mutex_;  // an encoder finds things of several frames at a time
    std::map<SurfaceKey, std::shared_ptr<const SurfaceIndex>> surfaces_;
    std::map<std::int64_t, SharedStep> steps_;
};

}  // namespace htvm::internal
