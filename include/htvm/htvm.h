/* htvm: compression of human time-varying meshes. The C interface: plain C99, opaque handles, no exceptions.
 *
 * Decoding a stream that comes in pieces (examples/decode.c is a whole program):
 *
 *   htvm_decoder *decoder = NULL;
 *   if (htvm_decoder_create(NULL, &decoder) != HTVM_OK) return 1;
 *   while (there are bytes) {
 *       htvm_decoder_send_bytes(decoder, bytes, count);
 *       htvm_frame_info info;
 *       htvm_status status;
 *       while ((status = htvm_decoder_receive_frame(decoder, &info, sizeof info)) != HTVM_AGAIN) {
 *           if (status == HTVM_BAD_INPUT) return 1;               the call is wrong, and would be wrong again
 *           if (status != HTVM_OK) { puts(htvm_decoder_last_error(decoder)); continue; }     a packet is lost
 *           htvm_decoder_view(decoder, &view, sizeof view);      or htvm_decoder_copy_positions(...) and its like
 *       }
 *   }
 *   htvm_decoder_destroy(decoder);
 *
 * Encoding (examples/encode.c):
 *
 *   htvm_encoder_options_create(HTVM_PROFILE_TRACKED, NULL, &options);
 *   htvm_encoder_options_set(options, "key_interval", "60");
 *   if (htvm_encoder_create(options, &encoder, problem, sizeof problem) != HTVM_OK) return 1;
 *   htvm_encoder_send_mesh(encoder, &mesh, &pose, timestamp_us, 0);
 *   while (htvm_encoder_receive_packet(encoder, buffer, sizeof buffer, &size) == HTVM_OK) store(buffer, size);
 *   htvm_encoder_finish(encoder);                                   then receive the rest, up to HTVM_END
 *
 * Conventions
 * - Lengths are millimetres, times microseconds, rotations 3x3 matrices by rows. Arrays are packed: x y z x y z ...
 * - A capacity is the number of elements (not bytes, not vertices) that the array has room for.
 * - Structs begin with struct_size, so that they may grow. Those that the caller fills are given their defaults by
 *   their _init function, called with sizeof the struct (another size that no version can have is refused later); those
 *   that the library fills take that sizeof beside them.
 * - A handle may be used by one thread at a time; different handles by different threads at once.
 * - Functions that take a handle give HTVM_BAD_INPUT where it is NULL; _destroy takes NULL and does nothing.
 * - No C++ exception leaves these functions. (A WebAssembly build has none: where memory runs out there, it traps.)
 * - In C++ programs the header is htvm/htvm.hpp.
 */
#ifndef HTVM_HTVM_H
#define HTVM_HTVM_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- versions ------------------------------------------------------------------------------------------------- */

#define HTVM_VERSION_MAJOR 0 /* of this header */
#define HTVM_VERSION_MINOR 1
#define HTVM_VERSION_PATCH 0

/* Of the library that is linked: major * 65536 + minor * 256 + patch, and as text, "0.1.0". */
uint32_t htvm_version(void);
const char* htvm_version_string(void);
/* Of the stream that it writes and reads (docs/bitstream.md). */
uint32_t htvm_stream_version(void);

/* ---- status --------------------------------------------------------------------------------------------------- */

typedef int32_t htvm_status; /* one of: */
enum {
    HTVM_OK = 0,
    HTVM_AGAIN = 1,             /* nothing to receive until more is sent; to send: receive first */
    HTVM_END = 2,               /* nothing to receive any more */
    HTVM_BAD_INPUT = -1,        /* the call is wrong: NULL, an option or mesh out of its range, calls in wrong order */
    HTVM_CORRUPT_STREAM = -2,   /* the stream's bytes contradict themselves or end too early */
    HTVM_UNSUPPORTED = -3,      /* valid, but this version cannot do it */
    HTVM_LIMIT = -4,            /* larger than a configured limit */
    HTVM_OUT_OF_MEMORY = -5,    /* an allocation failed */
    HTVM_BUFFER_TOO_SMALL = -6, /* the caller's array is too short; nothing was written to it */
    HTVM_INTERNAL = -7          /* a fault of the library: please report it */
};

