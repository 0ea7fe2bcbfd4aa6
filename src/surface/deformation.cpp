#include "surface/deformation.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace htvm::internal {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d;

Vector3d vector_of(const Point3f& p) { return {p[0], p[1], p[2]}; }
Point3f point_of(const Vector3d& v) {
    return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

// Handles of one level, and the samples they move from where they rest.
struct Stage {
    const DeformationLevel& level;
    std::vector<Vector3d> rest, rest_normals;  // of the samples
    std::vector<Vector3d> centre;              // of the handles, at rest
    std::vector<HandlePair> pairs;             // their points at rest
    std::vector<RigidMotion> motion;
};

struct Moved {
    std::vector<Point3f> points, normals;
};

Vector3d blended(const SampleBlend& blend, const std::vector<RigidMotion>& motion, const Vector3d& x) {
    Vector3d out = Vector3d::Zero();
    for (std::size_t k = 0; k < blend.count; ++k)
        out += static_cast<double>(blend.weight[k]) * motion[blend.handle[k]](x);
    return out;
}

Vector3d blended_turn(const SampleBlend& blend, const std::vector<RigidMotion>& motion, const Vector3d& direction) {
    Vector3d out = Vector3d::Zero();
    for (std::size_t k = 0; k < blend.count; ++k)
        out += static_cast<double>(blend.weight[k]) * (motion[blend.handle[k]].rotation * direction);
    const double length = out.norm();
    return length > 0 ? Vector3d(out / length) : direction;
}

Moved move_samples(const Stage& stage, Threads threads) {
    Moved out{std::vector<Point3f>(stage.rest.size()), std::vector<Point3f>(stage.rest.size())};
    parallel_for(stage.rest.size(), threads, 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            out.points[i] = point_of(blended(stage.level.blends[i], stage.motion, stage.rest[i]));
            out.normals[i] = point_of(blended_turn(stage.level.blends[i], stage.motion, stage.rest_normals[i]));
        }
    });
    return out;
}

// A sample and the target's plane it should lie in.
struct Match {
    std::uint32_t sample = 0;
    std::uint32_t vertex = 0;  // of the target
    float weight = 0;          // 0: none
    float gap = 0;             // between the points searched
};

// Where the searches of the last round ended, which is where those of the next begin.
struct Guesses {
    std::vector<std::uint32_t> forward, back;  // by sample, and by the target's sample
};

struct Round {
    double reach = 0;  // positions' units
    double stiffness = 0;
    double point_share = 0;
    float gap = 0;          // between samples of the reference
    bool far = false;       // search among the target's samples; distant matches still count
    std::size_t every = 1;  // only each so many of the samples
};

// Near matches count fully and fade out at the reach; far ones all pull alike, however far they are.
float match_weight(const OrientedMatch& match, const Round& round) {
    if (!match.found) return 0;
    const double d = std::sqrt(static_cast<double>(match.squared_distance));
    if (round.far) return static_cast<float>(1 / std::max(1.0, d / (0.1 * round.reach)));
    const double fade = std::max(0.0, 1 - d * d / (round.reach * round.reach));
    return static_cast<float>(fade * fade);
}

