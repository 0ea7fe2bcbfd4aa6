/* Decodes a .htvm stream through the C interface: decode FILE.htvm [OBJ_PREFIX]
 * Prints a line a frame; with a prefix, writes PREFIX000000.obj and so on beside it. */
#include <htvm/htvm.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

/* Arrays that grow with the largest frame seen. */
typedef struct {
    float* positions;
    uint32_t* triangles;
    size_t position_capacity, triangle_capacity; /* numbers, not vertices or triangles */
} frame_buffers;

static int make_room(frame_buffers* buffers, const htvm_frame_info* info) {
    const size_t positions = (size_t)info->vertices * 3, triangles = (size_t)info->triangles * 3;
    if (positions > buffers->position_capacity) {
        float* larger = realloc(buffers->positions, positions * sizeof *larger);
        if (!larger) return 0;
        buffers->positions = larger;
        buffers->position_capacity = positions;
    }
    if (triangles > buffers->triangle_capacity) {
        uint32_t* larger = realloc(buffers->triangles, triangles * sizeof *larger);
        if (!larger) return 0;
        buffers->triangles = larger;
        buffers->triangle_capacity = triangles;
    }
    return 1;
}

static int write_obj(const char* prefix, const htvm_frame_info* info, const frame_buffers* buffers) {
    char name[4096];
    FILE* file;
    uint32_t i;
    if (snprintf(name, sizeof name, "%s%06" PRIu32 ".obj", prefix, info->frame) >= (int)sizeof name) return 0;
    file = fopen(name, "w");
    if (!file) return 0;
    for (i = 0; i < info->vertices; ++i) {
        const float* p = buffers->positions + 3 * (size_t)i;
        fprintf(file, "v %.9g %.9g %.9g\n", (double)p[0], (double)p[1], (double)p[2]);
    }
    for (i = 0; i < info->triangles; ++i) {
        const uint32_t* t = buffers->triangles + 3 * (size_t)i;
        fprintf(file, "f %" PRIu32 " %" PRIu32 " %" PRIu32 "\n", t[0] + 1, t[1] + 1, t[2] + 1);
    }
    return fclose(file) == 0;
}

/* Takes all frames that are whole so far. Gives the number of packets that could not be decoded. */
static int receive_frames(htvm_decoder* decoder, frame_buffers* buffers, const char* prefix) {
    htvm_frame_info info;
    htvm_status status;
    int errors = 0;
    while ((status = htvm_decoder_receive_frame(decoder, &info, sizeof info)) != HTVM_AGAIN) {
        if (status != HTVM_OK) {
            fprintf(stderr, "%s\n", htvm_decoder_last_error(decoder));
            ++errors;
            continue;
        }
        if (!make_room(buffers, &info) ||
            htvm_decoder_copy_positions(decoder, buffers->positions, buffers->position_capacity) != HTVM_OK ||
            htvm_decoder_copy_triangles(decoder, buffers->triangles, buffers->triangle_capacity) != HTVM_OK) {
            fprintf(stderr, "frame %" PRIu32 ": no memory for its mesh\n", info.frame);
            ++errors;
            continue;
        }
        printf("frame %" PRIu32 ": %s, %" PRIu32 " vertices, %" PRIu32 " triangles, %" PRIu64 " bytes\n", info.frame,
               htvm_frame_kind_letter(info.type), info.vertices, info.triangles, info.bytes);
        if (prefix && !write_obj(prefix, &info, buffers)) {
            fprintf(stderr, "frame %" PRIu32 " cannot be written\n", info.frame);
            ++errors;
        }
    }
    return errors;
}

int main(int argc, char** argv) {
    htvm_decoder* decoder = NULL;
    frame_buffers buffers = {NULL, NULL, 0, 0};
    uint8_t piece[65536];
    uint64_t damaged = 0, pending = 0;
    size_t count;
    int errors = 0;
    FILE* file = argc == 2 || argc == 3 ? fopen(argv[1], "rb") : NULL;
    if (!file) {
        fprintf(stderr, argc == 2 || argc == 3 ? "%s cannot be opened\n" : "usage: %s FILE.htvm [OBJ_PREFIX]\n",
                argc == 2 || argc == 3 ? argv[1] : "decode");
        return 2;
    }
    if (htvm_decoder_create(NULL, &decoder) != HTVM_OK) return 2;
    while ((count = fread(piece, 1, sizeof piece, file)) > 0) {
        if (htvm_decoder_send_bytes(decoder, piece, count) != HTVM_OK) ++errors;
        errors += receive_frames(decoder, &buffers, argc == 3 ? argv[2] : NULL);
    }
    htvm_decoder_unused_bytes(decoder, &damaged, &pending);
    if (damaged + pending > 0) fprintf(stderr, "%" PRIu64 " bytes are damaged or cut short\n", damaged + pending);
    htvm_decoder_destroy(decoder);
    free(buffers.positions);
    free(buffers.triangles);
    fclose(file);
    return errors > 0 || damaged + pending > 0 ? 1 : 0;
}
