/* What the Python package does with the library inside its wheel, for Windows, where no Python is at hand here: loads
 * it by its path alone, finds every function that the package declares, decodes a stream and writes and reads mesh
 * files. wheel_library LIBRARY STREAM FOLDER FUNCTION... Prints how many frames were decoded and files compared; fails
 * with a sentence. */
#include <htvm/htvm.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <windows.h>

typedef struct htvm_mesh_file htvm_mesh_file;
typedef htvm_status (*create_fn)(const htvm_decoder_options*, htvm_decoder**);
typedef htvm_status (*send_fn)(htvm_decoder*, const uint8_t*, size_t);
typedef htvm_status (*receive_fn)(htvm_decoder*, htvm_frame_info*, size_t);
typedef htvm_status (*view_fn)(htvm_decoder*, htvm_mesh_view*, size_t);
typedef htvm_status (*write_fn)(const char*, const char*, const htvm_mesh*, char*, size_t);
typedef htvm_status (*read_fn)(const char*, const char*, htvm_mesh_file**, char*, size_t);
typedef htvm_status (*file_view_fn)(htvm_mesh_file*, htvm_mesh_view*, size_t);
typedef void (*file_destroy_fn)(htvm_mesh_file*);

static HMODULE library;

static void* function(const char* name) {
    union {
        FARPROC found;
        void* address;
    } at;
    at.found = GetProcAddress(library, name);
    if (!at.found) {
        printf("the library has no %s\n", name);
        exit(1);
    }
    return at.address;
}

static void require(int fact, const char* what) {
    if (fact) return;
    printf("not so: %s\n", what);
    exit(1);
}

/* What is written in a format is read again, and replaces what was there. */
static void compare_file(const htvm_mesh_view* view, const char* folder, const char* name) {
    char path[1024], text[256] = "";
    htvm_mesh mesh;
    htvm_mesh_file* file = NULL;
    htvm_mesh_view read;
    memset(&mesh, 0, sizeof mesh);
    mesh.struct_size = sizeof mesh;
    mesh.vertices = view->vertices;
    mesh.triangles = view->triangles;
    mesh.positions = view->positions;
    mesh.indices = view->indices;
    mesh.colours = view->colours;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    for (int time = 0; time < 2; ++time)
        require(((write_fn)function("htvm_mesh_file_write"))(path, "mm", &mesh, text, sizeof text) == HTVM_OK, text);
    require(((read_fn)function("htvm_mesh_file_read"))(path, "mm", &file, text, sizeof text) == HTVM_OK, text);
    require(((file_view_fn)function("htvm_mesh_file_view"))(file, &read, sizeof read) == HTVM_OK, "a view of the file");
    require(read.vertices == view->vertices && read.triangles == view->triangles, "as many vertices and triangles");
    for (uint32_t i = 0; i < 3 * view->vertices; ++i)
        require(read.positions[i] - view->positions[i] < 1e-3f && view->positions[i] - read.positions[i] < 1e-3f,
                "the same positions");
    ((file_destroy_fn)function("htvm_mesh_file_destroy"))(file);
}

int main(int count, char** arguments) {
    static uint8_t bytes[1 << 20];
    htvm_decoder* decoder = NULL;
    htvm_frame_info info;
    htvm_mesh_view view;
    FILE* stream;
    size_t size;
    int frames = 0;
    if (count < 4) return 2;
    library = LoadLibraryA(arguments[1]);
    require(library != NULL, "the library is loaded");
    for (int i = 4; i < count; ++i) function(arguments[i]);
    stream = fopen(arguments[2], "rb");
    require(stream != NULL, "the stream is there");
    size = fread(bytes, 1, sizeof bytes, stream);
    fclose(stream);
    require(((create_fn)function("htvm_decoder_create"))(NULL, &decoder) == HTVM_OK, "a decoder");
    require(((send_fn)function("htvm_decoder_send_bytes"))(decoder, bytes, size) == HTVM_OK, "bytes are taken");
    while (((receive_fn)function("htvm_decoder_receive_frame"))(decoder, &info, sizeof info) == HTVM_OK) {
        ++frames;
        require(((view_fn)function("htvm_decoder_view"))(decoder, &view, sizeof view) == HTVM_OK,
                "a view of the frame");
        compare_file(&view, arguments[3], "mesh.ply");
        compare_file(&view, arguments[3], "mesh.obj");
    }
    require(frames > 0, "frames are decoded");
    printf("%d functions, %d frames, %d files\n", count - 4, frames, 2 * frames);
    return 0;
}
