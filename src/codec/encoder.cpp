// The encoder, top to bottom: a frame's mesh goes onto the lattice, becomes an I- or an EP-frame, and leaves as
// packets.
#include "htvm/encoder.hpp"

#include <algorithm>
#include <cmath>
#include <new>
#include <stdexcept>

#include "codec/choice/encoder_choice.h"
#include "codec/encoder_check.h"
#include "codec/encoder_state.h"
#include "codec/stage_clock_enc.h"
#include "core/parallel.h"
#include "htvm/decoder.hpp"

namespace htvm {

using namespace internal;

namespace {

using State = EncoderState;

// 1/16 mm, or as fine as makes the step eight units.
int lattice_bits(const EncoderOptions& options) {
    if (options.lattice_bits > 0) return options.lattice_bits;
    const bool controlled = options.rate.bits_per_second > 0 || options.rate.target_error > 0;
    const double finest = controlled ? quality_steps(100).geometry_step : options.geometry_step;
    const int needed = static_cast<int>(std::ceil(3 - std::log2(finest)));
    return std::clamp(needed, 4, 16);
}

// Short enough to need no memory itself.
tl::unexpected<Error> out_of_memory() { return fail(ErrorKind::limit, "out of memory"); }

void send(State& state, Packet packet) {
    state.stream_bytes += packet.payload.size() + packet_overhead;
    state.packets.push_back(std::move(packet));
}

// The sequence header goes out with the first frame: its origin and, where none were given, the radii come from there.
Result<void> begin(State& state, const Mesh& mesh, const Pose* pose) {
    const auto origin = lattice_origin(mesh);
    if (!origin) return tl::unexpected(origin.error());
    auto& header = state.header;
    header.lattice.origin = *origin;
    header.lattice.bits = lattice_bits(state.options);
    auto tracker = make_pose_tracker(state.options.skeleton, mesh, pose);
    if (!tracker) return tl::unexpected(tracker.error());
    state.poses = std::move(*tracker);
    header.skeleton = state.poses.skeleton;
    header.skeleton_tracked = state.poses.tracked;
    auto radii = state.options.radii;
    if (radii.empty()) {
        auto calibrated = calibrate(mesh, header.skeleton, state.poses.last);
        if (!calibrated) return tl::unexpected(calibrated.error());
        radii = std::move(*calibrated);
    }
    const double units = 1.0 / header.lattice.step();
    header.radii.clear();
    for (const auto r : radii)
        header.radii.push_back(static_cast<std::int32_t>(std::lround(std::min(r * units, 1.0 * lattice_limit))));
    header.fps_numerator = state.options.fps_numerator;
    header.fps_denominator = state.options.fps_denominator;
    header.unit_micrometres = state.options.unit_micrometres;
    header.nearest_vertices = static_cast<std::uint8_t>(state.options.topology.nearest_vertices);
    header.weight_width = static_cast<std::int32_t>(
        std::lround(std::min(state.options.topology.weight_width * units, 1.0 * lattice_limit)));
    if (state.options.profile == Profile::tracked)
        header.node_spacing = static_cast<std::int32_t>(
            std::clamp(std::lround(state.options.tracked.node_spacing * units), 1L, static_cast<long>(lattice_limit)));
    return {};
}

// Numbers and queues a frame's packets, and adds up where their bytes went.
void send_frame(State& state, std::vector<Packet> packets, std::uint32_t reference, std::int64_t timestamp_us) {
    LayerBytes codebooks;
    for (auto& packet : packets) {
        packet.frame = state.next_frame;
        packet.reference = packet.kind == PacketKind::tracked ? reference : state.group->reference.frame;
        packet.timestamp_us = timestamp_us;
        if (packet.kind == PacketKind::codebook) {
            codebooks.overhead += packet_overhead;
            codebooks[packet.payload[0] == codebook_for_geometry ? Layer::geometry : Layer::colour] +=
                packet.payload.size();
            continue;
        }
        state.info = *inspect(packet);
        state.info.vertices = static_cast<std::uint32_t>(state.decoded.positions.size());
        state.info.triangles = static_cast<std::uint32_t>(state.decoded.triangles.size());
        state.info.bytes += codebooks;
        if (packet.kind == PacketKind::intra)
            state.index.push_back({packet.frame, packet.timestamp_us, state.stream_bytes});
    }
    for (auto& packet : packets) send(state, std::move(packet));
}

Result<void> push_frame(State& state, const Mesh& mesh, const Pose* pose, std::int64_t timestamp_us, bool force_intra) {
    StageClock clock(state.stages);
    const auto on_lattice = to_lattice(mesh, state.header.lattice);
    if (!on_lattice) return tl::unexpected(on_lattice.error());
    const auto coded_pose = state.poses.next(mesh, pose, state.header.lattice);
    if (!coded_pose) return tl::unexpected(coded_pose.error());
    clock.done("to the lattice");
    FrameUnderWay frame{*on_lattice, *coded_pose, {}, {}, {}, {}};
    auto coded = code_frame(state, frame, force_intra);
    if (!coded) return tl::unexpected(coded.error());
    adopt(state, *coded);
    state.cost = {coded->type, coded->quality, bits_of(state, *coded)};
    if (state.rate) state.rate->coded(state.cost.type, state.cost.quality, state.cost.bits);
    if (brings_header(state, *coded)) {
        Packet header;
        header.payload = write_sequence_header(state.header);
        header.frame = state.header_sent = state.next_frame;
        header.timestamp_us = timestamp_us;
        send(state, std::move(header));
        state.begun = true;
    }
    send_frame(state, std::move(coded->packets), coded->reference, timestamp_us);
    ++state.next_frame;
    state.last_timestamp = timestamp_us;
    return {};
}

// Where a frame's packets begin: what is queued from there on can be taken back.
struct Queued {
    std::size_t packets, index;
    std::uint64_t stream_bytes;
    std::uint32_t header_sent;
    bool begun;
};

Queued queued(const State& state) {
    return {state.packets.size(), state.index.size(), state.stream_bytes, state.header_sent, state.begun};
}

// Memory ran out within a frame: it is not part of the stream, and nothing may refer to it, so the next is an I-frame.
tl::unexpected<Error> take_back(State& state, const Queued& before) {
    state.packets.resize(before.packets);
    state.index.resize(before.index);
    state.stream_bytes = before.stream_bytes;
    state.header_sent = before.header_sent;
    state.begun = before.begun;
    state.group.reset();
    return out_of_memory();
}

RateControlOptions rate_options(const EncoderOptions& options) {
    RateControlOptions out;
    out.bits_per_second = options.rate.bits_per_second;
    out.frames_per_second = static_cast<double>(options.fps_numerator) / options.fps_denominator;
    out.buffer_seconds = options.rate.buffer_seconds;
    out.key_interval = options.key_interval;
    if (options.profile == Profile::tracked) out.intra_extra = 3;
    return out;
}

}  // namespace

struct Encoder::State : EncoderState {};

QualitySteps quality_steps(double quality) {
    const double q = std::clamp(quality, 0.0, 100.0) / 100;
    return {16 * std::exp2(-6 * q), 32 * std::exp2(-5 * q)};
}

Result<Encoder> Encoder::create(const EncoderOptions& options) try {
    if (auto ok = check(options); !ok) return tl::unexpected(ok.error());
    auto state = std::make_unique<Encoder::State>();
    state->options = options;
    state->pool = ThreadPool(options.threads, options.runner);
    state->threads = state->pool.threads();
    if (options.rate.bits_per_second > 0) state->rate.emplace(rate_options(options), options.rate.first_pass);
    if (options.rate.target_error > 0) state->error.emplace(options.rate.target_error);
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

Result<void> Encoder::push(const Mesh& mesh, const Pose* pose, std::int64_t timestamp_us, bool force_intra) {
    auto& state = *state_;
    state.stages.clear();
    const auto before = queued(state);
    try {
        if (state.finished) return fail(ErrorKind::bad_input, "the sequence was finished; start a new encoder");
        if (state.last_timestamp && timestamp_us <= *state.last_timestamp)
            return fail(ErrorKind::bad_input, "timestamps must ascend");
        if (!state.begun)
            if (auto ok = begin(state, mesh, pose); !ok) return ok;
        return push_frame(state, mesh, pose, timestamp_us, force_intra);
    } catch (const std::bad_alloc&) {
        return take_back(state, before);
    } catch (const std::length_error&) {
        return take_back(state, before);
    }
}

void Encoder::finish() try {
    auto& state = *state_;
    if (state.finished || !state.begun) return;
    state.finished = true;
    Packet packet;
    packet.kind = PacketKind::index;
    packet.frame = state.next_frame;
    packet.timestamp_us = *state.last_timestamp;
    packet.payload = write_sequence_index(state.index);
    send(state, std::move(packet));
} catch (const std::bad_alloc&) {
    // A stream may end without an index.
}

std::optional<Packet> Encoder::pull() {
    if (state_->packets.empty()) return std::nullopt;
    Packet packet = std::move(state_->packets.front());
    state_->packets.pop_front();
    return packet;
}

const FrameInfo& Encoder::last_frame() const { return state_->info; }
FrameCost Encoder::last_cost() const { return state_->cost; }
Mesh Encoder::reconstruction() const { return to_mesh(state_->decoded, state_->header.lattice); }
const std::vector<StageTime>& Encoder::stage_times() const { return state_->stages; }
const std::vector<std::uint32_t>& Encoder::distance_order_counts() const { return state_->distance_order_counts; }

}  // namespace htvm