/* The status in a few words, never NULL. */
const char* htvm_status_text(htvm_status status);

/* ---- memory --------------------------------------------------------------------------------------------------- */

/* Where a handle is kept: that is all that this interface allocates itself. Both functions NULL: malloc and free. It
 * does not cover what the codec below works with (meshes, tables, packets under way): that comes from C++'s operator
 * new, which a program may replace, and for a decoder is bounded by htvm_decoder_options.max_memory. */
typedef struct htvm_allocator {
    void* user;                                  /* handed to the functions as it is */
    void* (*allocate)(void* user, size_t bytes); /* aligned as malloc's; NULL: there is none */
    void (*release)(void* user, void* memory);   /* memory is never NULL */
} htvm_allocator;

/* ---- threads -------------------------------------------------------------------------------------------------- */

/* Runs tasks on threads of the caller's: must call task(context, 0), ..., task(context, tasks - 1), each once, on any
 * threads and in any order, and return when all have returned. No task needs another to run beside it. It is called
 * from several threads at once where the tasks have tasks of their own. user is handed to it as it is. */
typedef void (*htvm_run_tasks)(void* user, size_t tasks, void (*task)(void* context, size_t index), void* context);

/* ---- frames --------------------------------------------------------------------------------------------------- */

/* type of a frame */
enum {
    HTVM_FRAME_INTRA = 0,     /* by itself */
    HTVM_FRAME_ENHANCED = 1,  /* against the last I-frame, with connectivity of its own */
    HTVM_FRAME_PREDICTED = 2, /* the last I-frame's mesh moved */
    HTVM_FRAME_TRACKED = 3,   /* the last I-frame's mesh laid on the captured surface */
    HTVM_FRAME_KINDS = 4      /* how many there are in this version */
};

/* What people call a type: "intra" and "I", "enhanced" and "EP", "predicted" and "P", "tracked" and "T"; "unknown" and
 * "?" for a number that this version does not know. Never NULL. */
const char* htvm_frame_kind_name(uint32_t type);
const char* htvm_frame_kind_letter(uint32_t type);

/* attributes of a mesh beside positions: bits */
enum { HTVM_COLOURS = 1, HTVM_NORMALS = 2, HTVM_TEXCOORDS = 4 };

typedef struct htvm_frame_info {
    uint32_t struct_size; /* bytes of this struct that were filled */
    uint32_t type;        /* HTVM_FRAME_... */
    uint32_t frame;       /* its number, from 0 */
    uint32_t reference;   /* number of the frame that it refers to; its own for an I-frame */
    int64_t timestamp_us;
    uint32_t source_vertices, source_triangles; /* of the captured mesh */
    uint32_t vertices, triangles;               /* of the decoded mesh */
    uint32_t attributes;                        /* HTVM_COLOURS | ... */
    uint32_t joints, bones;                     /* of its pose */
    uint32_t concealed;                         /* 1: from htvm_decoder_conceal() */
    uint64_t bytes;                             /* of its packet */
    uint32_t topology; /* frames of a decoder with the same number have the same triangles and texture coordinates; 0
                          from an encoder */
    uint32_t reserved; /* 0 */
} htvm_frame_info;

/* ---- decoder -------------------------------------------------------------------------------------------------- */

typedef struct htvm_decoder htvm_decoder;

typedef struct htvm_decoder_options {
    uint32_t struct_size; /* set by htvm_decoder_options_init() */
    uint32_t threads;     /* at work at once; 0: one per core; the meshes are the same for any number. 0 */
    /* What is larger is refused with HTVM_LIMIT before memory is taken for it. */
    uint32_t max_vertices;     /* of a frame. 2^22 */
    uint32_t max_triangles;    /* of a frame. 2^23 */
    uint32_t max_joints;       /* of the skeleton; the format has no more. 1024 */
    uint32_t max_bones;        /* likewise. 1024 */
    uint64_t max_packet_bytes; /* in a stream sent as bytes, larger packets count as damage. 2^28 */
    uint64_t max_memory;       /* bytes, for what is kept and the frame under way, by an upper bound. 2^32 */
    htvm_allocator allocator;  /* malloc and free */
    htvm_run_tasks run_tasks;  /* gives the threads. NULL: a pool of the decoder's own, whose threads stay */
    void* run_tasks_user;      /* for run_tasks */
} htvm_decoder_options;

