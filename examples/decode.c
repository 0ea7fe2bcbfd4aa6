/* Decodes a .htvm stream through the C interface:
 *     decode FILE.htvm [OBJ_PREFIX]
 * Prints one line per frame; with a prefix, also writes PREFIX000000.obj and so on. */
#include <htvm/htvm.h>
#include <inttypes.h>
#include <stdio.h>

static int write_obj(const char* prefix, uint32_t number, const htvm_mesh_view* mesh) {
    char name[4096];
    FILE* file;
    uint32_t i;
    if (snprintf(name, sizeof name, "%s%06" PRIu32 ".obj", prefix, number) >= (int)sizeof name) return 0;
    file = fopen(name, "w");
    if (!file) return 0;
    for (i = 0; i < mesh->vertices; ++i) {
        const float* p = mesh->positions + 3 * (size_t)i;
        fprintf(file, "v %.9g %.9g %.9g\n", (double)p[0], (double)p[1], (double)p[2]);
    }
    for (i = 0; i < mesh->triangles; ++i) {
        const uint32_t* t = mesh->indices + 3 * (size_t)i;
        fprintf(file, "f %" PRIu32 " %" PRIu32 " %" PRIu32 "\n", t[0] + 1, t[1] + 1, t[2] + 1);
    }
    return fclose(file) == 0;
}

/* Receives all frames that are complete so far. Returns the number of packets that could not be decoded. */
static int receive_frames(htvm_decoder* decoder, const char* prefix, uint32_t* topology) {
    htvm_frame_info info;
    htvm_mesh_view mesh; /* the decoder's own arrays, valid until the next frame is received */
    htvm_status status;
    int errors = 0;
    while ((status = htvm_decoder_receive_frame(decoder, &info, sizeof info)) != HTVM_AGAIN) {
        if (status != HTVM_OK) {
            fprintf(stderr, "%s\n", htvm_decoder_last_error(decoder));
            ++errors;
            continue;
        }
        if (htvm_decoder_view(decoder, &mesh, sizeof mesh) != HTVM_OK) return errors + 1;
        /* A player would send triangles and texture coordinates to the graphics card only when they are new. */
        printf("frame %" PRIu32 ": %s, %" PRIu32 " vertices, %" PRIu32 " triangles%s, %" PRIu64 " bytes\n", info.frame,
               htvm_frame_kind_letter(info.type), mesh.vertices, mesh.triangles,
               mesh.topology == *topology ? " as before" : "", info.bytes);
        *topology = mesh.topology;
        if (prefix && !write_obj(prefix, info.frame, &mesh)) {
            fprintf(stderr, "frame %" PRIu32 " cannot be written\n", info.frame);
            ++errors;
        }
    }
    return errors;
}

int main(int argc, char** argv) {
    htvm_decoder* decoder = NULL;
    uint32_t topology = 0;
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
        errors += receive_frames(decoder, argc == 3 ? argv[2] : NULL, &topology);
    }
    htvm_decoder_unused_bytes(decoder, &damaged, &pending);
    if (damaged + pending > 0) fprintf(stderr, "%" PRIu64 " bytes are damaged or cut short\n", damaged + pending);
    htvm_decoder_destroy(decoder);
    fclose(file);
    return errors > 0 || damaged + pending > 0 ? 1 : 0;
}
