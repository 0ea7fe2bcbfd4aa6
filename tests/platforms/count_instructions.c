/* Counts the instructions that a program executed, from qemu's log of it on standard input:
 *   qemu-aarch64-static -d in_asm,exec,nochain -D /dev/fd/3 PROGRAM ... 3>&1 >/dev/null | count_instructions
 * The log has each block of code once, an instruction a line, and a line for each time that it runs. A block that is
 * left in the middle, as by a signal, counts as whole. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SLOTS = 1 << 22 };
static struct {
    uint64_t at;
    uint32_t instructions;
} blocks[SLOTS];

static uint32_t* block(uint64_t at) {
    uint32_t slot = (uint32_t)(at * UINT64_C(0x9E3779B97F4A7C15) >> 42);
    while (blocks[slot].instructions && blocks[slot].at != at) slot = (slot + 1) % SLOTS;
    blocks[slot].at = at;
    return &blocks[slot].instructions;
}

int main(void) {
    static char line[1 << 12];
    uint64_t total = 0, unknown = 0, begun = 0;
    uint32_t* counted = NULL;
    while (fgets(line, sizeof line, stdin)) {
        if (strncmp(line, "Trace", 5) == 0) {
            /* Trace 0: 0x7f... [cs_base/pc/flags/cflags] */
            const char* place = strchr(line, '/');
            const uint32_t* known = place ? block(strtoull(place + 1, NULL, 16)) : NULL;
            if (known && *known)
                total += *known;
            else
                ++unknown;
            continue;
        }
        if (strncmp(line, "IN:", 3) == 0) {
            counted = NULL;
            begun = 1;
        } else if (begun && strncmp(line, "0x", 2) == 0) {
            if (!counted) {
                counted = block(strtoull(line, NULL, 16));
                *counted = 0;
            }
            ++*counted;
        } else {
            begun = 0;
        }
    }
    if (unknown > total / 1000) {
        fprintf(stderr, "%" PRIu64 " blocks are not in the log\n", unknown);
        return 1;
    }
    printf("%" PRIu64 "\n", total);
    return 0;
}