/* Sets the first struct_size bytes of options to the defaults above. HTVM_BAD_INPUT where struct_size is less than 8.
 */
htvm_status htvm_decoder_options_init(htvm_decoder_options* options, size_t struct_size);

/* Makes a decoder. options: NULL for the defaults. *decoder is set to NULL unless the status is HTVM_OK: HTVM_BAD_INPUT
 * (one allocator function without the other, a struct_size that no init gave), HTVM_UNSUPPORTED (an option that only a
 * later version knows), HTVM_OUT_OF_MEMORY. */
htvm_status htvm_decoder_create(const htvm_decoder_options* options, htvm_decoder** decoder);
void htvm_decoder_destroy(htvm_decoder* decoder);

/* What the last call on this handle that failed had to say: one sentence, "" before any did. Valid until the next call
 * on it. Of a NULL handle: "". */
const char* htvm_decoder_last_error(const htvm_decoder* decoder);

/* Sends one whole packet (header, payload and checksums, as the encoder gives it); the bytes are copied. For transports
 * that keep packets apart. HTVM_AGAIN: the packet before is still to be received, and this one was not taken.
 * HTVM_CORRUPT_STREAM: not one whole, undamaged packet, or beyond max_packet_bytes. HTVM_BAD_INPUT also after
 * htvm_decoder_send_bytes(): a decoder takes one or the other. */
htvm_status htvm_decoder_send_packet(htvm_decoder* decoder, const uint8_t* packet, size_t size);

/* Sends the next piece, of any size, of a .htvm stream; the bytes are copied. Damage costs the packets that it touches:
 * the decoder goes on at the next whole one. Receive all frames after each call, or the bytes pile up.
 * HTVM_OUT_OF_MEMORY: none of the bytes was taken. */
htvm_status htvm_decoder_send_bytes(htvm_decoder* decoder, const uint8_t* bytes, size_t size);

/* Decodes up to the next frame, which is then the current one, and says of what size it is. info: may be NULL.
 * HTVM_AGAIN: none until more is sent.
 * HTVM_CORRUPT_STREAM, HTVM_UNSUPPORTED, HTVM_LIMIT (also where decoding it ran out of memory): a packet could not be
 * decoded and is done with; call again for those after it.
 * HTVM_OUT_OF_MEMORY: not even a packet could be read; what was sent and not received is forgotten.
 * After any failure there is no current frame. Every call but one that gives HTVM_BAD_INPUT uses up some of what was
 * sent, so that a loop that ends with HTVM_AGAIN does end. */
htvm_status htvm_decoder_receive_frame(htvm_decoder* decoder, htvm_frame_info* info, size_t info_size);

/* Makes the current frame a stand-in for one that did not arrive or could not be decoded: the last I-frame's mesh moved
 * as the last frame was. frame, timestamp_us: the missing one's. HTVM_AGAIN before any I-frame. */
htvm_status htvm_decoder_conceal(htvm_decoder* decoder, uint32_t frame, int64_t timestamp_us, htvm_frame_info* info,
                                 size_t info_size);

/* Forgets what was sent and not received, as for a seek. The sequence header and the last I-frame stay known. */
htvm_status htvm_decoder_discard(htvm_decoder* decoder);

/* Bytes that were passed over as damage so far, and bytes that are not part of a whole packet yet: at the end of a
 * stream, a packet cut short. Either may be NULL. Both 0 with htvm_decoder_send_packet(). */
htvm_status htvm_decoder_unused_bytes(const htvm_decoder* decoder, uint64_t* damaged, uint64_t* pending);

/* The current frame's arrays, lent: none is copied, and they are valid until the next call to receive or conceal on the
 * decoder, or its end. */