// Both ways: each sample to the target, and each of the target's samples to the nearest moved sample.
std::vector<Match> find_matches(const Moved& moved, const TargetSurface& target, const Round& round, float cell,
                                const DeformationOptions& options, Guesses& guesses) {
    const std::size_t skip = round.every * (round.far ? 2 : 1);
    const std::size_t forward = moved.points.size() / round.every, back = target.samples.size() / skip;
    const auto reach = static_cast<float>(round.reach), agreement = static_cast<float>(options.agreement);
    const OrientedPoints reference(moved.points, moved.normals, cell);
    const auto& search = round.far ? target.coarse : target.fine;
    const float gap = round.far ? target.coarse_gap : target.fine_gap;
    guesses.forward.resize(forward, OrientedPoints::no_point);
    guesses.back.resize(back, OrientedPoints::no_point);
    std::vector<Match> out(forward + back);
    const auto go_forward = [&](std::size_t i, std::uint32_t last) {
        const std::size_t sample = i * round.every;
        std::uint32_t& guess = guesses.forward[i];
        const auto match = search.nearest(moved.points[sample], moved.normals[sample], reach, agreement,
                                          guess == OrientedPoints::no_point ? last : guess);
        if (match.found) guess = match.index;
        const auto vertex = round.far && match.found ? target.samples[match.index] : match.index;
        out[i] = {static_cast<std::uint32_t>(sample), vertex, match_weight(match, round), gap};
        return guess;
    };
    const auto go_back = [&](std::size_t i, std::uint32_t last) {
        const std::uint32_t vertex = target.samples[i * skip];
        std::uint32_t& guess = guesses.back[i];
        const auto match = reference.nearest(target.positions[vertex], target.normals[vertex], reach, agreement,
                                             guess == OrientedPoints::no_point ? last : guess);
        if (match.found) guess = match.index;
        out[forward + i] = {match.index, vertex, match_weight(match, round), round.gap};
        return guess;
    };
    // Slices of both, so that threads have the same to do.
    constexpr std::size_t slices = 64;
    parallel_for(slices, options.threads, 4, [&](std::size_t begin, std::size_t end) {
        std::uint32_t last = OrientedPoints::no_point;
        for (std::size_t i = begin * forward / slices; i < end * forward / slices; ++i) last = go_forward(i, last);
        last = OrientedPoints::no_point;
        for (std::size_t i = begin * back / slices; i < end * back / slices; ++i) last = go_back(i, last);
    });
    std::erase_if(out, [](const Match& m) { return !(m.weight > 0); });
    return out;
}

// How a point moves with a handle's six unknowns: the turn, about `centre`, and the shift.
Eigen::Matrix<double, 3, 6> lever(const Vector3d& point, const Vector3d& centre) {
    const Vector3d r = point - centre;
    Eigen::Matrix<double, 3, 6> out;
    out << 0, r.z(), -r.y(), 1, 0, 0, -r.z(), 0, r.x(), 0, 1, 0, r.y(), -r.x(), 0, 0, 0, 1;
    return out;
}

// What all matches of one sample ask of it: the quadratic form of the distances, and its slope.
struct Pull {
    Matrix3d metric = Matrix3d::Zero();
    Vector3d force = Vector3d::Zero();
};

// Of the samples from `begin` to before `end`.
std::vector<Pull> sum_pulls(const std::vector<Match>& matches, const Moved& moved, const TargetSurface& target,
                            double point_share, std::size_t begin, std::size_t end) {
    std::vector<Pull> pulls(end - begin);
    for (const Match& match : matches) {
        if (match.sample < begin || match.sample >= end) continue;
        const Vector3d apart = vector_of(target.positions[match.vertex]) - vector_of(moved.points[match.sample]);
        // The mean of the two normals: across it, points of one round surface are no distance apart.
        const Vector3d sum = vector_of(target.normals[match.vertex]) + vector_of(moved.normals[match.sample]);
        const double length = sum.norm();
        const Vector3d normal = length > 0 ? Vector3d(sum / length) : Vector3d::Zero();
        // Samples have gaps between them: only what is further along the surface than that is apart.
        const double across = normal.dot(apart);
        const Vector3d along = apart - across * normal;
        const double weight = static_cast<double>(match.weight);
        const double slide = along.norm();
        const double share = slide > match.gap ? weight * point_share * (1 - match.gap / slide) : 0;
        Pull& pull = pulls[match.sample - begin];
        pull.metric.noalias() += (weight - share) * normal * normal.transpose();
        pull.metric.diagonal().array() += share;
        pull.force += weight * across * normal + share * along;
    }
    return pulls;
}

Matrix3d cross_matrix(const Vector3d& r) {
    Matrix3d out;
    out << 0, -r.z(), r.y(), r.z(), 0, -r.x(), -r.y(), r.x(), 0;
    return out;
}

