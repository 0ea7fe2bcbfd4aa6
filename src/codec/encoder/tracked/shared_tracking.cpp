#include "codec/encoder/tracked/shared_tracking.h"

#include <algorithm>
#include <utility>

namespace htvm::internal {
namespace {

// Encoders go in step, but for the frames that wait in each.
constexpr std::size_t frames_kept = 6;

template <class Key, class Value>
void keep_newest(std::map<Key, Value>& frames) {
    while (frames.size() > frames_kept) frames.erase(frames.begin());
}

}  // namespace

SharedStep shared_step(const Lattice& lattice, const DeformableMesh& mesh, std::span<const RigidMotion> before,
                       std::span<const RigidMotion> now) {
    SharedStep out;
    out.lattice = lattice;
    for (std::size_t h = 0; h < now.size(); ++h) {
        const auto was = before.empty() ? RigidMotion{} : before[h];
        out.before.push_back(was(mesh.handles[h]));
        out.motion.push_back(now[h] * was.inverse());
    }
    return out;
}

std::shared_ptr<const SurfaceIndex> SharedTracking::surface(const SurfaceKey& key) const {
    const std::lock_guard lock(mutex_);
    const auto found = surfaces_.find(key);
    return found == surfaces_.end() ? nullptr : found->second;
}

void SharedTracking::add(const SurfaceKey& key, std::shared_ptr<const SurfaceIndex> surface) {
    const std::lock_guard lock(mutex_);
    surfaces_[key] = std::move(surface);
    keep_newest(surfaces_);
}

void SharedTracking::add(std::int64_t timestamp_us, SharedStep step) {
    const std::lock_guard lock(mutex_);
    steps_[timestamp_us] = std::move(step);
    keep_newest(steps_);
}

std::vector<RigidMotion> SharedTracking::start(std::int64_t timestamp_us, const Lattice& lattice,
                                               const DeformableMesh& mesh, std::span<const RigidMotion> last) const {
    const std::lock_guard lock(mutex_);
    const auto found = steps_.find(timestamp_us);
    if (found == steps_.end() || found->second.before.empty()) return {};
    const auto& [of, before, motion] = found->second;
    if (of.origin != lattice.origin || of.bits != lattice.bits) return {};
    std::vector<RigidMotion> out;
    for (std::size_t i = 0; i < mesh.handles.size(); ++i) {
        const auto own = last.empty() ? RigidMotion{} : last[i];
        const Eigen::Vector3d place = own(mesh.handles[i]);
        const auto nearest = std::min_element(before.begin(), before.end(), [&](const auto& a, const auto& b) {
            return (a - place).squaredNorm() < (b - place).squaredNorm();
        });
        const auto& step = motion[static_cast<std::size_t>(nearest - before.begin())];
        out.push_back(step * own);
    }
    return out;
}

}  // namespace htvm::internal
