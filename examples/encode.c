/* Encodes a small moving mesh through the C interface: encode FILE.htvm */
#include <htvm/htvm.h>
#include <stdio.h>
#include <stdlib.h>

enum { side = 20, frames = 4, vertices = side * side, triangles = 2 * (side - 1) * (side - 1) };

/* A sheet of 200 mm that bends a little more in every frame. */
static void make_sheet(int frame, float* positions, uint8_t* colours, uint32_t* indices) {
    int x, y;
    for (y = 0; y < side; ++y)
        for (x = 0; x < side; ++x) {
            const int v = y * side + x, from_middle = x - side / 2;
            positions[3 * v] = 10.0f * (float)x;
            positions[3 * v + 1] = 10.0f * (float)y;
            positions[3 * v + 2] = 0.1f * (float)(frame * from_middle * from_middle);
            colours[3 * v] = (uint8_t)(x * 12);
            colours[3 * v + 1] = (uint8_t)(y * 12);
            colours[3 * v + 2] = 100;
        }
    for (y = 0; y + 1 < side; ++y)
        for (x = 0; x + 1 < side; ++x) {
            const uint32_t v = (uint32_t)(y * side + x);
            const uint32_t two[6] = {v, v + 1, v + side, v + 1, v + side + 1, v + side};
            int i;
            for (i = 0; i < 6; ++i) *indices++ = two[i];
        }
}

/* Writes all packets that are ready. */
static int write_packets(htvm_encoder* encoder, FILE* file) {
    for (;;) {
        size_t size = 0;
        uint8_t* packet;
        htvm_status status = htvm_encoder_receive_packet(encoder, NULL, 0, &size);
        if (status == HTVM_AGAIN || status == HTVM_END) return 1;
        if (status != HTVM_BUFFER_TOO_SMALL || !(packet = malloc(size))) return 0;
        status = htvm_encoder_receive_packet(encoder, packet, size, &size);
        if (status != HTVM_OK || fwrite(packet, 1, size, file) != size) {
            free(packet);
            return 0;
        }
        free(packet);
    }
}

int main(int argc, char** argv) {
    static float positions[3 * vertices];
    static uint8_t colours[3 * vertices];
    static uint32_t indices[3 * triangles];
    htvm_encoder_options* options = NULL;
    htvm_encoder* encoder = NULL;
    htvm_mesh mesh;
    char problem[256];
    int frame, fine = 1;
    FILE* file = argc == 2 ? fopen(argv[1], "wb") : NULL;
    if (!file) {
        fprintf(stderr, "usage: encode FILE.htvm (a file that can be written)\n");
        return 2;
    }
    if (htvm_encoder_options_create(HTVM_PROFILE_TRACKED, NULL, &options) != HTVM_OK) return 2;
    if (htvm_encoder_options_set(options, "quality", "60") != HTVM_OK ||
        htvm_encoder_options_set(options, "key_interval", "60") != HTVM_OK) {
        fprintf(stderr, "%s\n", htvm_encoder_options_last_error(options));
        return 2;
    }
    if (htvm_encoder_create(options, &encoder, problem, sizeof problem) != HTVM_OK) {
        fprintf(stderr, "%s\n", problem);
        return 2;
    }
    htvm_encoder_options_destroy(options);
    htvm_mesh_init(&mesh, sizeof mesh);
    mesh.vertices = vertices;
    mesh.triangles = triangles;
    mesh.positions = positions;
    mesh.colours = colours;
    mesh.indices = indices;
    for (frame = 0; frame < frames && fine; ++frame) {
        make_sheet(frame, positions, colours, indices);
        fine = htvm_encoder_send_mesh(encoder, &mesh, NULL, (int64_t)frame * 33333, 0) == HTVM_OK &&
               write_packets(encoder, file);
    }
    fine = fine && htvm_encoder_finish(encoder) == HTVM_OK && write_packets(encoder, file);
    if (!fine) fprintf(stderr, "%s\n", htvm_encoder_last_error(encoder));
    htvm_encoder_destroy(encoder);
    return fclose(file) == 0 && fine ? 0 : 1;
}
