#include "live/hub/nats_peering.h"

#include <nats/nats.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <random>
#include <set>
#include <thread>
#include <utility>
#include <vector>

namespace htvm::live {
namespace {

namespace net = boost::asio;

constexpr std::chrono::milliseconds tick{20};
// The library waits between two attempts for this long and up to as much again.
constexpr std::chrono::milliseconds reconnect{250}, connect_timeout{2000}, write_timeout{2000};
constexpr int most_pending_messages = 65536;
constexpr std::size_t most_troubles = 10;

// What the library's threads reach. It outlives the peering for as long as one of them may call back.
struct Mailbox {
    Mailbox(net::io_context& given, Hub& its_hub, std::size_t bytes)
        : context(&given), hub(its_hub), most_waiting(bytes) {}

    std::mutex mutex;
    net::io_context* context;       // null: the peering is gone, and what comes goes nowhere
    Hub& hub;                       // on the context's thread only,
    HubPeering* peering = nullptr;  // null: likewise
    const std::size_t most_waiting;
    std::size_t waiting = 0;  // bytes posted to the context
    NatsCounters counters{};
    bool closed = false;               // the library gave the connection up
    std::set<std::string> troubles{};  // that the log was told of since there was a connection
    std::condition_variable news{};

    // Runs act(peering) on the server's thread.
    static void post(const std::shared_ptr<Mailbox>& box, std::function<void(HubPeering&)> act) {
        const std::lock_guard lock(box->mutex);
        if (!box->context) return;
        net::post(*box->context, [box, act = std::move(act)] {
            if (box->peering) act(*box->peering);
        });
    }
    // Says in the log why the hubs are not joined: each reason once, until they are.
    static void tell_trouble(const std::shared_ptr<Mailbox>& box, const std::string& why) {
        {
            const std::lock_guard lock(box->mutex);
            if (box->troubles.size() >= most_troubles || !box->troubles.insert(why).second) return;
        }
        post(box, [box, why](HubPeering&) {
            box->hub.tell({.name = "nats_trouble",
                           .text = "not joined with other hubs: " + why + "; streams of this hub go on",
                           .warning = true});
        });
    }
};
using SharedMailbox = std::shared_ptr<Mailbox>;

// ---- On the library's threads ---------------------------------------------------------------------------------------
// `closure`: a new SharedMailbox, which is deleted behind the last call.

SharedMailbox& mailbox(void* closure) { return *static_cast<SharedMailbox*>(closure); }

void on_message(natsConnection*, natsSubscription*, natsMsg* message, void* closure) {
    const auto& box = mailbox(closure);
    const auto* data = reinterpret_cast<const std::uint8_t*>(natsMsg_GetData(message));
    const auto size = static_cast<std::size_t>(std::max(0, natsMsg_GetDataLength(message)));
    bool room = false;
    {
        const std::lock_guard lock(box->mutex);
        room = box->waiting + size <= box->most_waiting;
        room ? box->waiting += size : ++box->counters.dropped_from;
    }
    if (room)
        Mailbox::post(box, [box, subject = std::string(natsMsg_GetSubject(message)),
                            bytes = Bytes(data, data + size)](HubPeering& peering) {
            {
                const std::lock_guard lock(box->mutex);
                box->waiting -= bytes.size();
            }
            peering.receive(subject, bytes, HubPeering::Clock::now());
        });
    natsMsg_Destroy(message);
}

void on_subscription_ended(void* closure) { delete &mailbox(closure); }

void on_connected(natsConnection*, void* closure) {
    const auto& box = mailbox(closure);
    {
        const std::lock_guard lock(box->mutex);
        ++box->counters.connections;
        box->troubles.clear();
    }
    Mailbox::post(box, [box](HubPeering& peering) {
        peering.connected(HubPeering::Clock::now());
        box->hub.tell({.name = "nats_connected", .text = "joined with other hubs through NATS"});
    });
}

void on_disconnected(natsConnection*, void* closure) {
    const auto& box = mailbox(closure);
    Mailbox::post(box, [](HubPeering& peering) { peering.disconnected(HubPeering::Clock::now()); });
    Mailbox::tell_trouble(box, "the connection to NATS has broken");
}

// What NATS itself said is clearer than the library's word for it.
void tell_error(natsConnection* connection, natsStatus status, const SharedMailbox& box) {
    const char* said = nullptr;
    natsConnection_GetLastError(connection, &said);
    Mailbox::tell_trouble(box, "NATS: " + std::string(said && *said ? said : natsStatus_GetText(status)));
}

void on_error(natsConnection* connection, natsSubscription*, natsStatus status, void* closure) {
    const auto& box = mailbox(closure);
    if (status != NATS_SLOW_CONSUMER) return tell_error(connection, status, box);
    const std::lock_guard lock(box->mutex);
    ++box->counters.slow_consumer;
}

// The library gave up, as it does when it is refused twice.
void on_closed(natsConnection* connection, void* closure) {
    auto* shared = &mailbox(closure);
    const char* ignored = nullptr;
    const auto status = natsConnection_GetLastError(connection, &ignored);
    if (status != NATS_OK) tell_error(connection, status, *shared);
    {
        const std::lock_guard lock((*shared)->mutex);
        (*shared)->closed = true;
    }
    (*shared)->news.notify_all();
    delete shared;
}

// ---- Options of the library -----------------------------------------------------------------------------------------

struct DestroyOptions {
    void operator()(natsOptions* options) const { natsOptions_Destroy(options); }
};
using LibraryOptions = std::unique_ptr<natsOptions, DestroyOptions>;

std::vector<std::string> addresses(const std::string& list) {
    std::vector<std::string> out;
    for (std::size_t begin = 0; begin <= list.size();) {
        const auto end = std::min(list.find(',', begin), list.size());
        if (end > begin) out.push_back(list.substr(begin, end - begin));
        begin = end + 1;
    }
    return out;
}

// "a.example" of "tls://user:password@a.example:4222".
std::string host_of(const std::string& address) {
    auto rest = address.substr(address.find("://") + 3);
    if (const auto at = rest.rfind('@'); at != std::string::npos) rest = rest.substr(at + 1);
    const bool six = rest.starts_with('[');
    return six ? rest.substr(1, rest.find(']') - 1) : rest.substr(0, rest.find_first_of(":/"));
}

// Its defaults would undo what the hubs rely on: a ping each two minutes, an end after 60 attempts, and a buffer of 8
// MB whose stale packets are sent after a reconnection.
Result<LibraryOptions> library_options(const NatsOptions& options) {
    const auto servers = addresses(options.servers);
    std::vector<const char*> names;
    bool secure = !options.ca_file.empty();
    for (const auto& server : servers) {
        if (!server.starts_with("nats://") && !server.starts_with("tls://"))
            return fail(ErrorKind::bad_input, "not an address of NATS: it begins with nats:// or tls://");
        secure = secure || server.starts_with("tls://");
        names.push_back(server.c_str());
    }
    if (names.empty()) return fail(ErrorKind::bad_input, "no address of NATS was given");
    if (secure && names.size() > 1)
        return fail(ErrorKind::bad_input, "with TLS give one address of NATS: its certificate is checked by its name");
    natsOptions* made = nullptr;
    if (natsOptions_Create(&made) != NATS_OK) return fail(ErrorKind::limit, "libnats has no memory");
    LibraryOptions out(made);
    std::string what;
    const auto set = [&](natsStatus status, const char* option) {
        if (status != NATS_OK && what.empty()) what = std::string(option) + ": " + natsStatus_GetText(status);
    };
    set(natsOptions_SetServers(made, names.data(), static_cast<int>(names.size())), "address of NATS");
    set(natsOptions_SetName(made, options.hub_name.c_str()), "name");
    set(natsOptions_SetPingInterval(made, options.ping.count()), "ping");
    set(natsOptions_SetMaxPingsOut(made, 2), "pings out");
    set(natsOptions_SetTimeout(made, connect_timeout.count()), "timeout");
    set(natsOptions_SetMaxReconnect(made, -1), "reconnects");
    set(natsOptions_SetReconnectWait(made, reconnect.count()), "reconnect wait");
    set(natsOptions_SetReconnectJitter(made, reconnect.count(), reconnect.count()), "reconnect jitter");
    set(natsOptions_SetReconnectBufSize(made, 1), "reconnect buffer");
    set(natsOptions_SetWriteDeadline(made, write_timeout.count()), "write deadline");
    set(natsOptions_SetSendAsap(made, true), "send as soon as possible");
    set(natsOptions_SetNoEcho(made, true), "no echo");
    set(natsOptions_SetMaxPendingMsgs(made, most_pending_messages), "pending messages");
    set(natsOptions_UseGlobalMessageDelivery(made, true), "message delivery");
    if (secure) {
        set(natsOptions_SetSecure(made, true), "TLS");
        set(natsOptions_SetExpectedHostname(made, host_of(servers[0]).c_str()), "TLS, name of the server");
    }
    if (!options.ca_file.empty())
        set(natsOptions_LoadCATrustedCertificates(made, options.ca_file.c_str()), "certificates for NATS");
    if (!options.credentials_file.empty()) {
        if (::access(options.credentials_file.c_str(), R_OK) != 0) what = options.credentials_file + " cannot be read";
        set(natsOptions_SetUserCredentialsFromFiles(made, options.credentials_file.c_str(), nullptr), "credentials");
    }
    if (!what.empty()) return fail(ErrorKind::bad_input, what);
    return out;
}

std::string name_of_machine() {
    std::array<char, 256> name{};
    return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "hub";
}

std::uint64_t random_number() {
    std::random_device random;
    return (std::uint64_t{random()} << 32) | random();
}

// ---- The thread that calls the library ------------------------------------------------------------------------------

// Calls to the library wait for locks and sockets, so the server's thread makes none.
class Sender {
public:
    Sender(LibraryOptions options, SharedMailbox box) : options_(std::move(options)), box_(std::move(box)) {}

