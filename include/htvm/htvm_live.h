/* htvm: live streams in C. Publishing and watching through a hub (docs/live.md), by the library htvm_c_live. Plain C99,
 * and the conventions of htvm/htvm.h, which it includes.
 *
 * Publishing what an encoder makes:
 *
 *   htvm_live_options options;
 *   htvm_live_options_init(&options, sizeof options);
 *   options.token = token;
 *   htvm_publisher_create("wss://hub.example/publish/anna", &options, &publisher, problem, sizeof problem);
 *   htvm_encoder_send_mesh(encoder, &mesh, &pose, timestamp_us, htvm_publisher_wants_key_frame(publisher));
 *   while (htvm_encoder_receive_packet(encoder, buffer, sizeof buffer, &size) == HTVM_OK)
 *       htvm_publisher_send(publisher, buffer, size);
 *   htvm_publisher_finish(publisher, 1, 5000);
 *   htvm_publisher_destroy(publisher);
 *
 * Watching:
 *
 *   htvm_watcher_create("wss://hub.example/watch/anna", NULL, &watcher, problem, sizeof problem);
 *   while ((status = htvm_watcher_receive(watcher, 1000, &bytes, &count)) == HTVM_OK || status == HTVM_AGAIN)
 *       if (status == HTVM_OK) htvm_decoder_send_bytes(decoder, bytes, count);        then receive frames
 *   htvm_watcher_destroy(watcher);
 *
 * Threads. Each handle has a thread of its own that reads and writes the line. One at a time of the caller's threads
 * may use a handle, but for htvm_watcher_stop(), which any may call at any time until _destroy is called; different
 * threads may use different handles at the same time. No function calls the caller back.
 *
 * Lifetimes. Texts and bytes that are passed in are copied; a _destroy ends the connection at once. Handles are
 * allocated by C++'s operator new.
 */
#ifndef HTVM_HTVM_LIVE_H
#define HTVM_HTVM_LIVE_H

#include "htvm/htvm.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct htvm_publisher htvm_publisher;
typedef struct htvm_watcher htvm_watcher;

typedef struct htvm_live_options {
    uint32_t struct_size;     /* set by htvm_live_options_init() */
    uint32_t insecure;        /* 1: takes any certificate of a hub: for tests alone. Default: 0 */
    const char* token;        /* of whoever may publish the stream; NULL, the default: none is sent. No use to watch */
    const char* certificates; /* PEM file of those who may vouch for a hub's; NULL, the default: the system's */
} htvm_live_options;
htvm_status htvm_live_options_init(htvm_live_options* options, size_t options_size);

/* ---- publishing ------------------------------------------------------------------------------------------------ */

/* Connects in the background. url: ws://HOST[:PORT]/publish/NAME, or wss:// for TLS. options: NULL: the defaults.
 * *publisher is set to NULL unless the status is HTVM_OK; else problem, if not NULL, receives a sentence of up to
 * problem_capacity characters, including the terminating 0. */
htvm_status htvm_publisher_create(const char* url, const htvm_live_options* options, htvm_publisher** publisher,
                                  char* problem, size_t problem_capacity);
void htvm_publisher_destroy(htvm_publisher* publisher);

/* The stream's next bytes: whole packets, as an encoder gives them; the first is a sequence header, of a session of its
 * own (option "session"). It never waits: what the line does not take is dropped so that the rest can be decoded.
 * HTVM_CORRUPT_STREAM: these are no whole packets, none of which was taken. HTVM_BAD_INPUT: the hub has refused the
 * stream for good. */
htvm_status htvm_publisher_send(htvm_publisher* publisher, const uint8_t* bytes, size_t count);

/* 1: the next frame should be an I-frame, since somebody cannot go on without one; said once for each time. Else 0. */
int htvm_publisher_wants_key_frame(htvm_publisher* publisher);

typedef struct htvm_publisher_state {
    uint32_t struct_size;    /* number of bytes of this struct that were filled in */
    uint32_t connected;      /* 1: it is */
    uint64_t connections;    /* made so far */
    uint64_t sent_packets;   /* handed to the line */
    uint64_t sent_bytes;     /* of these */
    uint64_t dropped_frames; /* that the line did not take in time, or while there was none */
    uint64_t queue_bytes;    /* that wait to be sent */
    uint64_t viewers;        /* by the hub's last heartbeat; 0 as long as there was none */
} htvm_publisher_state;
htvm_status htvm_publisher_get_state(htvm_publisher* publisher, htvm_publisher_state* state, size_t state_size);

/* Sends what waits, for at most timeout_ms, and closes the connection. ends: 1: the stream ends, which viewers are
 * told; 0: the hub keeps it for whoever goes on with it. HTVM_LIMIT: the line did not take it all in time. */
htvm_status htvm_publisher_finish(htvm_publisher* publisher, int ends, uint32_t timeout_ms);

/* What the last call that failed has to say; "" if none has. Valid until the next call on the handle. */
const char* htvm_publisher_last_error(const htvm_publisher* publisher);

/* ---- watching -------------------------------------------------------------------------------------------------- */

/* As of a publisher. url: ws://HOST[:PORT]/watch/NAME[?expires=...&key=...&signature=...], or wss://. */
htvm_status htvm_watcher_create(const char* url, const htvm_live_options* options, htvm_watcher** watcher,
                                char* problem, size_t problem_capacity);
void htvm_watcher_destroy(htvm_watcher* watcher);

/* Waits for the next packet, at most timeout_ms, and lends it as it stands in a file: *bytes and *count stay valid
 * until the next call with this handle. HTVM_AGAIN: none came in this time. HTVM_END: the stream has ended, or the
 * watcher was stopped. HTVM_BAD_INPUT: the hub refuses to show it. */
htvm_status htvm_watcher_receive(htvm_watcher* watcher, uint32_t timeout_ms, const uint8_t** bytes, size_t* count);

/* Ends htvm_watcher_receive(), now and for good. */
void htvm_watcher_stop(htvm_watcher* watcher);

const char* htvm_watcher_last_error(const htvm_watcher* watcher);

#ifdef __cplusplus
}
#endif

#endif