// A sample moves with the turn and the shift of handle k by weight_k (turn x r_k + shift): the blocks are written out,
// for this is where the time goes.
void add_pull(const Stage& stage, const std::vector<Vector3d>& centres, std::size_t sample, const Pull& pull,
              BlockSystem& system) {
    const SampleBlend& blend = stage.level.blends[sample];
    std::array<Vector3d, handles_a_vertex> arm;
    std::array<Matrix3d, handles_a_vertex> pressed;  // metric * transposed cross matrix of the arm
    auto add = [&](std::size_t a, std::size_t b, Matrix6& block) {
        const double weight_a = static_cast<double>(blend.weight[a]), weight_b = static_cast<double>(blend.weight[b]);
        const double both = weight_a * weight_b;
        const Vector3d& r = arm[a];
        for (int column = 0; column < 3; ++column) {
            const double x = pressed[b](0, column), y = pressed[b](1, column), z = pressed[b](2, column);
            block(0, column) += r.y() * z - r.z() * y;
            block(1, column) += r.z() * x - r.x() * z;
            block(2, column) += r.x() * y - r.y() * x;
            block(3, column) += weight_a * x;
            block(4, column) += weight_a * y;
            block(5, column) += weight_a * z;
        }
        for (int column = 0; column < 3; ++column)
            for (int row = 0; row < 3; ++row) {
                block(row, 3 + column) += weight_b * pressed[a](column, row);
                block(3 + row, 3 + column) += both * pull.metric(row, column);
            }
    };
    for (std::size_t k = 0; k < blend.count; ++k) {
        const std::size_t h = blend.handle[k];
        const double weight = static_cast<double>(blend.weight[k]);
        arm[k] = weight * (stage.motion[h](stage.rest[sample]) - centres[h]);
        pressed[k].noalias() = pull.metric * cross_matrix(arm[k]).transpose();
        add(k, k, system.diagonal[h]);
        system.right[h].head<3>() += arm[k].cross(pull.force);
        system.right[h].tail<3>() += weight * pull.force;
    }
    std::size_t slot = 0;
    for (std::size_t a = 0; a < blend.count; ++a)
        for (std::size_t b = a + 1; b < blend.count; ++b) add(a, b, system.above[blend.block[slot++]]);
}

void add_pairs(const Stage& stage, const std::vector<Vector3d>& centres, double stiffness, BlockSystem& system) {
    for (const HandlePair& pair : stage.pairs) {
        const RigidMotion &a = stage.motion[pair.first], &b = stage.motion[pair.second];
        const Vector3d at_a = a(pair.point), at_b = b(pair.point);
        const auto lever_a = lever(at_a, centres[pair.first]), lever_b = lever(at_b, centres[pair.second]);
        const double shift = stiffness * pair.shift_stiffness;
        const double turn = stiffness * pair.turn_stiffness * 0.25 *
                            (stage.centre[pair.first] - stage.centre[pair.second]).squaredNorm();
        system.diagonal[pair.first].noalias() += shift * lever_a.transpose() * lever_a;
        system.diagonal[pair.second].noalias() += shift * lever_b.transpose() * lever_b;
        system.right[pair.first].noalias() += shift * lever_a.transpose() * (at_b - at_a);
        system.right[pair.second].noalias() -= shift * lever_b.transpose() * (at_b - at_a);
        Matrix6 across = -shift * lever_a.transpose() * lever_b;
        const Matrix3d apart = b.rotation * a.rotation.transpose();
        const Vector3d twist =
            0.5 * Vector3d(apart(2, 1) - apart(1, 2), apart(0, 2) - apart(2, 0), apart(1, 0) - apart(0, 1));
        for (int k = 0; k < 3; ++k) {
            system.diagonal[pair.first](k, k) += turn;
            system.diagonal[pair.second](k, k) += turn;
            across(k, k) -= turn;
            system.right[pair.first][k] += turn * twist[k];
            system.right[pair.second][k] -= turn * twist[k];
        }
        system.above[stage.level.pattern.find(pair.first, pair.second)] += across;
    }
}

// Gives how far the handle that goes farthest goes, its turn counted a hand's breadth from it.
double apply_step(const std::vector<Vector6>& step, const std::vector<Vector3d>& centres, double breadth,
                  Stage& stage) {
    double farthest = 0;
    for (std::size_t h = 0; h < step.size(); ++h) {
        if (!step[h].allFinite()) continue;
        const Vector3d turn = step[h].head<3>();
        const double angle = turn.norm();
        farthest = std::max(farthest, step[h].tail<3>().norm() + breadth * angle);
        RigidMotion& motion = stage.motion[h];
        if (angle > 1e-12)
            motion.rotation =
                Eigen::AngleAxisd(std::min(angle, 0.6), turn / angle).toRotationMatrix() * motion.rotation;
        motion.shift = centres[h] + step[h].tail<3>() - motion.rotation * stage.centre[h];
    }
    return farthest;
}