    void start() {
        thread_ = std::thread([this] { run(); });
    }
    void end() {
        {
            const std::lock_guard lock(box_->mutex);
            ending_ = true;
        }
        box_->news.notify_all();
        if (thread_.joinable()) thread_.join();
    }
    void send(const std::string& subject, Bytes message) {
        {
            const std::lock_guard lock(box_->mutex);
            if (bytes_ + message.size() > box_->most_waiting) {
                ++box_->counters.dropped_to;
                return;
            }
            bytes_ += message.size();
            tasks_.push_back({Task::Kind::send, subject, std::move(message)});
        }
        box_->news.notify_all();
    }
    void hear(const std::string& subject, bool whether) {
        {
            const std::lock_guard lock(box_->mutex);
            tasks_.push_back({whether ? Task::Kind::subscribe : Task::Kind::unsubscribe, subject, {}});
        }
        box_->news.notify_all();
    }

private:
    struct Task {
        enum class Kind { send, subscribe, unsubscribe } kind;
        std::string subject;
        Bytes message;
    };

    // Until the peering ends: connects, again where that fails, and if the library gives up, as it does when it is
    // refused twice.
    void run() {
        while (!ends_within(std::chrono::milliseconds(0))) {
            natsConnection* connection = nullptr;
            const bool begun = connect(connection);
            while (begun) {
                Task task;
                {
                    std::unique_lock lock(box_->mutex);
                    box_->news.wait(lock, [&] { return ending_ || box_->closed || !tasks_.empty(); });
                    if (ending_ || box_->closed) break;
                    task = std::move(tasks_.front());
                    tasks_.pop_front();
                    bytes_ -= task.message.size();
                }
                act(connection, std::move(task));
            }
            for (auto& [subject, subscription] : subscriptions_) end_subscription(subscription);
            if (connection) natsConnection_Destroy(connection);
            forget_messages();
            if (ends_within(reconnect * 2)) break;
        }
    }

