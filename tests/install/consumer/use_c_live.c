/* Looks for a hub where there is none, by the installed library for C. */
#include <htvm/htvm_live.h>

int main(void) {
    htvm_watcher* watcher = NULL;
    htvm_publisher* publisher = NULL;
    const uint8_t* bytes;
    size_t count;
    char problem[100];
    if (htvm_watcher_create("http://127.0.0.1/watch/anna", NULL, &watcher, problem, sizeof problem) != HTVM_BAD_INPUT ||
        watcher || !problem[0])
        return 1;
    if (htvm_watcher_create("ws://127.0.0.1:9/watch/anna", NULL, &watcher, NULL, 0) != HTVM_OK) return 1;
    if (htvm_watcher_receive(watcher, 20, &bytes, &count) != HTVM_AGAIN) return 1;
    htvm_watcher_stop(watcher);
    if (htvm_watcher_receive(watcher, 20, &bytes, &count) != HTVM_END) return 1;
    htvm_watcher_destroy(watcher);
    if (htvm_publisher_create("ws://127.0.0.1:9/publish/anna", NULL, &publisher, NULL, 0) != HTVM_OK) return 1;
    htvm_publisher_destroy(publisher);
    return 0;
}
