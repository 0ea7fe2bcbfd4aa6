#include "command_line/mesh_pipe.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <istream>
#include <mutex>
#include <new>
#include <streambuf>
#include <thread>
#include <utility>

#include "command_line/console.h"
#include "command_line/interruption.h"
#include "io/ply.h"

namespace htvm::app {
namespace {

// Meshes that may wait for the encoder: where none is to be late, as many as it takes to get over an I-frame, which
// takes longer than others; else one, so that it is read beside the coding of the one before.
std::size_t most_waiting(WhileBusy while_busy) { return while_busy == WhileBusy::wait ? 1 : 8; }

// Standard input that ends where the program was interrupted, or nobody wants more of it: a read alone would wait on.
class InterruptibleInput : public std::streambuf {
public:
    explicit InterruptibleInput(const std::atomic<bool>& unwanted) : unwanted_(unwanted) {}

private:
    int_type underflow() override {
        while (interruption() == 0 && !unwanted_) {
            const auto got = read_input(bytes_);
            if (got.is_end) break;
            if (got.bytes == 0) continue;
            setg(bytes_.data(), bytes_.data(), bytes_.data() + got.bytes);
            return traits_type::to_int_type(bytes_[0]);
        }
        return traits_type::eof();
    }

    const std::atomic<bool>& unwanted_;
    std::array<char, 1 << 16> bytes_;
};

}  // namespace

struct MeshPipe::State {
    using Next = Result<std::optional<PipedMesh>>;

    explicit State(WhileBusy busy) : while_busy(busy), input(unwanted), stream(&input), reader(stream) {}
    ~State() {
        {
            const std::lock_guard lock(mutex);
            unwanted = true;
        }
        changed.notify_all();
        if (thread.joinable()) thread.join();
    }

    Next read() try {
        auto mesh = reader.next();
        if (interruption() != 0) return std::optional<PipedMesh>();  // in the middle of a mesh, perhaps
        if (!mesh) return tl::unexpected(mesh.error());
        if (!*mesh) return std::optional<PipedMesh>();
        return std::optional(PipedMesh{std::move(**mesh), came++, reader.timestamp(), reader.fps(), reader.findings(),
                                       std::chrono::steady_clock::now()});
    } catch (const std::bad_alloc&) {  // else it would end the process, as this is not the caller's thread
        return fail(ErrorKind::limit, "out of memory");
    }

    void read_on() {
        const auto most = most_waiting(while_busy);
        for (;;) {
            std::unique_lock lock(mutex);
            if (while_busy != WhileBusy::drop) changed.wait(lock, [&] { return unwanted || waiting.size() < most; });
            lock.unlock();
            auto next = read();
            const bool last = !next || !*next;
            lock.lock();
            if (!last && waiting.size() >= most) {
                waiting.pop_front();
                ++dropped;
            }
            waiting.push_back(std::move(next));
            changed.notify_all();
            if (last || unwanted) return;
        }
    }

    const WhileBusy while_busy;
    std::atomic<bool> unwanted = false;
    InterruptibleInput input;
    std::istream stream;
    PlyStreamReader reader;
    std::size_t came = 0;
    std::thread thread;
    // Those below the mutex are guarded by it.
    std::condition_variable changed;
    mutable std::mutex mutex;
    std::deque<Next> waiting;  // ends with nothing or an error, which stays
    std::size_t dropped = 0;
};

MeshPipe::MeshPipe(WhileBusy while_busy) : state_(std::make_unique<State>(while_busy)) {
    state_->thread = std::thread([state = state_.get()] { state->read_on(); });
}
MeshPipe::MeshPipe(MeshPipe&&) noexcept = default;
MeshPipe::~MeshPipe() = default;

Result<std::optional<PipedMesh>> MeshPipe::next() {
    auto& state = *state_;
    const auto asked = std::chrono::steady_clock::now();
    std::unique_lock lock(state.mutex);
    state.changed.wait(lock, [&] { return !state.waiting.empty(); });
    auto& front = state.waiting.front();
    if (!front || !*front) return front;
    auto next = std::move(front);
    // What was read ahead of a sender that waits might as well have come when it was asked for.
    if (state.while_busy == WhileBusy::wait) (*next)->came = std::max((*next)->came, asked);
    state.waiting.pop_front();
    state.changed.notify_all();
    return next;
}

std::size_t MeshPipe::dropped() const {
    const std::lock_guard lock(state_->mutex);
    return state_->dropped;
}

}  // namespace htvm::app