typedef struct htvm_mesh_view {
    uint32_t struct_size; /* bytes of this struct that were filled */
    uint32_t vertices, triangles;
    uint32_t topology;       /* as in htvm_frame_info: where it is the last frame's, indices and texcoords are too */
    const float* positions;  /* mm, 3 a vertex */
    const uint32_t* indices; /* 3 a triangle, counter-clockwise seen from outside */
    const uint8_t* colours;  /* red, green, blue a vertex; NULL: the frame has none */
    const float* normals;    /* 3 a vertex, unit length; or NULL */
    const float* texcoords;  /* 2 a vertex, or NULL */
} htvm_mesh_view;

/* HTVM_BAD_INPUT: there is no current frame, or view_size is not sizeof(htvm_mesh_view). */
htvm_status htvm_decoder_view(htvm_decoder* decoder, htvm_mesh_view* view, size_t view_size);

/* The current frame's arrays, copied into the caller's. HTVM_BAD_INPUT: there is no current frame, or it has no such
 * attribute. HTVM_BUFFER_TOO_SMALL: capacity is below what is said behind. A NULL array with nothing to copy is fine.
 */
htvm_status htvm_decoder_copy_positions(htvm_decoder* decoder, float* positions, size_t capacity);  /* 3 a vertex */
htvm_status htvm_decoder_copy_triangles(htvm_decoder* decoder, uint32_t* indices, size_t capacity); /* 3 a triangle */
htvm_status htvm_decoder_copy_colours(htvm_decoder* decoder, uint8_t* rgb, size_t capacity);        /* 3 a vertex */
htvm_status htvm_decoder_copy_normals(htvm_decoder* decoder, float* normals, size_t capacity);      /* 3 a vertex */
htvm_status htvm_decoder_copy_texcoords(htvm_decoder* decoder, float* texcoords, size_t capacity);  /* 2 a vertex */
htvm_status htvm_decoder_copy_joints(htvm_decoder* decoder, double* joints, size_t capacity);       /* 3 a joint */
htvm_status htvm_decoder_copy_orientations(htvm_decoder* decoder, double* rotations, size_t capacity); /* 9 a bone */

typedef struct htvm_sequence_info {
    uint32_t struct_size; /* bytes of this struct that were filled */
    uint32_t joints, bones;
    uint32_t skeleton_tracked;               /* 0: one bone stands in for a skeleton that the capture has not */
    uint32_t fps_numerator, fps_denominator; /* frames a second */
    uint32_t unit_micrometres;               /* the unit that the capture came in */
    uint32_t nearest_vertices;               /* m of the distance order */
    double lattice_step;                     /* mm: decoded positions are multiples of it from the origin */
} htvm_sequence_info;

/* What the sequence header says. HTVM_AGAIN until one was decoded. */
htvm_status htvm_decoder_sequence(htvm_decoder* decoder, htvm_sequence_info* info, size_t info_size);

/* The joint's name in UTF-8, ended by a 0. HTVM_BUFFER_TOO_SMALL below its length + 1; 256 are always enough. */
htvm_status htvm_decoder_joint_name(htvm_decoder* decoder, uint32_t joint, char* name, size_t capacity);

/* The bone's two joints, first the one that it turns about, and its radius, mm. Each may be NULL. */
htvm_status htvm_decoder_bone(htvm_decoder* decoder, uint32_t bone, uint32_t* first, uint32_t* second, double* radius);

/* ---- encoder -------------------------------------------------------------------------------------------------- */

typedef struct htvm_encoder htvm_encoder;

/* What the stream is for: which frames lie between the I-frames. */
enum {
    HTVM_PROFILE_TRACKED = 0,  /* the fewest bits: T-frames, the I-frame's mesh laid on each frame's surface */
    HTVM_PROFILE_TOPOLOGY = 1, /* every frame's own connectivity: EP-frames, or I-frames where those cost less */
    HTVM_PROFILE_PAPER = 2     /* the same by the published method's own choices */
};

/* The skeleton of the sequence: constant over it. All arrays are copied by htvm_encoder_options_set_skeleton(). */
typedef struct htvm_skeleton {
    uint32_t struct_size;           /* set by htvm_skeleton_init() */
    uint32_t joints, bones;         /* 0, 0: the capture has no skeleton */
    const uint16_t* bone_joints;    /* 2 a bone: the joint that it turns about, and the other */
    const char* const* joint_names; /* one a joint, UTF-8, or NULL */
    const double* radii;            /* mm, one a bone, or NULL: calibrated on the first frame */
} htvm_skeleton;