// Gives how far it moved the handles, see apply_step.
double run_round(Stage& stage, const TargetSurface& target, const Round& round, float cell, BlockSystem (&systems)[2],
                 Guesses& guesses, const DeformationOptions& options) {
    const Moved moved = move_samples(stage, options.threads);
    const auto matches = find_matches(moved, target, round, cell, options, guesses);
    std::vector<Vector3d> centres(stage.centre.size());
    for (std::size_t h = 0; h < centres.size(); ++h) centres[h] = stage.motion[h](stage.centre[h]);
    // Always in two halves, so that the sums do not depend on the number of threads.
    auto add_half = [&](std::size_t half) {
        systems[half].clear();
        const std::size_t begin = half * stage.rest.size() / 2, end = (half + 1) * stage.rest.size() / 2;
        const auto pulls = sum_pulls(matches, moved, target, round.point_share, begin, end);
        for (std::size_t i = begin; i < end; ++i)
            if (pulls[i - begin].metric(0, 0) > 0) add_pull(stage, centres, i, pulls[i - begin], systems[half]);
    };
    parallel_invoke(
        options.threads, [&] { add_half(1); }, [&] { add_half(0); });
    systems[0] += systems[1];
    const double load = static_cast<double>(stage.rest.size()) / static_cast<double>(centres.size());
    add_pairs(stage, centres, round.stiffness * load, systems[0]);
    // What nothing holds stays where it is.
    const double unit = options.millimetre * options.millimetre;
    for (auto& diagonal : systems[0].diagonal) {
        diagonal.topLeftCorner<3, 3>().diagonal().array() += 10 * load * unit;
        diagonal.bottomRightCorner<3, 3>().diagonal().array() += 0.01 * load;
    }
    return apply_step(solve(stage.level.pattern, systems[0], options.solver_iterations, 1e-3), centres,
                      100 * options.millimetre, stage);
}

Stage fine_stage(const DeformableMesh& mesh, std::vector<RigidMotion> motion) {
    Stage stage{mesh.fine, {}, {}, mesh.handles, mesh.fine.pairs, std::move(motion)};
    for (std::size_t i = 0; i < mesh.samples.size(); ++i) {
        stage.rest.push_back(vector_of(mesh.positions[mesh.samples[i]]));
        stage.rest_normals.push_back(vector_of(mesh.sample_normals[i]));
    }
    return stage;
}

// Groups of handles move on from where `fine` has them.
Stage coarse_stage(const DeformableMesh& mesh, const Stage& fine, Threads threads) {
    Stage stage{mesh.coarse, {}, {}, {}, mesh.coarse.pairs, std::vector<RigidMotion>(mesh.coarse.centre.size())};
    const Moved moved = move_samples(fine, threads);
    for (const std::uint32_t i : mesh.coarse.samples) {
        stage.rest.push_back(vector_of(moved.points[i]));
        stage.rest_normals.push_back(vector_of(moved.normals[i]));
    }
    for (const std::uint32_t h : mesh.coarse.centre) stage.centre.push_back(fine.motion[h](mesh.handles[h]));
    for (auto& pair : stage.pairs) pair.point = 0.5 * (stage.centre[pair.first] + stage.centre[pair.second]);
    return stage;
}

// Each handle moves on as its groups do, blended: the turn as a quaternion, the shift so that it arrives with them.
void follow_groups(const DeformableMesh& mesh, const Stage& coarse, std::vector<RigidMotion>& motion) {
    for (std::size_t h = 0; h < motion.size(); ++h) {
        const SampleBlend& blend = mesh.groups[h];
        Eigen::Vector4d sum = Eigen::Vector4d::Zero();
        const Eigen::Quaterniond first(coarse.motion[blend.handle[0]].rotation);
        for (std::size_t k = 0; k < blend.count; ++k) {
            const Eigen::Quaterniond turn(coarse.motion[blend.handle[k]].rotation);
            sum += (turn.dot(first) < 0 ? -1.0 : 1.0) * static_cast<double>(blend.weight[k]) * turn.coeffs();
        }
        const Matrix3d turn = Eigen::Quaterniond(sum).normalized().toRotationMatrix();
        const Vector3d before = motion[h](mesh.handles[h]);
        const Vector3d after = blended(blend, coarse.motion, before);
        motion[h].rotation = turn * motion[h].rotation;
        motion[h].shift = after - motion[h].rotation * mesh.handles[h];
    }
}

