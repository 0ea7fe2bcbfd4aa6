#include "htvm/publisher.hpp"

#include <algorithm>
#include <condition_variable>
#include <limits>
#include <mutex>
#include <optional>
#include <utility>

#include "htvm/decoder.hpp"
#include "htvm/dependency.hpp"
#include "live/client/broadcast.h"
#include "live/client/control.h"
#include "live/client/hub_client.h"

namespace htvm {

using namespace live;
using Clock = Broadcast::Clock;

namespace {

// What the stream's clock shows now, as the frames tell that were least late: those that took long to encode do not
// set it back.
class StreamClock {
public:
    void add(std::int64_t timestamp_us, Clock::time_point now) {
        if (timestamp_us <= last_us_) ahead_.reset();  // another sequence, with times of its own
        last_us_ = timestamp_us;
        const auto ahead = timestamp_us - microseconds(now);
        if (!ahead_ || now - begun_ > window) {
            before_ = ahead_ ? ahead_ : ahead;
            ahead_ = ahead;
            begun_ = now;
        }
        ahead_ = std::max(*ahead_, ahead);
    }
    std::optional<std::int64_t> at(Clock::time_point now) const {
        if (!ahead_) return std::nullopt;
        return microseconds(now) + std::max(*ahead_, *before_);
    }

private:
    static constexpr std::chrono::seconds window{2};
    static std::int64_t microseconds(Clock::time_point time) {
        return std::chrono::duration_cast<std::chrono::microseconds>(time.time_since_epoch()).count();
    }
    std::int64_t last_us_ = std::numeric_limits<std::int64_t>::min();
    std::optional<std::int64_t> ahead_, before_;  // of this window and the one before: stream time less our own
    Clock::time_point begun_{};
};

}  // namespace

// The broadcast of this stream has one viewer: the connection to a hub. So a new connection is sent what the newest
// frame needs, and a slow one is treated as the hub treats slow viewers.
struct Publisher::State {
    PublisherOptions options;
    mutable std::mutex mutex;
    std::condition_variable changed;
    Broadcast broadcast;
    std::optional<Broadcast::Viewer> line;  // while there is a connection
    StreamClock clock;
    ViewerCounters before;                               // of connections that ended
    std::uint64_t unheard_from = 0, unheard_frames = 0;  // since there is no connection: the first place, and frames
    std::optional<std::uint32_t> checksum;               // of the last sequence header sent over this connection
    bool announced = true;                               // whether its clock was told behind its first frame
    bool asked = false;                                  // for a key frame, by the hub
    Clock::time_point asked_at{};
    std::optional<std::uint64_t> viewers;
    std::string trouble;
    std::optional<HubEnding> ending;
    std::optional<HubClient> client;  // the last: its thread uses the rest

    explicit State(const PublisherOptions& given)
        : options(given),
          broadcast(BroadcastLimits{.bytes = given.queue_bytes,
                                    .wait = given.queue_time,
                                    .kept_packets = std::numeric_limits<std::size_t>::max()}) {}
    ~State() {
        if (client) client->stop();
    }