    // They would come late.
    void forget_messages() {
        const std::lock_guard lock(box_->mutex);
        box_->counters.dropped_to +=
            std::erase_if(tasks_, [](const Task& task) { return task.kind == Task::Kind::send; });
        bytes_ = 0;
    }

    bool ends_within(std::chrono::milliseconds time) {
        std::unique_lock lock(box_->mutex);
        return box_->news.wait_for(lock, time, [&] { return ending_; });
    }

    bool connect(natsConnection*& connection) {
        {
            const std::lock_guard lock(box_->mutex);
            box_->closed = false;
        }
        auto* closure = new SharedMailbox(box_);  // of all of the connection; on_closed comes last
        auto* options = options_.get();
        natsOptions_SetDisconnectedCB(options, on_disconnected, closure);
        natsOptions_SetReconnectedCB(options, on_connected, closure);
        natsOptions_SetClosedCB(options, on_closed, closure);
        natsOptions_SetErrorHandler(options, on_error, closure);
        const auto status = natsConnection_Connect(&connection, options);
        if (status != NATS_OK) {
            Mailbox::tell_trouble(box_, "NATS: " + std::string(natsStatus_GetText(status)));
            delete closure;
            connection = nullptr;
            return false;
        }
        for (auto& [subject, subscription] : subscriptions_) subscription = subscribed(connection, subject);
        on_connected(connection, closure);
        return true;
    }

