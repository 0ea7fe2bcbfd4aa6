// The encoder at a glance. A captured mesh and its pose are put on the lattice. The frame's work derives from them, the
// configuration and the sequence so far. The choice codes the frame in one or several ways and returns the candidate to
// send. The sequence advances by it, and its packets are numbered and queued. Where T-frames are coded in groups, those
// chosen are held until their group is whole, which then is coded anew.
#include "htvm/encoder.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <iterator>
#include <new>
#include <stdexcept>
#include <utility>

#include "codec/encoder/frame_choice.h"
#include "codec/encoder/frame_work.h"
#include "codec/encoder/frames_in_flight.h"
#include "codec/encoder/options_check.h"
#include "codec/encoder/pose_tracker.h"
#include "codec/encoder/tracked/group_coder.h"
#include "codec/format/frame_kinds.h"
#include "codec/format/sequence.h"
#include "htvm/decoder.hpp"

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

// A mesh as the decoder shows it.
struct ShownMesh {
    LatticeMesh mesh;
    std::vector<std::uint32_t> repeated;  // at the seams of charts: which vertices the last ones are
};

}  // namespace

struct Encoder::State {
    ThreadPool pool;
    Configuration configuration;
    bool configured = false;  // by Encoder::begin(), or a frame that waits
    bool begun = false, finished = false;
    PoseTracker poses;
    Sequence sequence;
    QualityControl control;
    int effort = usual_effort;         // for the next frame
    std::function<bool()> may_repair;  // Encoder::set_repair()
    Output output;
    std::optional<std::int64_t> last_timestamp;
    std::vector<PushedFrame> waiting;   // the last ones, in their order, with EncoderOptions::latency_frames
    std::vector<HeldFrame> held;        // T-frames of the group that is not whole yet
    std::optional<GroupAnchor> anchor;  // what the next group may refer to; none: the reference alone
    // Of the frames whose packets the last call queued; if it queued none, of the last one before.
    std::vector<EncodedFrame> coded;
    std::vector<ShownMesh> decoded;
    bool coded_none = true;
    std::vector<StageTime> stages;
    std::vector<std::uint32_t> distance_order_counts;
};