    ViewerCounters counters() const {
        auto out = before;
        out.dropped_frames += unheard_frames;
        if (!line) return out;
        const auto& now = broadcast.counters(*line);
        out.packets += now.packets;
        out.bytes += now.bytes;
        out.dropped_frames += now.dropped_frames;
        return out;
    }
    // The hub is sent those frames that found no connection and that the newest needs.
    void connect() {
        line = broadcast.join([this] { client->wake(); }, Clock::now());
        if (const auto sent = broadcast.kept())
            unheard_frames -=
                static_cast<std::uint64_t>(std::count_if(sent->begin(), sent->end(), [&](const auto& one) {
                    return one.place >= unheard_from && frame_type(one.packet->header.kind);
                }));
        before.dropped_frames += std::exchange(unheard_frames, 0);
    }
    void disconnect(const std::string& reason) {
        const std::lock_guard lock(mutex);
        if (line) {
            before = counters();
            broadcast.leave(*std::exchange(line, std::nullopt));
            unheard_from = broadcast.next_place();
        }
        viewers.reset();
        trouble = reason;
    }
    std::string heartbeat() const { return write_text(HeartbeatFromPublisher{clock.at(Clock::now())}); }
    void sent(const PacketHeader& header);
    void receive_text(const std::string& text);
    HubTalk talk();
};

// header: of a packet that is sent next. Behind the first frame of a session goes its clock.
void Publisher::State::sent(const PacketHeader& header) {
    if (header.kind == PacketKind::sequence && std::exchange(checksum, header.reference) != header.reference)
        announced = false;
    if (frame_type(header.kind) && !std::exchange(announced, true)) client->say(heartbeat());
}

void Publisher::State::receive_text(const std::string& text) {
    const auto message = read_to_publisher(text);
    if (!message) return;
    if (const auto* hello = std::get_if<Hello>(&*message)) client->learn(hello->hubs);
    const std::lock_guard lock(mutex);
    if (const auto* heartbeat = std::get_if<HeartbeatToPublisher>(&*message)) viewers = heartbeat->viewers;
    if (std::holds_alternative<KeyFrameRequest>(*message)) asked = true;
}

HubTalk Publisher::State::talk() {
    HubTalk out;
    out.connected = [this] {
        const std::lock_guard lock(mutex);
        trouble.clear();
        checksum.reset();
        connect();
    };
    out.next = [this]() -> SharedPacket {
        const std::lock_guard lock(mutex);
        auto packet = line ? broadcast.next(*line) : nullptr;
        if (packet) sent(packet->header);
        return packet;
    };
    if (options.stamps)
        out.before = [](const LivePacket& packet) {
            if (!frame_type(packet.header.kind)) return std::string();
            return write_text(Stamp{packet.header.frame, system_microseconds(), {}});
        };
    out.receive_text = [this](const std::string& text) { receive_text(text); };
    out.heartbeat = [this] {
        const std::lock_guard lock(mutex);
        return heartbeat();
    };
    out.lost = [this](const HubEnding& why) { disconnect(why.reason); };
    out.ended = [this](const HubEnding& why) {
        {
            const std::lock_guard lock(mutex);
            ending = why;
        }
        disconnect(why.reason);
        changed.notify_all();
    };
    return out;
}

Publisher::Publisher(std::unique_ptr<State> state) : state_(std::move(state)) {}
Publisher::Publisher(Publisher&&) noexcept = default;
Publisher& Publisher::operator=(Publisher&&) noexcept = default;
Publisher::~Publisher() = default;

Result<Publisher> Publisher::open(const std::string& url, const PublisherOptions& options) {
    std::vector<HubAddress> hubs;
    for (std::size_t i = 0; i <= options.other_hubs.size(); ++i) {
        auto address = parse_hub_address(i == 0 ? url : options.other_hubs[i - 1]);
        if (!address) return tl::unexpected(address.error());
        if (i > 0 && address->target == "/") address->target = hubs[0].target;
        hubs.push_back(std::move(*address));
    }
    auto state = std::make_unique<State>(options);
    HubClientOptions client;
    client.token = options.token;
    client.certificates = options.certificates;
    client.insecure = options.insecure;
    client.largest_message = std::size_t{1} << 16;  // a hub sends a publisher only texts
    auto created = HubClient::create(std::move(hubs), client, state->talk());
    if (!created) return tl::unexpected(created.error());
    state->client.emplace(std::move(*created));
    state->client->start();
    return Publisher(std::move(state));
}

Result<void> Publisher::send(const Packet& packet) {
    auto& state = *state_;
    auto header = header_with_flags(packet);
    auto shared = std::make_shared<LivePacket>(LivePacket{header, write_packet(packet)});
    const auto now = Clock::now();
    const std::lock_guard lock(state.mutex);
    if (state.ending) return fail(ErrorKind::bad_input, state.ending->reason);
    const bool frame = frame_type(packet.kind).has_value();
    if (frame) state.clock.add(packet.timestamp_us, now);
    if (state.broadcast.push(std::move(shared), now) && frame && !state.line) ++state.unheard_frames;
    return {};
}

bool Publisher::wants_key_frame() {
    constexpr std::chrono::seconds at_most_every{1};
    auto& state = *state_;
    const auto now = Clock::now();
    const std::lock_guard lock(state.mutex);
    const bool behind = state.line && !state.broadcast.follows(*state.line);
    if (!(state.asked || behind) || now - state.asked_at < at_most_every) return false;
    state.asked = false;
    state.asked_at = now;
    return true;
}

PublisherState Publisher::state() const {
    const auto client = state_->client->status();
    const auto& state = *state_;
    PublisherState out;
    out.connected = client.connected;
    out.hub = client.hub;
    out.connections = client.connections;
    out.round_trip = client.round_trip;
    const std::lock_guard lock(state.mutex);
    const auto counters = state.counters();
    out.sent_packets = counters.packets;
    out.sent_bytes = counters.bytes;
    out.dropped_frames = counters.dropped_frames;
    if (state.line) {
        out.queue_bytes = state.broadcast.waiting_bytes(*state.line);
        out.queue_time = std::chrono::duration_cast<std::chrono::milliseconds>(
            state.broadcast.waiting_time(*state.line, Clock::now()));
    }
    out.viewers = state.viewers;
    out.trouble = state.trouble;
    out.is_over = state.ending.has_value();
    return out;
}

Result<void> Publisher::finish(std::chrono::milliseconds timeout) {
    return end(write_text(live::EndOfStream{}), timeout);
}

Result<void> Publisher::leave(std::chrono::milliseconds timeout) { return end({}, timeout); }

Result<void> Publisher::end(std::string last_words, std::chrono::milliseconds timeout) {
    auto& state = *state_;
    state.client->finish(std::move(last_words));
    std::unique_lock lock(state.mutex);
    const bool over = state.changed.wait_for(lock, timeout, [&] { return state.ending.has_value(); });
    const auto why = state.ending ? state.ending->reason : state.trouble;
    const bool refused = state.ending && state.ending->kind == HubEnding::Kind::refused;
    lock.unlock();
    state.client->stop();
    if (refused) return fail(ErrorKind::bad_input, why);
    if (!over) {
        const bool reached = state.client->status().connections > 0;
        return fail(ErrorKind::limit, (reached ? "the hub did not take the end of the stream" : "no hub was reached") +
                                          (why.empty() ? why : ": " + why));
    }
    return {};
}

}  // namespace htvm
