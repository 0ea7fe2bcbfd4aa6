// Looks for a hub where there is none, by the installed library.
#include <htvm/publisher.hpp>
#include <htvm/watcher.hpp>

int main() {
    if (htvm::Publisher::open("http://127.0.0.1/publish/anna")) return 1;
    auto watcher = htvm::Watcher::open("wss://127.0.0.1:9/watch/anna");
    if (!watcher || watcher->next(std::chrono::milliseconds(20))) return 1;
    auto publisher = htvm::Publisher::open("wss://127.0.0.1:9/publish/anna");
    if (!publisher || publisher->state().sent_packets != 0) return 1;
    return publisher->finish(std::chrono::milliseconds(20)) ? 1 : 0;
}