/* The options of an encoder. Those that are numbers, words or switches are set by name; docs/options.md lists them, and
 * so does htvm_encoder_option(). */
typedef struct htvm_encoder_options htvm_encoder_options;

/* The options of a profile at their defaults. allocator: NULL for malloc and free; copied, and used for the encoders
 * made of these options too. *options is set to NULL unless the status is HTVM_OK: HTVM_BAD_INPUT (no such profile, one
 * allocator function without the other), HTVM_OUT_OF_MEMORY. */
htvm_status htvm_encoder_options_create(uint32_t profile, const htvm_allocator* allocator,
                                        htvm_encoder_options** options);
void htvm_encoder_options_destroy(htvm_encoder_options* options);

/* As htvm_decoder_last_error(). */
const char* htvm_encoder_options_last_error(const htvm_encoder_options* options);

/* Sets an option, such as "key_interval" to "60" or 60, "topology.frame_choice" to "motion" or its place in the list of
 * words, "topology.scene_changes" to "off" or 0. Numbers in text have a point, whatever the locale. HTVM_BAD_INPUT, and
 * nothing is changed: there is no such option (the last error names the nearest), or the value is out of its range.
 * Whether options go together is checked by htvm_encoder_create(). */
htvm_status htvm_encoder_options_set(htvm_encoder_options* options, const char* name, const char* value);
htvm_status htvm_encoder_options_set_number(htvm_encoder_options* options, const char* name, double value);

/* The option's value, as text ended by a 0 (HTVM_BUFFER_TOO_SMALL below its length + 1; 32 are always enough) or as a
 * number. */
htvm_status htvm_encoder_options_get(htvm_encoder_options* options, const char* name, char* value, size_t capacity);
htvm_status htvm_encoder_options_get_number(htvm_encoder_options* options, const char* name, double* value);

/* Copies the skeleton; NULL, and none to begin with: the capture has none. */
htvm_status htvm_encoder_options_set_skeleton(htvm_encoder_options* options, const htvm_skeleton* skeleton);

/* Gives the encoder its threads, up to the option "threads" at once. NULL, and none to begin with: a pool of the
 * encoder's own. user is handed to run_tasks as it is. */
htvm_status htvm_encoder_options_set_run_tasks(htvm_encoder_options* options, htvm_run_tasks run_tasks, void* user);

/* kind of an option's value */
enum {
    HTVM_OPTION_NUMBER = 0,
    HTVM_OPTION_WHOLE_NUMBER = 1,
    HTVM_OPTION_SWITCH = 2, /* "on" or "off", 1 or 0 */
    HTVM_OPTION_WORD = 3    /* one of htvm_encoder_option_word() */
};

/* What there is to know of an option. The texts are the library's own and never NULL. */
typedef struct htvm_option_info {
    uint32_t struct_size; /* bytes of this struct that were filled */
    uint32_t kind;        /* HTVM_OPTION_... */
    const char* name;     /* "tracked.node_spacing" */
    const char* group;    /* "common", "rate"; "tracked", "topology": of these profiles alone (paper: topology) */
    const char* unit;     /* "mm", "frames"; "": none */
    const char* meaning;  /* in a line */
    const char* zero;     /* what 0 stands for, where it stands for something: it is then allowed beside the range */
    double least, most;   /* range, both ends allowed */
    double default_value; /* in the profile asked for */
    uint32_t words;       /* how many it may be; 0 for other kinds */
    uint32_t serves;      /* 1: it means something to the profile; 0: it must stay at its default */
} htvm_option_info;

/* Options have the numbers 0 to htvm_encoder_option_count() - 1, which may be others in another version.
 * HTVM_BAD_INPUT: no such option or profile, or info is NULL. */