    natsSubscription* subscribed(natsConnection* connection, const std::string& subject) {
        natsSubscription* out = nullptr;
        auto* closure = new SharedMailbox(box_);
        if (natsConnection_Subscribe(&out, connection, subject.c_str(), on_message, closure) != NATS_OK) {
            delete closure;
            return nullptr;
        }
        natsSubscription_SetOnCompleteCB(out, on_subscription_ended, closure);
        natsSubscription_SetPendingLimits(out, most_pending_messages, static_cast<int>(box_->most_waiting));
        return out;
    }

    static void end_subscription(natsSubscription*& subscription) {
        if (!subscription) return;
        natsSubscription_Unsubscribe(subscription);
        natsSubscription_Destroy(subscription);
        subscription = nullptr;
    }

    void act(natsConnection* connection, Task task) {
        if (task.kind == Task::Kind::subscribe) {
            subscriptions_[task.subject] = subscribed(connection, task.subject);
        } else if (task.kind == Task::Kind::unsubscribe) {
            const auto found = subscriptions_.find(task.subject);
            if (found == subscriptions_.end()) return;
            end_subscription(found->second);
            subscriptions_.erase(found);
        } else if (natsConnection_Status(connection) != NATS_CONN_STATUS_CONNECTED ||
                   natsConnection_Publish(connection, task.subject.c_str(), task.message.data(),
                                          static_cast<int>(task.message.size())) != NATS_OK) {
            const std::lock_guard lock(box_->mutex);
            ++box_->counters.dropped_to;
        }
    }

    LibraryOptions options_;
    SharedMailbox box_;
    bool ending_ = false;  // like tasks_ and bytes_ behind the mailbox's mutex
    std::deque<Task> tasks_{};
    std::size_t bytes_ = 0;
    std::map<std::string, natsSubscription*> subscriptions_{};  // the thread's
    std::thread thread_{};
};

}  // namespace

struct NatsPeering::State {
    SharedMailbox box;
    Sender sender;
    HubPeering peering;
    std::shared_ptr<net::steady_timer> timer;

    State(LibraryOptions library, const HubPeeringOptions& options, std::size_t most_waiting, Hub& hub,
          net::io_context& context)
        : box(std::make_shared<Mailbox>(context, hub, most_waiting)),
          sender(std::move(library), box),
          peering(hub, options,
                  {[this](const std::string& subject, Bytes message) { sender.send(subject, std::move(message)); },
                   [this](const std::string& subject) { sender.hear(subject, true); },
                   [this](const std::string& subject) { sender.hear(subject, false); }}),
          timer(std::make_shared<net::steady_timer>(context)) {
        box->peering = &peering;
        for (const auto& subject : peering.subjects()) sender.hear(subject, true);
        sender.start();
        wait(box, timer);
    }
    State(const State&) = delete;
    State& operator=(const State&) = delete;
    ~State() {
        box->peering = nullptr;
        timer->cancel();
        {
            const std::lock_guard lock(box->mutex);
            box->context = nullptr;
        }
        sender.end();
    }

    static void wait(const SharedMailbox& box, const std::shared_ptr<net::steady_timer>& timer) {
        timer->expires_after(tick);
        timer->async_wait([box, timer](const boost::system::error_code& error) {
            if (error || !box->peering) return;
            box->peering->tick(HubPeering::Clock::now());
            wait(box, timer);
        });
    }
};

Result<NatsPeering> NatsPeering::open(const NatsOptions& options, Hub& hub, net::io_context& context) {
    auto library = library_options(options);
    if (!library) return tl::unexpected(library.error());
    HubPeeringOptions peering;
    peering.name = options.hub_name.empty() ? name_of_machine() : options.hub_name;
    peering.url = options.hub_url;
    peering.number = random_number();
    return NatsPeering(std::make_unique<State>(std::move(*library), peering, options.most_waiting, hub, context));
}

NatsPeering::NatsPeering(std::unique_ptr<State> state) : state_(std::move(state)) {}
NatsPeering::NatsPeering(NatsPeering&&) noexcept = default;
NatsPeering& NatsPeering::operator=(NatsPeering&&) noexcept = default;
NatsPeering::~NatsPeering() = default;

NatsCounters NatsPeering::counters() const {
    const std::lock_guard lock(state_->box->mutex);
    auto out = state_->box->counters;
    out.hubs = state_->peering.counters();
    return out;
}

}  // namespace htvm::live
