#include "htvm/watcher.hpp"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <utility>

#include "htvm/dependency.hpp"
#include "live/client/control.h"
#include "live/client/hub_client.h"
#include "live/client/repeated_packets.h"

namespace htvm {

using namespace live;

namespace {

// Packets that may wait for the owner. What comes beyond stays in the line, so that the hub notices.
constexpr std::size_t most_waiting = 32, most_waiting_bytes = std::size_t{1} << 20;
constexpr std::chrono::milliseconds look_up_after{100};

// The message is to be exactly one sound packet.
std::optional<Packet> packet_of(const std::vector<std::uint8_t>& message, std::size_t largest) {
    PacketReader reader(largest);
    reader.push(message);
    auto packet = reader.pull();
    if (!packet || reader.damaged_bytes() > 0 || reader.pending_bytes() > 0) return std::nullopt;
    return packet;
}

}  // namespace

struct Watcher::State {
    WatcherOptions options;
    mutable std::mutex mutex;
    std::condition_variable changed;
    std::deque<Packet> waiting;
    std::size_t waiting_bytes = 0;
    std::string trouble;  // not told yet
    bool stopped = false;
    std::optional<HubEnding> ending;
    WatcherState counters;
    RepeatedPackets repeated;         // of the thread
    std::optional<HubClient> client;  // the last: its thread uses the rest

    explicit State(WatcherOptions given) : options(std::move(given)) {}
    ~State() {
        if (client) client->stop();
    }
    bool is_full() const { return waiting.size() >= most_waiting || waiting_bytes >= most_waiting_bytes; }
    void receive_packet(const std::vector<std::uint8_t>& message);
    void receive_text(const std::string& text);
    HubTalk talk();
};

void Watcher::State::receive_packet(const std::vector<std::uint8_t>& message) {
    auto packet = packet_of(message, options.largest_packet);
    if (packet && repeated.is_repeat(header_with_flags(*packet))) return;
    const std::lock_guard lock(mutex);
    if (!packet) {
        ++counters.damaged_messages;
        counters.damaged_bytes += message.size();
        return;
    }
    waiting_bytes += packet->payload.size();
    waiting.push_back(std::move(*packet));
    changed.notify_all();
}

void Watcher::State::receive_text(const std::string& text) {
    const auto message = read_to_viewer(text);
    if (!message) return;
    if (const auto* hello = std::get_if<Hello>(&*message)) client->learn(hello->hubs);
    const std::lock_guard lock(mutex);
    if (const auto* heartbeat = std::get_if<HeartbeatToViewer>(&*message)) counters.dropped_frames = heartbeat->dropped;
}

HubTalk Watcher::State::talk() {
    HubTalk out;
    out.receive_packet = [this](std::vector<std::uint8_t> message) { receive_packet(message); };
    out.receive_text = [this](const std::string& text) { receive_text(text); };
    out.may_read = [this] {
        const std::lock_guard lock(mutex);
        return !is_full();
    };
    out.lost = [this](const HubEnding& why) {
        const std::lock_guard lock(mutex);
        trouble = why.reason;
        changed.notify_all();
    };
    out.ended = [this](const HubEnding& why) {
        const std::lock_guard lock(mutex);
        ending = why;
        changed.notify_all();
    };
    return out;
}

Watcher::Watcher(std::unique_ptr<State> state) : state_(std::move(state)) {}
Watcher::Watcher(Watcher&&) noexcept = default;
Watcher& Watcher::operator=(Watcher&&) noexcept = default;
Watcher::~Watcher() = default;

Result<Watcher> Watcher::open(const std::string& url, const WatcherOptions& options) {
    auto address = parse_hub_address(url);
    if (!address) return tl::unexpected(address.error());
    auto state = std::make_unique<State>(options);
    HubClientOptions client;
    client.certificates = options.certificates;
    client.insecure = options.insecure;
    client.token = options.token;
    client.largest_message = options.largest_packet + packet_overhead;
    client.patience = {};  // only publishers are refused for a moment
    auto created = HubClient::create({std::move(*address)}, client, state->talk());
    if (!created) return tl::unexpected(created.error());
    state->client.emplace(std::move(*created));
    state->client->start();
    return Watcher(std::move(state));
}

Result<std::optional<Packet>> Watcher::next() { return next(std::chrono::milliseconds::max()); }

Result<std::optional<Packet>> Watcher::next(std::chrono::milliseconds timeout) {
    auto& state = *state_;
    const auto begin = std::chrono::steady_clock::now();
    std::unique_lock lock(state.mutex);
    while (state.waiting.empty() || state.stopped) {
        if (state.stopped) return std::optional<Packet>();
        if (state.options.is_stopped && state.options.is_stopped()) return std::optional<Packet>();
        if (!state.trouble.empty() && state.options.trouble)
            state.options.trouble(std::exchange(state.trouble, std::string()));
        if (state.ending && state.ending->kind == HubEnding::Kind::refused)
            return fail(ErrorKind::bad_input, state.ending->reason);
        if (state.ending) return std::optional<Packet>();
        const auto passed =
            std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now() - begin);
        if (passed >= timeout) return fail(ErrorKind::limit, "no packet came in time");
        state.changed.wait_for(lock, std::min(look_up_after, timeout - passed));
    }
    const bool full = state.is_full();
    auto packet = std::move(state.waiting.front());
    state.waiting.pop_front();
    state.waiting_bytes -= packet.payload.size();
    lock.unlock();
    if (full) state.client->wake();
    return std::optional(std::move(packet));
}

void Watcher::stop() {
    const std::lock_guard lock(state_->mutex);
    state_->stopped = true;
    state_->changed.notify_all();
}

WatcherState Watcher::state() const {
    const auto status = state_->client->status();
    const std::lock_guard lock(state_->mutex);
    auto out = state_->counters;
    out.connected = status.connected;
    out.connections = status.connections;
    return out;
}

}  // namespace htvm