namespace {

using State = Encoder::State;

// The length on this subject that corresponds to a millimetre on an adult, in millimetres. Reaches, spacings and
// thresholds are known for adults; those for a doll or a giant follow from its size. The extent of an adult depends on
// the pose, so a subject from 1.1 to 2.5 m counts as an adult.
double adult_millimetre(const EncoderOptions& options, const Mesh& mesh) {
    constexpr double adult = 1750, shortest = 1100, longest = 2500;
    double size = options.subject_size;
    if (!(size > 0)) {
        for (std::size_t axis = 0; axis < 3 && !mesh.positions.empty(); ++axis) {
            const auto [low, high] =
                std::minmax_element(mesh.positions.begin(), mesh.positions.end(),
                                    [&](const auto& a, const auto& b) { return a[axis] < b[axis]; });
            size = std::max(size, static_cast<double>((*high)[axis]) - (*low)[axis]);
        }
    }
    return size <= 0 || (size >= shortest && size <= longest) ? 1 : size / adult;
}

// 1/16 mm on an adult and on whoever is larger, or finer if needed for a step of at least eight units. As much finer on
// a smaller subject as it is smaller, but not below a 64th of a step: the first frame may show little of a subject, and
// a fine lattice does not reach far.
int lattice_bits(const EncoderOptions& options, double adult) {
    if (options.lattice_bits > 0) return options.lattice_bits;
    const bool controlled = options.rate.bits_per_second > 0 || options.rate.target_error > 0;
    const double finest = controlled ? quality_steps(100).geometry_step : options.geometry_step;
    const auto bits_for = [&](double units) { return static_cast<int>(std::ceil(std::log2(units / finest))); };
    const int of_size = 4 - static_cast<int>(std::lround(std::log2(adult)));
    return std::clamp(std::max(bits_for(8), std::min(of_size, bits_for(64))), 4, 16);
}

// Short enough to need no memory itself.
tl::unexpected<Error> out_of_memory() { return fail(ErrorKind::limit, "out of memory"); }

// What the work gives, or that there is not enough memory for it.
template <class Work>
Result<void> guarded(const Work& work) {
    try {
        return work();
    } catch (const std::bad_alloc&) {
        return out_of_memory();
    } catch (const std::length_error&) {
        return out_of_memory();
    }
}

// Completes the configuration from the first frame: the origin of the lattice, the subject's size and, where not given,
// the skeleton and the radii.
Result<void> configure(State& state, const Mesh& mesh, const Pose* pose) {
    auto& configuration = state.configuration;
    const auto& options = configuration.options;
    auto& header = configuration.header;
    const auto origin = lattice_origin(mesh);
    if (!origin) return tl::unexpected(origin.error());
    header.lattice.origin = *origin;
    const double adult = adult_millimetre(options, mesh);
    header.lattice.bits = lattice_bits(options, adult);
    auto tracker = make_pose_tracker(options.skeleton, mesh, pose);
    if (!tracker) return tl::unexpected(tracker.error());
    state.poses = std::move(*tracker);
    header.skeleton = state.poses.skeleton;
    header.has_skeleton = state.poses.has_skeleton;
    auto radii = options.radii;
    if (radii.empty()) {
        auto calibrated = calibrate(mesh, header.skeleton, state.poses.last);
        if (!calibrated) return tl::unexpected(calibrated.error());
        radii = std::move(*calibrated);
    }
    const double units = configuration.units = 1.0 / header.lattice.step();
    configuration.adult_millimetre = adult * units;
    const auto on_lattice = [](double length) {
        return static_cast<std::int32_t>(std::lround(std::min(length, 1.0 * lattice_limit)));
    };
    header.radii.clear();
    for (const auto r : radii) header.radii.push_back(on_lattice(r * units));
    header.fps_numerator = options.fps_numerator;
    header.fps_denominator = options.fps_denominator;
    header.unit_micrometres = options.unit_micrometres;
    header.session = options.session;
    header.up = options.up;
    header.metadata = options.metadata;
    if (options.floor) {
        const auto origin_up = static_cast<double>(header.lattice.origin[axis_of(options.up)]);
        const double floor = std::round((*options.floor - origin_up) * units);
        if (!(std::abs(floor) <= lattice_limit))
            return fail(ErrorKind::bad_input, "the floor is too far from the first frame's mesh");
        header.floor = static_cast<std::int32_t>(floor);
    }
    if (options.tracked.group > 1) header.version = grouped_version;
    header.texture = options.texture;
    if (options.texture.layout != TextureLayout::none) header.version = textured_version;
    header.nearest_vertices = static_cast<std::uint8_t>(options.topology.nearest_vertices);
    header.weight_width = on_lattice(options.topology.weight_width * units);
    if (configuration.tracked()) {
        constexpr double spacing_on_adults = 80;  // mm
        const double spacing =
            options.tracked.node_spacing > 0 ? options.tracked.node_spacing : spacing_on_adults * adult;
        header.node_spacing = std::max(on_lattice(spacing * units), 1);
    }
    return {};
}

// The sequence header is sent before the first frame and repeated before some I-frames, so that a receiver that joins
// later, or lost it, can begin there.
bool brings_header(const State& state, const Candidate& candidate) {
    constexpr std::uint32_t repeated_after = 10;  // frames
    return !state.begun ||
           (stands_alone(candidate.type) && state.sequence.next_frame - state.output.header_sent >= repeated_after);
}

double bits_of(const State& state, const Candidate& candidate) {
    const std::size_t header = brings_header(state, candidate)
                                   ? write_sequence_header(state.configuration.header).size() + packet_overhead
                                   : 0;
    return 8.0 * static_cast<double>(candidate.bytes() + header);
}

void send(Output& output, Packet packet) {
    output.stream_bytes += packet.payload.size() + packet_overhead;
    output.packets.push_back(std::move(packet));
}

void send_header(State& state, std::int64_t timestamp_us) {
    auto header = sequence_packet(state.configuration.header);
    header.frame = state.output.header_sent = state.sequence.next_frame;
    header.timestamp_us = timestamp_us;
    send(state.output, std::move(header));
}

std::uint8_t flags_of(const Candidate& candidate) {
    using namespace packet_flag;
    return static_cast<std::uint8_t>((candidate.referred ? referred : droppable) | (candidate.access ? access : 0) |
                                     (candidate.renewal ? of_tracked_mesh : 0));
}

// What a call codes, until nothing can fail any more.
struct Outcome {
    std::vector<EncodedFrame> coded;
    std::vector<ShownMesh> decoded;
    std::optional<GroupAnchor> anchor;  // none: as it was
};

// A candidate's mesh as the decoder shows it. reference: that the candidate refers to, or null.
ShownMesh shown(Candidate& candidate, const Reference* reference) {
    const bool refers = candidate.type == FrameType::tracked || candidate.type == FrameType::predicted;
    const auto& textured = refers && reference ? reference->textured : candidate.textured;
    if (textured.empty()) return {std::move(candidate.decoded), {}};
    return {shown_mesh(candidate.decoded, textured), textured.copied};
}

// Numbers and queues a frame's packets, and counts their bytes by layer.
void send_frame(State& state, Candidate& candidate, const Reference* reference, std::int64_t timestamp_us,
                const FrameCost& cost, Outcome& outcome) {
    auto decoded = shown(candidate, reference);
    FrameInfo info;
    LayerBytes codebooks;
    for (auto& packet : candidate.packets) {
        packet.frame = state.sequence.next_frame;
        packet.reference = candidate.reference;
        packet.timestamp_us = timestamp_us;
        packet.flags |= packet_flag::flags_valid;
        if (packet.kind == PacketKind::codebook) {
            codebooks.overhead += packet_overhead;
            codebooks[packet.payload[0] == codebook_for_geometry ? Layer::geometry : Layer::colour] +=
                packet.payload.size();
            continue;
        }
        packet.flags |= flags_of(candidate);
        info = *inspect(packet);
        if (info.type == FrameType::tracked) {
            info.source_vertices = candidate.captured.vertices;
            info.source_triangles = candidate.captured.triangles;
            info.bytes = with_overhead(candidate.shares, packet);
        }
        info.vertices = static_cast<std::uint32_t>(decoded.mesh.positions.size());
        info.triangles = static_cast<std::uint32_t>(decoded.mesh.triangles.size());
        info.bytes += codebooks;
        // Where nothing refers to it while others are referred to, it is no place to start from.
        if (stands_alone(candidate.type) && (candidate.referred || state.configuration.intra_alone()))
            state.output.index.push_back({packet.frame, packet.timestamp_us, state.output.stream_bytes});
    }
    for (auto& packet : candidate.packets) send(state.output, std::move(packet));
    outcome.coded.push_back({info, cost});
    outcome.decoded.push_back(std::move(decoded));
}

// Codes these frames as a group. Returns what the next one may refer to.
Result<GroupAnchor> send_group(State& state, const GroupAnchor* before, std::span<const HeldFrame> held,
                               Outcome& outcome) {
    auto group = code_group(state.configuration, *state.sequence.reference, before, held, state.stages);
    if (!group) return tl::unexpected(group.error());
    for (std::size_t i = 0; i < held.size(); ++i) {
        auto& frame = group->frames[i];
        const auto& captured = held[i].work.mesh;
        auto info = *inspect(frame.packet);
        info.source_vertices = static_cast<std::uint32_t>(captured.positions.size());
        info.source_triangles = static_cast<std::uint32_t>(captured.triangles.size());
        const auto& textured = state.sequence.reference->decoded.textured;
        ShownMesh decoded{shown_mesh(frame.decoded, textured), textured.copied};
        info.vertices = static_cast<std::uint32_t>(decoded.mesh.positions.size());
        info.triangles = static_cast<std::uint32_t>(decoded.mesh.triangles.size());
        info.bytes = with_overhead(frame.shares, frame.packet);
        info.group = static_cast<std::uint8_t>(held.size());
        info.place = static_cast<std::uint8_t>(i + 1);
        FrameCost cost;
        cost.type = info.type;
        cost.bits = 8.0 * static_cast<double>(info.bytes.total());
        send(state.output, std::move(frame.packet));
        outcome.coded.push_back({info, cost});
        outcome.decoded.push_back(std::move(decoded));
    }
    return std::move(group->anchor);
}

// Codes the frames held, if there are any, as a group of what came before.
Result<void> send_held(State& state, std::span<const HeldFrame> held, Outcome& outcome) {
    if (held.empty()) return {};
    auto anchor = send_group(state, state.anchor ? &*state.anchor : nullptr, held, outcome);
    if (!anchor) return tl::unexpected(anchor.error());
    outcome.anchor = std::move(*anchor);
    return {};
}

// Nothing can fail here.
void commit(State& state, Outcome outcome) {
    if (outcome.anchor) state.anchor = std::move(outcome.anchor);
    state.coded_none = outcome.coded.empty();
    if (state.coded_none) return;
    state.coded = std::move(outcome.coded);
    state.decoded = std::move(outcome.decoded);
}

// Holds a T-frame, and codes its group once that has all its frames. Where the frame refers to the reference alone, for
// decoding to start there, the group before ends, and it is one by itself.
Result<void> hold(State& state, FrameWork& work, Candidate& chosen, std::int64_t timestamp_us) {
    Outcome outcome;
    auto& held = state.held;
    const bool place_to_start = chosen.access && (state.anchor || !held.empty());
    held.push_back({state.sequence.next_frame, timestamp_us, work.give_up(), chosen.steps, std::move(chosen.noise)});
    const std::span<const HeldFrame> all = held;
    const auto own = all.last(1);
    if (place_to_start) {
        if (auto sent = send_held(state, all.first(all.size() - 1), outcome); !sent) return sent;
        auto anchor = send_group(state, nullptr, own, outcome);
        if (!anchor) return tl::unexpected(anchor.error());
        outcome.anchor = std::move(*anchor);
    } else if (all.size() == static_cast<std::size_t>(state.configuration.options.tracked.group)) {
        if (auto sent = send_held(state, all, outcome); !sent) return sent;
    }
    if (!outcome.coded.empty()) held.clear();
    commit(state, std::move(outcome));
    return {};
}

Result<PushedFrame> put_on_lattice(State& state, const Mesh& mesh, const Pose* pose) {
    StageClock clock(state.stages);
    auto on_lattice = to_lattice(mesh, state.configuration.header.lattice);
    if (!on_lattice) return tl::unexpected(on_lattice.error());
    auto coded_pose = state.poses.next(mesh, pose, state.configuration.header.lattice);
    if (!coded_pose) return tl::unexpected(coded_pose.error());
    clock.done("to the lattice");
    PushedFrame out;
    if (state.configuration.options.texture.layout == TextureLayout::charts) {
        if (!mesh.texcoords.empty())
            return fail(ErrorKind::bad_input,
                        "the mesh has texture coordinates, but with texture.layout charts the stream has its own: "
                        "push it without them and without their seams");
        out.colours = std::exchange(on_lattice->colours, {});
    }
    out.mesh = std::move(*on_lattice);
    out.pose = std::move(*coded_pose);
    out.effort = state.effort;
    out.may_repair = state.may_repair;
    return out;
}

Result<void> code_frame_of(State& state, PushedFrame frame) {
    const auto timestamp_us = frame.timestamp_us;
    FrameWork work(state.configuration, state.sequence, frame.effort, std::move(frame.mesh), std::move(frame.colours),
                   std::move(frame.pose), state.stages);
    work.take(std::move(frame.ahead));
    work.may_repair = std::move(frame.may_repair);
    const auto bits = [&](const Candidate& candidate) { return bits_of(state, candidate); };
    auto chosen = choose_beside(work, frame.force_intra, enhanced_steps(state.configuration), state.waiting,
                                [&] { return choose_frame(work, state.control, bits, frame.force_intra); });
    if (!chosen) return tl::unexpected(chosen.error());
    const FrameCost cost{rate_type(*chosen), chosen->quality, bits_of(state, *chosen), chosen->renewed};
    StageClock derivation(state.stages);
    auto sequence = advance(state.configuration, state.sequence, *chosen);
    if (!sequence) return tl::unexpected(sequence.error());
    derivation.done("reference");
    if (chosen->type == FrameType::tracked && state.configuration.options.tracked.group > 1) {
        if (auto done = hold(state, work, *chosen, timestamp_us); !done) return done;
    } else {
        Outcome outcome;
        if (auto sent = send_held(state, state.held, outcome); !sent) return sent;
        if (brings_header(state, *chosen)) send_header(state, timestamp_us);
        const auto* reference = state.sequence.reference ? &state.sequence.reference->decoded : nullptr;
        send_frame(state, *chosen, reference, timestamp_us, cost, outcome);
        // Nothing can fail from here on.
        state.held.clear();
        commit(state, std::move(outcome));
        if (sequence->reference != state.sequence.reference) state.anchor.reset();
        state.distance_order_counts = std::move(chosen->distance_order_counts);
    }
    state.sequence = std::move(*sequence);
    state.begun = true;
    state.last_timestamp = std::max(timestamp_us, state.last_timestamp.value_or(timestamp_us));
    if (state.control.rate) state.control.rate->coded(cost);
    return {};
}

Result<void> code_first_waiting(State& state) {
    auto frame = std::move(state.waiting.front());
    state.waiting.erase(state.waiting.begin());
    return code_frame_of(state, std::move(frame));
}

Result<void> push_frame(State& state, const Mesh& mesh, const Pose* pose, std::int64_t timestamp_us, bool force_intra) {
    auto frame = put_on_lattice(state, mesh, pose);
    if (!frame) return tl::unexpected(frame.error());
    frame->timestamp_us = timestamp_us;
    frame->force_intra = force_intra;
    if (state.configuration.options.latency_frames == 0) return code_frame_of(state, std::move(*frame));
    state.configured = true;
    state.last_timestamp = timestamp_us;
    state.waiting.push_back(std::move(*frame));
    if (state.waiting.size() > static_cast<std::size_t>(state.configuration.options.latency_frames))
        return code_first_waiting(state);
    state.coded_none = true;
    return {};
}

// Marks where a frame's packets begin in the queue. If the frame fails, packets queued since are removed, the sequence
// stays as it was, and frames that wait are no longer behind it.
struct Queued {
    std::size_t packets, index;
    std::uint64_t stream_bytes;
    std::uint32_t header_sent;
    std::size_t held;
};

Queued queued(const State& state) {
    const auto& output = state.output;
    return {output.packets.size(), output.index.size(), output.stream_bytes, output.header_sent, state.held.size()};
}

void take_back(State& state, const Queued& before) {
    auto& output = state.output;
    output.packets.resize(before.packets);
    output.index.resize(before.index);
    output.stream_bytes = before.stream_bytes;
    output.header_sent = before.header_sent;
    state.held.erase(state.held.begin() + static_cast<std::ptrdiff_t>(before.held), state.held.end());
    for (auto& frame : state.waiting) frame.ahead = {};
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

Result<Encoder> Encoder::create(const EncoderOptions& options) try {
    if (auto ok = check(options); !ok) return tl::unexpected(ok.error());
    auto state = std::make_unique<State>();
    state->configuration.options = options;
    state->configuration.options.tracked.group = frames_in_group(options);
    const auto steps = quality_steps(options);
    state->configuration.options.geometry_step = steps.geometry_step;
    state->configuration.options.colour_step = steps.colour_step;
    state->effort = options.tracked.effort;
    state->pool = ThreadPool(options.threads, options.runner);
    state->configuration.threads = state->pool.threads();
    if (options.rate.bits_per_second > 0) state->control.rate.emplace(rate_options(options), options.rate.first_pass);
    if (options.rate.target_error > 0) state->control.error.emplace(options.rate.target_error);
    return Encoder(std::move(state));
} catch (const std::bad_alloc&) {
    return out_of_memory();
} catch (const std::length_error&) {
    return out_of_memory();
}

Encoder::Encoder(std::unique_ptr<State> state) : state_(std::move(state)) {}
Encoder::Encoder(Encoder&&) noexcept = default;
Encoder& Encoder::operator=(Encoder&&) noexcept = default;
Encoder::~Encoder() = default;

Result<void> Encoder::begin(const Mesh& first, const Pose* pose) try {
    auto& state = *state_;
    if (state.begun || !state.waiting.empty()) return fail(ErrorKind::bad_input, "the first frame was pushed already");
    auto done = configure(state, first, pose);
    state.configured = done.has_value();
    return done;
} catch (const std::bad_alloc&) {
    return out_of_memory();
} catch (const std::length_error&) {
    return out_of_memory();
}

Result<void> Encoder::push(const Mesh& mesh, const Pose* pose, std::int64_t timestamp_us, bool force_intra) {
    auto& state = *state_;
    state.stages.clear();
    const auto before = queued(state);
    const auto code = [&]() -> Result<void> {
        if (state.finished) return fail(ErrorKind::bad_input, "the sequence was finished; start a new encoder");
        if (state.last_timestamp && timestamp_us <= *state.last_timestamp)
            return fail(ErrorKind::bad_input, "timestamps must ascend");
        if (!state.begun && !state.configured)
            if (auto ok = configure(state, mesh, pose); !ok) return ok;
        return push_frame(state, mesh, pose, timestamp_us, force_intra);
    };
    auto done = guarded(code);
    if (!done) take_back(state, before);
    return done;
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

Result<void> Encoder::finish() {
    auto& state = *state_;
    if (state.finished || (!state.begun && state.waiting.empty())) return {};
    state.stages.clear();
    Outcome all;
    const auto add = [&](std::vector<EncodedFrame>& coded, std::vector<ShownMesh>& decoded) {
        std::ranges::move(coded, std::back_inserter(all.coded));
        std::ranges::move(decoded, std::back_inserter(all.decoded));
    };
    // One after the other, so that an error in one leaves those before it as they are.
    auto done = Result<void>();
    const auto code = [&](const auto& work) {
        const auto before = queued(state);
        done = guarded(work);
        if (!done) take_back(state, before);
    };
    while (done && !state.waiting.empty())
        code([&]() -> Result<void> {
            auto coded = code_first_waiting(state);
            if (coded && !state.coded_none) add(state.coded, state.decoded);
            return coded;
        });
    if (done)
        code([&]() -> Result<void> {
            Outcome rest;
            if (auto sent = send_held(state, state.held, rest); !sent) return sent;
            add(rest.coded, rest.decoded);
            state.held.clear();
            return {};
        });
    commit(state, std::move(all));
    if (!done) return done;
    if (!state.begun) return {};
    state.finished = true;
    try {
        Packet packet;
        packet.kind = PacketKind::index;
        packet.flags = packet_flag::flags_valid;
        packet.frame = state.sequence.next_frame;
        packet.timestamp_us = *state.last_timestamp;
        packet.payload = write_sequence_index(state.output.index);
        send(state.output, std::move(packet));
    } catch (const std::bad_alloc&) {
        // A stream may end without an index.
    }
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
    return state_->coded_none ? std::span<const EncodedFrame>() : state_->coded;
}
std::size_t Encoder::held_frames() const { return state_->held.size() + state_->waiting.size(); }

const FrameInfo& Encoder::last_frame() const {
    static const FrameInfo none;
    return state_->coded.empty() ? none : state_->coded.back().info;
}
FrameCost Encoder::last_cost() const { return state_->coded.empty() ? FrameCost() : state_->coded.back().cost; }

std::optional<SpaceBounds> Encoder::bounds() const {
    // Rounding to single precision keeps the order, so the corners can be found on the lattice.
    std::optional<std::vector<LatticePoint>> corners;
    for (const auto& decoded : state_->decoded)
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
    return state_->decoded.empty() ? Mesh() : reconstruction(state_->decoded.size() - 1);
}
Mesh Encoder::reconstruction(std::size_t coded) const {
    const bool charts = state_->configuration.options.texture.layout == TextureLayout::charts;
    return to_mesh(state_->decoded[coded].mesh, state_->configuration.header.lattice,
                   charts ? chart_texcoord_unit : captured_texcoord_unit);
}
std::span<const std::uint32_t> Encoder::repeated_vertices() const {
    return state_->decoded.empty() ? std::span<const std::uint32_t>() : repeated_vertices(state_->decoded.size() - 1);
}
std::span<const std::uint32_t> Encoder::repeated_vertices(std::size_t coded) const {
    return state_->decoded[coded].repeated;
}
const std::vector<StageTime>& Encoder::stage_times() const { return state_->stages; }
const std::vector<std::uint32_t>& Encoder::distance_order_counts() const { return state_->distance_order_counts; }

}  // namespace htvm