double between(double from, double to, int step, int steps) {
    return steps <= 1 ? to : from * std::pow(to / from, static_cast<double>(step) / (steps - 1));
}

}  // namespace

std::vector<RigidMotion> register_deformation(const DeformableMesh& mesh, const TargetSurface& target,
                                              std::span<const RigidMotion> start, const DeformationOptions& options) {
    std::vector<RigidMotion> motion(start.begin(), start.end());
    motion.resize(mesh.handles.size());
    if (mesh.samples.empty() || target.samples.empty()) return motion;
    const double unit = options.millimetre;
    const auto cell = static_cast<float>(30 * unit);
    Stage fine = fine_stage(mesh, std::move(motion));
    if (options.coarse_rounds > 0) {
        Stage coarse = coarse_stage(mesh, fine, options.threads);
        BlockSystem systems[2] = {BlockSystem(mesh.coarse.pattern), BlockSystem(mesh.coarse.pattern)};
        Guesses guesses;
        for (int i = 0; i < options.coarse_rounds; ++i) {
            const double reach = between(options.far_reach, options.middle_reach, i, options.coarse_rounds);
            const Round round = {reach * unit, options.first_stiffness, options.first_point_share,
                                 0.7f * mesh.sample_gap, true};
            const double moved = run_round(coarse, target, round, cell, systems, guesses, options);
            if (moved < options.settled * unit) i = std::max(i, options.coarse_rounds - 2);  // the last one is next
        }
        follow_groups(mesh, coarse, fine.motion);
    }
    BlockSystem systems[2] = {BlockSystem(mesh.fine.pattern), BlockSystem(mesh.fine.pattern)};
    Guesses guesses;
    for (int i = 0; i < options.fine_rounds; ++i) {
        auto value = [&](double from, double to) { return between(from, to, i, options.fine_rounds); };
        const Round round = {value(options.middle_reach, options.near_reach) * unit,
                             value(options.first_stiffness, options.last_stiffness),
                             value(options.first_point_share, options.last_point_share), 0.5f * mesh.sample_gap, false};
        run_round(fine, target, round, cell, systems, guesses, options);
    }
    return fine.motion;
}

std::vector<RigidMotion> moved_on(const DeformableMesh& mesh, std::span<const RigidMotion> before,
                                  std::span<const RigidMotion> last) {
    std::vector<RigidMotion> next(last.begin(), last.end());
    for (std::size_t h = 0; h < next.size(); ++h) {
        const Vector3d was = before[h](mesh.handles[h]), is = last[h](mesh.handles[h]);
        next[h].rotation = last[h].rotation * before[h].rotation.transpose() * last[h].rotation;
        next[h].shift = 2 * is - was - next[h].rotation * mesh.handles[h];
    }
    return next;
}

double deformation_error(const DeformableMesh& mesh, const TargetSurface& target, std::span<const RigidMotion> motions,
                         const DeformationOptions& options) {
    if (mesh.samples.empty() || target.samples.empty()) return 0;
    const Stage stage = fine_stage(mesh, {motions.begin(), motions.end()});
    const Moved moved = move_samples(stage, options.threads);
    const double reach = options.near_reach * options.millimetre;
    const std::size_t every = mesh.samples.size() + target.samples.size() < 2000 ? 1 : 4;
    const Round round{.reach = reach, .stiffness = 0, .point_share = 0, .gap = 0, .far = false, .every = every};
    Guesses guesses;
    const auto matches = find_matches(moved, target, round, static_cast<float>(reach / 2), options, guesses);
    double near = 0;
    for (const Match& match : matches) {
        const Vector3d apart = vector_of(target.positions[match.vertex]) - vector_of(moved.points[match.sample]);
        near += reach - std::min(reach, std::abs(apart.dot(vector_of(target.normals[match.vertex]))));
    }
    return reach - near / static_cast<double>(mesh.samples.size() / every + target.samples.size() / every);
}

std::vector<Point3f> deform(const DeformableMesh& mesh, std::span<const RigidMotion> motions, Threads threads) {
    std::vector<Point3f> out(mesh.positions);
    if (motions.empty()) return out;
    const std::vector<RigidMotion> motion(motions.begin(), motions.end());
    parallel_for(out.size(), threads, 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v)
            out[v] = point_of(blended(blend_of(mesh.weights[v]), motion, vector_of(mesh.positions[v])));
    });
    return out;
}

}  // namespace htvm::internal
