/* What the Python package's library has besides htvm.h: mesh files, read and written as `htvm encode` and `htvm decode`
 * do it. Its conventions are those of htvm.h. */
#ifndef HTVM_PYTHON_MESH_FILES_H
#define HTVM_PYTHON_MESH_FILES_H

#include <htvm/htvm.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct htvm_mesh_file htvm_mesh_file;

/* Reads a file, whose name decides its format. unit: that of its coordinates, such as "cm"; "auto": the one that the
 * format prescribes, or else by the size of the mesh. *file is set to NULL unless the status is HTVM_OK; else text, if
 * not NULL, receives a sentence of up to text_capacity characters, including the terminating 0. */
htvm_status htvm_mesh_file_read(const char* path, const char* unit, htvm_mesh_file** file, char* text,
                                size_t text_capacity);
void htvm_mesh_file_destroy(htvm_mesh_file* file);

/* Its arrays, in millimetres, on loan until it is destroyed. topology is 0. */
htvm_status htvm_mesh_file_view(htvm_mesh_file* file, htvm_mesh_view* view, size_t view_size);

/* Writes the mesh, from millimetres to the unit, replacing any file of that name. "auto": the one that the format
 * prescribes, or else millimetres. */
htvm_status htvm_mesh_file_write(const char* path, const char* unit, const htvm_mesh* mesh, char* text,
                                 size_t text_capacity);

#ifdef __cplusplus
}
#endif

#endif
