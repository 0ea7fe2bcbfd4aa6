// The encoder at a glance: what happens to a mesh that is pushed. It is put on the lattice, with its pose. The strategy
// of the options' profile, tracked or by bones, finds what can be found of it before it is coded. Control has the
// strategy code it, at the quality that is asked for or that a rate or an error leaves, and beside that other threads
// go on with frames that wait. The sequence advances by what was chosen; the strategy hands out frames whose packets
// are ready, and these are queued.
#include "htvm/encoder.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <iterator>
#include <utility>
#include <variant>

#include "codec/encoder/bones/bones_strategy.h"
#include "codec/encoder/configuration.h"
#include "codec/encoder/control/quality_control.h"
#include "codec/encoder/options_check.h"
#include "codec/encoder/pose_tracker.h"
#include "codec/encoder/tracked/shared_tracking.h"
#include "codec/encoder/tracked/tracked_strategy.h"
#include "codec/format/frame_kinds.h"
#include "codec/format/sequence.h"
#include "core/memory_guard.h"
#include "core/parallel.h"
#include "surface/projection_fit.h"
#include "surface/triangle_cleaning.h"

namespace htvm {

using namespace internal;

namespace {

// Packets that were handed out or wait to be.
struct Output {
    std::deque<Packet> packets;
    std::uint64_t stream_bytes = 0;
    std::vector<IndexEntry> index;
    std::uint32_t header_sent = 0;  // number of the frame with which the sequence header was last sent
};

// About the frames whose packets a call queued.
struct Queued {
    std::vector<EncodedFrame> coded;
    std::vector<ShownMesh> decoded;
};

}  // namespace

struct Encoder::State {
    ThreadPool pool;
    Configuration configuration;
    bool configured = false;  // by Encoder::begin(), or a frame that waits
    bool begun = false, finished = false;
    PoseTracker poses;
    std::optional<bool> cleans;                  // captured triangles; nothing: not decided yet
    std::optional<ProjectionMatrix> projection;  // of the last frame pushed, where the texture is a camera's film
    std::variant<TrackedStrategy, BonesStrategy> strategy;
    QualityControl control;
    int effort = usual_effort;         // for the next frame
    std::function<bool()> may_repair;  // Encoder::set_repair()
    bool access = false;               // Encoder::request_access()
    Output output;
    std::optional<std::int64_t> last_timestamp;
    Queued queued;            // by the last call that queued any
    bool queued_none = true;  // whether the last call did not
    std::vector<StageTime> stages;
};

namespace {

using State = Encoder::State;

std::size_t waiting_frames(const State& state) {
    return std::visit([](const auto& strategy) { return strategy.waiting.size(); }, state.strategy);
}

std::size_t frames_held(const State& state) {
    const auto* tracked = std::get_if<TrackedStrategy>(&state.strategy);
    return tracked ? tracked->held.size() : 0;
}

std::uint32_t next_frame(const State& state) {
    return std::visit([](const auto& strategy) { return strategy.sequence.next_frame; }, state.strategy);
}

// ---- 1. Onto the lattice --------------------------------------------------------------------------------------------

Result<void> configure(State& state, const Mesh& mesh, const Pose* pose) {
    auto poses = internal::configure(state.configuration, mesh, pose);
    if (!poses) return tl::unexpected(poses.error());
    state.poses = std::move(*poses);
    return {};
}

bool keeps_normals(const EncoderOptions& options) {
    if (options.normals != CapturedNormals::automatic) return options.normals == CapturedNormals::keep;
    return options.profile != Profile::tracked;
}

// Tracking follows a surface, so its triangles count once and face one way. The first mesh says whether a capture's are
// to be cleaned: most are not, and looking takes time.
void clean(State& state, LatticeMesh& mesh) {
    if (state.configuration.options.profile != Profile::tracked || state.cleans == false) return;
    if (mesh.triangles.empty()) return;
    auto cleaned = clean_triangles(mesh.positions, mesh.triangles);
    if (!state.cleans) state.cleans = needs_cleaning(cleaned, mesh.triangles.size());
    if (*state.cleans) mesh.triangles = std::move(cleaned.triangles);
}

// How the camera saw a mesh whose texture coordinates are places in its film; nothing of one without surface.
Result<std::optional<FilmProjection>> find_projection(State& state, const Mesh& mesh, const LatticeMesh& on_lattice) {
    if (on_lattice.triangles.empty()) return std::nullopt;
    if (mesh.texcoords.empty())
        return fail(ErrorKind::bad_input,
                    "the mesh has no texture coordinates, from which texture.layout projection finds how the camera "
                    "saw it");
    const auto& texture = state.configuration.options.texture;
    std::vector<Eigen::Vector3d> positions;
    positions.reserve(on_lattice.positions.size());
    for (const auto& p : on_lattice.positions) positions.emplace_back(p.x, p.y, p.z);
    const FilmPairs pairs{positions, mesh.texcoords, 1.0 * texture.width, 1.0 * texture.height};
    const auto found = state.projection ? follow_projection(*state.projection, pairs) : fit_projection(pairs);
    if (!found)
        return fail(ErrorKind::bad_input,
                    "the mesh's texture coordinates are not one camera's projection, as they are to be with "
                    "texture.layout projection");
    state.projection = found;
    FilmProjection out;
    for (int i = 0; i < 12; ++i) out.rows[static_cast<std::size_t>(i)] = static_cast<float>((*found)(i / 4, i % 4));
    if (!is_finite(out)) return fail(ErrorKind::bad_input, "the camera's projection of the mesh is out of range");
    return std::optional(out);
}

Result<CapturedFrame> put_on_lattice(State& state, const Mesh& mesh, const Pose* pose) {
    StageClock clock(state.stages);
    auto on_lattice = to_lattice(mesh, state.configuration.header.lattice);
    if (!on_lattice) return tl::unexpected(on_lattice.error());
    if (!keeps_normals(state.configuration.options)) on_lattice->normals.clear();
    clean(state, *on_lattice);
    auto coded_pose = state.poses.next(mesh, pose, state.configuration.header.lattice);
    if (!coded_pose) return tl::unexpected(coded_pose.error());
    clock.done("to the lattice");
    CapturedFrame out;
    if (state.configuration.options.texture.layout == TextureLayout::charts) {
        if (!mesh.texcoords.empty())
            return fail(ErrorKind::bad_input,
                        "the mesh has texture coordinates, but with texture.layout charts the stream has its own: "
                        "push it without them and without their seams");
        out.colours = std::exchange(on_lattice->colours, {});
    }
    if (state.configuration.options.texture.layout == TextureLayout::projection) {
        auto projection = find_projection(state, mesh, *on_lattice);
        if (!projection) return tl::unexpected(projection.error());
        out.projection = *projection;
        on_lattice->texcoords.clear();
        out.colours = std::exchange(on_lattice->colours, {});
        clock.done("projection");
    }
    out.mesh = std::move(*on_lattice);
    out.pose = std::move(*coded_pose);
    out.effort = state.effort;
    out.may_repair = state.may_repair;
    out.force_access = std::exchange(state.access, false);
    return out;
}

// ---- 2. Coded as the strategy chooses, at the quality that control finds --------------------------------------------

// The sequence header is sent before the first frame and repeated before some I-frames, so that a receiver that joins
// later, or lost it, can begin there.
bool brings_header(const State& state, FrameType type) {
    constexpr std::uint32_t repeated_after = 10;  // frames
    return !state.begun || (stands_alone(type) && next_frame(state) - state.output.header_sent >= repeated_after);
}

HeaderBits header_bits(const State& state) {
    if (!brings_header(state, FrameType::intra)) return {};  // then no other kind brings it
    const double bits =
        8.0 * static_cast<double>(write_sequence_header(state.configuration.header).size() + packet_overhead);
    return {.if_alone = bits, .otherwise = brings_header(state, FrameType::predicted) ? bits : 0};
}

// Beside it, other threads go on with the frames that wait.
template <class Strategy, class Work>
Result<typename Work::Frame> code_in_flight(State& state, Strategy& strategy, const Work& work,
                                            typename Work::Progress& progress, const HeaderBits& header) {
    auto& waiting = strategy.waiting;
    if (waiting.empty()) return code_under_control(work, progress, state.control, header);
    const auto assumed = assume(work, progress);
    std::optional<Result<typename Work::Frame>> chosen;
    std::vector<StageTime> ahead;
    parallel_invoke(
        state.configuration.threads, [&] { chosen = code_under_control(work, progress, state.control, header); },
        [&] { work_ahead(work, progress, assumed, waiting, ahead); });
    state.stages.insert(state.stages.end(), ahead.begin(), ahead.end());
    keep_what_holds(progress, *chosen ? &**chosen : nullptr, waiting);
    return std::move(*chosen);
}

// ---- 3. Queued ------------------------------------------------------------------------------------------------------

void queue(Output& output, Packet packet) {
    output.stream_bytes += packet.payload.size() + packet_overhead;
    output.packets.push_back(std::move(packet));
}

// frames: in the order of the stream, the one that is coded last, if it is among them.
void queue(State& state, std::vector<OutgoingFrame> frames, std::int64_t timestamp_us, Queued& queued) {
    auto& output = state.output;
    for (auto& frame : frames) {
        if (brings_header(state, frame.info.type)) {
            auto header = sequence_packet(state.configuration.header);
            header.frame = output.header_sent = next_frame(state);
            header.timestamp_us = timestamp_us;
            queue(output, std::move(header));
        }
        if (frame.starts_decoding)
            output.index.push_back({frame.info.frame, frame.info.timestamp_us, output.stream_bytes});
        for (auto& packet : frame.packets) queue(output, std::move(packet));
        queued.coded.push_back({frame.info, frame.cost});
        queued.decoded.push_back(std::move(frame.shown));
    }
}

// Nothing can fail here.
void keep(State& state, Queued queued) {
    state.queued_none = queued.coded.empty();
    if (!state.queued_none) state.queued = std::move(queued);
}

// ---- A frame's way --------------------------------------------------------------------------------------------------

template <class Strategy>
Result<void> code_frame(State& state, Strategy& strategy, typename Strategy::Waiting frame) {
    const auto timestamp_us = frame.captured.timestamp_us;
    const auto header = header_bits(state);
    typename Strategy::Work::Progress progress;
    typename Strategy::Work work = begin_work(state.configuration, strategy, std::move(frame), progress, state.stages);
    auto chosen = code_in_flight(state, strategy, work, progress, header);
    if (!chosen) return tl::unexpected(chosen.error());
    const auto& coded = coded_frame(*chosen);
    const FrameCost cost{rate_type(coded), coded.quality, bits_of(coded, header), coded.renewed};
    StageClock derivation(state.stages);
    auto sequence = sequence_after(work, *chosen);
    if (!sequence) return tl::unexpected(sequence.error());
    derivation.done("reference");
    auto handout = hand_out(strategy, work, progress, std::move(*chosen), cost);
    if (!handout) return tl::unexpected(handout.error());
    Queued queued;
    queue(state, std::move(handout->frames), timestamp_us, queued);
    keep(state, std::move(queued));
    commit(strategy, *handout, std::move(*sequence));
    state.begun = true;
    state.last_timestamp = std::max(timestamp_us, state.last_timestamp.value_or(timestamp_us));
    if (state.control.rate) state.control.rate->coded(cost);
    return {};
}

// The first of the frames that wait.
template <class Strategy>
Result<void> code_first_waiting(State& state, Strategy& strategy) {
    auto frame = std::move(strategy.waiting.front());
    strategy.waiting.erase(strategy.waiting.begin());
    return code_frame(state, strategy, std::move(frame));
}

Result<void> push_frame(State& state, const Mesh& mesh, const Pose* pose, std::int64_t timestamp_us, bool force_intra) {
    auto frame = put_on_lattice(state, mesh, pose);
    if (!frame) return tl::unexpected(frame.error());
    frame->timestamp_us = timestamp_us;
    frame->force_intra = force_intra;
    const auto latency = static_cast<std::size_t>(state.configuration.options.latency_frames);
    const auto push_to = [&](auto& strategy) -> Result<void> {
        if (latency == 0) return code_frame(state, strategy, {std::move(*frame)});
        state.configured = true;
        state.last_timestamp = timestamp_us;
        strategy.waiting.push_back({std::move(*frame)});
        if (strategy.waiting.size() > latency) return code_first_waiting(state, strategy);
        state.queued_none = true;
        return {};
    };
    return std::visit(push_to, state.strategy);
}

// Marks where a frame's packets begin in the queue. If the frame fails, packets queued since are removed, the sequence
// stays as it was, and frames that wait are no longer behind it.
struct Mark {
    std::size_t packets, index;
    std::uint64_t stream_bytes;
    std::uint32_t header_sent;
    std::size_t held;
};

Mark mark(const State& state) {
    const auto& output = state.output;
    return {output.packets.size(), output.index.size(), output.stream_bytes, output.header_sent, frames_held(state)};
}

void return_to(State& state, const Mark& before) {
    auto& output = state.output;
    output.packets.resize(before.packets);
    output.index.resize(before.index);
    output.stream_bytes = before.stream_bytes;
    output.header_sent = before.header_sent;
    if (auto* tracked = std::get_if<TrackedStrategy>(&state.strategy))
        tracked->held.erase(tracked->held.begin() + static_cast<std::ptrdiff_t>(before.held), tracked->held.end());
    std::visit(
        [](auto& strategy) {
            for (auto& frame : strategy.waiting) frame.ahead = {};
        },
        state.strategy);
}

// Does the work; or leaves packets, sequence and held frames as they were.
template <class Work>
Result<void> whole_or_not(State& state, const Work& work) {
    const auto before = mark(state);
    auto done = within_memory(work);
    if (!done) return_to(state, before);
    return done;
}

RateControlOptions rate_options(const EncoderOptions& options) {
    RateControlOptions out;
    out.bits_per_second = options.rate.bits_per_second;
    out.frames_per_second = static_cast<double>(options.fps_numerator) / options.fps_denominator;
    out.buffer_seconds = options.rate.buffer_seconds;
    // An I-frame's bits are made up for within a second, not over ten.
    out.key_interval = std::min(options.key_interval, 30);
    if (options.profile == Profile::tracked) out.intra_extra = 4;
    return out;
}

}  // namespace

int frames_in_group(const EncoderOptions& options) {
    if (options.tracked.group > 0) return options.tracked.group;
    const bool may_be = options.profile == Profile::tracked && options.key_interval > 1 &&
                        options.tracked.references == TrackedReferences::previous &&
                        !(options.rate.bits_per_second > 0) && !(options.rate.target_error > 0);
    return may_be ? tracking_effort(options.tracked.effort).group : 1;
}

Result<Encoder> Encoder::create(const EncoderOptions& options) {
    return within_memory([&]() -> Result<Encoder> {
        if (auto ok = check(options); !ok) return tl::unexpected(ok.error());
        auto state = std::make_unique<State>();
        state->configuration.options = options;
        state->configuration.options.tracked.group = frames_in_group(options);
        const auto steps = quality_steps(options);
        state->configuration.options.geometry_step = steps.geometry_step;
        state->configuration.options.colour_step = steps.colour_step;
        if (options.profile != Profile::tracked) state->strategy = BonesStrategy();
        state->effort = options.tracked.effort;
        state->pool = ThreadPool(options.threads, options.runner);
        state->configuration.threads = state->pool.threads();
        if (options.rate.bits_per_second > 0)
            state->control.rate.emplace(rate_options(options), options.rate.first_pass);
        if (options.rate.target_error > 0) state->control.error.emplace(options.rate.target_error);
        return Encoder(std::move(state));
    });
}

Encoder::Encoder(std::unique_ptr<State> state) : state_(std::move(state)) {}
Encoder::Encoder(Encoder&&) noexcept = default;
Encoder& Encoder::operator=(Encoder&&) noexcept = default;
Encoder::~Encoder() = default;

Result<void> Encoder::begin(const Mesh& first, const Pose* pose) {
    return within_memory([&]() -> Result<void> {
        auto& state = *state_;
        if (state.begun || waiting_frames(state) > 0)
            return fail(ErrorKind::bad_input, "the first frame was pushed already");
        auto done = configure(state, first, pose);
        state.configured = done.has_value();
        return done;
    });
}

Result<void> Encoder::push(const Mesh& mesh, const Pose* pose, std::int64_t timestamp_us, bool force_intra) {
    auto& state = *state_;
    state.stages.clear();
    return whole_or_not(state, [&]() -> Result<void> {
        if (state.finished) return fail(ErrorKind::bad_input, "the sequence was finished; start a new encoder");
        if (state.last_timestamp && timestamp_us <= *state.last_timestamp)
            return fail(ErrorKind::bad_input, "timestamps must ascend");
        if (!state.begun && !state.configured)
            if (auto ok = configure(state, mesh, pose); !ok) return ok;
        return push_frame(state, mesh, pose, timestamp_us, force_intra);
    });
}

Result<void> Encoder::set_bitrate(double bits_per_second) {
    auto& rate = state_->control.rate;
    if (!rate)
        return fail(ErrorKind::bad_input,
                    "this encoder keeps to no bitrate: give it rate.bits_per_second when it is made");
    auto options = state_->configuration.options;
    options.rate.bits_per_second = bits_per_second;
    if (!(bits_per_second > 0)) return fail(ErrorKind::bad_input, "a bitrate is above 0");
    if (auto ok = check(options); !ok) return ok;
    rate->change_rate(bits_per_second);
    return {};
}

Result<void> Encoder::set_effort(int effort) {
    if (state_->configuration.options.profile != Profile::tracked)
        return fail(ErrorKind::bad_input, "an effort is for the tracked profile: others have none");
    if (effort < 0 || effort > most_effort)
        return fail(ErrorKind::bad_input, "an effort is 0 to 9, not " + std::to_string(effort));
    state_->effort = effort;
    return {};
}

Result<void> Encoder::set_repair(std::function<bool()> may_repair) {
    if (state_->configuration.options.profile != Profile::tracked)
        return fail(ErrorKind::bad_input, "tracking is of the tracked profile: others lose none");
    state_->may_repair = std::move(may_repair);
    return {};
}

void Encoder::request_access() { state_->access = true; }

Result<void> Encoder::share_with(Encoder& first) {
    for (const auto* one : {state_.get(), first.state_.get()}) {
        if (one->begun || waiting_frames(*one) > 0)
            return fail(ErrorKind::bad_input, "encoders share what they find from the first frame on");
        if (one->configuration.options.profile != Profile::tracked)
            return fail(ErrorKind::bad_input, "only encoders of the tracked profile share what they find");
    }
    if (this == &first || first.state_->configuration.follows)
        return fail(ErrorKind::bad_input, "the encoder that others go by goes by none");
    auto& shared = first.state_->configuration.shared;
    if (!shared) shared = std::make_shared<SharedTracking>();
    state_->configuration.shared = shared;
    state_->configuration.follows = true;
    return {};
}

Result<void> Encoder::finish() {
    auto& state = *state_;
    if (state.finished || (!state.begun && waiting_frames(state) == 0)) return {};
    state.stages.clear();
    Queued all;
    const auto add = [&](Queued& queued) {
        std::ranges::move(queued.coded, std::back_inserter(all.coded));
        std::ranges::move(queued.decoded, std::back_inserter(all.decoded));
    };
    // One after the other, so that an error in one leaves those before it as they are.
    auto done = Result<void>();
    while (done && waiting_frames(state) > 0)
        done = whole_or_not(state, [&]() -> Result<void> {
            auto coded =
                std::visit([&](auto& strategy) { return code_first_waiting(state, strategy); }, state.strategy);
            if (coded && !state.queued_none) add(state.queued);
            return coded;
        });
    if (auto* tracked = std::get_if<TrackedStrategy>(&state.strategy); done && tracked)
        done = whole_or_not(state, [&]() -> Result<void> {
            auto rest = hand_out_held(*tracked, state.configuration, state.stages);
            if (!rest) return tl::unexpected(rest.error());
            Queued queued;
            queue(state, std::move(rest->frames), 0, queued);
            add(queued);
            tracked->held.clear();
            return {};
        });
    keep(state, std::move(all));
    if (!done) return done;
    if (!state.begun) return {};
    state.finished = true;
    // A stream may end without an index, where there is no memory for it.
    static_cast<void>(within_memory([&]() -> Result<void> {
        Packet packet;
        packet.kind = PacketKind::index;
        packet.flags = packet_flag::flags_valid;
        packet.frame = next_frame(state);
        packet.timestamp_us = *state.last_timestamp;
        packet.payload = write_sequence_index(state.output.index);
        queue(state.output, std::move(packet));
        return {};
    }));
    return {};
}

std::optional<Packet> Encoder::pull() {
    auto& packets = state_->output.packets;
    if (packets.empty()) return std::nullopt;
    Packet packet = std::move(packets.front());
    packets.pop_front();
    return packet;
}

std::span<const EncodedFrame> Encoder::coded_frames() const {
    return state_->queued_none ? std::span<const EncodedFrame>() : state_->queued.coded;
}
std::size_t Encoder::held_frames() const { return frames_held(*state_) + waiting_frames(*state_); }

const FrameInfo& Encoder::last_frame() const {
    static const FrameInfo none;
    return state_->queued.coded.empty() ? none : state_->queued.coded.back().info;
}
FrameCost Encoder::last_cost() const {
    return state_->queued.coded.empty() ? FrameCost() : state_->queued.coded.back().cost;
}

std::optional<SpaceBounds> Encoder::bounds() const {
    // Rounding to single precision keeps the order, so the corners can be found on the lattice.
    std::optional<std::vector<LatticePoint>> corners;
    for (const auto& decoded : state_->queued.decoded)
        for (const auto& p : decoded.mesh.positions) {
            if (!corners) corners.emplace(2, p);
            auto &low = corners->front(), &high = corners->back();
            low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
            high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
        }
    if (!corners) return std::nullopt;
    std::vector<Vector3f> in_millimetres;
    to_millimetres(*corners, state_->configuration.header.lattice, in_millimetres);
    return bounds_of(in_millimetres);
}

Mesh Encoder::reconstruction() const {
    return state_->queued.decoded.empty() ? Mesh() : reconstruction(state_->queued.decoded.size() - 1);
}
Mesh Encoder::reconstruction(std::size_t coded) const {
    const auto layout = state_->configuration.options.texture.layout;
    const bool own = layout == TextureLayout::charts || layout == TextureLayout::projection;
    return to_mesh(state_->queued.decoded[coded].mesh, state_->configuration.header.lattice,
                   own ? chart_texcoord_unit : captured_texcoord_unit);
}
std::span<const std::uint32_t> Encoder::repeated_vertices() const {
    return state_->queued.decoded.empty() ? std::span<const std::uint32_t>()
                                          : repeated_vertices(state_->queued.decoded.size() - 1);
}
std::span<const std::uint32_t> Encoder::repeated_vertices(std::size_t coded) const {
    return state_->queued.decoded[coded].repeated;
}
const std::vector<StageTime>& Encoder::stage_times() const { return state_->stages; }
const std::vector<std::uint32_t>& Encoder::distance_order_counts() const {
    static const std::vector<std::uint32_t> none;
    const auto* bones = std::get_if<BonesStrategy>(&state_->strategy);
    return bones ? bones->distance_order_counts : none;
}

}  // namespace htvm