uint32_t htvm_encoder_option_count(void);
htvm_status htvm_encoder_option(uint32_t option, uint32_t profile, htvm_option_info* info, size_t info_size);
/* NULL where there is no such word. */
const char* htvm_encoder_option_word(uint32_t option, uint32_t word);

/* A frame to code. Attributes are NULL where the mesh has none. Nothing is assumed of the triangles but that their
 * indices are below `vertices`. */
typedef struct htvm_mesh {
    uint32_t struct_size; /* set by htvm_mesh_init() */
    uint32_t vertices, triangles;
    uint32_t reserved;       /* 0 */
    const float* positions;  /* mm, 3 a vertex */
    const uint32_t* indices; /* 3 a triangle, counter-clockwise seen from outside */
    const uint8_t* colours;  /* red, green, blue a vertex */
    const float* normals;    /* 3 a vertex, unit length */
    const float* texcoords;  /* 2 a vertex */
} htvm_mesh;

/* The skeleton in this frame. */
typedef struct htvm_pose {
    uint32_t struct_size;       /* set by htvm_pose_init() */
    uint32_t reserved;          /* 0 */
    const double* joints;       /* mm, 3 a joint of the skeleton */
    const double* orientations; /* 9 a bone, or NULL: derived from the joints */
    const uint8_t* tracked;     /* one a joint, 0: the position is a guess; NULL: all tracked */
} htvm_pose;

/* Set the first struct_size bytes to 0, but for struct_size itself. */
htvm_status htvm_skeleton_init(htvm_skeleton* skeleton, size_t struct_size);
htvm_status htvm_mesh_init(htvm_mesh* mesh, size_t struct_size);
htvm_status htvm_pose_init(htvm_pose* pose, size_t struct_size);

/* The steps of a quality that means the same error whatever the capture: 16 mm at 0, 2 mm at 50, 0.25 mm at 100; one
 * outside of 0..100 counts as the nearer end. Either pointer may be NULL. */
void htvm_quality_steps(double quality, double* geometry_step, double* colour_step);

/* Makes an encoder. options: NULL for the defaults of the tracked profile; they are copied. *encoder is set to NULL
 * unless the status is HTVM_OK: HTVM_BAD_INPUT (options at odds with each other or with the skeleton; text, where not
 * NULL, is set to a sentence about it of up to text_capacity characters, the closing 0 included), HTVM_OUT_OF_MEMORY.
 */
htvm_status htvm_encoder_create(const htvm_encoder_options* options, htvm_encoder** encoder, char* text,
                                size_t text_capacity);
void htvm_encoder_destroy(htvm_encoder* encoder);

/* As htvm_decoder_last_error(). */
const char* htvm_encoder_last_error(const htvm_encoder* encoder);

/* Codes one frame; the arrays are read during the call only. pose: of the options' skeleton; NULL where the tracker
 * lost it, but not in the first frame, or where there is no skeleton. Timestamps must ascend. force_intra: 1 for an
 * I-frame. HTVM_BAD_INPUT: the mesh or pose is wrong; HTVM_LIMIT: under rate control, a frame that the buffer cannot
 * hold. After an error the frame is not part of the stream, and the next may be sent. */
htvm_status htvm_encoder_send_mesh(htvm_encoder* encoder, const htvm_mesh* mesh, const htvm_pose* pose,
                                   int64_t timestamp_us, int force_intra);

/* Ends the sequence. No mesh may be sent after it. */
htvm_status htvm_encoder_finish(htvm_encoder* encoder);

/* Copies the next packet, ready to store or send. *size is set to its bytes; HTVM_BUFFER_TOO_SMALL where capacity is
 * less, and the packet stays to be received (so a capacity of 0 asks for the size). HTVM_AGAIN: none until more is
 * sent; HTVM_END: none any more. A stream in a file is its packets one behind the other. */
htvm_status htvm_encoder_receive_packet(htvm_encoder* encoder, uint8_t* buffer, size_t capacity, size_t* size);

/* Of the last frame sent: what it is and how many bytes it took. HTVM_AGAIN before any. */
htvm_status htvm_encoder_last_frame(htvm_encoder* encoder, htvm_frame_info* info, size_t info_size);

#ifdef __cplusplus
}
#endif

#endif
